#!/usr/bin/python3
"""Draws the moving pictures of docs/concepts, from runs that it makes or from the mathematics: SVG that moves by itself.

    export PYTHONPATH=$PWD/build/release/python
    docs/concepts/pictures/animate.py [NAME...]       # writes the SVG files beside itself; without names: all
    docs/concepts/pictures/animate.py --check push    # writes nothing; exit code 1 where the file differs from what is drawn

Of a run the true state of the simulated robot moves the links, through poise.Robot; the controller's messages give the
rest. All films stand in this one file, since they share Film, its styles and the list of names.
"""
import math
import re
import sys
from collections import namedtuple
from decimal import Decimal
from fractions import Fraction

import numpy as np

import poise
from draw import HALF_LENGTH, HALF_WIDTH, HEIGHT, OMEGA, SOLE_Y, TICK, Axes, Picture, keep, number, span

FRAMES = 12  # a second of the picture
WIDTH, HEIGHT_OF_FILM = 640, 330
FIGURE = (20, 300)  # pixels across, of the robot as one looks at it
PLAN = (340, 620)  # of the soles from above
FLOOR, TOP = 262, 44
STYLE = """
.k { stroke: var(--ink); fill: none; stroke-width: 3.5; stroke-linejoin: round; stroke-linecap: round }
.n { stroke: var(--faint); fill: none; stroke-width: 3.5; stroke-linejoin: round; stroke-linecap: round }
.t { stroke: var(--ink); fill: var(--faint); fill-opacity: .25; stroke-width: 1.2 }"""
FORCE = 0.16  # pixels a newton, of the ground's forces
TRUNK = (0.12, 0.18, -0.1, 0.48)  # m, of the root link: half its depth and width, its lower and upper end

# scenario, changes: of poise.run. start, end: s of the run. speed: s of the run in a second of the picture.
# view: "behind" or "side", whence one sees the robot. height: m above the floor that are shown.
# marks: those of MARKS, drawn in this order.
Animation = namedtuple("Animation", "name title scenario changes start end speed view height marks")


def rotation(w, x, y, z):
    return np.stack([np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
                     np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
                     np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1)], -2)


class Placed:
    """Frames by their message's pose (position, orientation), of some ticks: points in them to points of the world."""

    def __init__(self, pose, ticks, foot=None):
        at = (ticks,) if foot is None else (ticks, foot)
        self.position = pose.position[at]
        self.rotation = rotation(*np.moveaxis(pose.orientation[at], -1, 0))

    def points(self, local):
        """local: (points, 3) or (ticks, points, 3); returns (ticks, points, 3)."""
        return self.position[:, None] + np.asarray(local) @ self.rotation.swapaxes(1, 2)


class Film:
    """A picture in which things move, and begin again after `length` seconds."""

    def __init__(self, name, title, length, height=HEIGHT_OF_FILM):
        self.length, self.count = length, round(length * FRAMES) + 1
        self.picture = Picture(name, title, WIDTH, height)
        self.picture.add(f"<style>{STYLE}</style>")
        self.at = np.linspace(0, length, self.count)  # s of each frame

    def moving(self, tag, attributes, style, inside="", mode=""):
        """An element whose attributes {name: a text a frame} change with time."""
        first = " ".join(f'{name}="{texts[0]}"' for name, texts in attributes.items())
        motion = "".join(f'<animate attributeName="{name}" dur="{self.length:g}s" repeatCount="indefinite"{mode} '
                         f'values="{";".join(texts)}"/>' for name, texts in attributes.items() if len(set(texts)) > 1)
        extra = ' r="4"' if tag == "circle" else ""
        self.picture.add(f'<{tag} class="{style}" {first}{extra}>{inside}{motion}</{tag}>' if motion or inside
                         else f'<{tag} class="{style}" {first}{extra}/>')

    def shown(self, x, y, text, on, style="s", anchor="middle"):
        """A text in the frames in which `on` is true."""
        place = {name: [value] for name, value in (("x", number(x)), ("y", number(y)), ("text-anchor", anchor))}
        self.moving("text", {**place, "opacity": [str(int(value)) for value in on]}, style, text, ' calcMode="discrete"')

    def line(self, pixels, style="l", close=False):
        """pixels: (frames, points, 2)"""
        self.moving("polygon" if close else "polyline",
                    {"points": [" ".join(f"{number(x)},{number(y)}" for x, y in frame) for frame in pixels]}, style)

    def dot(self, pixels, style):
        """pixels: (frames, 2)"""
        self.moving("circle", {"cx": [number(x) for x in pixels[:, 0]], "cy": [number(y) for y in pixels[:, 1]]}, style)

    def arrow(self, start, way, style):
        """From start along way, pixels (frames, 2); nothing where way is short."""
        length = np.linalg.norm(way, axis=-1, keepdims=True)
        way = np.where(length > 3, way, 0)
        along = way / np.maximum(length, 1e-9) * np.minimum(length / 2, 7)
        side = np.stack([-along[:, 1], along[:, 0]], -1) / 2
        end = start + way
        self.line(np.stack([start, end, end - along + side, end, end - along - side], 1), style)


