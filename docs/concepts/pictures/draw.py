#!/usr/bin/env python3
"""Draws the pictures of docs/concepts from the mathematics that the pages explain. Plain Python, no package.

    docs/concepts/pictures/draw.py              # writes the SVG files beside itself
    docs/concepts/pictures/draw.py --check      # writes nothing; exit code 1 where a file differs from what is drawn

Each picture carries its own background and colours for light and dark. Numbers are rounded to a tenth of a pixel.
"""
import math
import os
import sys
from fractions import Fraction
from html import escape

HERE = os.path.dirname(os.path.abspath(__file__))

# The paper's robot as its file has it: docs/reference/robots.md.
MASS, GRAVITY, HEIGHT = 54.63, 9.80665, 0.75  # kg, m/s², m of the COM
OMEGA = math.sqrt(GRAVITY / HEIGHT)  # 1/s
HALF_LENGTH, HALF_WIDTH, SOLE_Y = 0.15, 0.075, 0.105  # m, of a sole and of its centre beside frame O

STYLE = """
text { font: 13px system-ui, sans-serif; fill: var(--ink) } .s { font-size: 11px } .i { font-style: italic }
.bg { fill: var(--paper) } .l { stroke: var(--ink); fill: none; stroke-width: 1.2 } .g { stroke: var(--faint); fill: none }
.a { stroke: var(--a); fill: none; stroke-width: 2 } .b { stroke: var(--b); fill: none; stroke-width: 2 }
.c { stroke: var(--c); fill: none; stroke-width: 2 } .d { stroke-dasharray: 5 4 }
.fa { fill: var(--a); stroke: none } .fb { fill: var(--b); stroke: none } .fc { fill: var(--c); stroke: none }
.fi { fill: var(--ink); stroke: none } .ff { fill: var(--faint); stroke: none; opacity: .35 } .fs { fill: var(--b); opacity: .18 }
svg { --paper: #ffffff; --ink: #24292f; --faint: #9aa4af; --a: #b3261e; --b: #0b62c4; --c: #1a7f37 }
@media (prefers-color-scheme: dark) {
  svg { --paper: #161b22; --ink: #d7dee6; --faint: #6b7682; --a: #ff8f85; --b: #79b8ff; --c: #6bd58a }
}"""


def number(x):
    text = f"{x:.1f}"
    text = text[:-2] if text.endswith(".0") else text
    return "0" if text == "-0" else text


class Picture:
    """An SVG file of a width and height in pixels, y downward."""

    def __init__(self, name, title, width, height):
        self.name, self.width, self.height = name, width, height
        self.parts = [f'<title>{escape(title)}</title>', f'<style>{STYLE}</style>',
                      f'<rect class="bg" width="{width}" height="{height}" rx="8"/>']

    def add(self, text):
        self.parts.append(text)

    def text(self, x, y, text, style="", anchor="start"):
        classes = f' class="{style}"' if style else ""
        place = "" if anchor == "start" else f' text-anchor="{anchor}"'
        self.add(f'<text x="{number(x)}" y="{number(y)}"{classes}{place}>{escape(text)}</text>')

    def path(self, points, style="l", close=False):
        steps = " ".join(f"{number(x)} {number(y)}" for x, y in points)
        self.add(f'<path class="{style}" d="M{steps}{"Z" if close else ""}"/>')

    def dot(self, x, y, style="fi", radius=4):
        self.add(f'<circle class="{style}" cx="{number(x)}" cy="{number(y)}" r="{radius}"/>')

    def box(self, x, y, width, height, style="l", radius=0):
        corner = f' rx="{radius}"' if radius else ""
        self.add(f'<rect class="{style}" x="{number(x)}" y="{number(y)}" width="{number(width)}" '
                 f'height="{number(height)}"{corner}/>')

    def arrow(self, start, end, style="l"):
        self.path([start, end], style)
        dx, dy = end[0] - start[0], end[1] - start[1]
        length = math.hypot(dx, dy)
        ux, uy = dx / length, dy / length
        side = [(end[0] - 9 * ux + s * 4 * uy, end[1] - 9 * uy - s * 4 * ux) for s in (1, -1)]
        fill = {"a": "fa", "b": "fb", "c": "fc"}.get(style.split()[0], "fi")
        self.path([end] + side, fill, close=True)

    def file(self):
        body = "\n".join(self.parts)
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" '
                f'width="{self.width}" height="{self.height}">\n{body}\n</svg>\n')


