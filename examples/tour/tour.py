#!/usr/bin/python3
"""The tour of rhoyn/teleop-walking-benchmark (MIT) for a G1 of 29 joints, walked by Poise.

Eighteen way-points, one each 5 s, with a punch on a random joint after each, while the arms follow
somebody else's random targets. It prints survival, completed runs and errors at the way-points.
The same protocol in Poise's engines: quote it so. Nothing but the commanded velocity is Poise's to
be told; the robot is not told of arms or punches.

  python3 examples/tour/tour.py ROBOT.pbtxt --world mujoco --runs 16
"""
import argparse
import math
import multiprocessing
import pathlib
import re
import xml.etree.ElementTree

import numpy as np
import poise

STAND, LEG, WAYPOINTS = 3.0, 5.0, 18  # s before the release, s for each way-point, their number
PERIOD = 0.02  # s of a command
ARM_PERIOD, ARM_STEPS, ARM_STEP = 0.5, 25, 0.06  # s of a target, its random walk, rad
PUNCH, CEILING, GROWTH = 0.08, 500.0, 60.0  # s, N, s in which the ceiling grows from a third
RATE = 2 * math.pi * 10  # rad/s of what nobody owns
FASTEST = (0.4, 0.15, 0.6)  # m/s ahead, m/s aside, rad/s that are commanded at most


def joints_of(robot_text):
    """Name -> (link, armature) of the maker's MJCF that a robot's text names."""
    text = pathlib.Path(robot_text)
    if not text.is_file():
        raise SystemExit(f"{text}: no file; give the text that poise robot import wrote, NAME/NAME.pbtxt")
    mjcf = re.search(r'mjcf: "([^"]+)"', text.read_text())
    if mjcf is None:
        raise SystemExit(f"{text}: names no MJCF file; import g1_29dof.xml of unitree_rl_gym")
    joints = {}
    for body in xml.etree.ElementTree.parse(text.parent / mjcf[1]).iter("body"):
        for joint in body.findall("joint"):
            if joint.get("type") != "free" and "name" in joint.attrib:
                joints[joint.get("name")] = (body.get("name"), float(joint.get("armature", 0)))
    return joints


