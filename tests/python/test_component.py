"""Components written in Python: in this process, and as a program of a run of processes over LCM."""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import poise

POISE = os.path.join(os.environ["POISE_BIN"], "poise")

PROGRAM = '''#!{python}
import sys
import numpy as np
import poise


class Springs(poise.Component):
    """Springs at the joints, and gravity compensation."""
    inputs = {{"robot_state": "robot_state_t", "support_plan": "support_plan_t"}}
    outputs = {{"task_torque": "task_torque_t"}}

    def configure(self, context):
        self.robot, self.start = context.robot, None

    def step(self, tick, inputs, outputs):
        state = inputs.robot_state
        if self.start is None:
            self.start = state.joint_position
        gravity = self.robot.gravity_torque(state.joint_position, None, state.base_position, state.base_orientation)
        outputs.task_torque.torque = gravity + 600 * (self.start - state.joint_position) - 30 * state.joint_velocity


if __name__ == "__main__":
    sys.exit(poise.main(Springs))
'''


class Player(poise.Component):
    """Says again what a recorded run's task controller said."""

    def __init__(self, run):
        self.recorded = run["TASK_TORQUE"]

    def step(self, tick, inputs, outputs):
        assert inputs.robot_state.joint_position.shape == outputs.task_torque.torque.shape
        for path in self.recorded.fields:
            if path not in ("num_joints", "run_id", "tick", "utime"):
                outputs.task_torque[path] = self.recorded[path][tick.index]


class InProcess(unittest.TestCase):
    def test_the_same_words_give_the_same_run(self):
        whole = poise.run("push_double_support", duration=0.2)
        again = poise.run("push_double_support", duration=0.2, components={"task_controller": Player(whole)})
        for name in ("TASK_TORQUE", "JOINT_COMMAND", "GROUND_TRUTH"):
            for path in whole[name].fields:
                if path != "run_id":
                    np.testing.assert_array_equal(again[name][path], whole[name][path], f"{name} {path}")

    def test_it_is_told_what_it_must_know(self):
        seen = {}

        class Watch(Player):
            def configure(self, context):
                seen.update(name=context.name, period=context.tick_period, joints=context.robot.num_joints)

            def step(self, tick, inputs, outputs):
                assert isinstance(tick, tuple) and tuple(tick) == (tick.index, tick.utime, tick.time)
                seen.setdefault("ticks", []).append((tick.index, tick.utime, round(tick.time, 9)))
                super().step(tick, inputs, outputs)

        poise.run("stand", duration=0.01, components={"task_controller": Watch(poise.run("stand", duration=0.01))})
        self.assertEqual((seen["name"], seen["period"], seen["joints"]), ("task_controller", 0.002, 12))
        self.assertEqual(seen["ticks"], [(i, 2000 * i, round(0.002 * i, 9)) for i in range(5)])

    def test_what_it_raises_ends_the_run_and_is_raised(self):
        class Breaks(poise.Component):
            def step(self, tick, inputs, outputs):
                if tick.index == 3:
                    raise ZeroDivisionError("of mine")

        env = poise.Environment("stand", components={"task_controller": Breaks()})
        with self.assertRaisesRegex(ZeroDivisionError, "of mine"):
            env.step(10)
        self.assertTrue(env.failed)
        self.assertIn("of mine", env.detail)

    def test_what_is_not_finite_ends_the_run(self):
        class Bad(poise.Component):
            def step(self, tick, inputs, outputs):
                outputs.task_torque.torque = np.nan

        env = poise.Environment("stand", components={"task_controller": Bad()})
        env.step(10)
        self.assertTrue(env.failed)
        self.assertIn("task_torque is not finite", env.detail)

    def test_wrong_use_is_told(self):
        class Wrong(poise.Component):
            def __init__(self, do):
                self.do = do

            def step(self, tick, inputs, outputs):
                self.do(inputs, outputs)

        holder = []
        for do, error in ((lambda i, o: setattr(o.task_torque, "torque", np.zeros(3)), ValueError),
                          (lambda i, o: setattr(o.task_torque, "no", 1), AttributeError),
                          (lambda i, o: i.robot_state.no, AttributeError),
                          (lambda i, o: setattr(o.task_torque, "tick", 1), AttributeError),
                          (lambda i, o: o.task_torque.torque.resize(3, refcheck=False), poise.ConfigError),
                          (lambda i, o: holder[0].step(), poise.ConfigError)):
            env = poise.Environment("stand", components={"task_controller": Wrong(do)})
            holder[:] = [env]
            with self.assertRaises(error):
                env.step(2)
        with self.assertRaisesRegex(poise.ConfigError, "has no component 'no'"):
            poise.Environment("stand", components={"no": Wrong(None)})
        with self.assertRaises(poise.Error):  # two stages: a loop within a tick
            poise.Environment("stand", components={"hw_bridge": Wrong(None)}).step()
        with self.assertRaises(NotImplementedError):
            poise.Environment("stand", components={"task_controller": poise.Component()}).step()


