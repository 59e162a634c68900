"""Figures of the Python module, in processor time. Usage, with build/release/bin on the PATH:
PYTHONPATH=build/release/python /usr/bin/python3 tests/benchmarks/python_benchmark.py"""
import json
import os
import pathlib
import subprocess
import tempfile
import time

import numpy as np
import poise


def spent(work, times=1):
    """s of processor time, the least of three."""
    least = float("inf")
    for _ in range(3):
        start = time.process_time()
        for _ in range(times):
            work()
        least = min(least, time.process_time() - start)
    return least / times


with tempfile.TemporaryDirectory() as folder:
    poise.run("stand", duration=30, out=folder)

    def load():
        run = poise.open(folder)
        for name in run:
            run[name].load()
        return run

    print(f"a run of 30 s: opened in {spent(lambda: poise.open(folder)):.3f} s, all decoded in {spent(load):.3f} s")
    run = load()
    size = sum(array.nbytes for name in run for array in run[name]._columns.values())
    print(f"  {size / 1e6:.0f} MB of arrays of {len(run.channels)} channels")
    for title, env in (("without engine", poise.Environment("stand", plant=run)), ("with ODE", poise.Environment("stand")),
                       ("with MuJoCo", poise.Environment("stand", engine="mujoco"))):
        env.step(500)
        one = spent(env.step, 10000)
        together = spent(lambda: env.step(10000)) / 10000
        print(f"{title}: {1 / one:.0f} ticks a second one by one ({1e6 * one:.1f} us), {1 / together:.0f} in one call")
    print(f"a call that steps nothing: {1e6 * spent(lambda: env.step(0), 100000):.2f} us")
    print(f"one field of one message: {1e6 * spent(lambda: env['ROBOT_STATE'].joint_position, 10000):.1f} us")
    robot = run.robot
    q = robot.stance()["q"] + 0.1 * np.random.default_rng(1).standard_normal((10000, robot.num_joints))
    names = ["mass_matrix", "bias", "gravity"]
    print(f"{', '.join(names)} of 10,000 states: {1e2 * spent(lambda: robot.evaluate(names, q)):.1f} us each")
    names = ["lambda_c", "w_pinv", "gravity_torque"]
    print(f"{', '.join(names)} of 10,000 states: {1e2 * spent(lambda: robot.evaluate(names, q)):.1f} us each")


class Holds(poise.Component):
    """Says again what the last tick said: the cost of Python alone."""

    def step(self, tick, inputs, outputs):
        outputs.task_torque.torque = 0 * inputs.robot_state.joint_position


def in_place(components):
    env = poise.Environment("stand", plant=run, components=components)
    env.step(500)
    return spent(env.step, 5000)


own, python = in_place(None), in_place({"task_controller": Holds()})
print(f"a tick with task_controller in C++ {1e6 * own:.1f} us, with one in Python {1e6 * python:.1f} us: {python / own:.1f} times")

# As processes: beside the C++ task_controller two in Python get the same messages in the same run, one that computes nothing, and the
# springs of the tutorial. Each says how long it took from its last input to its outputs on the way.
PROGRAM = """#!/usr/bin/python3
import sys

import poise


class Beside(poise.Component):
    \"\"\"Gets what task_controller gets.\"\"\"

    inputs = {{"robot_state": "robot_state_t", "support_plan": "support_plan_t"}}
    outputs = {{"task_torque": "task_torque_t"}}

    def configure(self, context):
        self.robot = context.robot
        self.start = None

    def step(self, tick, inputs, outputs):
        state = inputs.robot_state
        if not {computes}:
            outputs.task_torque.torque = 0 * state.joint_position
            return
        self.start = state.joint_position if self.start is None else self.start
        feet = inputs.support_plan.in_contact.astype(bool)
        gravity = self.robot.gravity_torque(state.joint_position, None, state.base_position, state.base_orientation, in_contact=feet)
        outputs.task_torque.torque = gravity + 600 * (self.start - state.joint_position) - 30 * state.joint_velocity


sys.exit(poise.main(Beside))
"""
with tempfile.TemporaryDirectory() as folder:
    place = pathlib.Path(folder)
    for name in ("lib/poise/bin", "lib/poise/components"):
        (place / name).mkdir(parents=True)
    graph = 'name: "beside" base: "balance"\n'
    names = {"py_nothing": False, "py_springs": True}
    for name, computes in names.items():
        program = place / "lib/poise/bin" / name
        program.write_text(PROGRAM.format(computes=computes))
        program.chmod(0o755)
        (place / "lib/poise/components" / f"{name}.json").write_text(subprocess.check_output([program, "--describe"], text=True))
        graph += f'''channel {{ name: "{name.upper()}" type: "task_torque_t" }}
            component {{ name: "{name}" input {{ port: "robot_state" channel: "ROBOT_STATE" }}
                         input {{ port: "support_plan" channel: "SUPPORT_PLAN" }} output {{ port: "task_torque" channel: "{name.upper()}" }} }}\n'''
    (place / "beside.pbtxt").write_text(graph)
    (place / "beside_scenario.pbtxt").write_text('name: "beside" base: "stand" graph: "beside"')
    subprocess.run([os.environ.get("POISE", "poise"), "run", place / "beside_scenario.pbtxt", "--duration", "10", "--quiet", "--out", place / "run"],
                   env={**os.environ, "POISE_PATH": folder}, check=True, stdout=subprocess.DEVNULL)
    said = json.loads((place / "run/summary.json").read_text())
    latency = {each["name"]: each["latency_us"] for each in said["components"]}
    base = latency["task_controller"]["median"]
    print(f"as processes, from the last input to the outputs, median: task_controller {base:.0f} us")
    for name in names:
        print(f"  {name}: {latency[name]['median']:.0f} us, {latency[name]['median'] / base:.1f} times; p99 {latency[name]['p99']:.0f} us")
