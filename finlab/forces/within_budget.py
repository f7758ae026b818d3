"""The feasible forces of a robot with what they cost, so that all that `finlab.forces` says of them
is within a power budget (Eq. 30).

Powers are by the actuators' own laws, as method `dual` has them; those of fins and of measured
tables by parabolas between knots.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from finlab.actuators.fin.fin_response import FinGroup
from finlab.actuators.kinds import groups_of
from finlab.actuators.response import Line, Plane, RadialTable
from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation.power_budget import PowerBudget, layout_budget
from finlab.errors import AllocationError
from finlab.forces.force_sets import (
    HALF_TURN_TOLERANCE,
    MIN_ASPECT,
    ForceSets,
    Shape,
    force_sets,
    shapes_of,
    zones_of,
)
from finlab.forces.power_sides import PowerCurve, Side, Sides, power_sets
from finlab.layout import Actuator, Layout

CURVE_KNOTS = 513
"""Knots of the curve of a power that follows no power law, denser near rest: it is off by about a
millionth of the largest power."""


def counts_budget(layout: Layout, flow: ArrayLike | None = None) -> bool:
    """Returns whether budgets are counted for a robot in a flow (6,) [m/s, rad/s], None at rest:
    not where this drives actuators."""
    is_any_driven = any(actuator.KIND.driven_by_flow for actuator in layout.actuators)
    return not is_any_driven or not driven_by_flow(layout, shapes_of(layout, flow))


def leaves_budget_out(layout: Layout, flow: ArrayLike | None = None) -> bool:
    """Returns whether a robot has a power budget that is not counted in a flow (6,) [m/s, rad/s],
    None at rest."""
    return layout.has_budget and not counts_budget(layout, flow)


def counted_power(layout: Layout, flow: ArrayLike | None = None) -> float | None:
    """Returns the argument `power` that counts the budget of a layout where one can be counted in a
    flow (6,) [m/s, rad/s], None at rest: None for that budget, and infinity where none is."""
    return math.inf if leaves_budget_out(layout, flow) else None


def force_sets_within(
    layout: Layout, lost: Collection[str] = (), flow: ArrayLike | None = None, power: object = None
) -> ForceSets:
    """Returns the feasible forces of one robot within a power budget, as `force_sets` does without
    one.

    Args:
        layout: the robot.
        lost: names of actuators that give no force, and take no power.
        flow: velocity of the body relative to the water (6,), body frame [m/s, rad/s]; None at
            rest.
        power: as in `finlab.Allocator.allocate`: watts of all actuators, or of buses by their
            names; None for the budget of the layout, infinity for no limit.

    Raises:
        LayoutError: there is no actuator of a name.
        AllocationError: the power is none, or the flow drives actuators whose power is not known.
    """
    budget = layout_budget(layout, power)
    sets = force_sets(layout, lost, flow)
    if budget is None:
        return sets
    shapes = shapes_of(layout, flow)
    check_counted(layout, shapes)
    return with_power(sets, sides_of(layout, shapes), budget)


def check_counted(layout: Layout, shapes: Sequence[Shape]) -> None:
    """Raises AllocationError: budgets are not counted for a robot whose forces have these shapes,
    see `counts_budget`."""
    driven = driven_by_flow(layout, shapes)
    if driven:
        raise AllocationError(
            f"power: no budget is counted where the flow drives {', '.join(driven)}, as what they "
            "take is not in it; leave out `flow`, or lift the budget by power=math.inf"
        )


def with_power(sets: ForceSets, sides: Sequence[Sequence[Sides]], budget: PowerBudget) -> ForceSets:
    """Returns sets of forces of robots alike within a budget; `sides` as from `sides_of`."""
    powers = power_sets(sides, budget)
    whole = np.array([of_actuator[0] for of_actuator in powers.pieces])
    rows = np.broadcast_to(whole, (len(sets.radius), *whole.shape)).copy()
    return sets._replace(sides=rows, powers=powers)


def driven_by_flow(layout: Layout, shapes: Sequence[Shape]) -> tuple[str, ...]:
    """Returns the actuators whose force is that of the flow, and not 0: the power that they take is
    not that of a force alone."""
    return tuple(
        actuator.name
        for actuator, shape in zip(layout.actuators, shapes, strict=True)
        if actuator.KIND.driven_by_flow and shape.radius > 0.0
    )


def sides_of(layout: Layout, shapes: Sequence[Shape]) -> list[tuple[Sides, ...]]:
    """Returns of each actuator of a layout the sides of its set of forces, then those of the parts
    of this where it is not convex, as `Shape` has them; none of actuators without force, and of
    those whose force is that of the flow.

    Args:
        layout: the robot.
        shapes: of its actuators, from `shapes_of`.
    """
    own_axes = np.broadcast_to(np.eye(3, 6), (layout.n, 3, 6))
    sides: list[tuple[Sides, ...]] = [((),)] * layout.n
    for indices, group in groups_of(layout.actuators, own_axes):
        for i, response in zip(indices, group.responses, strict=True):
            actuator = layout.actuators[i]
            if actuator.KIND.driven_by_flow or shapes[i].radius <= 0.0:
                continue
            if isinstance(response, Plane):
                is_fin = isinstance(group, FinGroup)
                sides[i] = _sides_of_plane(actuator, response, shapes[i], is_fin)
            else:
                sides[i] = (_sides_of_line(actuator, response),)
    return sides


def _sides_of_line(actuator: Actuator, response: Line) -> Sides:
    """Sides ahead and astern of a force along one axis."""
    low, high = response.ends
    sides = []
    if high > 0.0:
        curve = _curve(actuator, response.table, max(low, 0.0), high)
        corner = np.array([[high, 0.0]])
        sides.append(Side(curve, high, corners=corner, least_share=max(low, 0.0) / high))
    if low < 0.0:
        curve = _curve(actuator, response.reverse or response.table, max(-high, 0.0), -low)
        corner = np.array([[low, 0.0]])
        sides.append(Side(curve, -low, corners=corner, least_share=max(-high, 0.0) / -low))
    return tuple(sides)


def _sides_of_plane(
    actuator: Actuator, response: Plane, shape: Shape, is_fin: bool
) -> tuple[Sides, ...]:
    """Sides of a force in a plane, and those of its convex parts, in the order of `Shape`."""
    low, high = response.ends
    center = response.sector_center
    half_angle = response.sector_half_angle
    if response.gauge is not None or half_angle == 0.0:
        curve = _curve(actuator, response.table, 0.0, response.table.largest)
        return tuple((Side(curve, shape.radius, corners=each),) for each in shape.polygons)
    is_narrow = bool(response.barred) or half_angle <= 0.5 * np.pi + HALF_TURN_TOLERANCE
    is_held = is_narrow and not is_fin and low > MIN_ASPECT * high
    least = low if is_held else 0.0
    ahead: Sides = ()
    if high > 0.0:
        curve = _curve(actuator, response.table, least, high)
        whole = Side(curve, high, center, half_angle, least_share=least / high)
        ahead = (whole,)
        if response.barred:
            ahead = tuple(_within_arc(whole, *zone) for zone in zones_of(response))
            return (ahead, *((side,) for side in ahead))
    if low < 0.0:
        curve = _curve(actuator, response.reverse or response.table, max(-high, 0.0), -low)
        least_share = max(-high, 0.0) / -low
        astern = Side(curve, -low, center + np.pi, half_angle, least_share=least_share)
        return ((*ahead, astern),)
    if shape.n_parts == 1:
        return (ahead,)
    upper = _within_arc(whole, center, center + half_angle)
    lower = _within_arc(whole, center - half_angle, center)
    return (ahead, (upper,), (lower,))


def _within_arc(side: Side, low: float, high: float) -> Side:
    """A side of a sector between two angles [rad]."""
    return replace(side, center=0.5 * (low + high), half_angle=0.5 * (high - low))


def _curve(actuator: Actuator, table: RadialTable, least: float, most: float) -> PowerCurve:
    """The power of forces from `least` to `most` [N] of an actuator, by its table."""
    price_at_most = float(np.interp(most, table.force, table.price))
    model = getattr(actuator, "model", None)
    if isinstance(model, PowerLaw):
        # c(T) = v T - c*(v) at v = c'(T) = p c(T) / T: stationary in v, so that two rounds settle
        # the watts of the law.
        for _ in range(2):
            watts = price_at_most * most - float(table.conjugate(np.array(price_at_most)))
            price_at_most = model.exponent * watts / most
        return PowerCurve(watts, model.exponent)
    return _curve_of_table(table, least, most, price_at_most)


def _curve_of_table(
    table: RadialTable, least: float, most: float, price_at_most: float
) -> PowerCurve:
    """The power of forces from `least` to `most` [N] by the prices of a table, c'(T) = v."""
    first = max(least, float(table.force[0]))
    force = first + (most - first) * np.linspace(0.0, 1.0, CURVE_KNOTS) ** 2
    price = np.interp(force, table.force, table.price)
    price[-1] = price_at_most
    least_watts = price[0] * first - float(table.conjugate(price[:1])[0])
    if first > least:
        # The tiny force that a fin cannot go below is neglected, but not what it takes.
        force = np.append(least, force)
        price = np.append(0.0, price)
    return PowerCurve.of_slopes(force / most, price * most, least_watts)
