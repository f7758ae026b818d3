"""The ctrl of models of MuJoCo that `mjcf_write.py` writes: of answers, of forces in a simulation,
and back what the motors give.

The actuators stand in the order of the layout: a motor for the force, where MuJoCo has one of it,
and a servo for the angle of what turns.
"""

from typing import NamedTuple, Protocol

import numpy as np

from finlab.arrays import Array
from finlab.layout import Actuator, Layout


class Answers(Protocol):
    """What `Allocator.allocate` or `allocate_batch` has returned."""

    @property
    def layout(self) -> Layout:
        """The robot that was asked."""

    @property
    def command(self) -> Array:
        """Commands (..., n, 3)."""

    @property
    def forces(self) -> Array:
        """Forces (..., n, 3) in the body frame [N]."""


class Drive(NamedTuple):
    """How an actuator is driven in a model."""

    row: int
    """The row of the actuator's frame along which it pushes; -1 of one that pushes nothing."""
    turns: bool
    """Whether a servo turns it about the first row of its frame."""


def drive_of(actuator: Actuator) -> Drive:
    """Returns how an actuator is driven."""
    kind = actuator.KIND
    if kind.driven_by_flow:
        return Drive(-1, True)
    return Drive(kind.push_rows[0], len(kind.push_rows) > 1)


def mujoco_control(answer: Answers) -> Array:
    """Returns the ctrl of a model that `finlab layout convert ROBOT out.xml` has written.

    A thruster has one number, its force [N]. An azimuth, a tilt and a fin have two, the force of
    their thrust [N] and the angle to which it turns [rad]; of a fin these are its mean over a beat.
    A rudder has its deflection [rad]. What is lost has zeros.

    Args:
        answer: what `Allocator.allocate` or `allocate_batch` has returned.

    Returns:
        (nu,), of a batch (N, nu): the actuators in the order of the layout.

    Example:
        >>> import finlab
        >>> from finlab.exchange import mujoco_control
        >>> rov = finlab.Allocator(finlab.load_layout("bluerov2"))
        >>> mujoco_control(rov.allocate([0, 0, 10, 0, 0, 0])).shape
        (6,)
    """
    layout = answer.layout
    in_body = np.nan_to_num(answer.forces)
    own = (in_body[..., None, :] @ layout.frames.transpose(0, 2, 1))[..., 0, :]
    return control_of(layout, np.nan_to_num(answer.command), own)


def control_of(layout: Layout, command: Array, force: Array) -> Array:
    """Returns the ctrl with which a model's motors give forces, and its servos stand at angles.

    Args:
        layout: the robot of n actuators.
        command: (..., n, 3), of which the angles of all but fins are read.
        force: (..., n, 3) along own axes [N]; what is across a motor is left out.

    Returns:
        (..., nu): forces [N] and angles [rad], see `mujoco_control`.
    """
    columns = []
    for i, actuator in enumerate(layout.actuators):
        drive = drive_of(actuator)
        own = force[..., i, :]
        if not drive.turns:
            columns.append(own[..., drive.row])
            continue
        if drive.row >= 0 and actuator.KIND.force_number is None:
            columns += [np.hypot(own[..., 1], own[..., 2]), np.arctan2(own[..., 2], own[..., 1])]
            continue
        angle = command[..., i, actuator.KIND.aiming_number or 0]
        if drive.row >= 0:
            columns.append(own[..., 1] * np.cos(angle) + own[..., 2] * np.sin(angle))
        columns.append(angle)
    return np.stack(columns, axis=-1)


def motor_forces(layout: Layout, control: Array) -> Array:
    """Returns the forces (..., n, 3) along own axes [N] that the motors of a model give.

    Args:
        layout: the robot of n actuators.
        control: the ctrl (..., nu), with each servo at its angle.
    """
    force = np.zeros((*control.shape[:-1], layout.n, 3))
    column = 0
    for i, actuator in enumerate(layout.actuators):
        drive = drive_of(actuator)
        if drive.row >= 0:
            thrust = control[..., column]
            column += 1
            if not drive.turns:
                force[..., i, drive.row] = thrust
        if drive.turns:
            angle = control[..., column]
            column += 1
            if drive.row >= 0:
                force[..., i, 1] = thrust * np.cos(angle)
                force[..., i, 2] = thrust * np.sin(angle)
    return force