class Axes:
    """Numbers to pixels within a frame of a picture; logarithmic where asked."""

    def __init__(self, picture, x, y, width, height, across, up, log_x=False, log_y=False):
        self.p, self.x, self.y, self.width, self.height = picture, x, y, width, height
        self.across, self.up, self.log = across, up, (log_x, log_y)
        picture.path([(x, y), (x, y + height), (x + width, y + height)])

    def _share(self, value, span, log):
        low, high = span
        if log:
            value, low, high = (math.log10(v) for v in (value, low, high))
        return (value - low) / (high - low)

    def at(self, x, y):
        return (self.x + self.width * self._share(x, self.across, self.log[0]),
                self.y + self.height * (1 - self._share(y, self.up, self.log[1])))

    def curve(self, points, style="l"):
        self.p.path([self.at(x, y) for x, y in points], style)

    def label(self, x, y, text, style="", anchor="start", dx=0, dy=0):
        px, py = self.at(x, y)
        self.p.text(px + dx, py + dy, text, style, anchor)

    def ticks(self, across, up, name_x, name_y):
        for value in across:
            px, py = self.at(value, self.up[0])
            self.p.path([(px, py), (px, py + 4)])
            self.p.text(px, py + 16, f"{value:g}", "s", "middle")
        for value in up:
            px, py = self.at(self.across[0], value)
            self.p.path([(px - 4, py), (px, py)])
            self.p.text(px - 7, py + 4, f"{value:g}", "s", "end")
        self.p.text(self.x + self.width, self.y + self.height + 31, name_x, "s", "end")
        self.p.text(self.x - 4, self.y - 9, name_y, "s")


def span(low, high, count):
    return [low + (high - low) * i / (count - 1) for i in range(count)]


class Plan:
    """Soles from above: x of frame O up the page, y to the left."""

    def __init__(self, picture, x, y, scale):
        self.p, self.x, self.y, self.scale = picture, x, y, scale

    def at(self, forward, left):
        return self.x - self.scale * left, self.y - self.scale * forward

    def rectangle(self, half_length, half_width, style, left=0.0):
        corners = [(half_length, half_width), (half_length, -half_width), (-half_length, -half_width), (-half_length, half_width)]
        self.p.path([self.at(a, b + left) for a, b in corners], style, close=True)

    def soles(self):
        for side in (-1, 1):
            self.rectangle(HALF_LENGTH, HALF_WIDTH, "ff", side * SOLE_Y)


def smooth(s):
    """The ramp of a transition, 0 to 1: components/balance/minimum_jerk.h."""
    s = min(max(s, 0.0), 1.0)
    return s ** 3 * (10 - 15 * s + 6 * s * s)


def notation():
    p = Picture("notation", "Frames and signs: soles, frame O and O_d from above, and the contact force from the side", 640, 290)
    plan = Plan(p, 170, 150, 600)
    plan.soles()
    for side, name in ((-1, "right sole"), (1, "left sole")):
        x, y = plan.at(0, side * SOLE_Y)
        p.text(x, y + 108, name, "s", "middle")
        p.arrow((x, y), (x, y - 40), "c")
        p.arrow((x, y), (x - 34, y), "c")
    p.arrow(plan.at(0, 0), plan.at(0.11, 0), "b")
    p.arrow(plan.at(0, 0), plan.at(0, 0.075), "b")
    p.text(plan.at(0, 0)[0] + 6, plan.at(0, 0)[1] + 15, "O")
    p.text(plan.at(0.11, 0)[0] + 6, plan.at(0.11, 0)[1] + 10, "x", "i")
    p.text(plan.at(0, 0.075)[0] - 2, plan.at(0, 0)[1] - 7, "y", "i")
    plan.rectangle(0.13, 0.07, "b d")
    p.dot(*plan.at(0.05, -0.07), "fb")
    p.text(plan.at(0.05, -0.07)[0] - 5, plan.at(0.05, -0.07)[1] + 16, "O_d", "s", "end")
    p.dot(*plan.at(0.05, -0.11), "fa")
    p.text(plan.at(0.05, -0.11)[0] + 7, plan.at(0.05, -0.11)[1] + 4, "CoP", "s")
    p.text(170, 275, "from above", "s", "middle")
    p.path([(360, 215), (620, 215)])
    p.box(430, 203, 120, 12, "ff")
    p.arrow((490, 207), (490, 130), "c")
    p.text(499, 138, "z of the sole", "s")
    p.arrow((470, 217), (470, 262), "a")
    p.text(479, 250, "F_c, robot on environment,", "s")
    p.text(479, 264, "F_z < 0", "s")
    p.arrow((440, 200), (440, 158), "g")
    p.text(431, 168, "what a sensor", "s", "end")
    p.text(431, 182, "reads", "s", "end")
    p.text(490, 40, "A q̈ + b + g + J_cᵀ F_c = Γ", "", "middle")
    p.text(490, 62, "hence the sign of F_c", "s", "middle")
    return p


