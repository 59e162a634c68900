"""The paper's mathematics on arrays: contacts, distribution, capture point. What needs a robot's dynamics is in poise.Robot.

Leading axes broadcast and come back; NaN stands where there is no result. Frames are 4×4 matrices; wrenches are [force; moment],
robot on environment; `soles` and `feet` are (..., 2, 4, 4), right first. Numbers in brackets: the paper's equations.
"""

import collections

import numpy as np

from . import _poise
from .robot import feet as _feet, rows as _rows

GRAVITY = 9.80665  # m/s², standard gravity

Limits = collections.namedtuple("Limits", ["friction", "yaw_friction", "half_length", "half_width"])
Limits.__doc__ = "Of a contact: μ, μ_z (m), half length and half width (m) of the sole."

Margins = collections.namedtuple("Margins", ["normal", "friction", "yaw", "roll", "pitch"])
Ratio = collections.namedtuple("Ratio", ["feasible", "min", "max", "optimal", "selected"])


def _limits(limits):
    limits = [float(x) for x in limits]
    if len(limits) != 4:
        raise ValueError("limits: must be friction, yaw_friction, half_length, half_width")
    return limits


def frame_o(soles, in_contact=(True, True)):
    """(..., 4, 4): frame O, midway between the soles in contact, in their frame."""
    (soles,), lead = _rows((soles, 3, (2, 4, 4), "soles"))
    return _poise.frame_o(soles, _feet(in_contact)).reshape(lead + (4, 4))


def wrench_transform(frame, sole):
    """(35), (44): (..., 6, 6) from a wrench in a sole's frame to the same in `frame`."""
    (frame, sole), lead = _rows((frame, 2, (4, 4), "frame"), (sole, 2, (4, 4), "sole"))
    return _poise.wrench_transform(frame, sole).reshape(lead + (6, 6))


def resultant(wrenches, frame, soles):
    """(35): both feet's wrenches (..., 2, 6) as one in `frame` (..., 6)."""
    wrenches, soles = np.asarray(wrenches, dtype=float), np.asarray(soles, dtype=float)
    if wrenches.shape[-2:] != (2, 6):
        raise ValueError(f"wrenches: is {wrenches.shape}, must end with (2, 6)")
    if soles.shape[-3:] != (2, 4, 4):
        raise ValueError(f"soles: is {soles.shape}, must end with (2, 4, 4)")
    return sum(np.einsum("...ij,...j->...i", wrench_transform(frame, soles[..., f, :, :]), wrenches[..., f, :]) for f in (0, 1))


def center_of_pressure(wrench):
    """(37), (38): (..., 2), m, of a wrench in its frame: (−M_y, M_x) / F_z."""
    (wrench,), lead = _rows((wrench, 1, (6,), "wrench"))
    return _poise.center_of_pressure(wrench).reshape(lead + (2,))


def contact_margins(wrench, limits):
    """(29)–(33): how far a wrench in its sole's frame is inside each condition, N and N·m: Margins of arrays."""
    (wrench,), lead = _rows((wrench, 1, (6,), "wrench"))
    return Margins(*np.moveaxis(_poise.contact_margins(wrench, _limits(limits)).reshape(lead + (5,)), -1, 0))


def ratio(resultant, feet, limits, eta_min=0.0, eta_max=1.0):
    """(70)–(79): the shares η of the right foot for which both feet's conditions hold, and the one to use: Ratio of arrays.

    resultant (..., 6) in frame O; feet: soles in O.
    """
    (resultant, feet), lead = _rows((resultant, 1, (6,), "resultant"), (feet, 3, (2, 4, 4), "feet"))
    columns = _poise.ratio(resultant, feet, _limits(limits), float(eta_min), float(eta_max)).reshape(lead + (5,))
    feasible, *others = np.moveaxis(columns, -1, 0)
    return Ratio(feasible != 0, *others)


def distribute(resultant, feet, eta):
    """(62)–(67): (..., 2, 6) each foot's share of the resultant, in its own sole's frame."""
    (resultant, feet, eta), lead = _rows((resultant, 1, (6,), "resultant"), (feet, 3, (2, 4, 4), "feet"), (eta, 0, (), "eta"))
    return _poise.distribute(resultant, feet, eta).reshape(lead + (2, 6))


def redistribution_torque(contact_jacobian, wrench_change):
    """(52): joint torques (..., k) that change both feet's wrenches (..., 12) by what has no resultant, and move nothing."""
    contact_jacobian = np.asarray(contact_jacobian, dtype=float)
    if contact_jacobian.ndim < 2 or contact_jacobian.shape[-2] != 12:
        raise ValueError(f"contact_jacobian: is {contact_jacobian.shape}, must end with (12, n)")
    n = contact_jacobian.shape[-1]
    (jacobian, change), lead = _rows((contact_jacobian, 2, (12, n), "contact_jacobian"),
                                     (wrench_change, 1, (12,), "wrench_change"))
    return _poise.redistribution_torque(jacobian, change).reshape(lead + (n - 6,))


def capture_point(frame, com, com_velocity, angular_momentum=(0, 0, 0), gravity=GRAVITY):
    """ξ (..., 2; m, in `frame`) and ω (..., rad/s). angular_momentum: about the COM per mass, m²/s, world axes."""
    arrays, lead = _rows((frame, 2, (4, 4), "frame"), (com, 1, (3,), "com"), (com_velocity, 1, (3,), "com_velocity"),
                         (angular_momentum, 1, (3,), "angular_momentum"))
    columns = _poise.capture_point(*arrays, float(gravity)).reshape(lead + (3,))
    return columns[..., :2], columns[..., 2]


def nearest_point(polygon, points):
    """(..., 2): the point of a convex polygon (corners × 2) nearest to each point: itself inside."""
    (points,), lead = _rows((points, 1, (2,), "points"))
    return _poise.nearest(np.asarray(polygon, dtype=float), points)[:, :2].reshape(lead + (2,))


def signed_distance(polygon, points):
    """(...,): distance of each point to the polygon's boundary, positive inside."""
    (points,), lead = _rows((points, 1, (2,), "points"))
    return _poise.nearest(np.asarray(polygon, dtype=float), points)[:, 2].reshape(lead)
