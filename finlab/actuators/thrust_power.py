"""Power of propellers over their force, as functions of arrays: power laws, and convex curves
through tables of measurements; and their response to a price (Eq. 5), as a table.

`finlab.actuators.thrust_model` has what a layout file says; the laws and groups of thrusters and of
turning ones, and the rudder's, use what is here.
"""

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from finlab.actuators.response import RadialTable, price_grid
from finlab.actuators.thrust_model import PowerLaw, PowerTable, ThrustModel, lower_hull, side_points
from finlab.arrays import NOTHING, AnyArray, Array

LEAST_SHARE = 1e-6
"""Least distance of an inserted knot from its neighbours, over their distance [1]."""
LEAST_RISE = 1e-300
"""Least rise of a slope between two points, so that equal slopes divide by no zero [W/N]."""


class PowerCurve(Protocol):
    """Power over force, of one propeller or of n: convex, least at rest."""

    def power_and_marginal_cost(self, force: AnyArray) -> tuple[AnyArray, AnyArray]:
        """Returns the power (..., n) [W] of forces (..., n) [N], and its derivative by the force,
        the marginal cost (..., n) [W/N]."""

    def response(self, price: Array) -> Array:
        """Returns the forces (..., n) [N] whose marginal cost is a price (..., n) [W/N]."""


class PowerLaws:
    """Power laws of n propellers, P = c |F|^e."""

    def __init__(self, models: Sequence[PowerLaw]) -> None:
        """Takes n models."""
        forward = []
        reverse = []
        for model in models:
            forward.append(model.forward)
            reverse.append(model.forward if model.reverse is None else model.reverse)
        self.forward = np.array(forward)
        self.reverse = np.array(reverse)
        self.exponent = np.array([model.exponent for model in models])

    def power_and_marginal_cost(self, force: AnyArray) -> tuple[AnyArray, AnyArray]:
        """See `PowerCurve`: c |F|^e, and its derivative e c |F|^(e - 1) with the sign of F."""
        factor = np.where(force < 0.0, -self.reverse, self.forward)
        power_over_force = factor * np.abs(force) ** (self.exponent - 1.0)
        return power_over_force * force, self.exponent * power_over_force

    def response(self, price: Array) -> Array:
        """See `PowerCurve`: the inverse of the marginal cost, (|v| / (e c))^(1 / (e - 1))."""
        factor = self.exponent * np.where(price < 0.0, self.reverse, self.forward)
        size: Array = (np.abs(price) / factor) ** (1.0 / (self.exponent - 1.0))
        return np.copysign(size, price)