class Scene(Film):
    """A run's ticks as frames of a picture, and where points of the world are in it."""

    def __init__(self, animation, run):
        super().__init__(animation.name, animation.title, (animation.end - animation.start) / animation.speed)
        self.run, self.robot, self.animation = run, run.robot, animation
        self.times = np.linspace(animation.start, animation.end, self.count)
        self.ticks = np.minimum(np.round(self.times / run.info["tick_period"]).astype(int), run.info["num_ticks"] - 1)
        self.truth, self.planner, self.balance = run["GROUND_TRUTH"], run["PLANNER_STATUS"], run["BALANCE_TORQUE"]
        self.feet = [Placed(self.truth.foot_pose, self.ticks, foot) for foot in (0, 1)]
        self.legend, self.above = [], "soles from above"
        half_length, half_width = np.array(self.robot.sole_size[0]) / 2
        self.sole = np.array([[half_length, half_width, 0], [half_length, -half_width, 0], [-half_length, -half_width, 0],
                              [-half_length, half_width, 0]])
        soles = np.concatenate([foot.points(self.sole).reshape(-1, 3) for foot in self.feet])
        low, high = soles.min(0), soles.max(0)
        self.middle = (low + high) / 2
        across, up = (0, 1) if animation.view == "side" else (1, 0)
        size = high - low
        self.scale = min((PLAN[1] - PLAN[0] - 20) / size[across], (FLOOR - TOP - 20) / size[up], 560)
        self.figure_scale = min((FLOOR - TOP + 10) / animation.height, (FIGURE[1] - FIGURE[0]) / (size[across] + 0.1))

    def figure(self, world):
        """Pixels of points (..., 3): seen from behind the left is left; from the robot's right, ahead is right."""
        away = world - self.middle
        across = away[..., 0] if self.animation.view == "side" else -away[..., 1]
        return np.stack([sum(FIGURE) / 2 + self.figure_scale * across, FLOOR - self.figure_scale * world[..., 2]], -1)

    def plan(self, world):
        away = world - self.middle
        x, y = away[..., 0], away[..., 1]
        across, up = (x, y) if self.animation.view == "side" else (-y, x)
        return np.stack([sum(PLAN) / 2 + self.scale * across, (FLOOR + TOP) / 2 - self.scale * up], -1)

    def robot_lines(self):
        """The links as lines from joint to joint, hip to ankle, and the trunk as what its box looks like."""
        truth, ticks, view = self.truth, self.ticks, self.animation.view
        state = truth.q[ticks], truth.base_position[ticks], truth.base_orientation[ticks]
        depth, width, low, high = TRUNK
        half = depth if view == "side" else width
        corners = [(half, low), (half, high), (-half, high), (-half, low)]
        base = self.robot.pose("upper_body", *state)
        trunk = np.array([(x, 0, z) if view == "side" else (0, x, z) for x, z in corners])
        self.line(self.figure(base[:, None, :3, 3] + np.einsum("tij,pj->tpi", base[:, :3, :3], trunk)), "t", close=True)
        for foot, side, style in ((1, "left", "n"), (0, "right", "k")):
            joints = [self.robot.pose(f"{side}_{link}", *state)[:, :3, 3] for link in ("thigh", "shank", "ankle")]
            end = 0 if view == "side" else 1
            sole = np.zeros((3, 3))
            sole[1:, end] = self.sole[0, end], -self.sole[0, end]
            sole = self.feet[foot].points(sole)
            leg = np.concatenate([np.stack(joints, 1), sole[:, :1]], 1)
            self.line(self.figure(leg), style if view == "side" else "k")
            self.line(self.figure(sole[:, 1:]), style if view == "side" else "k")

    def clock(self, spans):
        """The run's time as a line with a mark that goes along; spans: (start, end, word, style)."""
        left, right, y = 60, WIDTH - 60, self.picture.height - 24
        start, end = self.animation.start, self.animation.end

        def at(time):
            return left + (right - left) * (min(max(time, start), end) - start) / (end - start)

        self.picture.path([(left, y), (right, y)], "g")
        words = {}
        for begin, until, word, style in spans:
            self.picture.path([(at(begin), y), (at(until), y)], style)
            if word not in words:  # each once, in turn above and below the line
                words[word] = y + (16 if len(words) % 2 else -7)
                self.picture.text(at(begin), words[word], word, "s")
        self.picture.text(left - 8, y + 4, f"{start:g} s", "s", "end")
        self.picture.text(right + 8, y + 4, f"{end:g} s", "s")
        self.moving("circle", {"cx": [number(at(t)) for t in (start, end)], "cy": [number(y)] * 2}, "fi")

    def spans(self, on, word, style):
        """The stretches of time in which `on`, a value a tick of the run, is true."""
        edges = np.flatnonzero(np.diff(np.concatenate([[0], on.astype(int), [0]]))) * self.run.info["tick_period"]
        return [(a, b, word, style) for a, b in zip(edges[::2], edges[1::2])
                if b > self.animation.start and a < self.animation.end]