# One tick of deploy/graphs/balance.pbtxt: writer, message, readers, in the order of the tick.
TICK = [("sim", "DRIVE_FEEDBACK", ["hw_bridge"]),
        ("hw_bridge", "ROBOT_SENSORS", ["state_estimator"]),
        ("state_estimator", "ROBOT_STATE", ["step_planner", "task_controller", "contact_wrench_monitor", "redistributor"]),
        ("step_planner", "SUPPORT_PLAN", ["task_controller", "contact_wrench_monitor", "redistributor"]),
        ("task_controller", "TASK_TORQUE", ["contact_wrench_monitor"]),
        ("contact_wrench_monitor", "BALANCE_TORQUE", ["redistributor"]),
        ("redistributor", "JOINT_COMMAND", ["hw_bridge"]),
        ("hw_bridge", "DRIVE_COMMAND", ["sim"])]


def tick():
    p = Picture("tick", "One tick: which process writes which message, and who reads it, from top to bottom", 720, 345)
    names = []
    for writer, _, _ in TICK:
        if writer not in names:
            names.append(writer)
    column = {name: 48 + 104 * i for i, name in enumerate(names)}
    for name, x in column.items():
        head, _, tail = name.rpartition("_")
        for i, line in enumerate([head + "_", tail] if head else [tail]):
            p.text(x, 22 + 14 * i, line, "s", "middle")
        p.path([(x, 46), (x, 325)], "g")
    for i, (writer, message, readers) in enumerate(TICK):
        y = 72 + 34 * i
        ends = [column[r] for r in readers]
        far = max(ends, key=lambda x: abs(x - column[writer]))
        style = "a" if message == "BALANCE_TORQUE" else "b"
        for end in ends:
            p.arrow((column[writer], y), (end, y), style)
        p.dot(column[writer], y, "fi", 3)
        p.text((column[writer] + far) / 2, y - 7, message, "s", "middle")
    p.text(column["redistributor"], 338, "the command moves the robot in the next tick", "s", "end")
    return p


def contact_dynamics():
    p = Picture("contact_dynamics", "A force on a body that a floor holds, split as (8) to (11) say", 640, 285)
    # A body whose inertia is not the same in all directions, on a floor: q = (x, z), J_c = (0, 1).
    a = ((2.0, 0.9), (0.9, 1.0))
    det = a[0][0] * a[1][1] - a[0][1] ** 2
    inverse = ((a[1][1] / det, -a[0][1] / det), (-a[0][1] / det, a[0][0] / det))
    force = (1.5, -1.6)  # Γ − g
    lambda_c = 1 / inverse[1][1]  # (4)
    bar = (lambda_c * inverse[1][0], lambda_c * inverse[1][1])  # J̄_cᵀ, (7)
    f_c = bar[0] * force[0] + bar[1] * force[1]  # (8)
    left = (force[0], force[1] - f_c)  # N_cᵀ (Γ − g), (11)
    acceleration = [inverse[i][0] * left[0] + inverse[i][1] * left[1] for i in (0, 1)]
    assert abs(acceleration[1]) < 1e-12  # the contact holds
    origin, scale = (110, 100), 66

    def at(v):
        return origin[0] + scale * v[0], origin[1] - scale * v[1]

    p.path([(30, 118), (360, 118)], "g")
    p.box(30, 118, 330, 142, "ff")
    p.box(78, 82, 64, 36, "l", 3)
    p.arrow(at((0, 0)), at(force), "l")
    p.text(at(force)[0] + 7, at(force)[1] + 4, "Γ − g")
    p.arrow(at((0, 0)), at((0, f_c)), "a")
    p.text(at((0, f_c))[0] - 8, at((0, f_c))[1] - 4, "J_cᵀ f_c", "", "end")
    p.arrow(at((0, 0)), at(left), "b")
    p.text(at(left)[0] + 8, at(left)[1] + 14, "N_cᵀ (Γ − g)")
    p.path([at(left), at(force), at((0, f_c))], "g d")
    p.arrow(at((0, 0)), at((acceleration[0], 0)), "c")
    p.text(at((acceleration[0], 0))[0] - 4, at((acceleration[0], 0))[1] - 9, "q̈", "", "end")
    lines = ["The floor lets the body move along x alone.", "It takes J_cᵀ f_c: by (8), what keeps z̈ = 0.",
             "What is left, by (11), is N_cᵀ (Γ − g) = A q̈:", "not the horizontal part of the force, since",
             "the body's inertia A couples x and z.", f"Here f_c = {f_c:.2f}, of a vertical {force[1]:.2f}.".replace("-", "−")]
    for i, line in enumerate(lines):
        p.text(385, 60 + 22 * i, line, "s")
    return p