class ConvexCurve:
    """Power over the force's size through the points of one side of a table: convex, quadratic
    between knots, with slope 0 at rest (Schumaker, 1983)."""

    def __init__(self, size: Array, power: Array) -> None:
        """Places the knots of a quadratic spline that keeps the points' shape.

        Args:
            size: sizes of the force (K,) [N], rising from 0.
            power: power (K,) [W] at each, convex.
        """
        step = np.diff(size)
        chord = np.diff(power) / step
        slope = np.zeros_like(size)
        slope[1:-1] = (chord[:-1] * step[1:] + chord[1:] * step[:-1]) / (step[1:] + step[:-1])
        # At the last point as if the chord's slope were met in the middle of a parabola.
        slope[-1] = max(1.5 * chord[-1] - 0.5 * slope[-2], chord[-1])

        # One knot is inserted in each interval, where both its parabolas can have the slopes at
        # the interval's ends.
        rise_before = chord - slope[:-1]
        rise_after = slope[1:] - chord
        rise = np.maximum(rise_before + rise_after, LEAST_RISE)
        first_part = np.where(rise_before < rise_after, rise_after, rise - rise_before)
        share = np.clip(first_part / rise, LEAST_SHARE, 1.0 - LEAST_SHARE)
        slope_between = 2.0 * chord - slope[:-1] * share - slope[1:] * (1.0 - share)
        after_each = np.arange(1, len(size))
        self.size = np.insert(size, after_each, size[:-1] + share * step)
        """Sizes of the force at the knots (2 K - 1,) [N]."""
        marginal_cost = np.insert(slope, after_each, slope_between)
        marginal_cost = np.maximum.accumulate(np.maximum(marginal_cost, 0.0))
        # A little steeper, so that each price has one answer.
        self.marginal_cost = marginal_cost + NOTHING * slope[-1] * self.size / size[-1]
        """Marginal cost there [W/N]."""
        gain = 0.5 * (self.marginal_cost[1:] + self.marginal_cost[:-1]) * np.diff(self.size)
        self.power = power[0] + np.insert(np.cumsum(gain), 0, 0.0)
        """Power there [W]."""

    def power_and_marginal_cost(self, size: AnyArray) -> tuple[Array, Array]:
        """See `PowerCurve`, for sizes of the force; beyond the last knot the last parabola goes
        on."""
        i = np.clip(np.searchsorted(self.size, size, "right") - 1, 0, len(self.size) - 2)
        step = size - self.size[i]
        rise = self.marginal_cost[i + 1] - self.marginal_cost[i]
        curvature = rise / (self.size[i + 1] - self.size[i])
        power = self.power[i] + step * (self.marginal_cost[i] + 0.5 * curvature * step)
        return power, self.marginal_cost[i] + curvature * step

    def response(self, price: Array) -> Array:
        """See `PowerCurve`: sizes of the force at prices from 0 on."""
        return np.interp(price, self.marginal_cost, self.size)


class Side(NamedTuple):
    """One side of a table, forward or reverse."""

    curve: ConvexCurve
    """Power over the size of its forces."""
    sign: float
    """Sign of its forces."""


class TableCurves:
    """Power over force of a table: forward and reverse, each a `ConvexCurve`."""

    def __init__(self, model: PowerTable) -> None:
        """Makes the curves of the sides that the table has."""
        _, force, power = model.columns
        self.power_at_rest = float(power.min())
        """Power at rest [W]."""
        self.sides: list[Side] = []
        for sign in (1.0, -1.0):
            size, side_power = side_points(force, power, int(sign))
            side_power = np.minimum.accumulate(side_power[::-1])[::-1]
            side_power[0] = self.power_at_rest
            if len(size) > 1:
                self.sides.append(Side(ConvexCurve(*lower_hull(size, side_power)), sign))

    @cached_property
    def knots(self) -> Array:
        """How many knots there are, K, then at K rising forces these [N], powers [W] and marginal
        costs [W/N], which are linear between."""
        columns = [np.array([[0.0], [self.power_at_rest], [0.0]])]
        for curve, sign in self.sides:
            side = np.stack([sign * curve.size, curve.power, sign * curve.marginal_cost])[:, 1:]
            columns = [*columns, side] if sign > 0.0 else [side[:, ::-1], *columns]
        knots = np.concatenate(columns, axis=1)
        return np.concatenate([[knots.shape[1]], *knots])

    def power_and_marginal_cost(self, force: AnyArray) -> tuple[Array, Array]:
        """See `PowerCurve`."""
        marginal_cost = 0.0 * force  # keeps the NaN of a lost actuator
        power = self.power_at_rest + marginal_cost
        for curve, sign in self.sides:
            is_here = force * sign > 0.0
            power[is_here], slope = curve.power_and_marginal_cost(sign * force[is_here])
            marginal_cost[is_here] = sign * slope
        return power, marginal_cost

    def response(self, price: Array) -> Array:
        """See `PowerCurve`; 0 for prices of a side that the table does not have."""
        force = np.zeros_like(price)
        for curve, sign in self.sides:
            is_here = price * sign > 0.0
            force[is_here] = sign * curve.response(sign * price[is_here])
        return force


_curves_of = lru_cache(maxsize=256)(TableCurves)


