"""A limit of the power that actuators take together: of all, or of those of each bus."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.core.calls import budget_record
from finlab.core.fields import Record
from finlab.errors import AllocationError

if TYPE_CHECKING:
    from finlab.layout.layout import Layout

ALL = "power"
"""Name of the bus that feeds all actuators, where a layout names none."""
ROUNDING = 1e-6
"""Share by which rounding may exceed a budget."""
MOST_WATTS = 1e12
"""Largest budget [W]; beyond it something is wrong upstream."""


@dataclass(frozen=True, eq=False)
class PowerBudget:
    """What the b buses of a robot of n actuators may take."""

    names: tuple[str, ...]
    """Of the buses."""
    members: NDArray[np.bool_]
    """Which actuators (b, n) each one feeds; an actuator has one bus at most."""
    watts: Array
    """The most that each may take (b,) [W]."""

    @cached_property
    def record(self) -> Record:
        """The same as the core reads it."""
        return budget_record(self.members, self.watts)

    def power_of_buses(self, power: Array) -> Array:
        """Returns the power (..., b) [W] of each bus at powers (..., n) [W] of the actuators, NaN
        of lost ones."""
        return np.asarray(np.nan_to_num(power) @ self.members.T)

    def are_kept(self, power: Array) -> NDArray[np.bool_]:
        """Returns whether powers (..., n) [W] of the actuators, NaN of lost ones, are within the
        budgets of all buses, but for rounding."""
        most = self.watts * (1.0 + ROUNDING)
        return np.asarray((self.power_of_buses(power) <= most).all(axis=-1))


def budget_of(layout: Layout) -> PowerBudget | None:
    """Returns the budget that a layout has; None where nothing limits the power."""
    if layout.power_w is not None:
        return _budget_of_all(layout.power_w, layout)
    if not layout.buses:
        return None
    members = np.zeros((len(layout.buses), layout.n), bool)
    for row, bus in zip(members, layout.buses, strict=True):
        row[list(layout.indices(bus.actuators))] = True
    names = tuple(bus.name for bus in layout.buses)
    return PowerBudget(names, members, np.array([bus.power_w for bus in layout.buses]))


def bus_words(name: str) -> str:
    """Returns how a bus whose power is used up is named: `power` where one feeds all actuators."""
    return name if name == ALL else f"bus {name}"


def layout_budget(layout: Layout, power: object = None) -> PowerBudget | None:
    """Returns the budget that a question names, else that of the layout; arguments, results and
    errors as of `check_power`, None for the budget of the layout."""
    return budget_of(layout) if power is None else check_power(power, layout)


def check_power(power: object, layout: Layout) -> PowerBudget | None:
    """Returns the budget that a question names.

    Args:
        power: the most power of all actuators together [W], in place of what the layout says; or of
            buses of the layout, by their names. Infinity for no limit.
        layout: the robot.

    Returns:
        The budget; None where nothing is limited.

    Raises:
        AllocationError: a power is no number above 0, or the layout has no such bus.
    """
    if not isinstance(power, Mapping):
        watts = _checked_watts(power, "power", "all actuators together")
        return None if math.isinf(watts) else _budget_of_all(watts, layout)
    own = budget_of(layout)
    names = () if own is None or not layout.buses else own.names
    for name in power:
        if name not in names:
            has = f"has {', '.join(names)}" if names else "has no buses"
            raise AllocationError(f"power: layout {layout.name} {has}, got bus {name!r:.60}")
    if own is None:
        return None
    watts_of = dict(zip(own.names, own.watts, strict=True))
    for name, watts in power.items():
        watts_of[name] = _checked_watts(watts, f"power[{name!r:.60}]", "the bus")
    limits = np.array(list(watts_of.values()))
    is_limited = np.isfinite(limits)
    if not is_limited.any():
        return None
    left = tuple(name for name, watts in watts_of.items() if math.isfinite(watts))
    return PowerBudget(left, own.members[is_limited], limits[is_limited])


def power_from(texts: Sequence[str]) -> float | dict[str, float] | None:
    """Returns the power that a question names by texts, for `check_power`.

    Args:
        texts: watts of all actuators together, or `BUS=W` for each of some buses.

    Returns:
        Watts; or watts by the names of buses; None without texts.

    Raises:
        AllocationError: a text is neither, both kinds are mixed, or one is there twice.
    """
    if not texts:
        return None
    watts_of: dict[str, float] = {}
    for text in texts:
        name, _, number = text.rpartition("=")
        try:
            watts = float(number)
        except ValueError:
            raise AllocationError(
                f"power: expected watts such as 216, or those of a bus such as aft=60, got "
                f"{text!r:.60}"
            ) from None
        if name in watts_of:
            raise AllocationError(
                f"power: {name or 'all actuators'!r:.60} has two numbers; give one"
            )
        watts_of[name] = watts
    if "" not in watts_of:
        return watts_of
    if len(watts_of) > 1:
        raise AllocationError("power: give watts for all actuators, or for buses by name, not both")
    return watts_of[""]


def _budget_of_all(watts: float, layout: Layout) -> PowerBudget:
    """The budget of one bus that feeds all actuators."""
    return PowerBudget((ALL,), np.ones((1, layout.n), bool), np.array([watts]))


def _checked_watts(power: object, argument: str, what: str) -> float:
    """A power above 0 [W], or infinity."""
    is_number = isinstance(power, Real) and not isinstance(power, bool)
    watts = float(power) if is_number else math.nan  # type: ignore[arg-type]
    if not (0.0 < watts <= MOST_WATTS or watts == math.inf):
        raise AllocationError(
            f"{argument}: expected watts above 0, at most {MOST_WATTS:g}, for {what}, or infinity "
            f"for no limit, got {power!r:.60}"
        )
    return watts