def nearest_on(polygon, point):
    """The point of a convex polygon's boundary nearest to a point outside."""
    best = None
    for i, start in enumerate(polygon):
        end = polygon[(i + 1) % len(polygon)]
        d = (end[0] - start[0], end[1] - start[1])
        t = ((point[0] - start[0]) * d[0] + (point[1] - start[1]) * d[1]) / (d[0] ** 2 + d[1] ** 2)
        t = min(max(t, 0.0), 1.0)
        q = (start[0] + t * d[0], start[1] + t * d[1])
        distance = math.hypot(point[0] - q[0], point[1] - q[1])
        if best is None or distance < best[0]:
            best = (distance, q)
    return best[1]


def centre_of_pressure():
    p = Picture("centre_of_pressure", "The centre of pressure of the task torque goes to the nearest point of its region", 640, 300)
    rectangle = [(0.13, 0.07), (0.13, -0.07), (-0.13, -0.07), (-0.13, 0.07)]
    edge, side = HALF_LENGTH - 0.01, SOLE_Y + HALF_WIDTH - 0.01
    hull = [(edge, side), (edge, -side), (-edge, -side), (-edge, side)]
    force = -MASS * GRAVITY
    for x, region, cop, title in ((165, rectangle, (0.05, -0.115), "region RECTANGLE: (37), (38)"),
                                  (480, hull, (0.185, -0.215), "region POLYGON: the soles' hull less 10 mm")):
        plan = Plan(p, x, 128, 560)
        plan.soles()
        p.path([plan.at(*corner) for corner in region], "b", close=True)
        p.path([plan.at(*corner) for corner in region], "fs", close=True)
        p.dot(*plan.at(0, 0), "fi", 3)
        p.text(plan.at(0, 0)[0] + 6, plan.at(0, 0)[1] + 14, "O", "s")
        o_d = nearest_on(region, cop)
        p.arrow(plan.at(*cop), plan.at(*o_d), "a")
        p.dot(*plan.at(*cop), "fa")
        p.dot(*plan.at(*o_d), "fb")
        p.text(plan.at(*o_d)[0] - 8, plan.at(*o_d)[1] + 14, "O_d", "s", "end")
        p.text(plan.at(*cop)[0] + 7, plan.at(*cop)[1] + 14, "CoP", "s")
        p.text(x, 240, title, "s", "middle")
        roll, pitch = (cop[1] - o_d[1]) * force, -(cop[0] - o_d[0]) * force
        text = f"about O_d: M_x = {roll:.1f} N·m, M_y = {pitch:.1f} N·m".replace("-", "−").replace("−0.0", "0.0")
        p.text(x, 260, text, "s", "middle")
        p.text(x, 280, f"with F_z = {force:.0f} N; (41) takes both away".replace("-", "−"), "s", "middle")
    return p


