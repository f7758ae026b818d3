"""Actuators that sit on a joint: an azimuth where the mount of a thruster turns, or a fin."""

import math

import numpy as np

from finlab.arrays import Array
from finlab.axes import TURN
from finlab.errors import LayoutError
from finlab.exchange.exchange import Exchange, vector
from finlab.exchange.links import TURNING, Joint
from finlab.layout import Azimuth, Fin, Thruster

MAX_TILT = math.radians(5.0)
"""Most that a fin's shaft may leave the horizontal plane [rad] and still be taken for
horizontal."""
MAX_LEAN = 0.02
"""Most that the thrust of an azimuth may lean out of the plane in which it turns [rad]."""
MAX_OFFSET = 0.01
"""Most that the line of an azimuth's thrust may pass by its turning axis and count as through it
[m]."""


def on_mount(
    thruster: Thruster, mount: Joint | None, origin: Array, exchange: Exchange
) -> Thruster | Azimuth:
    """Returns a thruster as it is, or the azimuth that it is where its mount turns.

    Args:
        thruster: the thruster at angle 0 of its mount, in the frame of the layout.
        mount: the joint that it is mounted on, in the frame of the description; None where it sits
            on the hull.
        origin: the layout's origin in the description's frame, (3,) [m].
        exchange: gets the notes.

    Raises:
        LayoutError: the thrust leans out of the plane in which the mount turns.
    """
    if mount is None or mount.kind not in TURNING or not mount.limits[0] < mount.limits[1]:
        return thruster
    axis = np.array(thruster.axis)
    position = np.array(thruster.position)
    along = float(mount.axis @ axis)
    if abs(along) > MAX_LEAN:
        raise LayoutError(
            f"the thrust of {thruster.name!r:.60} leans out of the plane in which it turns"
        )
    zero = (axis - along * mount.axis) / math.sqrt(1.0 - along * along)
    arm = position + origin - mount.position
    if abs(arm @ np.cross(mount.axis, zero)) > MAX_OFFSET:
        exchange.note(
            f"{thruster.name} sits off the axis about which it turns: its place at angle 0 is "
            "taken."
        )
    turns_freely = mount.limits[1] - mount.limits[0] >= TURN
    return Azimuth(
        thruster.name,
        # Where it sits along its thrust changes nothing, but for what turns with it.
        vector(position - (arm @ zero) * zero),
        vector(mount.axis),
        vector(zero),
        thruster.force,
        thruster.model,
        (-math.pi, math.pi) if turns_freely else mount.limits,
        thruster.dead_band,
        thruster.torque_per_newton,
        time_constant=thruster.time_constant,
    )


def fin_on(joint: Joint, origin: Array, exchange: Exchange) -> Fin:
    """Returns the fin whose shaft is the axis of a joint, where its force acts.

    Args:
        joint: the joint, in the frame of the description.
        origin: the layout's origin in the description's frame, (3,) [m].
        exchange: gets the notes.

    Raises:
        LayoutError: the joint does not turn.
    """
    if joint.kind not in TURNING:
        kinds = " or ".join(TURNING)
        raise LayoutError(f"joint {joint.name!r:.60} is {joint.kind}; a fin's joint is {kinds}")
    axis = joint.axis
    position = joint.position - origin
    if abs(axis[2]) <= math.sin(MAX_TILT):
        # A joint may turn about the same line the other way round; finlab's shafts point out of the
        # hull.
        outward = axis if axis[:2] @ position[:2] >= 0 else -axis
        return Fin(joint.child, vector(position), math.atan2(outward[1], outward[0]))
    exchange.note(
        "Thrust of fins whose shaft is not horizontal is taken to point forward at direction 0.",
        field="zero",
    )
    forward = np.array([1.0, 0.0, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    ahead = forward if abs(axis[0]) < 0.9 else up  # up, where the shaft itself points forward
    zero = ahead - (ahead @ axis) * axis
    zero = zero / np.linalg.norm(zero)
    return Fin(joint.child, vector(position), shaft=vector(axis), zero=vector(zero))
