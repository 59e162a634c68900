"""The paper's figures of a run, by one call each. Needs matplotlib (python3-matplotlib).

Each takes a Run, draws into `axes` where given, and returns the matplotlib figure.
"""

import numpy as np


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
    """How far the centre of mass truly is from its reference: forward, lateral, vertical (mm)."""
    derived = run["DERIVED"]
    figure, axes = _axes(axes)
    for k, name in enumerate(("forward", "lateral", "vertical")):
        axes[0].plot(derived.time, 1e3 * derived.com_error_true[:, k], label=name)
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
    """η: the right foot's share of the vertical force, as commanded, with its feasible interval, and as it truly was."""
    derived = run["DERIVED"]
    figure, axes = _axes(axes)
    if np.isfinite(derived.share_commanded).any():
        axes[0].fill_between(derived.time, derived.share_least, derived.share_most, alpha=0.2, label="feasible")
        axes[0].plot(derived.time, derived.share_commanded, label="commanded")
    axes[0].plot(derived.time, derived.share_true, label="true", linewidth=0.8)
    axes[0].set_ylim(-0.05, 1.05)
    axes[0].set_ylabel("right foot's share")
    return _finish(figure, axes)


def foot_forces(run, axes=None):
    """Each foot's vertical force on the ground (N): as computed and as it truly was."""
    derived = run["DERIVED"]
    names = derived.names("foot.load_true") or ["right", "left"]
    computed = derived["foot.load_computed"]
    figure, axes = _axes(axes, 2)
    for f in (0, 1):
        if np.isfinite(computed).any():
            axes[f].plot(derived.time, computed[:, f], label="computed")
        axes[f].plot(derived.time, derived["foot.load_true"][:, f], label="true", linewidth=0.8)
        axes[f].set_ylabel(f"{names[f]} (N)")
    return _finish(figure, axes)


def foot_cop(run, axes=None):
    """Each foot's own centre of pressure in its sole's frame (mm), forward and lateral, as it truly was."""
    derived = run["DERIVED"]
    names = derived.names("foot.cop_true") or ["right", "left"]
    figure, axes = _axes(axes, 2)
    for f in (0, 1):
        for k, name in enumerate(("forward", "lateral")):
            axes[f].plot(derived.time, 1e3 * derived["foot.cop_true"][:, f, k], label=name)
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
