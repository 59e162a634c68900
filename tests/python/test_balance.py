"""The paper's mathematics on arrays: against closed forms, sums of forces and moments, and search by brute force."""
import unittest

import numpy as np
import poise
from poise import balance


def pose(x, y, z, turn=0.0):
    """A frame at a place, turned about z."""
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1.0]])


SOLES = np.stack([pose(0, -0.1, 0), pose(0, 0.1, 0)])
LIMITS = balance.Limits(0.6, 0.05, 0.13, 0.07)


class Mathematics(unittest.TestCase):
    def test_resultant_is_the_sum_of_forces_and_moments(self):
        rng = np.random.default_rng(1)
        for _ in range(20):
            soles = np.stack([pose(*rng.uniform(-0.3, 0.3, 3), rng.uniform(-1, 1)) for _ in range(2)])
            frame = pose(*rng.uniform(-0.3, 0.3, 3), rng.uniform(-1, 1))
            wrenches = rng.standard_normal((2, 6)) * 100
            force, moment = np.zeros(3), np.zeros(3)
            for sole, wrench in zip(soles, wrenches):
                f, m = sole[:3, :3] @ wrench[:3], sole[:3, :3] @ wrench[3:]
                force += f
                moment += m + np.cross(sole[:3, 3] - frame[:3, 3], f)
            wanted = np.concatenate([frame[:3, :3].T @ force, frame[:3, :3].T @ moment])
            np.testing.assert_allclose(balance.resultant(wrenches, frame, soles), wanted, atol=1e-10)

    def test_shares_add_up_whatever_the_ratio(self):
        rng = np.random.default_rng(2)
        eta = rng.uniform(0, 1, (4, 5))
        resultant = np.array([10, -20, -600, 15, 8, 2.0]) * rng.uniform(0.5, 1.5, (4, 5, 6))
        shares = balance.distribute(resultant, SOLES, eta)
        self.assertEqual(shares.shape, (4, 5, 2, 6))
        np.testing.assert_allclose(balance.resultant(shares, np.eye(4), SOLES), resultant, atol=1e-10)
        np.testing.assert_allclose(shares[..., 0, 2], eta * resultant[..., 2])  # (61)

    def test_feasible_ratios_are_those_that_a_search_finds(self):
        rng = np.random.default_rng(3)
        grid = np.linspace(0, 1, 2001)
        found = 0
        for _ in range(60):
            resultant = np.array([0, 0, -550.0, 0, 0, 0]) + rng.standard_normal(6) * [20, 20, 50, 25, 20, 5]
            ratio = balance.ratio(resultant, SOLES, LIMITS)
            shares = balance.distribute(resultant, SOLES, grid)
            margins = np.stack([np.stack(balance.contact_margins(shares[:, f], LIMITS)) for f in (0, 1)])
            good = grid[(margins >= -1e-9).all(axis=(0, 1))]
            if len(good) > 3:
                found += 1
                self.assertTrue(ratio.feasible)
                self.assertAlmostEqual(ratio.min, good.min(), delta=1e-3)
                self.assertAlmostEqual(ratio.max, good.max(), delta=1e-3)
                self.assertTrue(ratio.min - 1e-12 <= ratio.selected <= ratio.max + 1e-12)
            elif len(good) == 0:
                self.assertFalse(ratio.feasible and ratio.max - ratio.min > 2e-3)
        self.assertGreater(found, 10)

    def test_margins_are_the_inequalities(self):
        force, moment = np.array([30.0, -40, -500]), np.array([12.0, -20, 3])
        margins = balance.contact_margins(np.concatenate([force, moment]), LIMITS)
        self.assertAlmostEqual(margins.normal, 500)
        self.assertAlmostEqual(margins.friction, 0.6 * 500 - 50)
        self.assertAlmostEqual(margins.yaw, 0.05 * 500 - 3)
        self.assertAlmostEqual(margins.roll, 0.07 * 500 - 12)
        self.assertAlmostEqual(margins.pitch, 0.13 * 500 - 20)
        np.testing.assert_allclose(balance.center_of_pressure([0, 0, -500, 12, -20, 0]), [-0.04, -0.024])

    def test_frame_o_is_midway(self):
        frame = balance.frame_o(SOLES)
        np.testing.assert_allclose(frame, np.eye(4), atol=1e-12)
        np.testing.assert_allclose(balance.frame_o(SOLES, (True, False)), SOLES[0], atol=1e-12)
        self.assertTrue(np.isnan(balance.frame_o(np.stack([np.eye(4), np.eye(4)]))).all())  # soles in one place

    def test_capture_point_is_where_the_pendulum_comes_to_rest(self):
        com, velocity = np.array([0.01, -0.02, 0.75]), np.array([0.2, 0.1, 0.0])
        point, omega = balance.capture_point(np.eye(4), com, velocity)
        self.assertAlmostEqual(omega, np.sqrt(balance.GRAVITY / 0.75))
        # ẍ = ω² (x − p) with p = ξ: x(t) = ξ + (x − ξ) e^{−ωt}, so that ẋ = −ω (x − ξ).
        np.testing.assert_allclose(velocity[:2], -omega * (com[:2] - point), atol=1e-12)
        points, _ = balance.capture_point(np.eye(4), com + np.zeros((3, 1, 3)), velocity * np.array([[[0.0]], [[1]], [[2]]]))
        np.testing.assert_allclose(points[0, 0], com[:2])
        np.testing.assert_allclose(points[2, 0] - points[1, 0], points[1, 0] - points[0, 0])
        self.assertTrue(np.isnan(balance.capture_point(np.eye(4), [0, 0, -1], velocity)[0]).all())

    def test_redistribution_moves_nothing(self):
        robot = poise.Robot.load("dyros/dyros_legs")
        s = robot.stance()
        d = robot.evaluate(["contact_jacobian", "foot_pose", "gravity_torque"], **s)
        frame = balance.frame_o(d["foot_pose"])
        in_o = np.linalg.inv(frame) @ d["foot_pose"]
        total = np.array([5.0, -10, -robot.total_mass * balance.GRAVITY, 3, 2, 1])
        change = (balance.distribute(total, in_o, 0.7) - balance.distribute(total, in_o, 0.5)).reshape(12)
        torque = balance.redistribution_torque(d["contact_jacobian"], change)
        before = robot.evaluate(["wrench", "acceleration"], **s, torque=d["gravity_torque"])
        after = robot.evaluate(["wrench", "acceleration"], **s, torque=d["gravity_torque"] + torque)
        np.testing.assert_allclose(after["acceleration"], before["acceleration"], atol=1e-9)
        np.testing.assert_allclose(after["wrench"] - before["wrench"], change, atol=1e-8)

    def test_nearest_point_is_the_nearest_of_many(self):
        rng = np.random.default_rng(4)
        polygon = np.array([[0.1, 0], [0.05, 0.12], [-0.1, 0.08], [-0.12, -0.05], [0.02, -0.1]])
        edge = np.concatenate([a + (b - a) * np.linspace(0, 1, 4000)[:, None] for a, b in zip(polygon, np.roll(polygon, -1, 0))])
        points = rng.uniform(-0.3, 0.3, (50, 2))
        nearest, distance = balance.nearest_point(polygon, points), balance.signed_distance(polygon, points)
        for point, near, far in zip(points, nearest, distance):
            brute = np.linalg.norm(edge - point, axis=1).min()
            self.assertAlmostEqual(abs(far), brute, delta=2e-5)  # as close as the edge's points lie
            if far > 0:
                np.testing.assert_array_equal(near, point)
            else:
                self.assertAlmostEqual(np.linalg.norm(near - point), brute, delta=2e-5)

    def test_support_polygon_is_the_hull_of_the_soles(self):
        robot = poise.Robot.load("dyros/dyros_legs")
        length, width = robot.sole_size[0]
        polygon = robot.support_polygon(np.eye(4), SOLES)
        self.assertEqual(len(polygon), 4)
        np.testing.assert_allclose(polygon.max(axis=0), [length / 2, 0.1 + width / 2])
        np.testing.assert_allclose(polygon.min(axis=0), [-length / 2, -0.1 - width / 2])
        alone = robot.support_polygon(np.eye(4), SOLES, in_contact=(True, False), margin=0.01)
        np.testing.assert_allclose(alone.max(axis=0), [length / 2 - 0.01, -0.1 + width / 2 - 0.01])

    def test_wrong_shapes_are_told(self):
        for call in (lambda: balance.frame_o(np.eye(4)), lambda: balance.contact_margins(np.zeros(5), LIMITS),
                     lambda: balance.contact_margins(np.zeros(6), (1, 2)), lambda: balance.distribute(np.zeros((2, 6)), SOLES, np.zeros(3)),
                     lambda: balance.ratio(np.zeros(6), SOLES, LIMITS, 0.8, 0.2), lambda: balance.nearest_point([[0]], [0, 0]),
                     lambda: balance.nearest_point(np.zeros((40, 2)), [0, 0]), lambda: balance.resultant(np.zeros(6), SOLES, SOLES),
                     lambda: balance.redistribution_torque(np.zeros((12, 3)), np.zeros(12))):
            with self.assertRaises(ValueError):
                call()


if __name__ == "__main__":
    unittest.main()
