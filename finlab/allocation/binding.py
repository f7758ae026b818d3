"""Causes that keep a robot from delivering a wrench: limits, power budgets, rates and dead bands of
its actuators, in sentences; `Allocation.binding` and the judge of logs ask for them."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.power_budget import PowerBudget, bus_words
from finlab.arrays import Array
from finlab.axes import axes_in, is_full_turn, wrapped
from finlab.layout.effectiveness import own_effectiveness
from finlab.layout.layout import Layout

if TYPE_CHECKING:
    from finlab.actuators.actuator import Actuator


WITHIN = 1e-3
"""Share of a range, or of what a rate allows in a tick, within which a command is at its end."""
END_SLACK = 1e-9
"""By how much a command may miss the end of a range that has no width."""
STILL_RAD = 1e-6
"""Turn in a tick [rad] up to which an actuator stands still: rounding."""
MISSING_SHARE = 0.1
"""Share of what is missing along the worst axis from which on another axis is named."""


def limits_reached(layout: Layout, command: Array) -> tuple[str, ...]:
    """Names the actuators that a command has at their limits.

    Args:
        layout: the robot of n actuators.
        command: (n, 3), NaN for a lost one.

    Returns:
        A sentence for each.
    """
    at_full_thrust, at_end_of_arc = at_limits(layout, command)
    return limit_words(layout, at_full_thrust, at_end_of_arc)


def at_limits(layout: Layout, command: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Finds the actuators at their limits.

    Args:
        layout: the robot of n actuators.
        command: (..., n, 3), NaN for a lost one, which is at neither limit.

    Returns:
        Which actuators are at full thrust (..., n), and which at the end of their arc (..., n).
    """
    at_full_thrust = np.zeros(command.shape[:-1], bool)
    at_end_of_arc = np.zeros(command.shape[:-1], bool)
    for i, actuator in enumerate(layout.actuators):
        row = command[..., i, :]
        low = np.array(actuator.lower)
        high = np.array(actuator.upper)
        slack = WITHIN * (high - low) + END_SLACK
        at_low = row <= low + slack
        at_high = row >= high - slack
        if actuator.KIND.driven_by_flow:
            # The deflection is all that a foil is told; the flow says how it pushes.
            if not is_full_turn(high[0] - low[0]):
                at_end_of_arc[..., i] = (at_low | at_high)[..., 0]
            continue
        angle = actuator.KIND.aiming_number
        sizes = np.ones(3, bool)
        if angle is not None:
            sizes[angle] = False
        at_full_thrust[..., i] = (at_high | (at_low & (low < 0.0)))[..., sizes].all(-1)
        if angle is not None and not is_full_turn(high[angle] - low[angle]):
            is_at_rest = at_low[..., sizes].all(-1)
            at_end_of_arc[..., i] = ~is_at_rest & (at_low | at_high)[..., angle]
    return at_full_thrust, at_end_of_arc


def limit_words(
    layout: Layout, at_full_thrust: NDArray[np.bool_], at_end_of_arc: NDArray[np.bool_]
) -> tuple[str, ...]:
    """Says what `at_limits` has found.

    Args:
        layout: the robot of n actuators.
        at_full_thrust: which actuators (n,) are.
        at_end_of_arc: which actuators (n,) are.

    Returns:
        A sentence for each.
    """
    words: list[str] = []
    flags = zip(layout.names, at_full_thrust, at_end_of_arc, strict=True)
    for name, is_at_full_thrust, is_at_end_of_arc in flags:
        if is_at_full_thrust:
            words.append(f"{name} at full thrust")
        if is_at_end_of_arc:
            words.append(f"{name} at the end of its arc")
    return tuple(words)


def rate_words(layout: Layout, previous: Array, command: Array, period_s: float) -> tuple[str, ...]:
    """Names the actuators that changed as fast in a tick as their drives allow.

    Args:
        layout: the robot of n actuators.
        previous: command (n, 3) of the tick before; NaN for an unknown one.
        command: (n, 3), NaN for a lost one.
        period_s: time between ticks [s].

    Returns:
        A sentence for each.
    """
    words: list[str] = []
    rows = zip(layout.actuators, previous, command, strict=True)
    for actuator, row_previous, row in rows:
        max_change = np.array(actuator.rates) * period_s
        change = np.abs(row - row_previous)
        angle = actuator.KIND.aiming_number
        if angle is not None:
            change[angle] = abs(float(wrapped(row[angle] - row_previous[angle])))
        if (np.isfinite(max_change) & (change >= (1.0 - WITHIN) * max_change)).any():
            words.append(f"rate of {actuator.name}")
    return tuple(words)