def sharing_the_load():
    p = Picture("sharing_the_load", "Which ratios both feet can bear, and the ramp that empties the left foot", 640, 300)
    # A resultant at (r_x, r_y) of frame O, soles 0.21 m apart, the left one 0.1 m ahead; M/F_z in mm.
    y_r, y_l, x_r, x_l = -SOLE_Y, SOLE_Y, -0.05, 0.05

    def roll(eta, r_y):
        return -(y_r - y_l) * eta + r_y - y_l  # (a η + b) / F_z of (71), (72)

    def pitch(eta, r_x):
        return (x_r - x_l) * eta - r_x + x_l  # of (74), (75)

    r_x, r_y, half_length, half_width = 0.095, 0.02, 0.12, 0.05
    axes = Axes(p, 60, 35, 235, 205, (0, 1), (-150, 150))
    low = (-half_width - r_y + y_l) / (y_l - y_r)
    high = min((half_width - r_y + y_l) / (y_l - y_r), (half_length - r_x + x_l) / (x_l - x_r))
    top, bottom = axes.at(high, 150), axes.at(low, -150)
    p.box(bottom[0], top[1], top[0] - bottom[0], bottom[1] - top[1], "fs")
    etas = [0, 1]
    axes.curve([(e, 1e3 * roll(e, r_y)) for e in etas], "a")
    axes.curve([(e, -1e3 * pitch(e, r_x)) for e in etas], "c")
    for limit, style in ((half_width, "a d"), (half_length, "c d")):
        for sign in (1, -1):
            axes.curve([(0, sign * 1e3 * limit), (1, sign * 1e3 * limit)], style)
    best = (y_l - r_y) / (y_l - y_r)
    p.dot(*axes.at(best, 0), "fa")
    axes.label(best, 0, "η*", "i", dx=8, dy=14)
    axes.label(1, 1e3 * roll(1, r_y), "y", "i", dx=5, dy=4)
    axes.label(1, -1e3 * pitch(1, r_x), "x", "i", dx=5, dy=4)
    axes.label((low + high) / 2, -150, "feasible", "s", "middle", dy=-8)
    axes.ticks([0, 0.5, 1], [-120, -50, 50, 120], "η", "each foot's own centre of pressure, mm")
    axes = Axes(p, 390, 35, 225, 205, (0, 0.5), (0, 1.05))
    times = span(0, 0.5, 61)
    for r, style, name in ((-0.06, "b", "above the right sole"), (0.02, "a", "between the feet")):
        free = (y_l - r) / (y_l - y_r)
        most = (half_width - r + y_l) / (y_l - y_r)
        course = [(t, min(free + (1 - free) * smooth(t / 0.5), most)) for t in times]
        axes.curve(course, style)
        axes.label(0.5, course[-1][1], name, "s", "end", dx=-2, dy=32 if r < 0 else 14)
    axes.ticks([0, 0.25, 0.5], [0, 0.5, 1], "time, s", "η unloading the left foot, by where the CoP is")
    return p