def com(scene):
    place = scene.truth.com_position[scene.ticks]
    below = place * [1, 1, 0]
    scene.line(scene.figure(np.stack([place, below], 1)), "g d")
    scene.dot(scene.figure(place), "fc")
    scene.dot(scene.plan(below), "fc")
    scene.legend.append(("COM", "fc"))


def centre(wrench, foot):
    """A foot's centre of pressure in its sole, and the force of the ground on it, both (ticks, 3) in the sole's frame."""
    force, moment = wrench.force[:, foot], wrench.moment[:, foot]
    loaded = force[:, 2] < -5
    down = np.where(loaded, force[:, 2], -1)
    place = np.stack([-moment[:, 1] / down, moment[:, 0] / down, 0 * down], -1)
    return np.where(loaded[:, None], place, 0), np.where(loaded[:, None], -force, 0)


def forces(scene):
    """What the ground gives each foot, as an arrow at the foot's centre of pressure."""
    for foot, placed in enumerate(scene.feet):
        place, force = (values[scene.ticks] for values in centre(scene.truth.foot_wrench, foot))
        start = placed.points(place[:, None])[:, 0]
        way = np.einsum("tij,tj->ti", placed.rotation, force)
        pixels = scene.figure(start)
        scene.arrow(pixels, (scene.figure(start + way) - pixels) * FORCE / scene.figure_scale, "b")

def push(scene):
    """The push, as an arrow that ends at the root link."""
    force = scene.truth.push_force[scene.ticks]
    at = scene.truth.base_position[scene.ticks]
    most = np.abs(scene.truth.push_force).max()
    way = (scene.figure(at + force) - scene.figure(at)) * 85 / (most * scene.figure_scale)
    scene.arrow(scene.figure(at) - way, way, "a")
    on = np.abs(scene.truth.push_force).max(1) > 0
    return scene.spans(on, f"push, up to {most:.0f} N", "a")


def region(scene):
    """Where the centre of pressure is kept."""
    frame, count = Placed(scene.balance.frame_o, scene.ticks), scene.balance.num_corners[scene.ticks]
    x, y = scene.balance.corner_x[scene.ticks], scene.balance.corner_y[scene.ticks]
    last = np.minimum(np.arange(count.max()), count[:, None] - 1)  # corners that a frame lacks fall on its last one
    corners = np.stack([np.take_along_axis(x, last, 1), np.take_along_axis(y, last, 1), 0.0 * last], -1)
    scene.line(scene.plan(frame.points(corners)), "fs", close=True)


def in_frame_o(scene, place):
    local = np.concatenate([place[scene.ticks], np.zeros((len(scene.ticks), 1))], 1)
    return Placed(scene.balance.frame_o, scene.ticks).points(local[:, None])[:, 0]


def balancing(scene):
    """The centre of pressure that the tasks ask for, and the one that is commanded."""
    task, kept = (scene.plan(in_frame_o(scene, place)) for place in (scene.balance.cop_task, scene.balance.cop))
    task = np.clip(task, [PLAN[0], TOP], [PLAN[1], FLOOR])  # what is further away is at the edge
    scene.line(np.stack([task, kept], 1), "a d")
    scene.dot(task, "fa")
    scene.dot(kept, "fb")
    scene.legend.append(("CoP of the tasks", "fa"))
    scene.legend.append(("CoP kept", "fb"))
    return scene.spans((scene.balance.active_x + scene.balance.active_y) > 0, "balancing", "b")


def feet(scene):
    """The measured centre of pressure of each foot."""
    for foot, placed in enumerate(scene.feet):
        place, _ = centre(scene.truth.foot_wrench, foot)
        scene.dot(scene.plan(placed.points(place[scene.ticks][:, None])[:, 0]), "fb")
    scene.legend.append(("CoP of a foot", "fb"))


