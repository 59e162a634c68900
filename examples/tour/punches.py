#!/usr/bin/python3
"""Punches of the tour, each by itself: which of them stand.

A tour ends with its first fall, so that its survival says little of a change: of 32 tours it is
known to 4 s. Here G1 walks as the tour may ask, its arms driven by somebody else, and at one moment
the world is forked for each punch of 20 to 40 N s on a random link.

  python3 examples/tour/punches.py ROBOT.pbtxt --world mujoco --moments 16 --out before.txt
  python3 examples/tour/punches.py ROBOT.pbtxt --world mujoco --moments 16 --against before.txt
"""
import multiprocessing
import os
import pathlib
import re
import traceback

import numpy as np
import poise
import tour

WALKS, STRIKES, WATCHED = 2.0, 4.0, 3.0  # s: it sets off, is struck up to 1 s after, is watched for
LEAST, MOST = 20, 40  # N s: of the tour's last half minute
SEED = 7000  # beside the tours'
GROUPS = "shoulder|elbow|wrist|hip|knee|ankle"


def strike(env, go, link, impulse):
    """Whether the robot stands; in a fork, so that the next punch finds it as it was."""
    end = env.time + WATCHED
    child = os.fork()
    if child == 0:
        code = 2
        try:
            env.push(impulse / tour.PUNCH, body=link, duration=tour.PUNCH)
            go(end)
            code = int(env.ended)
        except Exception:
            traceback.print_exc()
        finally:
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code not in (0, 1):
        raise RuntimeError(f"the run of a punch on {link} ended with {code}")
    return code == 0


def run(task):
    """[(moment, joint struck, N s, it stands)] of one moment."""
    number, options = task
    rng = np.random.default_rng(SEED + number)
    joints = tour.joints_of(options.robot)
    changes = {"robot": str(pathlib.Path(options.robot).resolve()), "step_planner.walk.command": None}
    env = poise.Environment("walk", changes, engine=options.world, seed=number)
    env.step(1)
    arms = tour.Arms(env, joints, rng)
    # In a quarter of the moments it stands.
    velocity = rng.uniform(-1, 1, 3) * (np.array(tour.FASTEST) if number % 4 != 3 else 0)
    struck = STRIKES + rng.uniform()
    names = sorted(joints)
    punches = []
    for _ in range(options.punches):
        direction = rng.normal(size=3)
        punches.append((names[rng.integers(len(names))], rng.uniform(LEAST, MOST),
                        direction / np.linalg.norm(direction)))
    next_arms = WALKS

    def go(until):
        nonlocal next_arms
        while not env.ended and env.time < until:
            if env.time >= next_arms:
                arms.draw(env.time)
                next_arms += tour.ARM_PERIOD
            arms.drive(env.time)
            env.step(1)

    go(WALKS)
    env.walk(*velocity)
    go(struck)
    return [(number, name, size, not env.ended and strike(env, go, joints[name][0], size * direction))
            for name, size, direction in punches]


def group(joint):
    found = re.search(GROUPS, joint)
    return found[0] if found else "body"


def main():
    parser = tour.arguments(__doc__)
    parser.add_argument("--moments", type=int, default=16)
    parser.add_argument("--punches", type=int, default=24, help="at each moment")
    parser.add_argument("--out", type=pathlib.Path, help="file of each punch and whether it stood")
    parser.add_argument("--against", type=pathlib.Path, help="such a file of the same punches, to compare with")
    options = parser.parse_args()
    tour.joints_of(options.robot)
    before = options.against.read_text().splitlines() if options.against else []
    rows = []
    with multiprocessing.Pool(options.jobs) as pool:
        tasks = [(options.first + i, options) for i in range(options.moments)]
        for punches in pool.imap(run, tasks):
            rows += punches
            print(f"moment {punches[0][0]}: {sum(p[3] for p in punches)} of {len(punches)} stand", flush=True)
    for name in GROUPS.split("|") + ["body"]:
        stands = [row[3] for row in rows if group(row[1]) == name]
        print(f"{name:10}{sum(stands):4} of {len(stands)}")
    print(f"{sum(row[3] for row in rows)} of {len(rows)} stand")
    lines = [f"{number} {joint} {size:.3f} {int(stands)}" for number, joint, size, stands in rows]
    if options.out:
        options.out.write_text("\n".join(lines) + "\n")
    if options.against:
        if [line[:-2] for line in before] != [line[:-2] for line in lines]:
            raise SystemExit(f"{options.against}: holds other punches; give the same --moments, --punches, --first")
        changes = [(old[-1], new[-1]) for old, new in zip(before, lines)]
        print(f"{changes.count(('0', '1'))} stand that felled it there, {changes.count(('1', '0'))} fell it that stood")


if __name__ == "__main__":
    main()
