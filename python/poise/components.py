"""Components written in Python."""

import collections
import os
import sys

from . import _poise
from .robot import Robot
from .runs import SHORT

Tick = collections.namedtuple("Tick", ["index", "utime", "time"])
Tick.__doc__ = "The control cycle: index, utime (us since the start), time (s of the scenario)."


class Context:
    """What a component is given when it is configured: name, tick_period (s), seed, robot."""

    def __init__(self, given):
        self.name = given["name"]
        self.tick_period = given["tick_period"]
        self.lead_ticks = given["lead_ticks"]
        self.seed = given["seed"]
        self.robot = Robot(_poise.Robot.of_texts(*given["robot_texts"]))


class Incoming:
    """A message that came: each field an array or a number."""

    def __init__(self, message):
        self.__dict__["_message"] = message

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        try:
            return self._message.get(SHORT.get(name, name))
        except KeyError:
            pass
        prefix = name + "."
        paths = [path for path, _ in self._message.fields() if path.startswith(prefix)]
        if not paths:
            raise AttributeError(f"{self._message.type} has no field '{name}'")
        return type("Fields", (), {path[len(prefix):]: self._message.get(path) for path in paths})()

    def __getitem__(self, path):
        return self._message.get(path)


class Outgoing:
    """A message to fill: `out.torque[:] = ...`, `out.status = 0`, `out["foot_wrench.force"][0] = ...`.

    It keeps its values from tick to tick; counts, run_id, tick and utime are set for you.
    """

    def __init__(self, arrays):
        self.__dict__["_arrays"] = arrays

    def __getattr__(self, name):
        try:
            return self._arrays[SHORT.get(name, name)]
        except KeyError:
            raise AttributeError(f"the message has no field '{name}'; it has {', '.join(self._arrays)}") from None

    def __setattr__(self, name, value):
        getattr(self, name)[...] = value

    def __getitem__(self, path):
        return self._arrays[path]

    def __setitem__(self, path, value):
        self._arrays[path][...] = value


class Messages:
    """Messages by port, as attributes."""

    def __init__(self, messages):
        self.__dict__.update(messages)


class Component:
    """A component of the graph: derive from it, and give `step`, and `configure` where there is something to prepare.

        class Soft(poise.Component):
            def step(self, tick, inputs, outputs):
                outputs.task_torque.torque = -2 * inputs.robot_state.joint_velocity

    step is given a tick, a named tuple (index, utime, time), and messages by port: inputs (None: none has come yet) and outputs,
    which keep what was filled in from tick to tick.

    In the place of one of the graph's (Environment(components={...})) it has that one's ports. As a program of its own
    (poise.main) it says them: inputs and outputs, {port: message type}; an input may be (type, "tick before") or
    (type, "latest").

    step must be a function of the messages and of what it keeps in self: then replays give the same bits. What it raises ends
    the run.
    """

    inputs = {}
    outputs = {}

    def configure(self, context):
        """Called once, before any tick."""

    def step(self, tick, inputs, outputs):
        raise NotImplementedError(f"{type(self).__name__} has no step")

    def _configure(self, given, outputs):
        self.configure(Context(given))
        return Messages({port: Outgoing(arrays) for port, arrays in outputs.items()})

    def _step(self, tick, inputs, outputs):
        incoming = Messages({port: None if m is None else Incoming(m) for port, m in inputs.items()})
        self.step(Tick(*tick), incoming, outputs)


def main(component, name=None, arguments=None):
    """main() of a program that is one component of a run's graph: `sys.exit(poise.main(MyController))`.

    The program stands in FOLDER/lib/poise/bin/NAME, made executable, and what `NAME --describe` prints in
    FOLDER/lib/poise/components/NAME.json; with FOLDER on POISE_PATH a graph may have components of type NAME, which
    `poise run` starts as processes, in lockstep or real time.
    """
    arguments = list(sys.argv if arguments is None else arguments)
    name = name or os.path.splitext(os.path.basename(arguments[0]))[0]
    inputs = [(port, of, "same tick") if isinstance(of, str) else (port, *of) for port, of in component.inputs.items()]
    outputs = [(port, of, "same tick") for port, of in component.outputs.items()]
    if not inputs and not outputs:
        raise _poise.ConfigError(f"{component.__name__} declares neither inputs nor outputs")
    summary = (component.__doc__ or "").strip().split("\n")[0]
    sys.stdout.flush()
    return _poise.component_main(arguments, name, summary, inputs, outputs, component)