def capture(scene):
    """The capture point, and the centre of pressure of both feet, measured."""
    total, moment = 1e-9, 0
    for foot, placed in enumerate(scene.feet):
        place, force = (values[scene.ticks] for values in centre(scene.truth.foot_wrench, foot))
        load = np.maximum(force[:, 2:], 0)
        total, moment = total + load, moment + load * placed.points(place[:, None])[:, 0]
    scene.dot(scene.plan(moment / total), "fb")
    scene.dot(scene.plan(scene.planner.capture_point[scene.ticks]), "fa")
    scene.legend += [("capture point", "fa"), ("CoP", "fb")]


def stepping(scene):
    """When the planner has a foot on its way."""
    return scene.spans(scene.planner.stepping == 2, "a foot swings", "c")


def landing(scene):
    """What the planner makes of the left foot."""
    state = scene.planner.foot_state[:, 1]
    return [span for value, word, style in ((1, "swing", "l"), (2, "searching", "c"), (3, "touching", "b"))
            for span in scene.spans(state == value, word, style)]


def belief(scene):
    """The error of the estimated base, from above as the picture's robot stands, in the ellipse that holds it with 95 %."""
    state, covariance = scene.run["ROBOT_STATE"], scene.run["ESTIMATOR_STATUS"].covariance[scene.ticks]
    error = (state.base_position - scene.truth.base_position)[scene.ticks][:, :2]
    root = np.linalg.cholesky(covariance[:, [[39, 40], [40, 42]]])  # of x and y; the upper triangle by rows
    turn = 2 * math.pi * np.arange(20) / 20
    edge = math.sqrt(-2 * math.log(0.05)) * (root @ np.stack([np.cos(turn), np.sin(turn)])).swapaxes(1, 2)
    scale = 100 / np.abs(edge).max()
    middle = np.array([sum(PLAN) / 2, (FLOOR + TOP) / 2])

    def pixels(place):
        return middle - scale * place[..., ::-1]

    for x, y in ((120, 0), (0, 105)):
        scene.picture.path([middle - (x, y), middle + (x, y)], "g")
    scene.line(pixels(edge), "fs", close=True)
    scene.dot(pixels(error), "fa")
    unit = 1e-4  # m
    scene.picture.path([(PLAN[1] - scale * unit, FLOOR - 6), (PLAN[1], FLOOR - 6)], "l")
    scene.picture.text(PLAN[1] - scale * unit / 2, FLOOR - 11, f"{1e3 * unit:g} mm", "s", "middle")
    scene.above = "error of the estimated base, from above"
    scene.legend += [("error", "fa"), ("where the filter has it with 95 %", "fb")]


def block(scene):
    """The block below the left foot as the scenario has it, unloaded."""
    text = re.search(r"\bblock \{(.*?)\}", scene.run.scenario, re.DOTALL)[1]
    y, width, height = (float(re.search(rf"\b{name}: (\S+)", text)[1]) for name in ("y", "width", "height"))
    sides = [[0, y + width / 2, 0], [0, y + width / 2, height], [0, y - width / 2, height], [0, y - width / 2, 0]]
    scene.line(scene.figure(np.array([sides])), "ff", close=True)


MARKS = {mark.__name__: mark for mark in (com, forces, push, region, balancing, feet, capture, stepping, landing, belief, block)}

ANIMATIONS = (
    Animation("push", "Pushed from the right: the robot sways and stands", "push_double_support", {}, 0.3, 2.3, 0.4, "behind", 1.4,
              "region balancing com forces push"),
    Animation("shared_load", "The load goes from foot to foot, and the robot stands still", "gravity_compensation",
              {"duration": 13}, 7, 12, 1, "behind", 1.4, "feet com forces"),
    Animation("step", "Pushed ahead, too hard to stand: a step catches the robot", "push_double_support",
              {"variant": "step", "duration": 3}, 0.3, 2.3, 0.4, "side", 1.4, "com capture forces push stepping"),
    Animation("walk", "Walking ahead: capture point and centre of pressure from foot to foot", "walk", {"duration": 8},
              2, 7, 1, "side", 1.4, "com capture forces stepping"),
    Animation("belief", "Pushed: soles that rock say less of where the body is, and the filter knows it", "push_double_support",
              {"duration": 2.5}, 0.2, 2.2, 0.4, "behind", 1.4, "belief forces push"),
    Animation("unknown_ground", "The left foot comes down onto a soft block, lower than it was told", "unknown_surface",
              {"changes": {"sim.block.height": 0.06}, "duration": 32}, 24, 32, 1.6, "behind", 0.45, "block feet com forces landing"),
)


