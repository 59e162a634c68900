"""Poise in Python: runs as arrays, scenarios in this process, the robot's dynamics, the paper's mathematics.

    import poise
    run = poise.run("push_double_support", {"sim.push[0].peak": 120}, duration=2)
    run["ROBOT_STATE"].joint_position        # ticks × joints, rad

docs/reference/python.md says what there is.
"""

import os
import sys

try:
    import numpy  # noqa: F401

    from ._poise import ConfigError, Error, LogError, RobotError, __version__, metrics, names, version
except ModuleNotFoundError as error:
    if os.path.realpath(sys.executable) == os.path.realpath("/usr/bin/python3"):
        raise
    raise ModuleNotFoundError(f"{error}, for {sys.executable}: poise is made for Debian's Python and numpy; run /usr/bin/python3",
                              name=error.name) from error
from . import balance, plots
from .components import Component, main
from .environment import Environment, run
from .robot import Robot
from .runs import Channel, Run, open

__all__ = [
    "Channel", "Component", "ConfigError", "Environment", "Error", "LogError", "Robot", "RobotError", "Run",
    "__version__", "balance", "main", "metrics", "names", "open", "plots", "run", "version",
]
