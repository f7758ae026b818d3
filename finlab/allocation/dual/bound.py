"""Lower bounds of the power by weak duality (Eq. 3): any multipliers prove one, by the conjugates
of the actuators' laws.

`Dual.bound` makes of them what a result tells, when its bound is first read.
"""

import numpy as np

from finlab.allocation.dual.compiled import Compiled
from finlab.arrays import CLOSE, ROUNDING, Array
from finlab.core.calls import NOMINAL, Conditions
from finlab.physics.plant import Plant

TABLE_ERROR = 10.0 * CLOSE
"""Share of a power by which the core's tables may be off."""


def conjugates_by_laws(
    compiled: Compiled, multipliers: Array, conditions: Conditions = NOMINAL
) -> Array:
    """Returns upper bounds of the conjugates of costs (Eq. 4) by the actuators' laws.

    Args:
        compiled: the robot of n actuators.
        multipliers: lambda (N, 6) [W/N, W/(N m)].
        conditions: what holds of the robot.

    Returns:
        Conjugates (N, n) [W], 0 of lost actuators.
    """
    by_tables = compiled.core.conjugates(multipliers, compiled.conjugate_margins, conditions)
    conjugate = by_tables.conjugate.copy()
    for index, (indices, group) in enumerate(compiled.groups):
        along_price = compiled.conjugates_by_laws(index, by_tables)
        in_all_directions = group.conjugate_bound(multipliers)
        for by_laws in (along_price, in_all_directions):
            if by_laws is None:
                continue
            is_left = np.isnan(by_laws)
            if is_left.any():
                by_laws = np.where(is_left, conjugate[:, indices], by_laws)
            conjugate[:, indices] = by_laws
    if conditions.lost is not None:
        conjugate[:, conditions.lost] = 0.0
    return conjugate


def power_bound(
    compiled: Compiled, wrench: Array, multipliers: Array, conditions: Conditions = NOMINAL
) -> Array:
    """Returns a lower bound of the power by weak duality (Eq. 3), with conjugates by the laws.

    Args:
        compiled: the robot.
        wrench: (N, 6) [N, N m] that is given.
        multipliers: lambda (N, 6) [W/N, W/(N m)]; any prove a bound.
        conditions: what holds of the robot.

    Returns:
        Power (N,) [W] that no answer undercuts which gives these wrenches under the conditions.
    """
    conjugate = conjugates_by_laws(compiled, multipliers, conditions)
    wrench_offset = compiled.wrench_offset
    if conditions.lost is not None:
        wrench_offset = compiled.wrench_offset_of(~conditions.lost)
    paid = multipliers * (wrench - wrench_offset)
    rounding = ROUNDING * (np.abs(paid).sum(axis=1) + np.abs(conjugate).sum(axis=1))
    return np.asarray(paid.sum(axis=1) - conjugate.sum(axis=1) - rounding)


def bound_by_laws(
    compiled: Compiled, wrench: Array, multipliers: Array, conditions: Conditions
) -> Array:
    """Returns the larger one of the bounds at given multipliers and at 0.

    Args:
        compiled: the robot.
        wrench: (N, 6) [N, N m] that is given.
        multipliers: lambda (N, 6) [W/N, W/(N m)], of which some may not be finite.
        conditions: what holds of the robot.

    Returns:
        Power (N,) [W], as of `power_bound`.
    """
    is_finite = np.isfinite(multipliers).all(axis=-1, keepdims=True)
    multipliers = np.where(is_finite, multipliers, 0.0)
    # The last row is the multiplier 0, which proves for any wrench what all take at rest.
    multipliers_and_zero = np.concatenate([multipliers, np.zeros((1, 6))])
    wrenches = np.concatenate([wrench, np.zeros((1, 6))])
    bounds = power_bound(compiled, wrenches, multipliers_and_zero, conditions)
    return np.asarray(np.maximum(bounds[:-1], bounds[-1]))


def bound_by_measured_tables(
    compiled: Compiled,
    plant: Plant,
    wrench_scale: Array,
    wrench: Array,
    multipliers: Array,
    command: Array,
    conditions: Conditions,
) -> Array:
    """Returns the bounds at multipliers that are raised by the measured tables themselves.

    Args:
        compiled: the robot of n actuators.
        plant: their laws, in the flow of the answers.
        wrench_scale: (6,) [N, N m], by which wrenches are normalized.
        wrench: (R, 6) [N, N m] that commands give.
        multipliers: lambda (R, 6) [W/N, W/(N m)] of the answers.
        command: (R, n, 3).
        conditions: what holds of the robot.

    Returns:
        Power (R,) [W], as of `power_bound`.
    """
    from finlab.allocation.dual.multiplier_ascent import raised_multipliers

    if len(wrench) == 0:
        return np.empty(0)
    raised = [
        raised_multipliers(plant, wrench_scale, *row)
        for row in zip(wrench, multipliers, command, strict=True)
    ]
    return power_bound(compiled, wrench, np.stack(raised), conditions)