def animation(what):
    scene = Scene(what, poise.run(what.scenario, **what.changes))
    scene.picture.path([(FIGURE[0], FLOOR), (FIGURE[1], FLOOR)], "g")
    if "belief" not in what.marks:
        for foot in scene.feet:
            scene.line(scene.plan(foot.points(scene.sole)), "ff", close=True)
    scene.robot_lines()
    spans = [span for mark in what.marks.split() for span in MARKS[mark](scene) or []]
    where = "from its right" if what.view == "side" else "from behind"
    scene.picture.box(0, 0, sum(FIGURE), TOP - 10, "bg", 8)  # the rest of the robot is beyond the picture's edge
    slowed, hurried = f", slowed {1 / what.speed:g} times", f", {what.speed:g} times as fast"
    pace = slowed if what.speed < 1 else hurried if what.speed > 1 else ""
    scene.picture.text(sum(FIGURE) / 2, 24, where + pace, "s", "middle")
    scene.picture.text(sum(PLAN) / 2, 24, scene.above, "s", "middle")
    x = PLAN[0]
    for text, style in scene.legend:
        scene.picture.dot(x, FLOOR + 14, style)
        scene.picture.text(x + 8, FLOOR + 18, text, "s")
        x += 28 + 6 * len(text)
    scene.clock(spans)
    return scene.picture


# Pictures from the mathematics, with the numbers of the still picture of the page.

def pixels(axes, x, y):
    """(frames, 2) of numbers in axes of draw.py."""
    return np.array([axes.at(a, b) for a, b in zip(x, y)])


def frames():
    """The left foot goes ahead and turns, and the load goes over and back: what frame O and the wrenches' signs make of both."""
    film = Film("frames", "Frame O follows the soles, and the centre of pressure in it follows the load", 5, 290)
    wave = 0.5 - 0.5 * np.cos(2 * math.pi * film.at / film.length)
    right = np.tile([0, -SOLE_Y], (film.count, 1))  # x, y of its centre, m
    left, turn = np.stack([0.07 * wave, SOLE_Y + 0.01 * wave], -1), 0.3 * wave  # m, rad
    share = (0.85 - 0.7 * wave)[:, None]  # η of the right foot
    middle = (right + left) / 2  # O
    y = (left - right) / np.linalg.norm(left - right, axis=1, keepdims=True)
    x = np.stack([y[:, 1], -y[:, 0]], -1)

    def plan(place):
        return np.array([160, 163]) - 540 * place[:, ::-1]

    def frame(place, ahead, aside, style, length):
        for way in (ahead, aside):
            film.arrow(plan(place), plan(place + length * way) - plan(place), style)

    for place, angle in ((right, 0 * turn), (left, turn)):
        ahead, aside = np.stack([np.cos(angle), np.sin(angle)], -1), np.stack([-np.sin(angle), np.cos(angle)], -1)
        corners = ((1, 1), (1, -1), (-1, -1), (-1, 1))
        film.line(np.stack([plan(place + a * HALF_LENGTH * ahead + b * HALF_WIDTH * aside) for a, b in corners], 1), "ff", close=True)
        frame(place, ahead, aside, "c", 0.06)
    frame(middle, x, y, "b", 0.09)
    film.dot(plan(share * right + (1 - share) * left), "fi")  # M_x of (35) is the sum of y F_z
    film.picture.text(160, 28, "from above", "s", "middle")
    for column, (style, text) in enumerate((("fc", "frames of the soles"), ("fb", "frame O"), ("fi", "its CoP"))):
        at = (30, 165, 240)[column]
        film.picture.dot(at, 274, style)
        film.picture.text(at + 8, 278, text, "s")

    floor = 165
    film.picture.text(480, 28, "from behind, each foot's F_z", "s", "middle")
    film.picture.path([(360, floor), (600, floor)], "l")
    for place, load, name in ((left, 1 - share, "left"), (right, share, "right")):
        across = 480 - 560 * place[:, 1:]
        half = 560 * HALF_WIDTH
        film.line(np.stack([np.concatenate([across + a * half, 0 * across + floor - b], 1) for a, b in
                            ((-1, 0), (1, 0), (1, 10), (-1, 10))], 1), "ff", close=True)
        length = np.concatenate([0 * load, 90 * load], 1)
        film.arrow(np.concatenate([across, 0 * across + floor], 1), length, "a")
        film.arrow(np.concatenate([across, 0 * across + floor - 12], 1), -length, "l")
        film.picture.text(480 - 560 * place[0, 1], 50, name, "s", "middle")
    for at, style, text in ((360, "fa", "of F_c, on the ground: below 0"), (550, "fi", "a sensor's")):
        film.picture.dot(at, 274, style)
        film.picture.text(at + 8, 278, text, "s")
    return film.picture