class ThrustPower:
    """Power over force, convex, of n propellers, whatever their models; those with the same model
    are evaluated together."""

    def __init__(self, models: Sequence[ThrustModel | PowerCurve]) -> None:
        """Takes n models, or curves themselves."""
        self._n = len(models)
        self._models = models
        power_laws = [model for model in models if isinstance(model, PowerLaw)]
        # All power laws are one group, equal tables and curves one each.
        keys = [None if isinstance(model, PowerLaw) else model for model in models]
        self._groups: list[tuple[AnyArray | slice, PowerCurve]] = []
        for key in dict.fromkeys(keys):
            own = [i for i, other in enumerate(keys) if other == key]
            indices = slice(None) if len(own) == len(models) else np.array(own)
            curve: PowerCurve
            if key is None:
                curve = PowerLaws(power_laws)
            elif isinstance(key, PowerTable):
                curve = _curves_of(key)
            else:
                curve = key
            self._groups.append((indices, curve))

    @property
    def power_laws(self) -> PowerLaws | None:
        """The power laws of all n propellers; None where one has another model."""
        _, curve = self._groups[0]
        is_only_group = len(self._groups) == 1
        return curve if is_only_group and isinstance(curve, PowerLaws) else None

    def measured(self) -> tuple[PowerLaws, list[Array | None]] | None:
        """Returns the power laws of all n propellers, any of those that were measured, and the
        curves of these, see `TableCurves.knots`; None where a curve is of another kind."""
        laws = [PowerLaw(1.0)] * self._n
        curves: list[Array | None] = [None] * self._n
        for indices, curve in self._groups:
            for i in np.arange(self._n)[indices]:
                if isinstance(curve, TableCurves):
                    curves[i] = curve.knots
                elif isinstance(curve, PowerLaws):
                    laws[i] = self._models[i]
                else:
                    return None
        return PowerLaws(laws), curves

    def watts(self, force: AnyArray) -> AnyArray:
        """Returns the power (..., n) [W] of forces (..., n) [N], negative ones in reverse."""
        power: AnyArray = np.empty(np.shape(force))
        for indices, curve in self._groups:
            power[..., indices], _ = curve.power_and_marginal_cost(force[..., indices])
        return power

    def marginal(self, force: AnyArray) -> AnyArray:
        """Returns the derivative (..., n) [W/N] of the power by forces (..., n) [N]."""
        marginal_cost: AnyArray = np.empty(np.shape(force))
        for indices, curve in self._groups:
            _, marginal_cost[..., indices] = curve.power_and_marginal_cost(force[..., indices])
        return marginal_cost

    def response(self, price: Array) -> Array:
        """Returns the forces (..., n) [N] whose marginal cost is a price (..., n) [W/N]."""
        force = np.empty(price.shape)
        for indices, curve in self._groups:
            force[..., indices] = curve.response(price[..., indices])
        return force

    def conjugate(self, price: Array, least: Array, most: Array) -> Array:
        """Returns the convex conjugate of the power over an interval of forces (Eq. 4).

        Args:
            price: prices of the force (..., n) [W/N].
            least: least force (n,) [N].
            most: largest force (n,) [N].

        Returns:
            max v F - P(F) over the interval (..., n) [W].
        """
        force = np.clip(self.response(price), least, most)
        return np.asarray(price * force - self.watts(force))


@lru_cache(maxsize=256)
def radial_table(
    model: ThrustModel | PowerCurve, sign: int, least: float, most: float
) -> RadialTable:
    """Returns the response of one propeller to a price, in one sense, as a table; of equal
    propellers the same one, from a cache.

    Args:
        model: its power over the force.
        sign: 1 forward, -1 in reverse.
        least: least size of the force [N].
        most: largest size of the force [N].
    """
    power = ThrustPower([model])
    ends = np.array([[sign * least], [sign * most]])
    top = abs(float(power.marginal(ends)[1, 0]))
    if least == most:
        # The force is the same at any price, but a table needs prices.
        top = max(top, NOTHING)
    response = sign * power.response(sign * price_grid(top)[:, None])[:, 0]
    force = np.clip(response, least, most)
    return RadialTable.of_forces(top, force, float(power.watts(ends)[0, 0]))
