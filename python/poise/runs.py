"""Runs as arrays, by channel and field."""

import os

import numpy as np

from . import _poise
from .robot import Robot

# Short names of fields that most people use.
SHORT = {"q": "joint_position", "dq": "joint_velocity", "tau": "torque"}


class Fields:
    """The fields of a message below a prefix, as attributes: `wrench.force`."""

    def __init__(self, owner, prefix=""):
        self._owner = owner
        self._prefix = prefix

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        paths = self._owner._paths()
        for path in (self._prefix + name, self._prefix + SHORT.get(name, name)):
            if path in paths:
                return self._owner._get(path)
            if any(other.startswith(path + ".") for other in paths):
                return Fields(self._owner, path + ".")
        raise AttributeError(f"{self._owner._title()} has no field '{self._prefix}{name}'")

    def __dir__(self):
        n = len(self._prefix)
        return sorted({p[n:].split(".")[0] for p in self._owner._paths() if p.startswith(self._prefix)})

    def __repr__(self):
        return f"<{self._owner._title()} {self._prefix.rstrip('.')}: {', '.join(self.__dir__())}>"


class Channel(Fields):
    """The messages of one channel of a run: each field an array, its first axis the messages, ascending in time.

    Arrays are made when they are asked for, kept, and read-only. `channel["foot_wrench.force"]` and
    `channel.foot_wrench.force` are the same.
    """

    def __init__(self, store, name):
        super().__init__(self)
        self._store = store
        self.name = name
        self._columns = {}
        self._shapes = dict(store.fields(name))
        info = store.info()
        self._period, self._lead = info["tick_period"], info["lead_ticks"]

    def _paths(self):
        return self._shapes

    def _title(self):
        return self.name

    def _keep(self, path, array):
        array.flags.writeable = False
        self._columns[path] = array
        return array

    def _get(self, path):
        if path not in self._columns:
            self._keep(path, self._store.column(self.name, path))
        return self._columns[path]

    def __getitem__(self, path):
        return self._get(SHORT.get(path, path))

    def __len__(self):
        return len(self.tick)

    @property
    def type(self):
        """The message's type, "robot_state_t"."""
        return self._store.type(self.name)

    @property
    def fields(self):
        """Paths of all fields with the shape that each has in one message."""
        return {path: tuple(shape) for path, shape in self._shapes.items()}

    @property
    def tick(self):
        """The tick of each message."""
        if "tick" not in self._columns:
            self._keep("tick", self._store.ticks(self.name))
        return self._columns["tick"]

    @property
    def time(self):
        """s, of the scenario: negative in the run's lead."""
        return (self.tick - self._lead) * self._period

    def load(self):
        """Decodes all fields in one pass; returns the channel."""
        for path, array in self._store.columns(self.name).items():
            if path != "tick":
                self._keep(path, array)
        return self

    def unit(self, path):
        """The unit that the message's description gives: "rad"; "" for none."""
        return self._store.unit(self.name, SHORT.get(path, path))

    def names(self, path):
        """What the elements of a field's first axis (after the messages') are called: joints, feet."""
        return self._store.element_names(self.name, SHORT.get(path, path))

    def frame(self, *paths):
        """A pandas.DataFrame of these fields (all, without any): index time, a column a number, named as in `poise log csv`."""
        import pandas

        skip = {"run_id", "tick", "utime"}
        wanted = [SHORT.get(path, path) for path in paths] or [p for p in self._shapes if p not in skip]
        columns = {}
        for path in wanted:
            flat = self._get(path).reshape(len(self), -1)
            for i, label in enumerate(self._store.labels(self.name, path)):
                columns[label] = flat[:, i]
        return pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))


class Run:
    """A run: `run["ROBOT_STATE"].joint_position`. Threads may share one."""

    def __init__(self, store):
        self._store = store
        self._info = store.info()
        self._channels = {}
        self._robot = None

    @property
    def channels(self):
        """Names of the channels that have messages."""
        return self._store.channels()

    def __getitem__(self, name):
        if name not in self._channels:
            self._channels[name] = Channel(self._store, name)
        return self._channels[name]

    def __contains__(self, name):
        return name in self._store.channels()

    def __iter__(self):
        return iter(self._store.channels())

    @property
    def info(self):
        """Scenario, seed, tick_period (s), versions, log and so on."""
        return dict(self._info)

    @property
    def name(self):
        """The scenario's name."""
        return self._info["scenario"]

    @property
    def robot(self):
        """The robot that the run's controller knew."""
        if self._robot is None:
            self._robot = Robot(_poise.Robot.of_texts(*self._store.robot_texts()))
        return self._robot

    @property
    def joint_names(self):
        return self.robot.joint_names

    @property
    def scenario(self):
        """The scenario with its changes, protobuf text."""
        return self._store.scenario_text()

    def metric(self, name):
        """A figure that a run's table can show (poise.metrics()); None where the run has none."""
        return self._store.metric(name)

    @property
    def checks(self):
        """The scenario's checks and those of every run, a dict each: name, measured, limits, passed, and missing: what the
        run lacks for it to be known. What is not known has passed: True and measured: None."""
        return self._store.checks()

    @property
    def passed(self):
        """Whether `poise report` says so: no check is broken, and not all of the scenario's own are unknown."""
        return self._store.passed()

    def __repr__(self):
        return f"<poise.Run {self.name}: {', '.join(self.channels)}>"


def open(path=""):
    """The run in a folder, or a log; without one the latest run. Raises poise.Error."""
    return Run(_poise.RunStore.open(os.fspath(path)))