class AsProcess(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        for place in ("lib/poise/bin", "lib/poise/components", "share/poise/graphs", "share/poise/scenarios"):
            os.makedirs(os.path.join(self.folder, place))
        self.program = os.path.join(self.folder, "lib/poise/bin/springs")
        with open(self.program, "w") as file:
            file.write(PROGRAM.format(python=sys.executable))
        os.chmod(self.program, 0o755)
        self.told = subprocess.run([self.program, "--describe"], check=True, capture_output=True, text=True).stdout
        self.describe(self.told)
        with open(os.path.join(os.environ["POISE_GRAPHS"], "balance.pbtxt")) as file:
            graph = file.read()
        graph = graph.replace('name: "task_controller"\n  restart: true', 'name: "task_controller"\n  type: "springs"')
        with open(os.path.join(self.folder, "share/poise/graphs/springs.pbtxt"), "w") as file:
            file.write(graph)
        with open(os.path.join(self.folder, "share/poise/scenarios/sprung.pbtxt"), "w") as file:
            file.write('name: "sprung" description: "stands on springs" base: "stand" graph: "springs"')
        self.environment = {**os.environ, "POISE_PATH": self.folder}

    def describe(self, text):
        with open(os.path.join(self.folder, "lib/poise/components/springs.json"), "w") as file:
            file.write(text)

    def poise(self, *arguments, environment=None):
        return subprocess.run([POISE, *arguments], cwd=self.folder, env=environment or self.environment, capture_output=True,
                              text=True, timeout=120)

    def test_a_run_of_processes_in_lockstep(self):
        done = self.poise("run", "sprung", "--set", "duration=0.4", "--out", "run")
        self.assertIn(done.returncode, (0, 1), done.stdout + done.stderr)  # 1: a check of the scenario
        processes = poise.open(os.path.join(self.folder, "run"))
        # In this process the same class gives the same bits.
        scope = {}
        exec(compile(PROGRAM.format(python=""), "springs", "exec"), {"__name__": "springs"}, scope)
        inline = poise.run("stand", duration=0.4, components={"task_controller": scope["Springs"]()})
        self.assertEqual(len(processes["TASK_TORQUE"]), 200)
        for name in ("TASK_TORQUE", "JOINT_COMMAND", "GROUND_TRUTH"):
            for path in inline[name].fields:
                if path != "run_id":
                    np.testing.assert_array_equal(processes[name][path], inline[name][path], f"{name} {path}")
        self.assertEqual(processes.metric("fallen"), 0)

    def test_a_replay_judges_what_it_replayed_and_names_what_not(self):
        self.poise("run", "sprung", "--set", "duration=0.4", "--out", "run")
        poise.run("stand", duration=0.4, components={"task_controller": Player(poise.run("stand", duration=0.4))},
                  out=os.path.join(self.folder, "object"))
        elsewhere = {**self.environment, "POISE_PATH": ""}
        for run, environment, why in (("run", self.environment, "springs is a program of its own"),
                                      ("run", elsewhere, "does not know its type springs"),
                                      ("object", self.environment, "an object of Python's")):
            done = self.poise("replay", run, environment=environment)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertRegex(done.stdout, f"task_controller: not replayed: .*{why}")
            self.assertIn("JOINT_COMMAND: 200 messages, the same bits", done.stdout)
            self.assertNotIn("DIFFERENT", done.stdout)
            alone = self.poise("replay", run, "--component", "task_controller", environment=environment)
            self.assertEqual(alone.returncode, 1)
            self.assertIn("nothing was replayed", alone.stdout)

    def sweep(self, end, out, *more):
        """A sweep of two runs, whose program does `end` when it has been told to stop."""
        with open(self.program, "w") as file:
            text = PROGRAM.format(python=sys.executable)
            file.write(text.replace("    sys.exit(poise.main(Springs))", f"    status = poise.main(Springs)\n    {end}\n    sys.exit(status)"))
        return self.poise("sweep", "sprung", "--set", "duration=0.2", "--vary", "seed=1,2", "--out", out, *more)

    # How long a process takes to go is the machine's affair; that it crashes then, when all is done, its own.
    def test_a_run_whose_ticks_are_done_has_its_outcome_from_them(self):
        tables = []
        ends = {"good": "pass", "slow": "__import__('time').sleep(30)", "crash": "__import__('os').abort()"}
        for name, end in ends.items():
            done = self.sweep(end, name)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            with open(os.path.join(self.folder, name, "table.csv")) as file:
                tables.append(file.read())
            self.assertEqual(tables[-1], tables[0])
        self.assertEqual(tables[0].count(",stands,"), 2, tables[0])

    def test_a_program_that_dies_in_a_run_is_named(self):
        with open(self.program) as file:
            text = file.read()
        with open(self.program, "w") as file:
            file.write(text.replace("        state = inputs.robot_state\n",
                                    "        state = inputs.robot_state\n"
                                    "        if tick.index == 50:\n            __import__('os').abort()\n"))
        done = self.poise("sweep", "sprung", "--set", "duration=0.2", "--vary", "seed=1,2", "--out", "dead")
        self.assertEqual(done.returncode, 1)
        with open(os.path.join(self.folder, "dead", "table.csv")) as file:
            rows = file.read().splitlines()[1:]
        self.assertEqual(len(rows), 2)
        for row in rows:
            self.assertRegex(row, r",crashed,.*was ended by signal 6 \(Aborted\),task_controller,")

    def test_another_program_does_not_go_on_with_a_sweep(self):
        self.assertEqual(self.sweep("pass", "mine").returncode, 0)
        again = self.sweep("pass  # changed", "mine", "--resume")
        self.assertEqual(again.returncode, 2)
        self.assertIn("another build of poise", again.stderr)

    def test_descriptions_are_read_and_refused(self):
        listed = self.poise("list", "components")
        self.assertIn("springs", listed.stdout)
        self.assertIn("Springs at the joints, and gravity compensation.", listed.stdout)
        for text in ("", "[]", '{"name": "other", "inputs": []}', '{"name": "springs"}',
                     self.told.replace("same tick", "sometimes"), self.told.replace('"task_torque_t"', "3")):
            self.describe(text)
            refused = self.poise("run", "sprung")
            self.assertEqual(refused.returncode, 2)
            self.assertIn("springs.json: is no description of a component", refused.stderr)
            self.assertIn("unknown component type 'springs'", refused.stderr)
            listed = self.poise("list", "robots")  # what has nothing to do with it goes on
            self.assertEqual(listed.returncode, 0)
            self.assertIn("springs.json: is no description of a component", listed.stderr)
        self.describe(self.told.replace("task_torque_t", "health_t"))
        self.assertEqual(self.poise("run", "sprung").returncode, 2)

    def test_a_program_is_no_part_of_another_process(self):
        with open(os.path.join(self.folder, "share/poise/graphs/springs.pbtxt")) as file:
            graph = file.read()
        with open(os.path.join(self.folder, "share/poise/graphs/fresh.pbtxt"), "w") as file:
            file.write(graph.replace('type: "springs"', 'type: "springs"\n  restart: true'))
        program = "component 'task_controller' is springs, a program of its own"
        for flags, what_to_do in ((["--inline"], "without --inline"), (["--interactive"], "without --inline and --interactive"),
                                  (["--set", "graph=fresh", "--hosted"], "without --hosted"),
                                  (["--set", "graph=fresh", "--host", "one=step_planner,task_controller"], "leave it out of --host")):
            refused = self.poise("run", "sprung", "--set", "duration=0.1", "--out", "refused", *flags)
            self.assertEqual(refused.returncode, 2, refused.stdout + refused.stderr)
            self.assertEqual(refused.stderr.count("\n"), 1, refused.stderr)
            self.assertIn(program, refused.stderr)
            self.assertIn(what_to_do, refused.stderr)
            self.assertFalse(os.path.exists(os.path.join(self.folder, "refused")))

    def test_the_description_says_what_the_class_says(self):
        scope = {}
        exec(compile(PROGRAM.format(python=""), "springs", "exec"), {"__name__": "springs"}, scope)
        told, springs = json.loads(self.told), scope["Springs"]
        self.assertEqual((told["name"], told["summary"]), ("springs", springs.__doc__.strip().split("\n")[0]))
        self.assertEqual({port["name"]: (port["type"], port["kind"]) for port in told["inputs"]},
                         {name: (of, "same tick") for name, of in springs.inputs.items()})
        self.assertEqual({port["name"]: port["type"] for port in told["outputs"]}, springs.outputs)


if __name__ == "__main__":
    unittest.main()
