"""A robot's dynamics on arrays, one state or many at once."""

import os

import numpy as np

from . import _poise

# Quantities by what they are computed from: poise.Robot.evaluate says what each is.
QUANTITIES = tuple(_poise.quantities())


class Robot:
    """A robot: `poise.Robot.load("heron/heron")`, or a run's or an environment's `.robot`.

    k joints, n = k + 6 velocities v = [base linear (m/s); base angular (rad/s); joints (rad/s)], base parts in world axes.
    States are given as q (..., k), v (..., n; default 0), base_position (..., 3; default 0) and base_orientation (..., 4: w, x,
    y, z; default upright); leading axes broadcast against each other and come back in the results. A state that is none (a
    number that is not finite, a zero quaternion, contacts that cannot be held) gives NaN. Feet: right first.
    """

    def __init__(self, handle):
        self._handle = handle

    @classmethod
    def load(cls, name):
        """By name, folder or file, as `poise run --robot` finds it. Raises poise.Error."""
        return cls(_poise.Robot.named(os.fspath(name)))

    @property
    def name(self):
        return self._handle.name

    @property
    def num_joints(self):
        return len(self.joint_names)

    @property
    def joint_names(self):
        return self._handle.joint_names

    @property
    def body_names(self):
        return self._handle.body_names

    @property
    def frame_names(self):
        """Every link, also those that are fixed to a body."""
        return self._handle.frame_names

    @property
    def foot_names(self):
        return self._handle.foot_names

    @property
    def sole_size(self):
        """Length and width of each sole, m."""
        return self._handle.sole_size

    @property
    def total_mass(self):
        """kg"""
        return self._handle.total_mass

    @property
    def joint_limits(self):
        """lower, upper (rad) and effort (N·m), an array each."""
        return self._handle.joint_lower, self._handle.joint_upper, self._handle.joint_effort

    def stance(self):
        """The robot at rest on level ground: {"q", "base_position", "base_orientation"}, for the functions below."""
        return self._handle.stance()

    def _states(self, q, v, base_position, base_orientation, *others):
        """States as rows, the axes before them, and `others` (array, axes of its own) as rows beside them."""
        k = self.num_joints
        given = [(q, 1, (k,), "q"), (v, 1, (k + 6,), "v"), (base_position, 1, (3,), "base_position"),
                 (base_orientation, 1, (4,), "base_orientation")] + list(others)
        defaults = {"v": np.zeros(k + 6), "base_position": np.zeros(3), "base_orientation": np.array([1.0, 0, 0, 0])}
        arrays, lead = rows(*[(defaults[name] if a is None and name in defaults else a, axes, shape, name)
                              for a, axes, shape, name in given])
        return _poise.States(*arrays[:4]), arrays[4:], lead

    def evaluate(self, names, q, v=None, base_position=None, base_orientation=None, *, in_contact=(True, True), torque=None):
        """Several quantities of each state, computed together: a dict of arrays (..., shape).

        names, of QUANTITIES: foot_pose (2, 4, 4), foot_jacobian (2, 6, n: linear over angular), foot_velocity (2, 6),
        foot_bias_acceleration (2, 6, J̇ v); mass_matrix A (n, n), bias b (n), gravity g (n): A v̇ + b + g = generalised force;
        com, com_velocity, com_jacobian (3, n), com_bias_acceleration; momentum (6: linear, angular about the COM),
        momentum_matrix (6, n), momentum_bias (6). Of the feet in contact, m = 6 rows each ([force; moment] in the sole's frame,
        robot on environment): contact_jacobian (m, n), lambda_c (4), mu_c (5), p_c (6), jc_bar_transpose (7; m, n), w (22; k, k),
        w_pinv, gravity_torque (k; section 7.1); with `torque` (..., k): wrench (34; m), acceleration (9; n). Numbers in brackets:
        the paper's equations.
        """
        names = [names] if isinstance(names, str) else list(names)
        others = [] if torque is None else [(torque, 1, (self.num_joints,), "torque")]
        states, arrays, lead = self._states(q, v, base_position, base_orientation, *others)
        contact = feet(in_contact)
        results = self._handle.evaluate(names, states, contact, arrays[0] if arrays else None)
        return {name: array.reshape(lead + array.shape[1:]) for name, array in results.items()}

    def __getattr__(self, name):
        if name not in QUANTITIES:
            raise AttributeError(f"poise.Robot has no '{name}'")

        def quantity(q, v=None, base_position=None, base_orientation=None, **others):
            return self.evaluate(name, q, v, base_position, base_orientation, **others)[name]

        quantity.__name__ = name
        quantity.__doc__ = f"evaluate(\"{name}\", ...)[\"{name}\"]"
        return quantity

    def __dir__(self):
        return sorted(set(super().__dir__()) | set(QUANTITIES))

    def jacobian(self, frame, q, base_position=None, base_orientation=None, *, point=(0, 0, 0)):
        """(..., 6, n), linear over angular, world axes, of a point (m, in the link's frame) fixed to a link."""
        states, _, lead = self._states(q, None, base_position, base_orientation)
        result = self._handle.point_jacobian(states, frame, [float(x) for x in point])
        return result.reshape(lead + result.shape[1:])

    def pose(self, frame, q, base_position=None, base_orientation=None):
        """(..., 4, 4), a link's frame in the world."""
        states, _, lead = self._states(q, None, base_position, base_orientation)
        return self._handle.frame_pose(states, frame).reshape(lead + (4, 4))

    def inverse_dynamics(self, acceleration, q, v=None, base_position=None, base_orientation=None):
        """(..., n) generalised force of v̇ (..., n) from Newton's and Euler's laws body by body, without the mass matrix."""
        n = self.num_joints + 6
        states, arrays, lead = self._states(q, v, base_position, base_orientation, (acceleration, 1, (n,), "acceleration"))
        return self._handle.inverse_dynamics(states, arrays[0]).reshape(lead + (n,))

    def task_torque(self, jacobian, acceleration, q, v=None, base_position=None, base_orientation=None, *,
                    bias_acceleration=None, in_contact=(True, True)):
        """(24): joint torques (..., k) that give task rows J (..., t, n) an acceleration (..., t). bias_acceleration: J̇ v."""
        jacobian = np.asarray(jacobian, dtype=float)
        if jacobian.ndim < 2:
            raise ValueError("jacobian: must be (..., tasks, n)")
        t, n = jacobian.shape[-2:]
        bias = np.zeros(t) if bias_acceleration is None else bias_acceleration
        states, arrays, lead = self._states(
            q, v, base_position, base_orientation, (jacobian, 2, (t, n), "jacobian"), (bias, 1, (t,), "bias_acceleration"),
            (acceleration, 1, (t,), "acceleration"))
        result = _poise.task_torque(self._handle, states, feet(in_contact), *arrays)
        return result.reshape(lead + (self.num_joints,))

    def balance(self, torque, region, q, v=None, base_position=None, base_orientation=None, *, in_contact=(True, True),
                legs_only=False):
        """(39)–(46): the torque (..., k) that keeps the centre of pressure in a convex region of frame O (corners × 2, m).

        Returns torque, cop_task and cop (..., 2; before and after, frame O) and active (..., bool).
        """
        states, arrays, lead = self._states(q, v, base_position, base_orientation,
                                            (torque, 1, (self.num_joints,), "torque"))
        columns = _poise.balance(self._handle, states, feet(in_contact), arrays[0], np.asarray(region, dtype=float),
                                 bool(legs_only))
        k = self.num_joints
        columns = columns.reshape(lead + (k + 5,))
        return columns[..., :k], columns[..., k:k + 2], columns[..., k + 2:k + 4], columns[..., k + 4] == 1

    def support_polygon(self, frame, soles, *, in_contact=(True, True), margin=0.0):
        """Corners × 2 (m, in `frame`, anticlockwise) of the hull of the soles in contact, less a margin (m) of each."""
        frame, soles = np.asarray(frame, dtype=float), np.asarray(soles, dtype=float)
        return _poise.support_polygon(self._handle, frame, soles, feet(in_contact), float(margin))

    def __repr__(self):
        return f"<poise.Robot {self.name}: {self.num_joints} joints, {self.total_mass:.1f} kg>"


def feet(in_contact):
    in_contact = [bool(x) for x in in_contact]
    if len(in_contact) != 2:
        raise ValueError("in_contact: must be two, right and left")
    return in_contact


def rows(*given):
    """(array, number of own axes, their sizes, name) each: arrays of one number of rows in C order, and their leading axes."""
    arrays = []
    for array, axes, shape, name in given:
        array = np.asarray(array, dtype=float)
        if array.ndim < axes or array.shape[array.ndim - axes:] != tuple(shape):
            raise ValueError(f"{name}: is {array.shape}, must end with {tuple(shape)}")
        arrays.append((array, axes))
    try:
        lead = np.broadcast_shapes(*[a.shape[:a.ndim - axes] for a, axes in arrays])
    except ValueError as error:
        named = ", ".join(f"{name} {np.shape(a)}" for a, _, _, name in given)
        raise ValueError(f"leading axes do not fit each other: {named}") from error
    count = int(np.prod(lead))  # of no axes: 1
    whole = [np.ascontiguousarray(np.broadcast_to(a, lead + a.shape[a.ndim - axes:])).reshape(
        (count,) + a.shape[a.ndim - axes:]) for a, axes in arrays]
    return whole, lead
