"""Controllers that are not Poise's, in graphs without any of its own: by torque and by impedance they are judged by the truth."""
import csv
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

FOLDER = tempfile.mkdtemp()
PROGRAM = '''#!{python}
import sys
import numpy as np
import poise


class Holder(poise.Component):
    """Holds the first posture of the joints."""
    inputs = {{"robot_state": "robot_state_t"}}
    outputs = {{"joint_command": "joint_command_t"}}
    impedance = {impedance}

    def configure(self, context):
        self.robot, self.start = context.robot, None

    def step(self, tick, inputs, outputs):
        state, command = inputs.robot_state, outputs.joint_command
        if self.start is None:
            self.start = np.array(state.joint_position)
        if self.impedance:
            command.position, command.stiffness, command.damping = self.start, 1500, 40
            return
        gravity = self.robot.gravity_torque(state.joint_position, None, state.base_position, state.base_orientation)
        command.torque = gravity + 600 * (self.start - state.joint_position) - 30 * state.joint_velocity


if __name__ == "__main__":
    sys.exit(poise.main(Holder))
'''


def make_types():
    """Both programs and graphs in FOLDER, before poise is imported: it then knows their types."""
    for place in ("lib/poise/bin", "lib/poise/components", "share/poise/graphs"):
        os.makedirs(os.path.join(FOLDER, place))
    with open(os.path.join(os.environ["POISE_GRAPHS"], "balance.pbtxt")) as file:
        graph = file.read()
    for name in ("step_planner", "task_controller", "contact_wrench_monitor", "redistributor"):
        graph = re.sub(r'component \{\n  name: "%s"\n(.*\n)*?\}\n' % name, "", graph)
    for channel in ("SUPPORT_PLAN", "PLANNER_STATUS", "TASK_TORQUE", "BALANCE_TORQUE"):
        graph = re.sub(r'channel \{ name: "%s" .*\n' % channel, "", graph)
    for name, impedance in (("impedance", True), ("torque", False)):
        program = os.path.join(FOLDER, "lib/poise/bin", name)
        with open(program, "w") as file:
            file.write(PROGRAM.format(python=sys.executable, impedance=impedance))
        os.chmod(program, 0o755)
        told = subprocess.run([program, "--describe"], check=True, capture_output=True, text=True).stdout
        with open(os.path.join(FOLDER, "lib/poise/components", name + ".json"), "w") as file:
            file.write(told)
        with open(os.path.join(FOLDER, "share/poise/graphs", name + ".pbtxt"), "w") as file:
            file.write(graph + 'component {\n  name: "holder"\n  type: "%s"\n'
                       '  input { port: "robot_state" channel: "ROBOT_STATE" }\n'
                       '  output { port: "joint_command" channel: "JOINT_COMMAND" }\n}\n' % name)
    os.environ["POISE_PATH"] = FOLDER


make_types()
import numpy as np  # noqa: E402
import poise  # noqa: E402


def tearDownModule():
    shutil.rmtree(FOLDER)


def holder(impedance, **more):
    scope = {"__name__": "holder"}
    exec(compile(PROGRAM.format(python="", impedance=impedance), "holder", "exec"), scope)
    return type("Told", (scope["Holder"],), more)()


