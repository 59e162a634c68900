"""Poise in Python: runs as arrays, scenarios in this process, the robot's dynamics, the paper's mathematics.

    import poise
    run = poise.run("push_double_support", {"sim.push[0].peak": 120}, duration=2)
    run["ROBOT_STATE"].joint_position        # ticks × joints, rad

docs/python.md says what there is.
"""

from ._poise import ConfigError, Error, LogError, RobotError, __version__, metrics, names, version
from . import balance, plots
from .components import Component, main
from .environment import Environment, run
from .robot import Robot
from .runs import Channel, Run, open

__all__ = [
    "Channel", "Component", "ConfigError", "Environment", "Error", "LogError", "Robot", "RobotError", "Run",
    "__version__", "balance", "main", "metrics", "names", "open", "plots", "run", "version",
]
