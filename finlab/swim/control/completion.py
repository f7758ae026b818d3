"""Wrenches whose open axes are filled with what the actuators give along with the wanted ones, and
which axes a robot commands.

A controller commands some axes of the wrench, holds others at zero, and may leave some free. Few
actuators, or few that are left, may not be able to hold zeros: two fins have four forces to choose
for six axes, and five thrusters one to hold two axes, of which a stuck sixth one pushes both. A
target that asks for the impossible spoils what the controller wants, so the open axes are set to
what the actuators give with it; and free axes to what they give with the least force.
"""

import math
from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import mask_of
from finlab.layout import Layout
from finlab.layout.damage import NO_DAMAGE, Damage
from finlab.layout.effectiveness import layout_effectiveness, own_effectiveness
from finlab.physics import plant_of
from finlab.swim.control.contract import LEVER_M, NO_WRENCH

RANK_TOLERANCE = 1e-6
"""Singular values below this share of the matrix's norm count as zero."""
HELD_PER_FORCE = 0.1
"""What is held of the open axes, in newtons per newton of the forces that it takes. Where it is
less they are left as they are: actuators would soon be at their limits, and give up what is
wanted."""


class _Pseudoinverse(NamedTuple):
    """Of a matrix (r, m) without its small singular values."""

    inverse: Array
    """(m, r)."""
    null_basis: Array
    """What it maps to all but zero (m, m - rank), orthonormal."""
    rank: int


def _pseudoinverse(matrix: Array, least: float) -> _Pseudoinverse:
    """Returns the pseudoinverse of a matrix whose singular values up to `least` count as zero."""
    U, singular_values, V_T = np.linalg.svd(matrix)
    rank = int((singular_values > least).sum())
    inverse = V_T[:rank].T @ np.diag(1.0 / singular_values[:rank]) @ U[:, :rank].T
    return _Pseudoinverse(inverse, V_T[rank:].T, rank)


class Completion:
    """Wanted axes to whole wrenches, for one layout with some actuators damaged. Affine in the
    wanted axes: linear where nothing pushes on by itself."""

    def __init__(
        self, layout: Layout, damage: Damage, axes: Sequence[str], free: Sequence[str] = ()
    ) -> None:
        """Prepares for what the actuators can still do.

        Args:
            layout: the robot.
            damage: lost actuators do not take part. A thruster that is stuck, and any actuator that
                runs on, gives a constant wrench; a pod or a fin that no longer turns pushes along
                one direction.
            axes: names of the axes that are commanded, c below.
            free: names of those that may be anything; the others are held at 0, h below.

        Raises:
            AllocationError: an actuator cannot have its fault.
            LayoutError: an unknown name, or no actuator is left.
        """
        # Forces y with B_c y + b_c = w_c exactly, of which B_h y + b_h = 0 comes nearest, where b
        # is the constant wrench: with the pseudoinverse B_c^+, a basis N of the null space of B_c,
        # and y_c = B_c^+ (w_c - b_c),
        #     y = y_c - N (B_h N)^+ (B_h y_c + b_h).
        scale = np.array([1.0, 1.0, 1.0, 1 / LEVER_M, 1 / LEVER_M, 1 / LEVER_M])
        B, b = _pushes_left(layout, damage)
        B = B * scale[:, None]
        b = b * scale
        chosen = mask_of(axes)
        held = ~mask_of((*axes, *free))
        B_c = B[chosen]
        B_h = B[held]
        of_wanted = _pseudoinverse(B_c, RANK_TOLERANCE * max(float(np.linalg.norm(B_c)), 1e-9))
        self.controllable = of_wanted.rank == len(B_c)
        """Whether the working actuators can give any small combination of the wanted axes."""
        B_c_inverse = of_wanted.inverse
        N = of_wanted.null_basis
        B_of_held = B @ N @ _pseudoinverse(B_h @ N, HELD_PER_FORCE).inverse
        M = B @ B_c_inverse - B_of_held @ B_h @ B_c_inverse
        M = np.where(np.abs(M) < 1e-9, 0.0, M)
        self.matrix = np.zeros((6, 6))
        """Wrench with the wanted axes filled in, to the whole wrench (6, 6), but for `offset`."""
        self.matrix[:, chosen] = M * scale[chosen] / scale[:, None]
        self.offset: Array = (b - M @ b[chosen] - B_of_held @ b[held]) / scale
        """What the whole wrench has beside that, for what pushes on by itself (6,) [N, N m]."""
        self._transposed = np.ascontiguousarray(self.matrix.T)

    def __call__(self, wrench: Array) -> Array:
        """Wrenches (..., 6) whose wanted axes are asked for, whole."""
        whole: Array = wrench @ self._transposed + self.offset
        return whole


