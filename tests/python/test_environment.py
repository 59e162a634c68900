"""A scenario stepped tick by tick: against the same scenario run as a whole, and against pushes that the scenario itself gives."""
import os
import subprocess
import tempfile
import threading
import unittest

import numpy as np
import poise

POISE = os.path.join(os.environ["POISE_BIN"], "poise")


class Steps(unittest.TestCase):
    def test_single_steps_give_the_bits_of_a_whole_run(self):
        env = poise.Environment("push_double_support", duration=0.3, record=True)
        while env.step():
            pass
        self.assertTrue(env.ended)
        stepped, whole = env.finish(), poise.run("push_double_support", duration=0.3)
        for name in whole:
            for path in whole[name].fields:
                if path != "run_id":
                    np.testing.assert_array_equal(stepped[name][path], whole[name][path], f"{name} {path}")

    def test_reset_begins_the_same_run_again(self):
        env = poise.Environment("stand", seed=3)
        env.step(60)
        first = env["ROBOT_STATE"].q
        env.push([0, 50, 0])
        env.step(20)
        env.reset()
        self.assertEqual(env.tick, 0)
        env.step(60)
        np.testing.assert_array_equal(env["ROBOT_STATE"].q, first)
        env.reset(seed=4)
        env.step(60)
        self.assertFalse(np.array_equal(env["ROBOT_STATE"].q, first))

    def test_reset_changes_one_run(self):
        env = poise.Environment("stand", {"duration": 1.5})
        env.step(500)
        own = env["ROBOT_STATE"].q
        env.reset(changes={"sim.joint_friction": False}).step(500)
        alike = poise.Environment("stand", {"duration": 1.5, "sim.joint_friction": False})
        alike.step(500)
        np.testing.assert_array_equal(env["ROBOT_STATE"].q, alike["ROBOT_STATE"].q)
        self.assertFalse(np.array_equal(env["ROBOT_STATE"].q, own))
        with self.assertRaisesRegex(poise.ConfigError, "no_such"):
            env.reset(changes={"sim.no_such": 1})
        env.reset().step(500)
        np.testing.assert_array_equal(env["ROBOT_STATE"].q, own)

    def test_it_walks_where_it_is_told(self):
        env = poise.Environment("walk", {"step_planner.walk.command": "", "duration": 60})
        env.step(500)
        env.walk(0.3)
        env.step(2000)
        before = env["GROUND_TRUTH"].com_position[0]
        env.step(1000)
        self.assertAlmostEqual((env["GROUND_TRUTH"].com_position[0] - before) / 2, 0.3, delta=0.08)
        env.stand()
        env.step(3000)
        before = np.array(env["GROUND_TRUTH"].com_position)
        env.step(500)
        np.testing.assert_allclose(env["GROUND_TRUTH"].com_position, before, atol=0.01)
        self.assertFalse(env.failed, env.detail)
        with self.assertRaisesRegex(poise.ConfigError, "walk"):
            env.walk(9)
            env.step(2)
        stands = poise.Environment("stand")
        stands.step(10)
        with self.assertRaisesRegex(poise.ConfigError, "walk: this run's step_planner does not walk"):
            stands.walk(0.1)
            stands.step(2)

    def test_arms_go_where_they_are_sent_and_balance_is_kept(self):
        env = poise.Environment("stand", robot="heron/heron", duration=60)
        env.step(1000)
        joint = {name: env.joint_names.index(name) for name in env.joint_names}
        angles = {"left_shoulder_pitch": -0.8, "right_shoulder_pitch": -0.8, "left_elbow_pitch": -1.0, "waist_yaw": 0.4}
        env.upper_body(angles, duration=1.0)
        env.step(250)
        half = env["GROUND_TRUTH"].joint_position[joint["waist_yaw"]]
        self.assertTrue(0.1 < half < 0.3, half)  # the minimum-jerk line's middle is at 0.2
        env.step(750)
        for name, angle in angles.items():  # to what friction holds against the posture's stiffness
            self.assertAlmostEqual(env["GROUND_TRUTH"].joint_position[joint[name]], angle, delta=0.12, msg=name)
        # A target each 0.02 s, as a teleoperator sends them: the arm follows it 0.1 s late.
        for i in range(200):
            env.upper_body({"left_elbow_pitch": -1.0 + 0.5 * np.sin(2 * np.pi * 0.5 * 0.02 * i)})
            env.step(10)
        phase = 2 * np.pi * 0.5 * (0.02 * 200 - 0.1)
        self.assertAlmostEqual(env["GROUND_TRUTH"].joint_position[joint["left_elbow_pitch"]], -1.0 + 0.5 * np.sin(phase), delta=0.1)
        self.assertFalse(env.failed, env.detail)
        with self.assertRaisesRegex(poise.ConfigError, "move: this joint is a leg's"):
            env.upper_body({"left_knee_pitch": 0.5})
            env.step(2)
        with self.assertRaisesRegex(poise.ConfigError, "outside the joint's range"):
            env.upper_body({"waist_yaw": 9})
            env.step(2)
        with self.assertRaisesRegex(poise.ConfigError, "no joint 'elbow'; use one of"):
            env.upper_body({"elbow": 0})

    def test_a_push_is_that_of_a_scenario(self):
        ticks, length, force = 100, 50, 70.0
        start = (ticks - 1) * 0.002  # tick i begins where tick i - 1 ended
        given = {"sim.push": "", "sim.push[0].start": start, "sim.push[0].duration": length * 0.002, "sim.push[0].peak": force,
                 "sim.push[0].direction_y": 1, "sim.push[0].profile": "RECTANGLE"}
        del given["sim.push"]
        configured = poise.Environment("stand", given)
        pushed = poise.Environment("stand")
        for env in (configured, pushed):
            env.step(ticks)
        pushed.push([0, force, 0], duration=length * 0.002)
        for env in (configured, pushed):
            env.step(length // 2)
        np.testing.assert_allclose(pushed["GROUND_TRUTH"].push_force, [0, force, 0])
        for env in (configured, pushed):
            env.step(length)
        np.testing.assert_array_equal(pushed["GROUND_TRUTH"].push_force, [0, 0, 0])
        a, b = configured["GROUND_TRUTH"], pushed["GROUND_TRUTH"]
        self.assertGreater(b.com_position[1], 1e-3)
        np.testing.assert_allclose(b.com_position, a.com_position, atol=1e-7)

    def test_a_replay_repeats_a_push_to_the_bit(self):
        with tempfile.TemporaryDirectory() as folder:
            run = os.path.join(folder, "run")
            env = poise.Environment("stand", out=run, duration=0.4)
            env.step(50)
            env.push([0, 40, 0], duration=0.05)
            env.push([15, 0, 0], point=[0, 0, 0.1])  # in its place, in the same tick
            env.step(100)
            env.push([0, 0, 0])
            env.step()
            env.finish()
            done = subprocess.run([POISE, "replay", run], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertNotIn("DIFFERENT", done.stdout)

    def test_a_torque_put_in_the_controllers_place_reaches_the_motor(self):
        env = poise.Environment("stand")
        env.step(50)
        knee = next(name for name in env.joint_names if "knee" in name)
        j = env.joint_names.index(knee)
        before = env["JOINT_COMMAND"].torque[j], env["DRIVE_COMMAND"].current[j]
        env.override_torque(knee, 0.5 * before[0])
        env.step(1)
        self.assertEqual(env["JOINT_COMMAND"].torque[j], 0.5 * before[0])
        self.assertAlmostEqual(env["DRIVE_COMMAND"].current[j] / before[1], 0.5, places=2)  # (54) is linear
        env.override_torque(knee, None)
        env.step(1)
        self.assertNotEqual(env["JOINT_COMMAND"].torque[j], 0.5 * before[0])

    def test_a_fall_ends_it_and_is_no_error(self):
        env = poise.Environment("stand")
        env.push([0, 2000, 0])
        ran = env.step(5000)
        self.assertLess(ran, 5000)
        self.assertTrue(env.ended and env.failed)
        self.assertIn("fell", env.detail)
        self.assertEqual(env.step(10), 0)

    def test_played_sensors_give_the_recorded_commands(self):
        run = poise.run("stand", duration=0.2)
        env = poise.Environment("stand", plant=run)
        for tick in range(60):
            env.step()
            np.testing.assert_array_equal(env["JOINT_COMMAND"].torque, run["JOINT_COMMAND"].torque[tick])
        with self.assertRaisesRegex(poise.ConfigError, "nothing is simulated"):
            env.push([1, 0, 0])

    def test_what_is_seen_before_the_first_tick_is_what_its_command_answers(self):
        looked, stepped = (poise.Environment("stand", seed=5, record=True) for _ in range(2))
        for env in (looked, looked.reset(seed=5)):
            first = env["ROBOT_SENSORS"].joint_position, env["ROBOT_STATE"].q, env["GROUND_TRUTH"].com_position
            self.assertEqual(env.tick, 0)
        looked.step(100)
        stepped.step(100)
        run, other = looked.finish(), stepped.finish()
        np.testing.assert_array_equal(first[0], run["ROBOT_SENSORS"].joint_position[0])
        np.testing.assert_array_equal(first[1], run["ROBOT_STATE"].q[0])
        np.testing.assert_array_equal(first[2], run["GROUND_TRUTH"].com_position[0])
        for name in run:  # looking changes nothing
            for path in run[name].fields:
                if path != "run_id":
                    np.testing.assert_array_equal(run[name][path], other[name][path], f"{name} {path}")

    def test_a_push_after_a_look_acts_from_the_next_tick_on(self):
        env = poise.Environment("stand")
        env["ROBOT_STATE"]
        env.push([0, 60, 0], duration=0.1)
        env.step(2)
        np.testing.assert_allclose(env["GROUND_TRUTH"].push_force, [0, 60, 0])

    def test_a_component_sees_its_first_tick_once(self):
        class Counted(poise.Component):
            def configure(self, context):
                self.ticks = []

            def step(self, tick, inputs, outputs):
                self.ticks.append(tick.index)

        counted = Counted()
        env = poise.Environment("stand", components={"redistributor": counted})
        env["ROBOT_STATE"], env["ROBOT_STATE"]
        self.assertEqual(counted.ticks, [])
        env.step(3)
        self.assertEqual(counted.ticks, [0, 1, 2])

    def test_a_command_in_the_controllers_place_is_what_the_drives_close(self):
        env = poise.Environment("stand", {"sim.sensor_noise": False})
        start = env["ROBOT_SENSORS"].joint_position
        env.command(position=start, stiffness=400, damping=10)
        env.step(250)
        self.assertFalse(env.ended, env.detail)
        command = env["JOINT_COMMAND"]
        np.testing.assert_array_equal(command.position, start)
        np.testing.assert_array_equal(command.stiffness, np.full(start.size, 400))
        np.testing.assert_array_equal(command.torque, np.zeros(start.size))
        self.assertFalse(command.in_contact.any())  # nothing computed is left of the controller's
        np.testing.assert_array_equal(env["DRIVE_COMMAND"].position, start)
        # The springs carry the robot: their torque is the joints'.
        truth = env["GROUND_TRUTH"]
        springs = 400 * (start - truth.joint_position) - 10 * truth.joint_velocity
        self.assertGreater(abs(springs).max(), 10)
        np.testing.assert_allclose(truth.joint_torque, springs, atol=0.05 * abs(springs).max())
        np.testing.assert_allclose(env["ROBOT_SENSORS"].joint_velocity, truth.joint_velocity, atol=0.2)
        env.command()
        env.step(1)
        self.assertTrue(env["JOINT_COMMAND"].torque.any())
        with self.assertRaisesRegex(poise.ConfigError, "stiffness: -1"):
            env.command(stiffness=-1)
        with self.assertRaises(ValueError):
            env.command(position=[0, 0])

    def test_none_empties_a_list(self):
        pushed, quiet = poise.Environment("push_double_support"), poise.Environment("push_double_support", {"sim.push": None})
        for env in (pushed, quiet):
            env.step(300)
        self.assertTrue(pushed["EXTERNAL_PUSH"].force.any())
        self.assertLess(abs(quiet["EXTERNAL_PUSH"].force).max(), 2)  # the sensor's noise

    def test_the_detail_says_why_the_bridge_has_stopped_the_robot(self):
        env = poise.Environment("stand", {"hw_bridge.velocity_trip": 0.02})
        env.step(50)
        self.assertEqual(env.detail, "")
        env.command(torque=0)  # limp: it sinks
        env.step(100)
        self.assertIn("hw_bridge has stopped the robot: joint too fast (", env.detail)

    def test_a_thread_steps_and_others_look(self):
        env = poise.Environment("stand")
        env.step(1)
        counts = []
        threads = [threading.Thread(target=lambda: counts.append(sum(env.step(5) for _ in range(20)))) for _ in range(3)]
        threads += [threading.Thread(target=lambda: [env["ROBOT_STATE"].q for _ in range(100)])]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(sum(counts), 300)
        self.assertEqual(env.tick, 301)

    def test_what_cannot_be_is_told_as_poise_run_tells_it(self):
        with self.assertRaisesRegex(poise.ConfigError, "no scenario named 'no_such'"):
            poise.Environment("no_such")
        with self.assertRaisesRegex(poise.ConfigError, "sim.no_such_field"):
            poise.Environment("stand", {"sim.no_such_field": 1})
        with self.assertRaises(poise.Error):
            poise.Environment("stand", robot="no_such")
        env = poise.Environment("stand")
        with self.assertRaisesRegex(poise.ConfigError, "no message before the first tick"):
            env["JOINT_COMMAND"]
        env.step()
        with self.assertRaisesRegex(poise.ConfigError, "no channel 'NO'"):
            env["NO"]
        with self.assertRaisesRegex(poise.ConfigError, "no moving link 'tail'"):
            env.push([1, 0, 0], body="tail")
        for force in ([np.nan, 0, 0], [np.inf, 0, 0]):
            with self.assertRaisesRegex(poise.ConfigError, "finite"):
                env.push(force)
        with self.assertRaisesRegex(poise.ConfigError, "three numbers"):
            env.push([1, 2])
        with self.assertRaisesRegex(poise.ConfigError, "step: 1.5"):
            env.step(1.5)
        with self.assertRaisesRegex(poise.ConfigError, "seed: cannot be -1"):
            poise.Environment("stand", seed=-1)
        with self.assertRaisesRegex(poise.ConfigError, "'task_controller' is <object"):
            poise.Environment("stand", components={"task_controller": object()})
        with self.assertRaisesRegex(poise.ConfigError, "no joint 'elbow'"):
            env.override_torque("elbow", 1)
        with self.assertRaises(poise.ConfigError):
            env.override_torque(99, 1)
        with self.assertRaises(poise.ConfigError):
            env.override_torque(0, float("nan"))
        with self.assertRaises(ValueError):
            env.step(-1)
        self.assertIsNone(env.finish())
        with self.assertRaisesRegex(poise.ConfigError, "finished"):
            env.step()


if __name__ == "__main__":
    unittest.main()