def multiply(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def estimation():
    p = Picture("estimation", "Standard deviations of velocity and position along one axis, foot on the ground and in the air", 640, 290)
    # One axis of the filter: errors of velocity, position, sole, accelerometer bias. Measured: sole less position.
    dt, steps = 0.002, 2000
    covariance = [[0.1 ** 2, 0, 0, 0], [0, 5e-5 ** 2, 5e-5 ** 2, 0], [0, 5e-5 ** 2, 5e-5 ** 2 + 1e-10, 0], [0, 0, 0, 0.1 ** 2]]
    move = [[1, 0, 0, -dt], [dt, 1, 0, -dt * dt / 2], [0, 0, 1, 0], [0, 0, 0, 1]]
    back = [list(row) for row in zip(*move)]
    course = []
    for i in range(steps):
        t = i * dt
        stands = t < 1.5 or t >= 2.5
        covariance = multiply(multiply(move, covariance), back)
        covariance[0][0] += (1e-2 * dt) ** 2  # accelerometer, each sample
        covariance[3][3] += 1e-4 ** 2 * dt  # its bias walks
        covariance[2][2] += (2e-5 ** 2 if stands else 0.3 ** 2) * dt  # contact_walk, slip_speed
        if stands:
            h = [0, -1, 1, 0]
            ph = [sum(x * y for x, y in zip(row, h)) for row in covariance]
            s = ph[2] - ph[1] + 3e-5 ** 2  # encoders
            covariance = [[covariance[r][c] - ph[r] * ph[c] / s for c in range(4)] for r in range(4)]
        if i % 12 == 0:
            course.append((t, 1e3 * math.sqrt(covariance[0][0]), 1e3 * math.sqrt(covariance[1][1])))
    axes = Axes(p, 65, 35, 550, 195, (0, 4), (1e-2, 1e3), log_y=True)
    left, right = axes.at(1.5, 1e3), axes.at(2.5, 1e-2)
    p.box(left[0], left[1], right[0] - left[0], right[1] - left[1], "ff")
    axes.curve([(t, v) for t, v, _ in course], "a")
    axes.curve([(t, x) for t, _, x in course], "b")
    axes.label(2, 1e3, "foot in the air", "s", "middle", dy=16)
    axes.label(0.75, 1e3, "foot stands", "s", "middle", dy=16)
    axes.label(3.25, 1e3, "foot stands", "s", "middle", dy=16)
    axes.label(0.6, 0.16, "velocity, mm/s", "s", dy=-8)
    axes.label(0.6, 0.05, "position, mm", "s", dy=16)
    axes.ticks([0, 1, 2, 3, 4], [0.01, 0.1, 1, 10, 100, 1000], "time, s", "standard deviation")
    return p


def steps():
    p = Picture("steps", "A push, a step that catches the capture point, and the COM coming to rest above it", 640, 300)
    com, velocity, edge, swing = 0.0, 0.72, 0.12, 0.3  # m, m/s, m, s
    xi = com + velocity / OMEGA
    dt, course = 0.005, []
    landing = edge + (xi - edge) * math.exp(OMEGA * swing)
    foothold = landing + 0.04  # overshoot
    for i in range(261):
        t = i * dt
        cop = edge if t < swing else xi + 0.4 * (xi - foothold)
        course.append((t, com, xi, cop))
        xi = cop + (xi - cop) * math.exp(OMEGA * dt)
        com += (xi - com) * (1 - math.exp(-OMEGA * dt))
    axes = Axes(p, 60, 35, 440, 215, (0, 1.3), (-0.15, 0.6))
    for middle, start, end in ((0.0, 0, 1.3), (foothold, swing, 1.3)):
        top, bottom = axes.at(start, min(middle + HALF_LENGTH, 0.6)), axes.at(end, middle - HALF_LENGTH)
        p.box(top[0], top[1], bottom[0] - top[0], bottom[1] - top[1], "ff")
    axes.curve([(t, x) for t, x, _, _ in course], "l")
    axes.curve([(t, min(x, 0.6)) for t, _, x, _ in course], "a")
    axes.curve([(t, x) for t, _, _, x in course], "b d")
    axes.label(0.02, 0.25, "ξ", "i")
    axes.label(0.02, 0.05, "c", "i")
    axes.label(0.05, 0.13, "p", "i", dy=-4)
    notes = ["ξ  capture point", "c  COM", "p  centre of pressure", "", f"ω = {OMEGA:.2f} 1/s", f"T = {swing} s", "",
             "Grey: the soles."]
    for i, line in enumerate(notes):
        p.text(515, 60 + 19 * i, line, "s")
    axes.ticks([0, 0.3, 0.6, 0.9, 1.2], [0, 0.12, 0.3, 0.5], "time, s", "ahead, m")
    return p


def walking():
    p = Picture("walking", "Capture point and centre of pressure from foot to foot, as strides ask for it", 640, 290)
    time, gain, steps, dt = 1.3 / OMEGA, 0.4, 7, 0.005  # s, the recovery's gain
    growth = math.exp(OMEGA * time)
    axes = Axes(p, 60, 30, 560, 205, (0, 3.6), (-0.2, 0.2))
    for middle in (-SOLE_Y, SOLE_Y):
        top, bottom = axes.at(0, middle + HALF_WIDTH), axes.at(3.6, middle - HALF_WIDTH)
        p.box(top[0], top[1], bottom[0] - top[0], bottom[1] - top[1], "ff")
    # NominalStride on the spot: footsteps of 2 SOLE_Y to one side, then to the other.
    side, course, clock = -1, [], 0.0
    xi = com = -SOLE_Y + 2 * SOLE_Y * (growth - 1) / (growth ** 2 - 1)
    while clock < 3.6:
        walks = clock < steps * time
        side = -1 if int(clock / time) % 2 == 0 else 1
        cop = side * SOLE_Y if walks else xi + gain * xi
        course.append((clock, xi, cop, com))
        for _ in range(4):
            xi += dt * OMEGA * (xi - cop)
            com += dt * OMEGA * (xi - com)
        clock += 4 * dt
    axes.curve([(t, cop) for t, _, cop, _ in course], "b d")
    axes.curve([(t, xi) for t, xi, _, _ in course], "a")
    axes.curve([(t, com) for t, _, _, com in course], "l")
    axes.label(0, 0.18, "left sole", "s", dx=6, dy=14)
    axes.label(0, -0.18, "right sole", "s", dx=6, dy=-2)
    axes.label(3.6, 0.2, "ξ (full)   p (dashed)   COM (thin)", "s", "end", dy=-8)
    axes.ticks([0, 1, 2, 3], [-0.105, 0, 0.105], "time, s", "to the left, m")
    return p


def gains():
    p = Picture("gains", "The rule for the COM's gains, and the answers of three pairs of gains", 640, 290)
    axes = Axes(p, 60, 35, 235, 205, (0, 50), (0, 16))
    for omega, style, name in ((OMEGA, "b", "h = 0.75 m"), (4.59, "c", "h = 0.46 m")):
        axes.curve([(t, min(2.75 * omega, 1 / (6 * 0.7 * t * 1e-3))) for t in span(1, 50, 99)], style)
        axes.label(1, 2.75 * omega, name, "s", dx=8, dy=-6)
    axes.curve([(t, 1 / (6 * 0.7 * t * 1e-3)) for t in span(14.9, 50, 60)], "g d")
    delay = (math.sqrt(2) / (2 * math.pi * 20) + 0.002 + 0.0005 + 0.001) * 1e3
    p.dot(*axes.at(delay, 2.75 * OMEGA), "fb")
    axes.label(delay, 2.75 * OMEGA, "the paper's robot", "s", "middle", dy=19)
    axes.label(50, 4.8, "1/(6 ζ τ)", "s", "end", dy=-16)
    axes.ticks([0, 10, 20, 30, 40, 50], [0, 5, 10, 15], "delay τ of the loop, ms", "ω_c of the COM, 1/s")
    axes = Axes(p, 390, 35, 230, 205, (0, 1.2), (-0.5, 1.0))
    axes.curve([(0, 0), (1.2, 0)], "g")
    for kp, kd, style, name, y in ((225, 10, "a", "225, 10 (the paper's)", 0.92), (99, 13.9, "b", "99, 13.9", 0.80),
                                   (99, 19.9, "c", "99, 19.9", 0.68)):
        course, e, v, dt = [], 1.0, 0.0, 1e-3
        for i in range(1201):
            if i % 12 == 0:
                course.append((i * dt, e))
            v += dt * (-kp * e - kd * v)
            e += dt * v
        axes.curve(course, style)
        axes.curve([(0.5, y), (0.57, y)], style)
        axes.label(0.6, y, name, "s", dy=4)
    axes.ticks([0, 0.4, 0.8, 1.2], [-0.5, 0, 0.5, 1], "time, s", "error of a task: ë + k_d ė + k_p e = 0")
    return p


def ground():
    p = Picture("ground", "How far a sole sinks, and how far it rolls, by the stiffness of the ground", 640, 290)
    stiffness = [10 ** x for x in span(math.log10(2), math.log10(200), 50)]  # kN/m of a whole sole
    axes = Axes(p, 60, 35, 235, 205, (2, 200), (0, 0.3), log_x=True)
    axes.curve([(k, MASS * GRAVITY / (1e3 * k)) for k in stiffness], "b")
    axes.label(5, MASS * GRAVITY / 5e3, "m g / k", "i", dx=10, dy=-2)
    axes.ticks([2, 5, 20, 200], [0, 0.1, 0.2, 0.3], "k, kN/m", "sinking under the whole weight, m")
    axes = Axes(p, 385, 35, 235, 205, (2, 200), (0, 0.8), log_x=True)
    for offset, style in ((0.01, "c"), (0.02, "b"), (0.035, "a")):
        course = [(k, MASS * GRAVITY * offset / (1e3 * k * HALF_WIDTH ** 2)) for k in stiffness]
        axes.curve([(k, y) for k, y in course if y <= 0.8], style)
        roll = {0.01: 0.3, 0.02: 0.45, 0.035: 0.5}[offset]
        axes.label(MASS * GRAVITY * offset / (roll * 1e3 * HALF_WIDTH ** 2), roll, f"{1e3 * offset:.0f}", "s", dx=4)
    axes.curve([(2, 0.6), (200, 0.6)], "g d")
    axes.label(200, 0.6, "limit of the ankle, 0.6 rad", "s", "end", dy=-6)
    axes.ticks([2, 5, 20, 200], [0, 0.2, 0.4, 0.6, 0.8], "k, kN/m", "roll, rad, by mm of CoP off the middle")
    return p


def simulation():
    p = Picture("simulation", "From a commanded current to torque, and a joint's friction by its velocity", 640, 290)
    lag, period, h = 0.5, 2.0, 1.0  # ms: current loop, tick, engine's step
    axes = Axes(p, 60, 35, 235, 205, (0, 6), (0, 1.45))
    commands = [(0, 0), (2, 0), (2, 1), (4, 1), (4, 0.4), (6, 0.4)]
    axes.curve(commands, "g d")
    current, course = 0.0, []
    for i in range(121):
        t = 0.05 * i
        command = 0.0 if t < period else 1.0 if t < 2 * period else 0.4
        course.append((t, current))
        current = command + math.exp(-0.05 / lag) * (current - command)  # CurrentLoop::Advance
    axes.curve(course, "b")
    for step in range(6):
        inside = [y for t, y in course if step * h <= t <= (step + 1) * h]
        mean = sum(inside) / len(inside)
        axes.curve([(step * h, mean), ((step + 1) * h, mean)], "a")
    for i, (style, name) in enumerate((("g d", "commanded"), ("b", "current"), ("a", "mean of an engine's step"))):
        axes.curve([(0.1, 1.4 - 0.12 * i), (0.45, 1.4 - 0.12 * i)], style)
        axes.label(0.55, 1.4 - 0.12 * i, name, "s", dy=4)
    axes.ticks([0, 2, 4, 6], [0, 0.5, 1], "time, ms; a tick is 2 ms", "current over the command")
    axes = Axes(p, 390, 35, 230, 205, (-1, 1), (-3.2, 3.2))
    coulomb, static, viscous, stribeck = 2.0, 2.4, 0.5, 0.05
    for sign in (-1, 1):
        axes.curve([(sign * v, sign * (coulomb + (static - coulomb) * math.exp(-(v / stribeck) ** 2) + viscous * v))
                    for v in [0.001 + 0.004 * i for i in range(30)] + span(0.13, 1, 12)], "a")
    axes.curve([(0, -static), (0, static)], "b")
    axes.curve([(-1, 0), (1, 0)], "g")
    axes.label(0, 2.4, "sticks", "s", "end", dx=-6, dy=4)
    axes.label(0.45, 2.2, "slides", "s", dy=20)
    axes.ticks([-1, 0, 1], [-2.4, -2, 0, 2, 2.4], "velocity of the joint, rad/s", "friction, N·m")
    return p


def same_bits():
    p = Picture("same_bits", "One rounding or two: the last bit differs; and how a difference grows in a fall", 640, 290)
    # a·b + c in double precision, exactly: rounded once, as a fused instruction does, or after each operation.
    axes = Axes(p, 60, 35, 235, 205, (0, 200), (-2.5, 2.5))
    points = []
    for i in range(200):
        a, b, c = math.sin(1 + i), math.sin(2 + 3 * i), math.sin(5 + 7 * i)
        twice = a * b + c
        once = float(Fraction(a) * Fraction(b) + Fraction(c))
        units = round((once - twice) / math.ulp(once))
        points.append((i, max(-2, min(2, units))))
    for i, units in points:
        x, y = axes.at(i, units)
        p.dot(x, y, "fa" if units else "fb", 1.6)
    different = sum(1 for _, units in points if units)
    axes.label(200, 2.2, f"{different} of 200 differ", "s", "end")
    axes.ticks([0, 100, 200], [-2, -1, 0, 1, 2], "200 values of a·b + c", "difference, units of the last bit")
    axes = Axes(p, 390, 35, 230, 205, (0, 10), (1e-16, 1e1), log_y=True)
    bit = math.ulp(HEIGHT)
    axes.curve([(t, bit * math.exp(OMEGA * t)) for t in span(0, 10, 21)], "a")
    axes.curve([(t, bit * math.exp(-2 * t)) for t in span(0, 0.05, 2)], "b")
    when = math.log(1e-3 / bit) / OMEGA
    p.dot(*axes.at(when, 1e-3), "fa")
    axes.label(when, 1e-3, f"1 mm after {when:.1f} s", "s", "end", dx=-9, dy=-3)
    axes.ticks([0, 5, 10], [1e-15, 1e-10, 1e-5, 1], "time, s", "last bit of 0.75 m, grown by e^(ωt), m")
    return p


PICTURES = (notation, tick, contact_dynamics, centre_of_pressure, sharing_the_load, estimation, steps, walking, gains, ground,
            simulation, same_bits)


def keep(pictures, check):
    """Writes each picture beside this file, or with `check` ends the program where a file is not that picture."""
    different = []
    for picture in pictures:
        path, text = os.path.join(HERE, picture.name + ".svg"), picture.file()
        if not check:
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        elif not os.path.exists(path) or open(path, encoding="utf-8").read() != text:
            different.append(path)
    if different:
        sys.exit(f"not what {os.path.basename(sys.argv[0])} draws: " + ", ".join(different))


def main():
    check = sys.argv[1:] == ["--check"]
    if sys.argv[1:] and not check:
        sys.exit("usage: draw.py [--check]")
    keep((draw() for draw in PICTURES), check)


if __name__ == "__main__":
    main()