def turning_words(layout: Layout, previous: Array, command: Array) -> tuple[str, ...]:
    """Names the actuators that turn in a tick, as idle ones do towards what they will give.

    Args:
        layout: the robot of n actuators.
        previous: command (n, 3) of the tick before; NaN for an unknown one.
        command: (n, 3), NaN for a lost one.

    Returns:
        A sentence for each.
    """
    words: list[str] = []
    for actuator, row_previous, row in zip(layout.actuators, previous, command, strict=True):
        angle = actuator.KIND.aiming_number
        if angle is None:
            continue
        turn = abs(float(wrapped(row[angle] - row_previous[angle])))
        if turn > STILL_RAD:
            words.append(f"{actuator.name} still turns")
    return tuple(words)


def gives_all_axes_apart(layout: Layout, works: NDArray[np.bool_]) -> bool:
    """Whether a robot away from its limits changes each axis that counts and leaves the others.

    It does where what pushes either way has an effectiveness matrix of full rank in these axes. An
    actuator of one direction, or one that the flow drives, is not asked.

    Args:
        layout: the robot of n actuators.
        works: which actuators (n,) work.
    """
    columns = [np.zeros((0, 6))]
    rows = zip(layout.actuators, own_effectiveness(layout), works, strict=True)
    for actuator, effectiveness, is_working in rows:
        if is_working and _pushes_either_way(actuator):
            columns.append(effectiveness[list(actuator.KIND.push_rows)])
    in_counted_axes = np.concatenate(columns)[:, layout.commanded]
    rank = np.linalg.matrix_rank(in_counted_axes)
    return bool(rank == layout.commanded.sum())


def _pushes_either_way(actuator: "Actuator") -> bool:
    """Whether it pushes along each of its directions and against it, at rest as well."""
    kind = actuator.KIND
    if kind.driven_by_flow:
        return False
    if kind.aiming_number is not None:
        arc = actuator.upper[kind.aiming_number] - actuator.lower[kind.aiming_number]
        return bool(is_full_turn(arc))
    return kind.force_number is not None and bool(actuator.lower[kind.force_number] < 0.0)


def band_words(layout: Layout, command: Array) -> tuple[str, ...]:
    """Names the actuators that a command has inside their dead bands, or at their edges.

    Args:
        layout: the robot of n actuators.
        command: (n, 3), NaN for a lost one.

    Returns:
        A sentence for each.
    """
    words: list[str] = []
    for actuator, row in zip(layout.actuators, command, strict=True):
        dead_band = getattr(actuator, "dead_band", 0.0)
        if dead_band <= 0.0 or actuator.KIND.force_number is None:
            continue
        if abs(row[actuator.KIND.force_number]) <= (1.0 + WITHIN) * dead_band:
            words.append(f"dead band of {actuator.name}")
    return tuple(words)


def budget_words(budget: PowerBudget, power: Array) -> tuple[str, ...]:
    """Names the buses that take all that they have: `power` where one feeds all actuators.

    Args:
        budget: of b buses.
        power: of each actuator (n,) [W], NaN of a lost one.

    Returns:
        Names of the buses.
    """
    taken = budget.power_of_buses(power)
    is_used_up = taken >= (1.0 - WITHIN) * budget.watts
    words = []
    for name, is_full in zip(budget.names, is_used_up, strict=True):
        if is_full:
            words.append(bus_words(name))
    return tuple(words)


NOT_APART = "not given apart by these actuators"
"""How the last resort of `what_binds` ends, after names of axes."""


def what_binds(
    layout: Layout,
    command: Array,
    missing: Array,
    previous: Array | None,
    period_s: float,
    budget: PowerBudget | None = None,
    power: Array | None = None,
) -> tuple[str, ...]:
    """Says what keeps a robot from delivering what is missing.

    Args:
        layout: the robot.
        command: (n, 3), NaN for a lost one.
        missing: what is missing along each axis (6,), over the wrench scale.
        previous: command (n, 3) of the tick before; None outside of ticks.
        period_s: time between ticks [s].
        budget: what actuators might take together; None for no limit.
        power: of each actuator (n,) [W], where there is a budget.

    Returns:
        Limits, then buses, then rates; where there are none of these, what still turns, else dead
        bands, else the axes that these actuators do not give apart from the others. Nothing where
        they do: then it is the method that does not find the command.
    """
    words = limits_reached(layout, command)
    if budget is not None and power is not None:
        words += budget_words(budget, power)
    if previous is not None:
        words += rate_words(layout, previous, command, period_s)
        words = words or turning_words(layout, previous, command)
    if words:
        return words
    words = band_words(layout, command)
    if words:
        return words
    if gives_all_axes_apart(layout, np.isfinite(command[:, 0])):
        return ()
    largest = np.abs(missing).max()
    axes = axes_in(np.abs(missing) >= MISSING_SHARE * largest)
    return (f"{', '.join(axes)} {NOT_APART}",)
