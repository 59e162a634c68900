"""Runs as arrays: against `poise log export` of the same log, which reads it by other code."""
import csv
import os
import shutil
import subprocess
import tempfile
import threading
import unittest

import numpy as np
import poise

POISE = os.path.join(os.environ["POISE_BIN"], "poise")


class Runs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.path = os.path.join(cls.folder, "run")
        poise.run("push_double_support", {"sim.push[0].peak": 120}, duration=0.6, out=cls.path)
        cls.table = os.path.join(cls.folder, "csv")
        subprocess.run([POISE, "log", "export", cls.path, "--csv", cls.table], check=True, stdout=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def test_every_number_of_every_channel_is_that_of_the_export(self):
        run = poise.open(self.path)
        self.assertGreaterEqual(len(run.channels), 12)
        for name in run.channels:
            with open(os.path.join(self.table, name + ".csv"), newline="") as file:
                header, *lines = csv.reader(file)
            exported = {column: np.array([float(line[i] or "nan") for line in lines]) for i, column in enumerate(header)}
            channel = run[name]
            self.assertEqual(len(channel), len(lines), name)
            numbers = 0
            for path in channel.fields:
                labels = channel._store.labels(name, path)
                flat = channel[path].reshape(len(channel), -1)
                for i, label in enumerate(labels):
                    if label in exported and label != "tick":
                        np.testing.assert_array_equal(flat[:, i], exported[label], f"{name} {label}")
                        numbers += 1
            self.assertGreater(numbers, len(header) - 4, name)  # all but time, tick and what the header has
            np.testing.assert_array_equal(channel.tick, exported["tick"])
            np.testing.assert_allclose(channel.time, exported["time"], atol=1e-9)

    def test_names_and_units_are_those_of_the_descriptions(self):
        run = poise.open(self.path)
        state = run["ROBOT_STATE"]
        self.assertEqual(state.unit("joint_position"), "rad")
        self.assertEqual(state.unit("foot_wrench.force"), "N")
        self.assertEqual(state.names("q"), run.joint_names)
        self.assertEqual(state.q.shape, (len(state), len(run.joint_names)))
        self.assertEqual(state.foot_wrench.force.shape, (len(state), 2, 3))
        self.assertIs(state.q, state["joint_position"])
        self.assertEqual(run.info["scenario"], "push_double_support")

    def test_arrays_own_their_numbers_and_are_read_only(self):
        q = poise.open(self.path)["ROBOT_STATE"].q  # the run is gone
        self.assertTrue(q.flags.owndata)
        with self.assertRaises(ValueError):
            q[0, 0] = 1

    def test_a_run_in_memory_is_the_one_in_the_log(self):
        kept = poise.run("push_double_support", {"sim.push[0].peak": 120}, duration=0.6)
        logged = poise.open(self.path)
        self.assertEqual(sorted(kept.channels), sorted(logged.channels))
        for name in kept:
            for path in kept[name].fields:
                if path != "run_id":
                    np.testing.assert_array_equal(kept[name][path], logged[name][path], f"{name} {path}")
        for metric in ("push_peak", "com_error_max_y", "fallen"):
            self.assertIn(metric, poise.metrics())
            self.assertEqual(kept.metric(metric), logged.metric(metric), metric)
        self.assertAlmostEqual(kept.metric("push_peak"), 120, delta=1)

    def test_pandas(self):
        try:
            import pandas  # noqa: F401
        except ImportError:
            self.skipTest("python3-pandas is not installed")
        run = poise.open(self.path)
        frame = run["ROBOT_STATE"].frame("q", "foot_wrench.force")
        self.assertEqual(list(frame.columns[:2]), [f"joint_position[{name}]" for name in run.joint_names[:2]])
        self.assertIn("foot_wrench[left].force[2]", frame.columns)
        self.assertEqual(len(frame), len(run["ROBOT_STATE"]))

    def test_what_is_not_there_is_told(self):
        run = poise.open(self.path)
        with self.assertRaisesRegex(KeyError, "no channel 'NO'; it has"):
            run["NO"]
        with self.assertRaisesRegex(AttributeError, "ROBOT_STATE has no field 'no'"):
            run["ROBOT_STATE"].no
        with self.assertRaisesRegex(KeyError, "no field"):
            run["ROBOT_STATE"]["foot_wrench"]
        with self.assertRaises(poise.ConfigError):
            poise.open(os.path.join(self.folder, "nothing"))
        with self.assertRaisesRegex(poise.ConfigError, "there is no metric"):
            run.metric("no_such_figure")

    def test_a_damaged_log_gives_what_is_whole(self):
        broken = os.path.join(self.folder, "broken")
        shutil.copytree(self.path, broken)
        log = os.path.join(broken, "run.lcm")
        with open(log, "r+b") as file:
            data = file.read()
            size = len(data)
            # The damage begins with a record: a reader cannot tell a record of which only the numbers are damaged.
            file.seek(data.index(b"\xed\xa1\xda\x01", size // 2))
            file.write(b"\xff" * 20000)
            file.truncate(size - 777)
        run = poise.open(broken)
        self.assertGreater(run.info["damages"], 0)
        whole, part = poise.open(self.path)["GROUND_TRUTH"], run["GROUND_TRUTH"]
        self.assertLess(len(part), len(whole))
        _, i, j = np.intersect1d(whole.tick, part.tick, return_indices=True)
        self.assertEqual(len(j), len(part))
        np.testing.assert_array_equal(whole.com_position[i], part.com_position[j])

    def test_a_log_that_changes_under_the_run_is_told(self):
        changed = os.path.join(self.folder, "changed")
        shutil.copytree(self.path, changed)
        run = poise.open(changed)
        with open(os.path.join(changed, "run.lcm"), "r+b") as file:
            file.truncate(4096)
        with self.assertRaisesRegex(poise.LogError, "has changed since it was opened"):
            run["ROBOT_STATE"].q

    def test_threads_share_a_run(self):
        run = poise.open(self.path)
        wanted = poise.open(self.path)["GROUND_TRUTH"].com_position
        wrong = []

        def read():
            for name in run.channels:
                for path in run[name].fields:
                    run[name][path]
            if not np.array_equal(run["GROUND_TRUTH"].com_position, wanted):
                wrong.append(1)

        threads = [threading.Thread(target=read) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])


if __name__ == "__main__":
    unittest.main()
