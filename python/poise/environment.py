"""Scenarios in this process: to their end, or step by step."""

import os

import numpy as np

from . import _poise
from .robot import Robot
from .runs import Fields, Run


def _changes(changes, **others):
    """The changes of a scenario as the C++ half takes them."""
    settings = []
    for field, value in (changes or {}).items():
        if isinstance(value, (bool, np.bool_)):
            value = "true" if value else "false"
        elif isinstance(value, (float, np.floating)):
            value = repr(float(value))
        elif value is None:
            value = ""  # a list or a group without elements
        settings.append(f"{field}={value}")
    without = others.pop("without", ())
    others["without"] = [without] if isinstance(without, str) else list(without)
    if others.get("robot") is not None:
        others["robot"] = os.fspath(others["robot"])
    return {"set": settings, **others}


class Snapshot(Fields):
    """The last message of a channel: each field an array or a number of its own."""

    def __init__(self, message, channel):
        super().__init__(self)
        self._message = message
        self.channel = channel
        self._shapes = None

    def _paths(self):
        if self._shapes is None:
            self._shapes = dict(self._message.fields())
        return self._shapes

    def _title(self):
        return self.channel

    def _get(self, path):
        return self._message.get(path)

    def __getitem__(self, path):
        return self._message.get(path)


class Environment:
    """A scenario's graph in this process, stepped tick by tick, observed and disturbed.

        env = poise.Environment("stand")
        env.step(500)
        env.push([0, 60, 0], duration=0.2)
        env.step(1000)
        env["GROUND_TRUTH"].com_position

    scenario: a name (poise.names("scenarios")) or a file.
    changes: {"sim.push[0].peak": 120}: fields as `poise list fields` names them; None empties a list or a group.
    robot, engine, variant, seed, ideal, without: as the flags of `poise run`. duration: s; None: it does not end by itself.
    components: {"task_controller": object}: poise.Component objects in the place of the graph's.
    plant: a Run whose sensors are played, over and over, in the place of the simulated robot: nothing is simulated.
    record: keep all messages in memory (6 KB a tick and robot of 12 joints); out: write a run's folder. Then finish() gives
    the Run.

    One thread steps; others may look. Raises poise.Error.
    """

    def __init__(self, scenario, changes=None, *, robot=None, engine=None, variant=None, seed=None, ideal=False, without=(),
                 duration=None, components=None, plant=None, record=False, out=None, force=False, _endless=None):
        self._arguments = dict(
            scenario=os.fspath(scenario),
            changes=_changes(changes, robot=robot, engine=engine, variant=variant, seed=seed, ideal=ideal, without=without,
                             duration=duration),
            components=dict(components or {}), plant=plant._store if plant is not None else None, record=record,
            out=os.fspath(out) if out else "", force=force, endless=duration is None if _endless is None else _endless)
        self.reset()

    def reset(self, seed=None, changes=None):
        """Begins anew; every component of `components` is configured again. Returns the environment.

        changes: of this run alone, on top of those that it was made with: another mass, friction, push.
        """
        arguments = dict(self._arguments)
        if seed is not None:
            arguments["changes"] = {**arguments["changes"], "seed": int(seed)}
        if arguments["out"]:
            self._now = None  # lets go of the run's folder
        own = arguments["changes"]
        self._now = _poise.Session(**{**arguments, "changes": {**own, "set": own["set"] + _changes(changes)["set"]}})
        self._arguments = arguments
        self._robot = None
        return self

    @property
    def _session(self):
        session = self.__dict__.get("_now")
        if session is None:
            raise _poise.ConfigError("the environment could not be made; make it anew")
        return session

    def step(self, ticks=1):
        """Runs up to `ticks` ticks; returns those run: fewer when the run ends. Ctrl-C stops it between ticks."""
        if not isinstance(ticks, (int, np.integer)):
            raise _poise.ConfigError(f"step: {ticks!r} is no whole number of ticks")
        return self._session.step(ticks)

    def __getitem__(self, channel):
        """The last message of a channel. Before the first tick: what the first command will answer."""
        return Snapshot(self._session.message(channel), channel)

    observe = __getitem__

    @property
    def channels(self):
        return self._session.channels()

    def push(self, force, body="", point=(0, 0, 0), duration=None):
        """N, world axes, at `point` (m, body frame) of a body (default: the base), for `duration` s or until set again."""
        force, point = ([float(x) for x in vector] for vector in (force, point))
        if len(force) != 3 or len(point) != 3:
            raise _poise.ConfigError(f"push: force {force} and point {point} must have three numbers each")
        ticks = -1 if duration is None else max(1, round(float(duration) / self.tick_period))
        self._session.push(body, force, point, ticks)

    def walk(self, vx, vy=0.0, wz=0.0):
        """m/s ahead, m/s and rad/s to the left, from the next tick on, in a scenario that walks, as `walk`."""
        self._session.walk([float(vx), float(vy), float(wz)])

    def stand(self):
        """Stops walking, the feet side by side."""
        self._session.walk(None)

    def upper_body(self, angles, duration=0.1):
        """Sends joints that no leg needs, arms, hands, head or waist, to `angles`, {name: rad}, from the next tick on.

        Each comes to rest there in `duration` s, longer where its limits of velocity and acceleration ask for it, from whatever
        motion it is in: who sends a target each 0.02 s, as a teleoperator or a policy does, takes some 0.1 s. The controller's
        dynamics have the moving joints; it keeps the balance as far as soles and torques allow.
        """
        for joint, angle in angles.items():
            self._session.move(joint, float(angle), float(duration))

    def override_torque(self, joint, torque):
        """N·m that the bridge is commanded for a joint (name or index) in the controller's place; None: no longer."""
        if isinstance(joint, str):
            names = self.joint_names
            if joint not in names:
                raise _poise.ConfigError(f"the robot has no joint '{joint}'; it has {', '.join(names)}")
            joint = names.index(joint)
        self._session.override_torque(joint, None if torque is None else float(torque))

    def command(self, *, torque=None, position=None, velocity=None, stiffness=None, damping=None):
        """What the bridge is commanded in the controller's place from now on: torque + stiffness (position - q) +
        damping (velocity - qd), closed by the drives. By joint (joint_names), or one number for all: N·m, rad, rad/s,
        N·m/rad, N·m·s/rad; what is not given is 0. Without arguments: the controller commands again.
        """
        given = (torque, position, velocity, stiffness, damping)
        if all(field is None for field in given):
            self._session.set_command(None)
            return
        joints = len(self.joint_names)
        self._session.set_command([np.broadcast_to(np.asarray(0.0 if field is None else field, float), joints).tolist()
                                   for field in given])

    def finish(self):
        """Ends the run. Returns it as a Run where it was recorded, else None."""
        store = self._session.finish()
        return Run(store) if store is not None else None

    @property
    def robot(self):
        """The robot as the controller knows it."""
        if self._robot is None:
            self._robot = Robot(_poise.Robot.of_texts(*self._session.robot_texts()))
        return self._robot

    @property
    def joint_names(self):
        return self.robot.joint_names

    @property
    def tick(self):
        """Ticks done."""
        return self._session.tick

    @property
    def time(self):
        """s, of the scenario, of the last tick."""
        return self._session.time

    @property
    def tick_period(self):
        return self._session.tick_period

    @property
    def ended(self):
        """Whether it goes no further: the robot fell, or the duration is over."""
        return self._session.ended

    @property
    def failed(self):
        return self._session.failed

    @property
    def detail(self):
        """Why it ended, "sim: the robot fell at 1.234 s (...)", and why the bridge has stopped the robot; empty: neither."""
        return self._session.detail

    @property
    def warnings(self):
        """What is odd about the scenario; and each joint of whose commanded stiffness, damping, position or velocity the bridge has
        cut something, with the largest cut so far."""
        return self._session.warnings

    def __repr__(self):
        return f"<poise.Environment {self._session.scenario}: tick {self.tick}{', ended' if self.ended else ''}>"


def run(scenario, changes=None, *, duration=None, out=None, force=False, **others):
    """Runs a scenario to its end in this process, as `poise run --inline` does, and returns the Run.

    duration: s; None: the scenario's. out: a folder that takes the run as `poise run --out` would, for `poise report`; without
    it the run is kept in memory, some 3 MB a second and robot of 12 joints. Others: as for Environment. Raises poise.Error;
    a robot that falls is no error: see Run.checks.
    """
    env = Environment(scenario, changes, duration=duration, record=True, out=out, force=force, _endless=False, **others)
    while env.step(1000) == 1000:
        pass
    return env.finish()