def _pushes_left(layout: Layout, damage: Damage) -> tuple[Array, Array]:
    """Returns what the actuators of a damaged robot can still do.

    Args:
        layout: the robot.
        damage: of its actuators.

    Returns:
        Wrenches (6, m) of 1 N along each direction in which one pushes by command, and the constant
        wrench (6,) of those that push on by themselves [N, N m].
    """
    left = layout.without(damage.lost) if damage.lost else layout
    heedless = {*damage.stuck, *damage.running}.intersection(left.names)
    if not heedless:
        return layout_effectiveness(left), NO_WRENCH
    of_lost = dict.fromkeys(damage.lost)
    damaged = damage.renamed({name: name for name in layout.names if name not in of_lost})
    limited = damaged.applied_to(left)
    force = plant_of(limited).force(limited.lower)
    columns = []
    constant = np.zeros(6)
    for k, part in enumerate(limited.actuators):
        effectiveness = own_effectiveness(limited)[k]
        push_rows = list(part.KIND.push_rows)
        if part.name not in heedless:
            columns.append(effectiveness[push_rows])
        elif part.name in damage.running or not part.KIND.sticks_at_angle:
            constant += force[k] @ effectiveness
        else:
            angle = damage.stuck[part.name]
            direction = np.array([[math.cos(angle), math.sin(angle)]])
            columns.append(direction @ effectiveness[push_rows])
    return np.concatenate([np.zeros((0, 6)), *columns]).T, constant


def axes_of(layout: Layout) -> tuple[str, ...]:
    """The axes that are commanded: surge, heave and yaw, and sway where that costs nothing. Fins
    that push sideways hardly push ahead: with them sway is headed against. A robot that lifts by
    rudders alone dives by its pitch, and one that does not lift at all is steered in the plane."""
    surge_heave_yaw = ("Fx", "Fz", "Tz")
    rudders = layout.flow_driven
    without_rudders = layout.without(rudders) if len(rudders) < layout.n else layout
    candidates: list[tuple[Layout, tuple[str, ...]]] = []
    if not layout.n_fins:
        candidates.append((without_rudders, ("Fx", "Fy", "Fz", "Tz")))
    candidates.append((without_rudders, surge_heave_yaw))
    if rudders:
        candidates.append((layout, ("Fx", "Ty", "Tz")))
    if not layout.n_fins:
        candidates.append((layout, ("Fx", "Fy", "Tz")))
    for robot, axes in candidates:
        if Completion(robot, NO_DAMAGE, axes).controllable:
            return axes
    return surge_heave_yaw


def steers(layout: Layout, lost: Sequence[str] = ()) -> bool:
    """Whether what works of a robot can give the axes that are commanded independently, in
    small."""
    return Completion(layout, Damage(lost), axes_of(layout)).controllable


def steerable_loss(layout: Layout, count: int, lost: Sequence[str] = ()) -> tuple[str, ...] | None:
    """Returns the names of the first actuators without which a robot can still be steered.

    Args:
        layout: the robot.
        count: how many besides the lost ones.
        lost: names of actuators that do not work anyway.

    Returns:
        Their names; None where there are no such.
    """
    working = [name for name in layout.names if name not in lost]
    if count >= len(working):
        return None
    for more_lost in combinations(working, count):
        if count == 0 or steers(layout, (*lost, *more_lost)):
            return more_lost
    return None
