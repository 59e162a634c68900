"""Nothing that a Python user passes ends the process: hostile arguments to every function, in a process of its own."""
import os
import random
import subprocess
import sys
import unittest

CALLS = int(os.environ.get("POISE_PYTHON_CALLS", "2000"))
SEED = int(os.environ.get("POISE_TEST_SEED", "20240601"))


def hostile(rng, np, good):
    """Something that may be none of what is wanted, or nearly."""
    values = [None, "", "ROBOT_STATE", "torque", b"\x00", -1, 0, 3, 2 ** 63, 2 ** 70, 1e308, float("nan"), float("inf"), (), [], {},
              [1, 2], [[1], [2, 3]], [1, "a"], object(), True, np.zeros(0), np.zeros((0, 12)), np.zeros((3, 0, 18)),
              np.full(12, np.nan), np.full((2, 6), np.inf), np.full((2, 4, 4), 1e308), np.zeros((2, 4, 4)), np.ones((12, 18)),
              np.arange(12), np.arange(24.0)[::2], np.zeros(12, dtype=complex), np.array(["x"]), np.zeros((40, 2)),
              np.zeros((1, 2)), np.full((5, 2), np.nan), np.ones((2, 12), order="F"), np.zeros((1,) * 20 + (12,)), lambda *a: 1]
    return rng.choice(good if good and rng.random() < 0.6 else values)


def attack(calls, seed):
    import numpy as np
    import poise
    from poise import _poise, balance
    rng = random.Random(seed)
    run = poise.run("stand", duration=0.02)
    env = poise.Environment("stand", record=True)
    env.step(3)
    watched = poise.Environment("stand")  # which nobody attacks
    watched.step(3)
    robot = env.robot
    stance = robot.stance()
    q, place, turn = stance["q"], stance["base_position"], stance["base_orientation"]
    soles = robot.foot_pose(q)
    good = [q, np.zeros(18), place, turn, soles, np.eye(4), np.zeros((12, 18)), np.zeros(12), np.zeros(6), "ROBOT_STATE",
            "joint_position", 1, [0, 0, 1], "mass_matrix", ["lambda_c", "w"], (True, False), (0.9, 0.1, 0.1, 0.1), 0.5, None,
            np.array([[0, 0], [1, 0], [0, 1.0]]), run._store, robot._handle, env._session]
    targets = []
    for owner in (run, run["ROBOT_STATE"], env, robot, balance, poise, _poise, run._store, robot._handle, env._session,
                  env["ROBOT_STATE"]._message, _poise.RunStore, _poise.Robot, _poise.Session, _poise.States, poise.plots):
        for name in dir(owner):
            if name.startswith("__") and name != "__getitem__":
                continue
            if name in ("main", "component_main", "run", "finish", "reset") or name.startswith("pybind11"):
                continue  # those that wait, write, or end what others use
            try:
                function = getattr(owner, name)
            except Exception:
                continue
            if callable(function):
                targets.append((name, function))
    assert len(targets) > 100, len(targets)
    raised = answered = 0
    for _ in range(calls):
        name, function = rng.choice(targets)
        arguments = [hostile(rng, np, good) for _ in range(rng.randrange(7))]
        if "step" in name:
            arguments = [min(a, 5) if isinstance(a, (int, float)) else a for a in arguments]
        keywords = {}
        if rng.random() < 0.3:
            keywords[rng.choice(["v", "base_position", "base_orientation", "in_contact", "torque", "point", "margin"])] = hostile(
                rng, np, good)
        try:
            function(*arguments, **keywords)
            answered += 1
        except Exception:
            raised += 1
    watched.step(20)
    assert np.isfinite(watched["ROBOT_STATE"].q).all()
    print(f"{len(targets)} functions, {calls} calls, {answered} answered, {raised} raised")


class Fuzz(unittest.TestCase):
    def test_hostile_arguments(self):
        done = subprocess.run([sys.executable, "-X", "faulthandler", __file__, str(CALLS), str(SEED)], capture_output=True,
                              text=True, timeout=300, env={**os.environ, "PYTHONWARNINGS": "ignore"})
        self.assertEqual(done.returncode, 0, done.stdout[-2000:] + done.stderr[-4000:])
        self.assertIn(f"{CALLS} calls", done.stdout)


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1].isdigit():
        attack(int(sys.argv[1]), int(sys.argv[2]))
    else:
        unittest.main()