def messages():
    """Where each message of a tick goes, in the order of TICK."""
    film = Film("messages", "One tick: each process computes as soon as it has all its inputs of this tick", 6)
    places = {"sim": (75, 195), "hw_bridge": (210, 195), "state_estimator": (310, 90), "step_planner": (450, 90),
              "task_controller": (575, 165), "contact_wrench_monitor": (480, 285), "redistributor": (310, 285)}
    slot = film.length / (len(TICK) + 1)  # a message's; the last one is the robot's
    for writer, _, readers in TICK:
        for reader in readers:
            film.picture.path([places[writer], places[reader]], "g")
    lit = []  # process, when it begins to compute, how strongly it is shown
    for i, (writer, message, readers) in enumerate(TICK):
        lit.append((writer, i * slot, 0.8))
        share = np.clip(film.at / slot - i - 0.4, 0, 0.6) / 0.6  # first it computes, then the message is on its way
        away = (share > 0) & (share < 1)
        for reader in readers:
            start, end = (np.array(places[name]) for name in (writer, reader))
            film.dot(start + (end - start) * share[:, None], "fa")
        film.shown(20, 50, message, away, "", "start")
        if message == "ROBOT_STATE":
            lit += [(name, (i + 1) * slot, 0.3) for name in readers[1:]]  # the stage `prepare`
    lit.append(("sim", len(TICK) * slot, 0.8))
    for x, y in places.values():
        film.picture.box(x - 50, y - 20, 100, 40, "bg", 4)
    for name, begin, strength in lit:
        on = (film.at >= begin) & (film.at < begin + (slot if begin == len(TICK) * slot else 0.4 * slot))
        film.moving("rect", {**rectangle(places[name]), "opacity": [f"{strength * value:g}" for value in on.astype(int)]}, "fc",
                    mode=DISCRETE)
    for name, (x, y) in places.items():
        film.picture.box(x - 50, y - 20, 100, 40, "l", 4)
        head, _, tail = name.rpartition("_")
        for line, text in enumerate([head + "_", tail] if head else [tail]):
            film.picture.text(x, y + (-3 if head else 4) + 14 * line, text, "s", "middle")
    film.picture.text(20, 28, "tick i", "s")
    film.shown(20, 50, "the robot moves; then tick i + 1", film.at >= len(TICK) * slot, "", "start")
    for x, strength, text in ((340, 0.8, "computes"), (440, 0.3, "prepares, from the state alone")):
        film.picture.add(f'<rect class="fc" x="{x}" y="18" width="12" height="12" opacity="{strength}"/>')
        film.picture.text(x + 18, 28, text, "s")
    return film.picture


DISCRETE = ' calcMode="discrete"'


def rectangle(middle):
    return {"x": [number(middle[0] - 50)], "y": [number(middle[1] - 20)], "width": ["100"], "height": ["40"], "rx": ["4"]}


def oblique():
    """The body of contact_dynamics.svg under a force that turns."""
    film = Film("oblique", "A force turns, the floor answers: what is left stays on one oblique line", 6, 270)
    a = np.array([[2.0, 0.9], [0.9, 1.0]])  # A; q = (x, z), J_c = (0, 1)
    bar = np.linalg.inv(a)[1] / np.linalg.inv(a)[1, 1]  # (7)
    angle = -math.pi / 2 + 0.9 * np.sin(2 * math.pi * film.at / film.length)
    force = 2 * np.stack([np.cos(angle), np.sin(angle)], -1)  # Γ − g
    contact = np.stack([0 * angle, force @ bar], -1)  # J_cᵀ f_c, (8)
    left = force - contact  # N_cᵀ (Γ − g), (11)
    acceleration = left @ np.linalg.inv(a)  # (9)
    assert np.abs(acceleration[:, 1]).max() < 1e-12 and contact[:, 1].max() < 0  # the floor holds, and does not pull
    origin, scale = np.array([190, 95]), 66 * np.array([1, -1])
    film.picture.path([(40, 115), (370, 115)], "g")
    film.picture.box(40, 115, 330, 145, "ff")
    film.picture.box(158, 75, 64, 40, "l", 3)
    way = left[np.argmax(left[:, 0])] * 1.15
    film.picture.path([origin - way * scale, origin + way * scale], "g d")
    start = np.tile(origin, (film.count, 1)).astype(float)
    film.line(np.stack([origin + scale * left, origin + scale * force, origin + scale * contact], 1), "g d")
    for vector, style, y, text in ((force, "l", 60, "Γ − g: it turns"), (contact, "a", 84, "J_cᵀ f_c: what the floor takes, (8)"),
                                   (left, "b", 108, "N_cᵀ (Γ − g): what is left, (11)"),
                                   (acceleration, "c", 132, "q̈: along the floor alone, (9)")):
        film.arrow(start, vector * scale, style)
        film.picture.path([(395, y - 4), (417, y - 4)], style)
        film.picture.text(425, y, text, "s")
    film.picture.text(395, 166, "dashed: the line of N_cᵀ,", "s")
    film.picture.text(395, 182, "oblique, since A couples x and z", "s")
    return film.picture


