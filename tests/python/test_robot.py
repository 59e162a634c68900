"""The robot's dynamics and its contacts: against numpy's linear algebra, differences of positions, and identities of mechanics."""
import unittest

import numpy as np
import poise

G = 9.80665
ROBOTS = ("dyros/dyros_legs", "heron/heron")


def states(robot, count, seed=1):
    """Random states near the stance, with velocities."""
    rng = np.random.default_rng(seed)
    stance, k = robot.stance(), robot.num_joints
    turn = rng.standard_normal((count, 4)) * 0.3 + [1, 0, 0, 0]
    return {"q": stance["q"] + 0.2 * rng.standard_normal((count, k)), "v": rng.standard_normal((count, k + 6)),
            "base_position": stance["base_position"] + rng.standard_normal((count, 3)),
            "base_orientation": turn / np.linalg.norm(turn, axis=1, keepdims=True)}


def rotation(w, x, y, z):
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def moved(state, dt):
    """The state after dt with its velocity."""
    v, (w, x, y, z) = state["v"], state["base_orientation"]
    wx, wy, wz = v[3:6]
    rate = 0.5 * np.array([-x * wx - y * wy - z * wz, w * wx + wy * z - wz * y, w * wy + wz * x - wx * z,
                           w * wz + wx * y - wy * x])  # 0.5 (0, ω) ∘ q
    turn = state["base_orientation"] + dt * rate
    return {"q": state["q"] + dt * v[6:], "v": v, "base_position": state["base_position"] + dt * v[:3],
            "base_orientation": turn / np.linalg.norm(turn)}