def heading(quaternion):
    w, x, y, z = quaternion
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def turned(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


class Arms:
    """Targets of the arms' joints, approached linearly by drives with gains of their own."""

    def __init__(self, env, joints, rng):
        self.env, self.rng = env, rng
        names = env.joint_names
        arm = re.compile("shoulder|elbow|wrist")
        self.left = [n for n in names if n.startswith("left_") and arm.search(n)]
        self.right = ["right_" + n[len("left_"):] for n in self.left]
        self.index = [names.index(n) for n in self.left + self.right]
        armature = np.array([joints[n][1] for n in self.left + self.right])
        self.stiffness, self.damping = armature * RATE**2, 4 * armature * RATE
        self.lower, self.upper = (limit[self.index] for limit in env.robot.joint_limits[:2])
        # Rolls and yaws mirror with the other sign.
        self.mirror = np.array([-1.0 if re.search("roll|yaw", n) else 1.0 for n in self.left])
        self.from_ = self.target = np.array(env["GROUND_TRUTH"].joint_position)[self.index]
        self.since = 0.0

    def draw(self, time):
        n = len(self.left)
        self.from_, self.since = self.target, time
        q = np.array(self.env["GROUND_TRUTH"].joint_position)
        for _ in range(8):
            left = self.target[:n] + self.rng.uniform(-ARM_STEP, ARM_STEP, (ARM_STEPS, n)).sum(axis=0)
            target = np.clip(np.concatenate([left, self.mirror * left]), self.lower, self.upper)
            q[self.index] = target
            hand = self.env.robot.pose(self.left[-1].replace("_joint", "_link"), q)[:3, 3]
            if hand[0] > 0 and hand[2] < 0.4:  # m from the pelvis: before the body, below the head
                break
        self.target = target

    def drive(self, time):
        truth = self.env["GROUND_TRUTH"]
        share = min(1.0, (time - self.since) / ARM_PERIOD)
        wanted = self.from_ + share * (self.target - self.from_)
        torque = (self.stiffness * (wanted - np.asarray(truth.joint_position)[self.index])
                  - self.damping * np.asarray(truth.joint_velocity)[self.index])
        for joint, value in zip(self.index, torque):
            self.env.override_torque(joint, value)


def run(task):
    number, options = task
    rng = np.random.default_rng(number)
    joints = joints_of(options.robot)
    changes = {"robot": str(pathlib.Path(options.robot).resolve()), "step_planner.walk.command": None}
    env = poise.Environment("walk", changes, engine=options.world, seed=number)
    env.step(1)
    names = sorted(joints)
    arms = None if options.arms_held else Arms(env, joints, rng)
    start, tick = None, env.tick_period
    goal, aims, walking, errors, work = None, -1, False, [], 0.0
    next_command = next_arms = STAND
    punch = None
    while not env.ended and env.time < STAND + WAYPOINTS * LEG:
        time = env.time
        truth = env["GROUND_TRUTH"]
        if time >= STAND and start is None:
            start = (np.array(truth.base_position[:2]), heading(truth.base_orientation))
        if start is not None:
            leg = int((time - STAND) / LEG)
            if leg > aims and leg < WAYPOINTS:
                if goal is not None:
                    errors.append(error(truth, goal)[:2])
                aims = leg
                radius, angle = math.sqrt(rng.uniform()), rng.uniform(-math.pi, math.pi)
                place = np.array([0.3 + radius * math.cos(angle), radius * math.sin(angle)])
                c, s = math.cos(start[1]), math.sin(start[1])
                goal = (start[0] + np.array([c * place[0] - s * place[1], s * place[0] + c * place[1]]),
                        turned(start[1] + rng.uniform(-math.pi, math.pi)))
                direction = rng.normal(size=3)
                force = rng.uniform(0.5, 1) * CEILING * min(1, 1 / 3 + (time - STAND) / GROWTH * 2 / 3)
                punch = (time + 0.1, joints[names[rng.integers(len(names))]][0],
                         force * direction / np.linalg.norm(direction))
            if punch is not None and time >= punch[0] and not options.no_punches:
                env.push(punch[2], body=punch[1], duration=PUNCH)
                punch = None
            if arms is not None and time >= next_arms:
                arms.draw(time)
                next_arms += ARM_PERIOD
            if time >= next_command:
                next_command += PERIOD
                far, off, way = error(truth, goal)
                walking = (far > 0.2 or off > 0.12) if not walking else not (far < 0.1 and off < 0.05)
                velocity = np.clip(1.5 * way, -np.array(options.fastest), options.fastest) if walking else np.zeros(3)
                env.walk(*velocity)
        if arms is not None:
            arms.drive(time)
        env.step(1)
        truth = env["GROUND_TRUTH"]
        work += tick * np.maximum(0, np.asarray(truth.joint_torque) * np.asarray(truth.joint_velocity)).sum()
    lived = min(env.time - STAND, WAYPOINTS * LEG)
    return number, lived, not env.failed, errors, work, env.detail


def error(truth, goal):
    """m, rad to the goal, and both in body axes."""
    yaw = heading(truth.base_orientation)
    way = goal[0] - np.asarray(truth.base_position[:2])
    turn = turned(goal[1] - yaw)
    c, s = math.cos(yaw), math.sin(yaw)
    return np.linalg.norm(way), abs(turn), np.array([c * way[0] + s * way[1], c * way[1] - s * way[0], turn])


def arguments(description):
    """What every command of this folder is told."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", help="text of an imported g1_29dof.xml (poise robot import)")
    parser.add_argument("--world", choices=("mujoco", "ode"), default="mujoco")
    parser.add_argument("--first", type=int, default=0, help="number of the first one, its seed")
    parser.add_argument("--jobs", type=int, default=multiprocessing.cpu_count())
    return parser


def main():
    parser = arguments(__doc__)
    parser.add_argument("--runs", type=int, default=16)
    parser.add_argument("--fastest", type=float, nargs=3, default=FASTEST,
                        help="m/s ahead, m/s aside, rad/s that are commanded at most")
    parser.add_argument("--no-punches", action="store_true")
    parser.add_argument("--arms-held", action="store_true", help="the arms are the controller's")
    options = parser.parse_args()
    joints_of(options.robot)  # a worker that ended for want of a robot would be waited for without end
    lived, completed, errors = [], 0, []
    with multiprocessing.Pool(options.jobs) as pool:
        tasks = [(options.first + i, options) for i in range(options.runs)]
        for number, time, whole, errors_now, work, why in pool.imap(run, tasks):
            lived.append(time)
            completed += whole
            errors += errors_now
            print(f"run {number}: {time:.1f} s, {work / 1000:.1f} kJ{'' if whole else ', ' + why}", flush=True)
    quartiles = np.percentile(lived, [25, 50, 75])
    print(f"survival {np.mean(lived):.1f} s of {WAYPOINTS * LEG:.0f} (quartiles {', '.join(f'{q:.1f}' for q in quartiles)}), "
          f"completed {100 * completed / options.runs:.0f} % of {options.runs}")
    if errors:
        far, off = np.mean(np.array(errors), axis=0)
        print(f"off a way-point by {100 * far:.0f} cm and {math.degrees(off):.0f}° on average, of {len(errors)}")


if __name__ == "__main__":
    main()