def answers():
    """The three pairs of gains.svg: errors that come back to 0."""
    film = Film("answers", "Three pairs of gains bring a task back: one overshoots", 5, 290)
    axes = Axes(film.picture, 390, 35, 230, 205, (0, 1.2), (-0.5, 1.0))
    axes.curve([(0, 0), (1.2, 0)], "g")
    axes.ticks([0, 0.4, 0.8, 1.2], [-0.5, 0, 0.5, 1], "time, s", "error of the task")
    rest, time = 120, np.minimum(film.at / 4, 1.2)  # the last frames stand still
    film.picture.path([(rest, 30), (rest, 245)], "g d")
    film.picture.text(rest, 262, "where it shall be", "s", "middle")
    film.picture.text(rest + 150, 262, "slowed 4 times", "s", "middle")
    for lane, (kp, kd, style, name) in enumerate(((225, 10, "a", "225, 10 (the paper's)"), (99, 13.9, "b", "99, 13.9"),
                                                  (99, 19.9, "c", "99, 19.9"))):
        # ë + k_d ė + k_p e = 0 from e = 1 at rest, exactly.
        root = np.emath.sqrt(kd ** 2 / 4 - kp)
        one, two = -kd / 2 + root, -kd / 2 - root
        error = lambda t: np.real((one * np.exp(two * t) - two * np.exp(one * t)) / (one - two))  # noqa: E731
        axes.curve([(t, error(t)) for t in span(0, 1.2, 61)], style)
        film.dot(pixels(axes, time, error(time)), f"f{style}")
        y, x = 75 + 65 * lane, rest + 170 * error(time)
        film.picture.text(340, y - 22, f"k_p, k_d: {name}", "s", "end")
        film.picture.path([(40, y + 15), (340, y + 15)], "g")
        film.moving("rect", {"x": [number(v - 15) for v in x], "y": [number(y - 15)], "width": ["30"], "height": ["30"], "rx": ["3"]},
                    f"f{style}")
    return film.picture


def stick_slip():
    """The friction of simulation.svg: a rotor pulled through a spring sticks and slips."""
    film = Film("stick_slip", "Friction of a joint: pulled slowly through a spring it sticks, and slips", 6, 290)
    coulomb, static, viscous, stribeck = 2.0, 2.4, 0.5, 0.05  # N·m, N·m, N·m·s/rad, rad/s, of simulation.svg
    inertia, spring, wound, pull, step = 0.1, 8.0, 1.6, 0.12, 1e-4  # kg·m², N·m/rad, N·m, rad/s, s
    place = speed = 0.0
    course = []
    for i in range(round(film.length / step) + 1):
        torque = wound + spring * (pull * i * step - place)
        slides = abs(speed) > 1e-9 or torque > static
        friction = coulomb + (static - coulomb) * math.exp(-(speed / stribeck) ** 2) + viscous * speed if slides else torque
        if i % 200 == 0:
            course.append((i * step, place, speed, friction, torque))
        speed = max(0.0, speed + step * (torque - friction) / inertia) if slides else 0.0
        place += step * speed
    course = np.array(course).T
    time, place, speed, friction, torque = (np.interp(film.at, course[0], figures) for figures in course)
    axes = Axes(film.picture, 410, 35, 210, 205, (0, 1), (0, 3.2))
    axes.curve([(v, coulomb + (static - coulomb) * math.exp(-(v / stribeck) ** 2) + viscous * v)
                for v in span(0, 0.15, 31) + span(0.17, 1, 12)], "a")
    axes.curve([(0, 0), (0, static)], "b")
    axes.ticks([0, 0.5, 1], [0, 2, 2.4], "velocity, rad/s", "friction, N·m")
    film.dot(pixels(axes, speed, friction), "fa")
    left, scale = 30, 220  # pixels, of a radian
    x, hook = left + scale * place, left + 130 + scale * pull * time
    film.picture.path([(20, 90), (365, 90)], "g")
    film.moving("rect", {"x": [number(v) for v in x], "y": ["50"], "width": ["50"], "height": ["40"], "rx": ["3"]}, "ff")
    zigzag = np.array([0, 0.08] + [0.08 + 0.84 * (k + 0.5) / 8 for k in range(8)] + [0.92, 1])
    up = np.array([0, 0] + [7 * (-1) ** k for k in range(8)] + [0, 0])
    film.line(np.stack([(x + 50)[:, None] + (hook - x - 50)[:, None] * zigzag, 70 + 0 * x[:, None] + up], -1), "l")
    film.dot(np.stack([hook, 70 + 0 * x], -1), "fb")
    film.picture.text(30, 34, "the blue end is pulled evenly; the rotor holds on, and slips", "s")
    axes = Axes(film.picture, 60, 135, 290, 105, (0, film.length), (1.5, 2.6))
    axes.curve(list(zip(course[0], course[3])), "a")
    axes.curve(list(zip(course[0], course[4])), "b")
    axes.ticks([0, 2, 4, 6], [1.5, 2, 2.4], "time, s", "torque of the spring (blue), and friction (red), N·m")
    film.dot(pixels(axes, time, torque), "fb")
    return film.picture


