"""Figures of the Python module, in processor time. Usage: PYTHONPATH=build/release/python /usr/bin/python3 tests/benchmarks/python_benchmark.py"""
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


env = poise.Environment("stand", plant=run, components={"task_controller": Holds()})
with_python = spent(env.step, 5000)
env = poise.Environment("stand", plant=run)
print(f"a component in Python: {1e6 * (with_python - spent(env.step, 5000)):.0f} us a tick more than its C++")
