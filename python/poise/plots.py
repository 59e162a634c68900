"""The paper's figures of a run, by one call each. Needs matplotlib (python3-matplotlib).

Each takes a Run, draws into `axes` where given, and returns the matplotlib figure.
"""

import numpy as np

from .balance import center_of_pressure


def _axes(axes, rows=1, **size):
    if axes is not None:
        axes = np.atleast_1d(axes)
        if len(axes) != rows:
            raise ValueError(f"axes: must be {rows}")
        return axes[0].figure, axes
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError("poise.plots needs matplotlib: apt-get install python3-matplotlib") from error
    figure, axes = plt.subplots(rows, 1, sharex=True, squeeze=False, constrained_layout=True, figsize=(7, 2.2 * rows + 0.6))
    return figure, axes[:, 0]


def _finish(figure, axes):
    axes[-1].set_xlabel("time (s)")
    for each in axes:
        each.legend(loc="best", fontsize="small")
        each.grid(True, alpha=0.3)
    return figure


def com_error(run, axes=None):
    """How far the centre of mass is from its reference: forward, lateral, vertical (mm)."""
    truth, plan = run["GROUND_TRUTH"], run["SUPPORT_PLAN"]
    _, i, j = np.intersect1d(truth.tick, plan.tick, return_indices=True)
    error = 1e3 * (truth.com_position[i] - plan["com_reference.position"][j])
    # In steps a centre of pressure is followed, and the COM has no reference.
    error[plan.com_follows[j] != 0, :2] = np.nan
    figure, axes = _axes(axes)
    for k, name in enumerate(("forward", "lateral", "vertical")):
        axes[0].plot(truth.time[i], error[:, k], label=name)
    axes[0].set_ylabel("COM error (mm)")
    return _finish(figure, axes)


def cop(run, axes=None):
    """The centre of pressure of both feet in frame O (mm): of the task torque alone, after balancing, and its bound."""
    balance = run["BALANCE_TORQUE"]
    figure, axes = _axes(axes, 2)
    for k, name in enumerate(("sagittal", "lateral")):
        axes[k].plot(balance.time, 1e3 * balance.cop_task[:, k], label="task torque alone", linestyle="--")
        axes[k].plot(balance.time, 1e3 * balance.cop[:, k], label="with balancing")
        for sign in (-1, 1):
            axes[k].plot(balance.time, sign * 1e3 * balance.cop_limit[:, k], color="grey", linewidth=0.8,
                         label="limit" if sign > 0 else None)
        axes[k].set_ylabel(f"CoP {name} (mm)")
    return _finish(figure, axes)


def load_share(run, axes=None):
    """η: the right foot's share of the vertical force, as commanded, with its feasible interval, and as measured."""
    command, truth = run["JOINT_COMMAND"], run["GROUND_TRUTH"]
    figure, axes = _axes(axes)
    told = (command.eta_feasible != 0) | (command.eta_max != 0)
    if told.any():  # a controller that distributes nothing leaves all of it zero
        low, high, eta = (np.where(told, values, np.nan) for values in (command.eta_min, command.eta_max, command.eta))
        axes[0].fill_between(command.time, low, high, alpha=0.2, label="feasible")
        axes[0].plot(command.time, eta, label="commanded")
    force = truth["foot_wrench.force"][:, :, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        axes[0].plot(truth.time, force[:, 0] / force.sum(axis=1), label="true", linewidth=0.8)
    axes[0].set_ylim(-0.05, 1.05)
    axes[0].set_ylabel("right foot's share")
    return _finish(figure, axes)


def foot_forces(run, axes=None):
    """Each foot's vertical force on the ground (N): as computed and as it truly was."""
    command, truth = run["JOINT_COMMAND"], run["GROUND_TRUTH"]
    names = truth.names("foot_wrench.force") or ["right", "left"]
    figure, axes = _axes(axes, 2)
    computed = -command["foot_wrench.force"][:, :, 2]
    told = (command.conditions_met != 0).any(axis=1) | (computed != 0).any(axis=1)
    for f in (0, 1):
        if told.any():  # a controller that computes no wrenches leaves all of them zero
            axes[f].plot(command.time, np.where(told, computed[:, f], np.nan), label="computed")
        axes[f].plot(truth.time, -truth["foot_wrench.force"][:, f, 2], label="true", linewidth=0.8)
        axes[f].set_ylabel(f"{names[f]} (N)")
    return _finish(figure, axes)


def foot_cop(run, axes=None):
    """Each foot's own centre of pressure in its sole's frame (mm), forward and lateral, as it truly was."""
    truth = run["GROUND_TRUTH"]
    wrench = np.concatenate([truth["foot_wrench.force"], truth["foot_wrench.moment"]], axis=2)
    loaded = np.abs(wrench[:, :, 2]) > 0.02 * run.robot.total_mass * 9.80665  # else it is noise
    places = np.where(loaded[:, :, None], 1e3 * center_of_pressure(wrench), np.nan)
    names = truth.names("foot_wrench.force") or ["right", "left"]
    figure, axes = _axes(axes, 2)
    for f in (0, 1):
        for k, name in enumerate(("forward", "lateral")):
            axes[f].plot(truth.time, places[:, f, k], label=name)
        axes[f].set_ylabel(f"{names[f]} CoP (mm)")
    return _finish(figure, axes)


def push(run, axes=None):
    """The push (N, world axes) as it was given."""
    truth = run["GROUND_TRUTH"]
    figure, axes = _axes(axes)
    for k, name in enumerate("xyz"):
        axes[0].plot(truth.time, truth.push_force[:, k], label=name)
    axes[0].set_ylabel("push (N)")
    return _finish(figure, axes)


def torques(run, axes=None, joints=None):
    """Torques (N·m) of the joints named: the motors' true ones where the log has them, else as the bridge ordered them, else
    the command's, which lack what stiffness and damping add."""
    for channel, field, label in (("GROUND_TRUTH", "joint_torque", "torque, true (N·m)"),
                                  ("BRIDGE_STATUS", "applied_torque", "torque, ordered (N·m)"),
                                  ("JOINT_COMMAND", "torque", "torque, commanded (N·m)")):
        if channel in run.channels:
            break
    told = run[channel]
    names = run.joint_names
    figure, axes = _axes(axes)
    for joint in names if joints is None else joints:
        if joint not in names:
            raise ValueError(f"the robot has no joint '{joint}'; it has {', '.join(names)}")
        axes[0].plot(told.time, told[field][:, names.index(joint)], label=joint)
    axes[0].set_ylabel(label)
    return _finish(figure, axes)
