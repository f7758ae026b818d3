"""Propellers: the law that thrusters share, and their power over the force, a power law or a convex
curve through a table of measurements."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Protocol

import numpy as np

from finlab.actuators.response import RadialTable, price_grid
from finlab.actuators.thrust_model import PowerLaw, PowerTable, ThrustModel, lower_hull, side_points
from finlab.arrays import NOTHING, AnyArray, Array


class PowerCurve(Protocol):
    """Watts over newtons, of one propeller or of n: convex, least at rest."""

    def at(self, force: AnyArray) -> tuple[AnyArray, AnyArray]:
        """Returns power [W] and marginal cost [W/N] of forces (..., n) [N]."""

    def answer(self, price: Array) -> Array:
        """Returns the forces (..., n) [N] whose marginal cost is a price [W/N]."""


class ByPower:
    """Watts that grow with a power of the force, of n propellers."""

    def __init__(self, models: Sequence[PowerLaw]) -> None:
        """Takes n models."""
        self.forward = np.array([model.forward for model in models])
        self.reverse = np.array(
            [model.forward if model.reverse is None else model.reverse for model in models]
        )
        self.exponent = np.array([model.exponent for model in models])

    def at(self, force: AnyArray) -> tuple[AnyArray, AnyArray]:
        """Returns power [W] and marginal cost [W/N] of forces (..., n) [N]."""
        slope = np.where(force < 0.0, -self.reverse, self.forward) * np.abs(force) ** (
            self.exponent - 1.0
        )
        return slope * force, self.exponent * slope

    def answer(self, price: Array) -> Array:
        """Returns the forces (..., n) [N] whose marginal cost is a price [W/N]."""
        factor = self.exponent * np.where(price < 0.0, self.reverse, self.forward)
        size: Array = (np.abs(price) / factor) ** (1.0 / (self.exponent - 1.0))
        return np.copysign(size, price)


class Curve:
    """Watts over the force's size of one side: convex, quadratic between knots, its slope from 0 at
    rest."""

    def __init__(self, size: Array, watts: Array) -> None:
        """Takes points of a convex curve, sizes [N] from 0 on, and meets each of them. The knots
        between are those of Schumaker (1983): quadratic splines that keep the shape."""
        step = np.diff(size)
        chord = np.diff(watts) / step
        slope = np.zeros_like(size)
        slope[1:-1] = (chord[:-1] * step[1:] + chord[1:] * step[:-1]) / (step[1:] + step[:-1])
        slope[-1] = max(1.5 * chord[-1] - 0.5 * slope[-2], chord[-1])
        below = chord - slope[:-1]
        above = slope[1:] - chord
        total = np.maximum(below + above, 1e-300)
        share = np.clip(np.where(above < below, above, total - below) / total, 1e-6, 1.0 - 1e-6)
        between = 2.0 * chord - slope[:-1] * share - slope[1:] * (1.0 - share)
        gaps = np.arange(1, len(size))
        self.size = np.insert(size, gaps, size[:-1] + share * step)
        """Sizes of the force [N] at the knots."""
        marginal = np.maximum.accumulate(np.maximum(np.insert(slope, gaps, between), 0.0))
        self.marginal = marginal + NOTHING * slope[-1] * self.size / size[-1]
        """Marginal cost [W/N] there."""
        gain = 0.5 * (self.marginal[1:] + self.marginal[:-1]) * np.diff(self.size)
        self.watts = watts[0] + np.insert(np.cumsum(gain), 0, 0.0)
        """Power [W] there."""

    def at(self, size: AnyArray) -> tuple[Array, Array]:
        """Returns power [W] and marginal cost [W/N] of sizes [N]; beyond the last knot on with its
        slope."""
        i = np.clip(np.searchsorted(self.size, size, "right") - 1, 0, len(self.size) - 2)
        step = size - self.size[i]
        bend = (self.marginal[i + 1] - self.marginal[i]) / (self.size[i + 1] - self.size[i])
        return self.watts[i] + step * (self.marginal[i] + 0.5 * bend * step), self.marginal[
            i
        ] + bend * step

    def answer(self, price: Array) -> Array:
        """Returns the sizes [N] that are worth most at prices [W/N] from 0 on."""
        return np.interp(price, self.marginal, self.size)


class Sides:
    """Watts over newtons of a table, forward and reverse, each side a `Curve`."""

    def __init__(self, model: PowerTable) -> None:
        """Makes the curves of the sides that the table has."""
        _, force, power = model.columns
        self.rest = float(power.min())
        """Power at rest [W]."""
        self.curves = []
        """Curves with the sign of their forces, of the sides that there are."""
        for sign in (1.0, -1.0):
            size, watts = side_points(force, power, int(sign))
            watts = np.minimum.accumulate(watts[::-1])[::-1]
            watts[0] = self.rest
            if len(size) > 1:
                self.curves.append((Curve(*lower_hull(size, watts)), sign))

    def at(self, force: AnyArray) -> tuple[Array, Array]:
        """Returns power [W] and marginal cost [W/N] of forces [N]."""
        marginal = 0.0 * force  # NaN of a lost one stays
        watts = self.rest + marginal
        for curve, sign in self.curves:
            on = force * sign > 0.0
            watts[on], slope = curve.at(sign * force[on])
            marginal[on] = sign * slope
        return watts, marginal

    def answer(self, price: Array) -> Array:
        """Returns the forces [N] that are worth most at prices [W/N]; 0 on a side that there is
        not."""
        force = np.zeros_like(price)
        for curve, sign in self.curves:
            on = price * sign > 0.0
            force[on] = sign * curve.answer(sign * price[on])
        return force


_sides_of = lru_cache(maxsize=256)(Sides)


class ThrustPower:
    """Watts over newtons, convex, of n propellers, whatever their models; those of one model
    together."""

    def __init__(self, models: Sequence[ThrustModel | PowerCurve]) -> None:
        """Takes n models, or curves themselves."""
        kinds = [None if isinstance(model, PowerLaw) else model for model in models]
        self._groups: list[tuple[AnyArray | slice, PowerCurve]] = []
        for kind in dict.fromkeys(kinds):
            own = [i for i, other in enumerate(kinds) if other == kind]
            laws = [model for model in models if isinstance(model, PowerLaw)]
            places = slice(None) if len(own) == len(models) else np.array(own)
            curve = _sides_of(kind) if isinstance(kind, PowerTable) else kind
            self._groups.append((places, ByPower(laws) if curve is None else curve))

    def watts(self, force: AnyArray) -> AnyArray:
        """Returns the power [W] of forces (..., n) [N], negative ones in reverse."""
        return self._both(force, 0)

    def marginal(self, force: AnyArray) -> AnyArray:
        """Returns its derivative [W/N] by the force."""
        return self._both(force, 1)

    def answer(self, price: Array) -> Array:
        """Returns the forces (..., n) [N] whose marginal cost is a price [W/N]."""
        force = np.empty(price.shape)
        for places, power in self._groups:
            force[..., places] = power.answer(price[..., places])
        return force

    def worth(self, price: Array, least: Array, most: Array) -> Array:
        """Returns the most [W] that forces from `least` to `most` (n,) [N] are worth at prices
        (..., n) [W/N]."""
        force = np.clip(self.answer(price), least, most)
        return np.asarray(price * force - self.watts(force))

    def _both(self, force: AnyArray, which: int) -> AnyArray:
        result: AnyArray = np.empty(np.shape(force))
        for places, power in self._groups:
            result[..., places] = power.at(force[..., places])[which]
        return result


def radial_table(
    model: ThrustModel | PowerCurve, sign: int, least: float, most: float
) -> RadialTable:
    """Returns the answer to a price forward (`sign` 1) or in reverse (-1), for sizes from `least`
    to `most` [N]."""
    own = ThrustPower([model])
    ends = np.array([[sign * least], [sign * most]])
    top = abs(float(own.marginal(ends)[1, 0]))
    if least == most:
        # The force is the same at any price, but a table needs prices.
        top = max(top, NOTHING)
    force = np.clip(sign * own.answer(sign * price_grid(top)[:, None])[:, 0], least, most)
    return RadialTable.of_forces(top, force, float(own.watts(ends)[0, 0]))