def rounding():
    """An inverted pendulum with one start, a·b + c rounded once or twice; and what a controller makes of it."""
    film = Film("rounding", "The same start, rounded in two ways: two falls, but one way to stand", 6, 290)
    step, end = 1 / 256, 13.0  # s; a power of two
    rate = float(round(OMEGA ** 2 * 1024)) / 1024  # 1/s²

    def fused(a, b, c):
        return float(Fraction(a) * Fraction(b) + Fraction(c))

    def separate(a, b, c):
        return a * b + c

    def run(add, x, stiffness, damping):
        """Of the COM's place x: x'' = (ω² − k_p) x − k_d x', step by step."""
        v, k = 0.0, rate - stiffness
        if not stiffness:  # on the way that ends upright, but for rounding: both shrink by `share` a step
            grown = Decimal(step * step * k)
            share = 1 + grown / 2 - (grown + grown * grown / 4).sqrt()
            v = float(Decimal(-x) * (1 - share) / (Decimal(step) * share))
        places = []
        for _ in range(round(end / step) + 1):
            places.append(x)
            if abs(x) < 1.2:  # it lies
                v = add(step * k, x, v * (1 - step * damping))
                x = add(step, v, x)
        return np.array(places)

    starts = (0.15 + k / 4096 for k in range(100))
    start = next(x for x in starts if run(fused, x, 0, 0)[-1] * run(separate, x, 0, 0)[-1] < 0)  # the falls are to both sides
    pairs = [[run(add, start, *gains) for add in (fused, separate)] for gains in ((0, 0), (99, 13.9))]
    at = np.minimum(np.round(film.at * end / film.length / step).astype(int), len(pairs[0][0]) - 1)
    for foot, pair, name in ((145, pairs[0], "it falls"), (305, pairs[1], "controlled")):
        film.picture.path([(foot - 50, 240), (foot + 50, 240)], "g")
        film.picture.text(foot, 262, name, "s", "middle")
        for places, style in zip(pair, ("a", "b")):
            lean = np.clip(places[at] / HEIGHT, -1.5, 1.5)  # rad
            top = np.stack([foot + 120 * np.sin(lean), 240 - 120 * np.cos(lean)], -1)
            film.line(np.stack([np.tile([foot, 240.0], (film.count, 1)), top], 1), style)
            film.dot(top, f"f{style}")
    film.picture.text(30, 28, "a·b + c rounded once", "s")
    film.picture.path([(165, 24), (187, 24)], "a")
    film.picture.text(215, 28, "and twice", "s")
    film.picture.path([(278, 24), (300, 24)], "b")
    axes = Axes(film.picture, 410, 35, 210, 205, (0, end), (1e-18, 1e1), log_y=True)
    axes.ticks([0, 4, 8, 12], [1e-15, 1e-10, 1e-5, 1], "time, s; twice as fast", "difference of the two, m")
    for (one, two), style in zip(pairs, ("a", "c")):
        apart = np.clip(np.abs(one - two)[at], 1e-18, 1)
        axes.curve(list(zip(at * step, apart)), style)
        film.dot(pixels(axes, at * step, apart), f"f{style}")
    axes.label(5, 1e-7, "it falls", "s", "end")
    axes.label(9, 1e-17, "controlled", "s", "middle")
    return film.picture


FILMS = {film.__name__: film for film in (frames, messages, oblique, answers, stick_slip, rounding)}


def main():
    names = [name for name in sys.argv[1:] if name != "--check"]
    drawn = {**{a.name: lambda a=a: animation(a) for a in ANIMATIONS}, **FILMS}
    if set(names) - set(drawn):
        sys.exit("usage: animate.py [--check] [NAME...], of " + ", ".join(drawn))
    keep((drawn[name]() for name in names or drawn), "--check" in sys.argv)


if __name__ == "__main__":
    main()