class Dynamics(unittest.TestCase):
    def setUp(self):
        self.robots = [poise.Robot.load(name) for name in ROBOTS]

    def test_mass_matrix_is_that_of_newton_and_euler(self):
        for robot in self.robots:
            s, n = states(robot, 5), robot.num_joints + 6
            d = robot.evaluate(["mass_matrix", "bias", "gravity"], **s)
            matrix = d["mass_matrix"]
            np.testing.assert_allclose(matrix, np.swapaxes(matrix, 1, 2), atol=1e-12)
            self.assertGreater(np.linalg.eigvalsh(matrix).min(), 0)
            acceleration = np.random.default_rng(2).standard_normal((5, n))
            wanted = robot.inverse_dynamics(acceleration, **s)
            np.testing.assert_allclose(np.einsum("sij,sj->si", matrix, acceleration) + d["bias"] + d["gravity"], wanted,
                                       rtol=1e-9, atol=1e-8)

    def test_jacobians_are_differences_of_places(self):
        for robot in self.robots:
            s = states(robot, 3, seed=3)
            foot = robot.body_names[-1]
            jacobian = robot.jacobian(foot, s["q"], s["base_position"], s["base_orientation"], point=(0.03, -0.02, 0.1))
            d = robot.evaluate(["com", "com_jacobian", "com_velocity", "foot_velocity", "foot_pose", "foot_jacobian"], **s)
            h = 1e-6
            for i in range(3):
                one = {key: value[i] for key, value in s.items()}
                later, earlier = moved(one, h), moved(one, -h)
                place = [robot.pose(foot, a["q"], a["base_position"], a["base_orientation"]) @ [0.03, -0.02, 0.1, 1]
                         for a in (later, earlier)]
                np.testing.assert_allclose(jacobian[i, :3] @ one["v"], (place[0] - place[1])[:3] / (2 * h), atol=2e-7)
                com = robot.com(**later) - robot.com(**earlier)
                np.testing.assert_allclose(d["com_jacobian"][i] @ one["v"], com / (2 * h), atol=2e-7)
                np.testing.assert_allclose(d["com_velocity"][i], com / (2 * h), atol=2e-7)
                soles = (robot.foot_pose(**later) - robot.foot_pose(**earlier))[:, :3, 3] / (2 * h)
                np.testing.assert_allclose(d["foot_velocity"][i, :, :3], soles, atol=2e-7)
            np.testing.assert_allclose(np.einsum("sfij,sj->sfi", d["foot_jacobian"], s["v"]), d["foot_velocity"], atol=1e-10)

    def test_gravity_is_the_slope_of_the_potential_energy(self):
        for robot in self.robots:
            s = states(robot, 2, seed=4)
            gravity = robot.gravity(**s)
            h = 1e-6
            for i in range(2):
                one = {key: value[i] for key, value in s.items()}
                power = robot.total_mass * G * (robot.com(**moved(one, h)) - robot.com(**moved(one, -h)))[2] / (2 * h)
                self.assertAlmostEqual(gravity[i] @ one["v"], power, delta=1e-4)

    def test_energy_is_kept_by_free_flight(self):
        # dT/dt = v·(force), and no force acts but gravity: with A v̇ = −b − g, d(½ vᵀA v)/dt = −v·g.
        for robot in self.robots:
            one = {key: value[0] for key, value in states(robot, 1, seed=5).items()}
            d = robot.evaluate(["mass_matrix", "bias", "gravity"], **one)
            acceleration = np.linalg.solve(d["mass_matrix"], -d["bias"] - d["gravity"])
            energy = []
            h = 1e-5
            for dt in (h, -h):
                at = moved(one, dt)
                v = one["v"] + dt * acceleration
                energy.append(0.5 * v @ robot.mass_matrix(**{**at, "v": v}) @ v)
            self.assertAlmostEqual((energy[0] - energy[1]) / (2 * h), -one["v"] @ d["gravity"], delta=2e-3)

    def test_momentum_is_its_matrix_times_velocity_and_changes_as_the_base_rows_say(self):
        for robot in self.robots:
            s = states(robot, 4, seed=6)
            d = robot.evaluate(["momentum", "momentum_matrix", "com_velocity"], **s)
            np.testing.assert_allclose(np.einsum("sij,sj->si", d["momentum_matrix"], s["v"]), d["momentum"], atol=1e-9)
            np.testing.assert_allclose(d["momentum"][:, :3], robot.total_mass * d["com_velocity"], atol=1e-9)

    def test_contacts_are_those_of_the_papers_matrices(self):
        for robot in self.robots:
            stance = robot.stance()
            rng = np.random.default_rng(7)
            k = robot.num_joints
            s = {**stance, "q": stance["q"] + 0.05 * rng.standard_normal((3, k)), "v": 0.3 * rng.standard_normal((3, k + 6))}
            torque = 20 * rng.standard_normal((3, k))
            for feet in ((True, True), (True, False), (False, True)):
                d = robot.evaluate(["mass_matrix", "bias", "gravity", "contact_jacobian", "lambda_c", "jc_bar_transpose", "mu_c",
                                    "p_c", "w", "w_pinv", "wrench", "acceleration", "gravity_torque"], **s,
                                   torque=torque, in_contact=feet)
                for i in range(3):
                    a, jc = np.linalg.inv(d["mass_matrix"][i]), d["contact_jacobian"][i]
                    lambda_c = np.linalg.inv(jc @ a @ jc.T)
                    np.testing.assert_allclose(d["lambda_c"][i], lambda_c, rtol=1e-6, atol=1e-6 * np.abs(lambda_c).max())
                    bar = lambda_c @ jc @ a
                    np.testing.assert_allclose(d["jc_bar_transpose"][i], bar, atol=1e-6 * np.abs(bar).max())
                    select = np.hstack([np.zeros((k, 6)), np.eye(k)])
                    n = np.eye(k + 6) - jc.T @ bar
                    w = select @ a @ n @ select.T
                    np.testing.assert_allclose(d["w"][i], w, atol=1e-8 * np.abs(w).max())
                    # The eigenvalue that is zero has no tolerance in ours; numpy needs one.
                    pinv = np.linalg.pinv(w, rcond=1e-10, hermitian=True)
                    np.testing.assert_allclose(d["w_pinv"][i], pinv, atol=1e-5 * np.abs(pinv).max())
                    # Newton: A q̈ + b + g = Sᵀ Γ − J_cᵀ F, with F the robot's wrench on the ground.
                    left = d["mass_matrix"][i] @ d["acceleration"][i] + d["bias"][i] + d["gravity"][i]
                    right = select.T @ torque[i] - jc.T @ d["wrench"][i]
                    np.testing.assert_allclose(left, right, atol=1e-6 * np.abs(left).max())
            rest = {**stance, "v": None}
            d = robot.evaluate(["gravity_torque"], **rest)
            still = robot.evaluate(["acceleration", "wrench"], **rest, torque=d["gravity_torque"])
            np.testing.assert_allclose(still["acceleration"], 0, atol=1e-8)
            frame = poise.balance.frame_o(robot.foot_pose(**rest))
            total = poise.balance.resultant(still["wrench"].reshape(2, 6), frame, robot.foot_pose(**rest))
            self.assertAlmostEqual(total[2], -robot.total_mass * G, delta=1e-6)  # robot on ground

    def test_task_torque_gives_the_acceleration(self):
        for robot in self.robots:
            s = robot.stance()
            d = robot.evaluate(["com_jacobian", "com_bias_acceleration"], **s)
            wanted = np.array([[0.3, -0.2, 0.1], [0, 0, 0.5]])
            torque = robot.task_torque(d["com_jacobian"], wanted, **s, bias_acceleration=d["com_bias_acceleration"])
            self.assertEqual(torque.shape, (2, robot.num_joints))
            moves = robot.acceleration(**s, torque=torque)
            np.testing.assert_allclose(moves @ d["com_jacobian"].T + d["com_bias_acceleration"], wanted, atol=1e-7)

    def test_balancing_puts_the_centre_of_pressure_on_the_regions_edge(self):
        for robot in self.robots:
            s = robot.stance()
            d = robot.evaluate(["com_jacobian", "foot_pose", "gravity_torque"], **s)
            torque = robot.task_torque(d["com_jacobian"], [0, 1.2, 0], **s)  # a jerk to the left: the pressure goes right
            region = [[-0.05, -0.04], [0.05, -0.04], [0.05, 0.04], [-0.05, 0.04]]
            result, before, after, active = robot.balance(torque, region, **s)
            self.assertTrue(active)
            self.assertLess(before[1], -0.04)
            self.assertAlmostEqual(after[1], -0.04, places=7)
            frame = poise.balance.frame_o(d["foot_pose"])
            wrench = robot.wrench(**s, torque=result).reshape(2, 6)
            total = poise.balance.resultant(wrench, frame, d["foot_pose"])
            np.testing.assert_allclose(poise.balance.center_of_pressure(total), after, atol=1e-7)
            # The COM's height is protected.
            rows = d["com_jacobian"][2]
            np.testing.assert_allclose(rows @ robot.acceleration(**s, torque=result),
                                       rows @ robot.acceleration(**s, torque=torque), atol=1e-8)

    def test_batches_are_single_states_side_by_side(self):
        robot = self.robots[1]
        s = states(robot, 6, seed=8)
        cube = {key: value.reshape((2, 3) + value.shape[1:]) for key, value in s.items()}
        names = ["mass_matrix", "com", "foot_pose", "momentum"]
        whole = robot.evaluate(names, **cube)
        for i in range(2):
            for j in range(3):
                one = robot.evaluate(names, **{key: value[i, j] for key, value in cube.items()})
                for name in names:
                    self.assertEqual(whole[name].shape[:2], (2, 3))
                    np.testing.assert_array_equal(whole[name][i, j], one[name])
        same = robot.com(s["q"], None, cube["base_position"][0, 0])  # leading axes broadcast
        self.assertEqual(same.shape, (6, 3))
        self.assertEqual(robot.com(np.zeros((0, robot.num_joints))).shape, (0, 3))

    def test_what_is_no_state_gives_nan_and_what_is_no_shape_an_error(self):
        robot = self.robots[0]
        stance = robot.stance()
        q = np.stack([stance["q"], np.full(12, np.nan), stance["q"]])
        matrix = robot.mass_matrix(q)
        self.assertTrue(np.isnan(matrix[1]).all())
        np.testing.assert_array_equal(matrix[0], matrix[2])
        self.assertTrue(np.isnan(robot.com(stance["q"], base_orientation=[0, 0, 0, 0])).all())
        with self.assertRaisesRegex(ValueError, "q: is"):
            robot.com(np.zeros(11))
        with self.assertRaisesRegex(ValueError, "leading axes"):
            robot.com(np.zeros((2, 12)), np.zeros((3, 18)))
        with self.assertRaisesRegex(ValueError, "a foot must be in contact"):
            robot.lambda_c(stance["q"], in_contact=(False, False))
        with self.assertRaisesRegex(ValueError, "needs torque"):
            robot.wrench(stance["q"])
        with self.assertRaises(AttributeError):
            robot.no_such_quantity
        with self.assertRaises(KeyError):
            robot.evaluate("no_such_quantity", stance["q"])
        with self.assertRaises(poise.ConfigError):
            robot.jacobian("tail", stance["q"])
        with self.assertRaises(poise.Error):
            poise.Robot.load("no_such")


if __name__ == "__main__":
    unittest.main()
