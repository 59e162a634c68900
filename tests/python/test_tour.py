"""The tour of examples/tour: its geometry, and two of its way-points on the maker's robot."""
import argparse
import importlib.util
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
MAKER = ROOT.parent / "shared/robots/g1_29dof_tour.xml"


def load(name="tour"):
    sys.path.insert(0, str(ROOT / "examples/tour"))
    spec = importlib.util.spec_from_file_location(name, ROOT / f"examples/tour/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def imported(folder):
    """The maker's robot, brought into `folder`."""
    subprocess.run([os.environ["POISE_BIN"] + "/poise", "robot", "import", MAKER, "--to", folder + "/g1"],
                   check=True, capture_output=True)
    return str(next(pathlib.Path(folder, "g1").glob("*.pbtxt")))


class TourTest(unittest.TestCase):
    def test_the_way_to_a_goal_is_in_axes_of_the_body(self):
        tour = load()
        yaw = 2.5
        truth = types.SimpleNamespace(base_position=[1, 2, 0.7],
                                      base_orientation=[math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)])
        ahead = (np.array([1 + 0.3 * math.cos(yaw), 2 + 0.3 * math.sin(yaw)]), yaw - 2 * math.pi)
        far, off, way = tour.error(truth, ahead)
        self.assertAlmostEqual(far, 0.3)
        self.assertAlmostEqual(off, 0)
        np.testing.assert_allclose(way, [0.3, 0, 0], atol=1e-12)
        left = (np.array([1 - 0.2 * math.sin(yaw), 2 + 0.2 * math.cos(yaw)]), yaw + 0.4)
        np.testing.assert_allclose(tour.error(truth, left)[2], [0, 0.2, 0.4], atol=1e-12)

    def test_what_is_no_robot_is_said_in_a_line(self):
        with tempfile.TemporaryDirectory() as folder:
            for wrong in folder, folder + "/none.pbtxt":
                told = subprocess.run([sys.executable, ROOT / "examples/tour/tour.py", wrong], capture_output=True,
                                      text=True, timeout=60)
                self.assertEqual(told.returncode, 1)
                self.assertRegex(told.stderr, f"^{wrong}: no file.*\n$")

    @unittest.skipUnless(MAKER.exists(), f"the maker's file {MAKER.name} is not beside the repository")
    def test_it_comes_to_the_first_way_points_with_moving_arms(self):
        tour = load()
        tour.WAYPOINTS = 2
        with tempfile.TemporaryDirectory() as folder:
            options = argparse.Namespace(robot=imported(folder), world="mujoco", fastest=(0.4, 0.15, 0.6), no_punches=True,
                                         arms_held=False)
            runs = [tour.run((seed, options)) for seed in range(4, 8)]
        for seed, (number, lived, whole, errors, work, why) in zip(range(4, 8), runs):
            self.assertEqual((number, whole), (seed, True), why)
            self.assertAlmostEqual(lived, 10, places=6)
            self.assertGreater(work, 0)
        # A run is up to 0.35 m off.
        self.assertLess(np.mean([errors[0][0] for _, _, _, errors, _, _ in runs]), 0.3)

    @unittest.skipUnless(MAKER.exists(), f"the maker's file {MAKER.name} is not beside the repository")
    def test_a_punch_by_itself_leaves_the_next_one_nothing(self):
        punches = load("punches")
        with tempfile.TemporaryDirectory() as folder:
            options = argparse.Namespace(robot=imported(folder), world="mujoco", punches=8)
            punches.LEAST, punches.MOST = 0, 80
            struck = punches.run((3, options))
        stands = [stands for *_, stands in sorted(struck, key=lambda punch: punch[2])]
        self.assertTrue(stands[0])
        self.assertFalse(stands[-1])
        # Each finds the robot as it was, though the one before has felled it.
        felled, after = struck[:-1], struck[1:]
        self.assertTrue(any(next_[3] for before, next_ in zip(felled, after) if not before[3]), struck)


if __name__ == "__main__":
    unittest.main()
