"""Input of a network for a robot: a token for each actuator that works, all without units.

An actuator is described by its effectiveness, and by what it gives for a few prices. So thrusters,
pods and fins, their limits, arcs and laws are told in the same numbers, and an actuator of a kind
that nobody has seen is, too.

Wrenches and multipliers are whitened by the quadratic costs that have each actuator's power at its
largest force. With S the scale of the axes, P the power of all actuators, F_i and P_i the largest
force of an actuator and its power,

    b_i = B_i F_i / S,    d_i = P / (2 P_i),    M = sum d_i b_i b_i',    K = M^(-1/2)

    whitened wrench       w' = K w / S
    whitened multipliers  l' = K^-1 S lambda / P

Where costs are quadratic and no limit counts, l' = w': a network learns what is different.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.response import power_of
from finlab.allocation.dual.compiled import Compiled
from finlab.arrays import NOTHING, Array
from finlab.core.calls import NOMINAL, Conditions
from finlab.errors import AllocationError
from finlab.layout.layout import Layout

LEVELS = (0.05, 0.3, 1.0)
"""Prices at which responses are asked for, over that of the largest force by quadratic costs."""
DIRECTIONS = 8
"""Directions of these prices in an actuator's plane; of a line their cosines count."""
TOKEN_SIZE = 12 + 2 + 2 * len(LEVELS) * DIRECTIONS
"""Numbers of a token: whitened effectiveness (2, 6), logarithm of the power, whether it is a plane,
and responses."""


@dataclass(frozen=True)
class RobotTokens:
    """A robot in one state of losses, as networks read it; m actuators work."""

    layout: Layout
    """The robot, with what is lost."""
    compiled: Compiled
    """The robot as the core reads it."""
    conditions: Conditions
    """Losses, for the core."""
    works: NDArray[np.intp]
    """Which actuators (m,) work."""
    token: Array
    """(m, TOKEN_SIZE)."""
    column: Array
    """Whitened effectiveness sqrt(d_i) K b_i (m, 2, 6) of the largest force [1]."""
    root_stiffness: Array
    """sqrt(d_i) (m,): share of the largest force over the whitened price, by quadratic costs."""
    force_max: Array
    """F_i (m, 2) [N]."""
    power_max: float
    """P, power of all actuators that work, at their largest forces [W]."""
    whiten_wrench: Array
    """(6, 6): w' = whiten_wrench w [1/N, 1/(N m)]."""
    unwhiten_multipliers: Array
    """(6, 6): lambda = unwhiten_multipliers l' [W/N, W/(N m)]."""

    @classmethod
    def of(cls, layout: Layout, lost: NDArray[np.bool_] | None = None) -> "RobotTokens":
        """Compiles a robot and describes what works of it.

        Args:
            layout: the robot.
            lost: actuators (n,) that do not work; None for none.

        Raises:
            AllocationError: an actuator needs a flow, or none works.
        """
        compiled = Compiled.of(layout)
        conditions = NOMINAL if lost is None else Conditions(lost=lost)
        power = np.array([power_of(each, np.array(each.ends)).max() for each in compiled.responses])
        is_left = np.ones(compiled.count, bool) if lost is None else ~lost
        works = np.flatnonzero(is_left & (power > 0.0))
        if len(works) == 0 or len(works) < is_left.sum():
            raise AllocationError(
                f"distilled: expected actuators that push at rest, got {len(works)} of "
                f"{compiled.count}; rudders and robots without actuators are left to method dual"
            )
        power = power[works]
        force_max = compiled.row_force_max[works]
        scale = compiled.axis_scale
        b = compiled.effectiveness[works] * force_max[..., None] / scale
        d = power.sum() / (2.0 * power)
        M = np.einsum("i,iaj,iak->jk", d, b, b)
        K = _inverse_root(M)
        column = np.sqrt(d)[:, None, None] * (b @ K)
        response = _responses(compiled, conditions, works, 2.0 * power / force_max[:, 0])
        token = np.concatenate(
            [
                column.reshape(-1, 12),
                np.log(2.0 * d)[:, None] / 2.0,
                (~compiled.is_line[works])[:, None],
                (response / force_max[:, None, :1]).reshape(len(works), -1),
            ],
            axis=1,
        )
        return cls(
            layout=layout,
            compiled=compiled,
            conditions=conditions,
            works=works,
            token=token,
            column=column,
            root_stiffness=np.sqrt(d),
            force_max=force_max,
            power_max=float(power.sum()),
            whiten_wrench=K / scale,
            unwhiten_multipliers=power.sum() * K / scale[:, None],
        )


def _inverse_root(M: Array) -> Array:
    """M^(-1/2) (6, 6) of a symmetric matrix, 0 along directions that nothing drives."""
    values, vectors = np.linalg.eigh(M)
    is_driven = values > NOTHING * values.max()
    roots = np.where(is_driven, 1.0 / np.sqrt(np.where(is_driven, values, 1.0)), 0.0)
    return np.asarray((vectors * roots) @ vectors.T)


def _responses(
    compiled: Compiled, conditions: Conditions, works: NDArray[np.intp], price_full: Array
) -> Array:
    """Forces (m, LEVELS x DIRECTIONS, 2) [N] that actuators give for prices.

    Args:
        compiled: the robot.
        conditions: losses.
        works: indices (m,) of the actuators.
        price_full: price (m,) [W/N] of the level 1.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, DIRECTIONS, endpoint=False)
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    price = (np.array(LEVELS)[:, None, None] * direction).reshape(-1, 2)
    # The shortest multipliers that offer an actuator a price: lambda = B (B'B)^-1 s.
    offered = np.linalg.pinv(compiled.effectiveness[works])  # (m, 6, 2)
    multipliers = np.einsum("ijk,i,lk->ilj", offered, price_full, price).reshape(-1, 6)
    points = compiled.core.dual_points(np.zeros_like(multipliers), multipliers, 0, conditions)
    force = points.force.reshape(len(works), len(price), compiled.count, 2)
    return force[np.arange(len(works)), :, works]
