#!/usr/bin/python3
"""Draws the moving pictures of docs/concepts from runs that it makes: SVG that moves by itself, without a script.

    export PYTHONPATH=$PWD/build/release/python
    docs/concepts/pictures/animate.py [NAME...]       # writes the SVG files beside itself; without names: all
    docs/concepts/pictures/animate.py --check push    # writes nothing; exit code 1 where the file differs from what is drawn

The true state of the simulated robot moves the links, through poise.Robot; the controller's messages give the rest.
"""
import re
import sys
from collections import namedtuple

import numpy as np

import poise
from draw import Picture, keep, number

FRAMES = 12  # a second of the picture
WIDTH, HEIGHT = 640, 330
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


class Scene:
    """A run's ticks as frames of a picture, and where points of the world are in it."""

    def __init__(self, animation, run):
        self.run, self.robot, self.animation = run, run.robot, animation
        self.length = (animation.end - animation.start) / animation.speed  # s of the picture
        count = round(self.length * FRAMES) + 1
        self.times = np.linspace(animation.start, animation.end, count)
        self.ticks = np.minimum(np.round(self.times / run.info["tick_period"]).astype(int), run.info["num_ticks"] - 1)
        self.picture = Picture(animation.name, animation.title, WIDTH, HEIGHT)
        self.picture.add(f"<style>{STYLE}</style>")
        self.truth, self.support, self.balance = run["GROUND_TRUTH"], run["SUPPORT_PLAN"], run["BALANCE_TORQUE"]
        self.feet = [Placed(self.truth.foot_pose, self.ticks, foot) for foot in (0, 1)]
        self.legend = []
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

    def moving(self, tag, attributes, style):
        """An element whose attributes {name: a text a frame} change with time."""
        first = " ".join(f'{name}="{texts[0]}"' for name, texts in attributes.items())
        motion = "".join(f'<animate attributeName="{name}" dur="{self.length:g}s" repeatCount="indefinite" '
                         f'values="{";".join(texts)}"/>' for name, texts in attributes.items() if len(set(texts)) > 1)
        extra = ' r="4"' if tag == "circle" else ""
        self.picture.add(f'<{tag} class="{style}" {first}{extra}>{motion}</{tag}>' if motion
                         else f'<{tag} class="{style}" {first}{extra}/>')

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
        left, right, y = 60, WIDTH - 60, HEIGHT - 24
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
    scene.dot(scene.plan(scene.support.capture_point[scene.ticks]), "fa")
    scene.legend += [("capture point", "fa"), ("CoP", "fb")]


def stepping(scene):
    """When the planner has a foot on its way."""
    return scene.spans(scene.support.stepping == 2, "a foot swings", "c")


def landing(scene):
    """What the planner makes of the left foot."""
    state = scene.support.foot_state[:, 1]
    return [span for value, word, style in ((1, "swing", "l"), (2, "searching", "c"), (3, "touching", "b"))
            for span in scene.spans(state == value, word, style)]


def block(scene):
    """The block below the left foot as the scenario has it, unloaded."""
    text = re.search(r"\bblock \{(.*?)\}", scene.run.scenario, re.DOTALL)[1]
    y, width, height = (float(re.search(rf"\b{name}: (\S+)", text)[1]) for name in ("y", "width", "height"))
    sides = [[0, y + width / 2, 0], [0, y + width / 2, height], [0, y - width / 2, height], [0, y - width / 2, 0]]
    scene.line(scene.figure(np.array([sides])), "ff", close=True)


MARKS = {mark.__name__: mark for mark in (com, forces, push, region, balancing, feet, capture, stepping, landing, block)}

ANIMATIONS = (
    Animation("push", "Pushed from the right: the robot sways and stands", "push_double_support", {}, 0.3, 2.3, 0.4, "behind", 1.4,
              "region balancing com forces push"),
    Animation("shared_load", "The load goes from foot to foot, and the robot stands still", "gravity_compensation",
              {"duration": 13}, 7, 12, 1, "behind", 1.4, "feet com forces"),
    Animation("step", "Pushed ahead, too hard to stand: a step catches the robot", "push_double_support",
              {"variant": "step", "duration": 3}, 0.3, 2.3, 0.4, "side", 1.4, "com capture forces push stepping"),
    Animation("walk", "Walking ahead: capture point and centre of pressure from foot to foot", "walk", {"duration": 8},
              2, 7, 1, "side", 1.4, "com capture forces stepping"),
    Animation("unknown_ground", "The left foot comes down onto a soft block, lower than it was told", "unknown_surface",
              {"changes": {"sim.block.height": 0.06}, "duration": 32}, 24, 32, 1.6, "behind", 0.45, "block feet com forces landing"),
)


def animation(what):
    scene = Scene(what, poise.run(what.scenario, **what.changes))
    scene.picture.path([(FIGURE[0], FLOOR), (FIGURE[1], FLOOR)], "g")
    for foot in scene.feet:
        scene.line(scene.plan(foot.points(scene.sole)), "ff", close=True)
    scene.robot_lines()
    spans = [span for mark in what.marks.split() for span in MARKS[mark](scene) or []]
    where = "from its right" if what.view == "side" else "from behind"
    scene.picture.box(0, 0, sum(FIGURE), TOP - 10, "bg", 8)  # the rest of the robot is beyond the picture's edge
    slowed, hurried = f", slowed {1 / what.speed:g} times", f", {what.speed:g} times as fast"
    pace = slowed if what.speed < 1 else hurried if what.speed > 1 else ""
    scene.picture.text(sum(FIGURE) / 2, 24, where + pace, "s", "middle")
    scene.picture.text(sum(PLAN) / 2, 24, "soles from above", "s", "middle")
    x = PLAN[0]
    for text, style in scene.legend:
        scene.picture.dot(x, FLOOR + 14, style)
        scene.picture.text(x + 8, FLOOR + 18, text, "s")
        x += 28 + 6 * len(text)
    scene.clock(spans)
    return scene.picture


def main():
    names = [name for name in sys.argv[1:] if name != "--check"]
    chosen = [a for a in ANIMATIONS if not names or a.name in names]
    if not chosen or {a.name for a in chosen} < set(names):
        sys.exit("usage: animate.py [--check] [NAME...], of " + ", ".join(a.name for a in ANIMATIONS))
    keep(map(animation, chosen), "--check" in sys.argv)


if __name__ == "__main__":
    main()