class Judged(unittest.TestCase):
    def run_it(self, scenario, kind, controller, changes=None):
        out = tempfile.mkdtemp(dir=FOLDER)
        run = poise.run(scenario, {"graph": kind, **(changes or {})}, components={"holder": controller}, out=out)
        shown = subprocess.run([os.path.join(os.environ["POISE_BIN"], "poise"), "report", out, "--no-html"],
                               capture_output=True, text=True, env={**os.environ, "COLUMNS": "200"})
        return run, {check["name"]: check for check in run.checks}, shown

    def test_stand_and_push_are_passed_by_torque_and_by_impedance(self):
        for kind in ("torque", "impedance"):
            for scenario in ("stand", "push"):
                with self.subTest(kind=kind, scenario=scenario):
                    run, checks, shown = self.run_it(scenario, kind, holder(kind == "impedance"))
                    self.assertTrue(run.passed, shown.stdout)
                    self.assertEqual(shown.returncode, 0, shown.stdout + shown.stderr)
                    self.assertIn("the robot stood on both feet to the end".lower(), shown.stdout.lower())
                    self.assertNotIn("balancing", shown.stdout)
                    self.assertRegex(shown.stdout, r"passed: (\d+) of \1 checks hold, 2 not known")
                    # What its own words would have to tell.
                    self.assertIsNone(checks["violated_ticks"]["measured"])
                    self.assertEqual(checks["violated_ticks"]["missing"], ["JOINT_COMMAND.conditions_met, margins"])
                    self.assertEqual(checks["com_error_end"]["missing"], ["SUPPORT_PLAN.com_reference"])
                    self.assertIn("SUPPORT_PLAN.com_reference", shown.stdout)
                    # What the truth tells.
                    self.assertEqual(checks["fallen"]["measured"], 0)
                    truth = run["GROUND_TRUTH"]
                    torque = abs(truth.joint_torque)
                    self.assertGreater(torque.max(), 20)
                    self.assertAlmostEqual(run.metric("joint_torque_max"), torque.max(), places=9)
                    self.assertAlmostEqual(run.metric("torque_step_max"), abs(np.diff(truth.joint_torque, axis=0)).max(), places=9)
                    self.assertGreater(checks["joint_torque_share"]["measured"], 5)

    def test_who_stands_has_not_walked(self):
        for scenario, duration, asked in (("walk", 6, ("steps", "walk_course_share")),
                                          ("walk_blocks", 3, ("steps", "walk_way", "landing_height_max"))):
            run, checks, shown = self.run_it(scenario, "impedance", holder(True), {"duration": duration})
            self.assertEqual(checks["fallen"]["measured"], 0)
            self.assertFalse(run.passed, scenario)
            self.assertEqual(shown.returncode, 1)
            for metric in asked:
                self.assertFalse(checks[metric]["passed"], metric)
                self.assertEqual(checks[metric]["missing"], [])
            self.assertIn("(%s) measured " % asked[0], shown.stdout)
        self.assertAlmostEqual(poise.run("walk", {"graph": "impedance", "duration": 6}, components={"holder": holder(True)})
                               .metric("walk_course_share"), 0, delta=2)

    def test_who_walks_has_walked_whoever_commands_it(self):
        walked = poise.run("walk")
        played = walked["JOINT_COMMAND"]

        def plays(self, tick, inputs, outputs):
            for field in ("torque", "position", "velocity", "stiffness", "damping"):
                outputs.joint_command[field][...] = getattr(played, field)[tick.index]

        run, checks, shown = self.run_it("walk", "torque", holder(False, step=plays))
        for channel in ("SUPPORT_PLAN", "PLANNER_STATUS", "TASK_TORQUE", "BALANCE_TORQUE"):
            with self.assertRaises(KeyError):
                run[channel]
        self.assertTrue(run.passed, shown.stdout)
        self.assertEqual(shown.returncode, 0, shown.stdout)
        np.testing.assert_array_equal(run["GROUND_TRUTH"].joint_position, walked["GROUND_TRUTH"].joint_position)
        told = re.search(r"It walked (\d+) steps, a way of ([\d.]+) m", " ".join(shown.stdout.split()))
        self.assertGreater(int(told[1]), 50)
        self.assertGreater(float(told[2]), 1)
        for metric in ("fallen", "steps", "walk_course_share", "walk_turn_share", "walk_way", "walk_speed_max", "walk_cost_of_transport",
                       "torque_step_max", "joint_torque_share"):
            self.assertEqual(checks[metric]["missing"], [], metric)
            self.assertEqual(checks[metric]["measured"], walked.metric(metric), metric)
        for metric in ("violated_ticks", "eta_infeasible_ticks", "walk_velocity_error_rms"):
            self.assertIsNone(checks[metric]["measured"], metric)
        # The same course walked by half is no walk of it.
        half = len(played.torque) // 2

        def stops(self, tick, inputs, outputs):
            super(type(self), self).step(tick, inputs, outputs) if tick.index > half else plays(self, tick, inputs, outputs)

        run, checks, shown = self.run_it("walk", "torque", holder(False, step=stops))
        self.assertFalse(run.passed)

    def test_a_fall_in_a_sweep_is_a_fall(self):
        out = os.path.join(tempfile.mkdtemp(dir=FOLDER), "sweep")
        done = subprocess.run([os.path.join(os.environ["POISE_BIN"], "poise"), "sweep", "push", "--set", "graph=torque",
                               "--set", "sim.push[0].scaled_impulse=", "--vary", "sim.push[0].peak=50,900", "--jobs", "1", "--quiet",
                               "--out", out], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with open(os.path.join(out, "table.csv")) as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([row["outcome"] for row in rows], ["stands", "fell"])
        self.assertGreater(float(rows[1]["fell_at"]), 1)

    def test_what_nobody_told_is_not_shown(self):
        run, checks, shown = self.run_it("stand", "impedance", holder(True), {"duration": 0.5})
        true = abs(run["GROUND_TRUTH"].joint_torque).max()
        for metric in ("push_peak", "push_impulse", "mass_error_end", "eta_lowest"):
            self.assertIsNone(run.metric(metric), metric)
        self.assertNotIn("ushed", shown.stdout)
        self.assertIn("limited by a motor's torque or heat", shown.stdout)
        try:
            import matplotlib
            matplotlib.use("Agg")
        except ImportError:
            return
        torques = poise.plots.torques(run)
        self.assertEqual(torques.axes[0].get_ylabel(), "torque, true (N·m)")
        self.assertAlmostEqual(max(abs(line.get_ydata()).max() for line in torques.axes[0].lines), true)
        for plot in (poise.plots.load_share, poise.plots.foot_forces):
            for axes in plot(run).axes:
                self.assertEqual([line.get_label() for line in axes.lines], ["true"])

    def test_chatter_makes_no_step(self):
        def chatters(self, tick, inputs, outputs):
            super(type(self), self).step(tick, inputs, outputs)
            outputs.joint_command.torque += 50 * (500 <= tick.index < 515) * (-1) ** tick.index

        run, checks, shown = self.run_it("stand", "torque", holder(False, step=chatters), {"duration": 2})
        force = -run["GROUND_TRUTH"]["foot_wrench.force"][:, :, 2]
        unloaded = force < 0.02 * run.robot.total_mass * 9.80665
        self.assertTrue(unloaded.any())
        longest = max(len(stretch) for foot in unloaded.T for stretch in "".join("01"[x] for x in foot).split("0"))
        self.assertLess(longest, 50)
        self.assertEqual(run.metric("steps"), 0)
        self.assertNotIn("made", shown.stdout.split("\n\n")[0])

    def test_chatter_is_no_fault_of_a_sensor(self):
        def rattles(self, tick, inputs, outputs):
            super(type(self), self).step(tick, inputs, outputs)
            legs = np.array([any(part in name for part in ("knee", "hip_pitch", "ankle_pitch")) for name in self.robot.joint_names])
            outputs.joint_command.torque = 80 * legs * (-1) ** (tick.index // 2)

        run, checks, shown = self.run_it("stand", "impedance", holder(True, step=rattles), {"duration": 1})
        force = -run["GROUND_TRUTH"]["foot_wrench.force"][:, :, 2]
        self.assertTrue((force < 10).any() and force.max() > run.robot.total_mass * 9.80665)
        self.assertFalse(run["ESTIMATOR_STATUS"].foot_sensor.any())
        self.assertNotIn("sensor", shown.stdout.split("\n\n")[0])

    def test_the_component_whose_output_is_not_finite_is_named(self):
        def breaks(self, tick, inputs, outputs):
            super(type(self), self).step(tick, inputs, outputs)
            if tick.index > 300:
                outputs.joint_command.torque[0] = np.nan

        run, checks, shown = self.run_it("stand", "torque", holder(False, step=breaks))
        self.assertRegex(shown.stdout.replace("\n", " "), r": holder: output joint_command is not finite at tick 301\.")
        self.assertNotIn(": holder: holder", shown.stdout)

    def test_a_program_is_not_stepped_here(self):
        with self.assertRaisesRegex(poise.ConfigError, "'holder' is torque, a program of its own.*components="):
            poise.Environment("stand", {"graph": "torque"})

    def test_a_cut_impedance_is_warned_of(self):
        def stiff(self, tick, inputs, outputs):
            super(type(self), self).step(tick, inputs, outputs)
            outputs.joint_command.stiffness = 600
            if tick.index >= 100:
                outputs.joint_command.stiffness[3] = 1e7

        env = poise.Environment("stand", {"graph": "impedance"}, components={"holder": holder(True, step=stiff)})
        env.step(100)
        self.assertEqual(env.warnings, [])
        env.step(10)
        self.assertEqual(len(env.warnings), 1)
        self.assertRegex(env.warnings[0], r"%s: stiffness cut from 1e\+07 to \S+ N·m/rad, from 0\.200 s on" % env.joint_names[3])
        env.command(position=env["ROBOT_SENSORS"].joint_position, damping=[1e6] + [0] * (len(env.joint_names) - 1))
        env.step(10)
        self.assertEqual(len(env.warnings), 2)
        self.assertRegex(env.warnings[0], r"%s: damping cut from 1e\+06 to " % env.joint_names[0])
        env.reset()
        self.assertEqual(env.warnings, [])

    def test_a_negative_stiffness_is_named(self):
        def softens(self, tick, inputs, outputs):
            super(type(self), self).step(tick, inputs, outputs)
            if tick.index > 300:
                outputs.joint_command.stiffness[3] = -5

        run, checks, shown = self.run_it("stand", "impedance", holder(True, step=softens))
        self.assertIn("(stiffness of %s: -5 N·m/rad)" % run.joint_names[3], " ".join(shown.stdout.split()))

    def test_conditions_that_a_controller_tells_are_judged(self):
        def tells(met):
            def step(self, tick, inputs, outputs):
                super(type(self), self).step(tick, inputs, outputs)
                command = outputs.joint_command
                command.in_contact, command.conditions_met, command["margins.normal"][...] = 1, met, 1

            return step

        for met, ticks in ((1, 0), (0, 250)):
            run, checks, shown = self.run_it("stand", "torque", holder(False, step=tells(met)), {"duration": 0.5 + met})
            self.assertEqual(checks["violated_ticks"]["measured"], ticks)
            self.assertEqual(run.passed, met == 1)
            self.assertEqual(shown.returncode, 1 - met, shown.stdout)

    def test_why_a_robot_that_is_stopped_lies_there_is_told(self):
        env = poise.Environment("stand", {"graph": "impedance", "sim.fall_height": 0.01, "sim.fall_tilt": 4},
                                components={"holder": holder(True)}, out=os.path.join(FOLDER, "pushed_over"))
        self.assertEqual(env.detail, "")
        env.step(500)
        self.assertEqual(env.detail, "")
        env.push([0, 400, 0], duration=0.3)
        while not env.ended and env["GROUND_TRUTH"].com_position[2] > 0.3:
            env.step(5)
        self.assertFalse(env.ended)
        self.assertRegex(env.detail, r"^hw_bridge has stopped the robot: \w")
        run = env.finish()
        self.assertGreater(run.metric("fallen"), 0)
        shown = subprocess.run([os.path.join(os.environ["POISE_BIN"], "poise"), "report", os.path.join(FOLDER, "pushed_over"),
                                "--no-html"], capture_output=True, text=True, env={**os.environ, "COLUMNS": "200"})
        self.assertEqual(shown.returncode, 1)
        self.assertNotIn("robot stood", shown.stdout)
        self.assertIn("fell at ", shown.stdout)
        self.assertIn("did not call it fallen", shown.stdout)


if __name__ == "__main__":
    unittest.main()
