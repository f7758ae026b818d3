"""What fins give at most within power budgets, from above: cone programs on the convex hulls of
what each fin can give and take, written apart from the library. Needs Clarabel, an extra of the
tests.

A fin's force y costs at least c(T) with T >= g(y), the least watts of its laws for a thrust T; g is
the length of y, of an uneven fin over its unevenness in that direction. c is convex, so that each
tangent is below it; tangents are added where an answer is cheaper than c, until none is. What a
program then says cannot be passed by any command: it lets fins rest that cannot, and that alone is
between it and the best command.
"""

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from finlab.arrays import Array
from tests.oracle_budget import ConicProgram
from tests.oracle_plant import OracleActuator, OraclePlant

ROUNDS = 40
"""Programs at most until tangents are enough."""
CHEAPER = 1e-8
"""Share of a fin's largest power, and of its force, by which an answer may be below its law."""
FIRST_TANGENTS = 12
"""Tangents to begin with."""
AMPLITUDES = 400
"""Amplitudes of a grid on which the cheapest is looked for, before it is refined."""
NEAR_LEAST = 3.0
"""Times its least thrust up to which a fin is near to it."""
STEP = 1e-5
"""Share of a thrust by which the slope of its cost is found."""


class FinCost:
    """The least watts of a fin for a thrust [N], its unevenness left out."""

    def __init__(self, fin: OracleActuator) -> None:
        self.fin = fin
        low, high = fin.limits
        self._amplitude = float(low[0]), float(high[0])
        self._frequency = float(low[1]), float(high[1])
        self.least = float(fin.thrust(low[0], low[1]))
        """Least thrust [N]."""
        self.largest = float(fin.thrust(*self._strongest))
        """Largest thrust [N]."""

    def limit(self, watts: float) -> None:
        """Takes what it gives for more than some watts out of the range, as nobody uses it."""
        if self(self.largest) <= watts or self(self.least) >= watts:
            return
        end = brentq(lambda thrust: self(thrust) / watts - 1.0, self.least, self.largest)
        self.largest = min(1.001 * float(end), self.largest)

    @cached_property
    def _strongest(self) -> tuple[float, float]:
        """Amplitude and frequency of the largest thrust."""
        amplitude = self._amplitude[1]
        frequency = self._frequency[1]
        if self.fin.model["type"] != "soft":
            return amplitude, frequency
        peak = self._peak
        if peak >= amplitude * frequency:
            return amplitude, frequency
        return amplitude, peak / amplitude

    @cached_property
    def _reach(self) -> float:
        """Amplitude times frequency of the largest thrust of a soft fin."""
        amplitude, frequency = self._strongest
        return amplitude * frequency

    @cached_property
    def _peak(self) -> float:
        """Amplitude times frequency at which a soft fin gives most."""
        p = self.fin.model.get("p", 1.0)
        q = self.fin.model.get("q", 5.0)
        x0 = self.fin.model.get("x0", 1.3)
        # of x^p / (1 + (x / x0)^q) the derivative is 0 where p (1 + z) = q z, z = (x / x0)^q
        return float(x0 * (p / (q - p)) ** (1.0 / q)) if q > p else np.inf

    def _beats(self, thrust: float) -> tuple[float, float, Callable[[Array], Array]]:
        """Range of amplitudes that give a thrust, and the frequency at each."""
        low, high = self._amplitude
        slow, fast = self._frequency
        if self.fin.model["type"] == "soft":
            most = self._reach
            least = low * slow
            reach = float(self.fin.thrust(most, 1.0))
            beat = most
            if thrust < reach:
                beat = brentq(
                    lambda x: float(self.fin.thrust(x, 1.0)) - thrust, least, most, xtol=1e-15
                )
            return max(low, beat / fast), min(high, beat / slow), lambda a: beat / a

        def frequency(amplitude: Array) -> Array:  # thrust grows with its square
            return np.sqrt(thrust / self.fin.thrust(amplitude, 1.0))

        def amplitude_at(limit: float) -> float:
            """The amplitude in the range whose frequency, which falls with it, is a limit."""
            if float(frequency(np.array(low))) <= limit:
                return low
            if float(frequency(np.array(high))) >= limit:
                return high
            root = brentq(lambda a: float(frequency(np.array(a))) - limit, low, high, xtol=1e-15)
            return float(root)

        return amplitude_at(fast), amplitude_at(slow), frequency

    def __call__(self, thrust: float) -> float:
        """Least watts of a thrust between the least and the largest one [N]."""
        low, high, frequency = self._beats(min(max(thrust, self.least), self.largest))
        high = max(low, high)

        def watts(amplitude: Array) -> Array:
            a = np.asarray(amplitude, np.float64)
            return self.fin.beating(a, frequency(a))

        grid = np.linspace(low, high, AMPLITUDES)
        power = watts(grid)
        k = int(np.argmin(power))
        around = grid[max(k - 1, 0)], grid[min(k + 1, AMPLITUDES - 1)]
        if around[1] - around[0] <= 1e-12:
            return float(power[k])
        found = minimize_scalar(watts, bounds=around, method="bounded", options={"xatol": 1e-12})
        return float(min(power[k], found.fun))

    def tangent(self, thrust: float) -> tuple[float, float, float]:
        """A thrust within the range, its watts, and the slope of these [W/N]."""
        step = STEP * self.largest
        at = min(max(thrust, self.least + step), self.largest - step)
        slope = (self(at + step) - self(at - step)) / (2.0 * step)
        return at, self(at), slope


class BudgetedFins:
    """Forces of a plant of fins, whose arcs are half a turn at most, within budgets."""

    def __init__(self, plant: OraclePlant, members: Array, watts: Array) -> None:
        self.plant = plant
        self.members = members
        self.watts = watts
        self.costs = [FinCost(fin) for fin in plant.actuators]
        for i, cost in enumerate(self.costs):
            for most in self.watts[np.flatnonzero(members[:, i])]:
                cost.limit(float(most))
        self.most_watts = np.array([cost(cost.largest) for cost in self.costs])
        self.tangents = [
            [cost.tangent(float(share) * cost.largest) for share in _shares()]
            for cost in self.costs
        ]
        self.normals = [
            [_gauge_slope(fin, angle) for angle in np.linspace(-np.pi, np.pi, 2 * FIRST_TANGENTS)]
            if _is_uneven(fin)
            else []
            for fin in plant.actuators
        ]
        self._held: list[tuple[Array, list[int], float]] = []

    def are_beyond_least(self, command: Array) -> bool:
        """Whether at a command (n, 3) no fin is near to its least thrust."""
        for fin, own_command in zip(self.plant.actuators, command, strict=True):
            cost = FinCost(fin)
            thrust = float(fin.thrust(own_command[0], own_command[1]))
            if thrust <= NEAR_LEAST * cost.least:
                return False
        return True

    def least_power(self, wrench: Array) -> float:
        """Watts that no command within the budgets undercuts which gives a wrench (6,).

        Raises:
            ValueError: there are none.
        """
        watts = self.most_watts

        def program(p: "_Program") -> dict[int, float]:
            p.give(wrench / self.plant.scales)
            return {t: float(w / watts.max()) for t, w in zip(p.power, watts, strict=True)}

        x, p = self._least(program)
        return float(sum(x[t] * w for t, w in zip(p.power, watts, strict=True)))

    def least_miss(self, wrench: Array, axes: Sequence[int] = range(6)) -> float:
        """A norm of what is missing along some axes, over the scales, that none undercuts."""
        numbers: list[int] = []

        def program(p: "_Program") -> dict[int, float]:
            numbers.append(p.miss(wrench / self.plant.scales, axes))
            return {numbers[-1]: 1.0}

        x, _ = self._least(program)
        return float(x[numbers[-1]])

    def hold(self, wrench: Array, axes: Sequence[int], most: float) -> None:
        """Allows no more to be missing along some axes from now on."""
        self._held.append((wrench / self.plant.scales, list(axes), most))

    def largest_share(self, wrench: Array) -> float:
        """A share up to 1 of a wrench, given alone, that none passes."""
        numbers: list[int] = []

        def program(p: "_Program") -> dict[int, float]:
            share = p.cones.number()
            numbers.append(share)
            for terms, target in zip(p.wrench, wrench / self.plant.scales, strict=True):
                p.cones.equal({**terms, share: -float(target)}, 0.0)
            p.cones.at_most({share: 1.0}, 1.0)
            return {share: -1.0}

        x, _ = self._least(program)
        return float(x[numbers[-1]])

    def _least(
        self, objective: Callable[["_Program"], dict[int, float]]
    ) -> tuple[Array, "_Program"]:
        """Solves, and adds tangents, until no fin is cheaper than its law."""
        for _ in range(ROUNDS):
            program = _Program(self)
            for target, axes, most in self._held:
                program.cones.at_most({program.miss(target, axes): 1.0}, most)
            x = program.cones.least(objective(program))
            if not self._add_tangents(program, x):
                return x, program
        raise ValueError("tangents are not enough")

    def _add_tangents(self, program: "_Program", x: Array) -> bool:
        """Adds tangents where fins are cheaper, or stronger, than their laws; returns whether any
        is."""
        is_any = False
        for i, (cost, fin) in enumerate(zip(self.costs, self.plant.actuators, strict=True)):
            thrust = float(x[program.thrust[i]]) * cost.largest
            watts = float(x[program.power[i]]) * self.most_watts[i]
            if cost(thrust) - watts > CHEAPER * self.most_watts[i]:
                self.tangents[i].append(cost.tangent(thrust))
                is_any = True
            along = x[program.along[i]]
            size = float(np.hypot(*along))
            if _is_uneven(fin) and size > CHEAPER:
                angle = float(np.arctan2(along[1], along[0]))
                normal = _gauge_slope(fin, angle)
                if normal @ along - thrust / cost.largest > CHEAPER:
                    self.normals[i].append(normal)
                    is_any = True
        return is_any


class _Program:
    """One cone program, whose forces are over the largest thrusts."""

    def __init__(self, fins: BudgetedFins) -> None:
        self.cones = ConicProgram()
        self.wrench: list[dict[int, float]] = [{} for _ in range(6)]
        self.along: list[list[int]] = []
        self.thrust: list[int] = []
        self.power: list[int] = []
        for i, (cost, fin) in enumerate(zip(fins.costs, fins.plant.actuators, strict=True)):
            self._fin(fin, cost, fins.tangents[i], fins.normals[i], float(fins.most_watts[i]))
            for k, column in zip(self.along[-1], fin.effectiveness.T, strict=True):
                for axis, scale in enumerate(fins.plant.scales):
                    self.wrench[axis][k] = float(cost.largest * column[axis] / scale)
        for row, most in zip(fins.members, fins.watts, strict=True):
            terms = {
                self.power[i]: float(fins.most_watts[i] / most) for i in np.flatnonzero(row > 0)
            }
            self.cones.at_most(terms, 1.0)

    def _fin(
        self,
        fin: OracleActuator,
        cost: FinCost,
        tangents: list[tuple[float, float, float]],
        normals: list[Array],
        most_watts: float,
    ) -> None:
        cones = self.cones
        along = [cones.number(), cones.number()]
        thrust = cones.number()
        power = cones.number()
        self.along.append(along)
        self.thrust.append(thrust)
        self.power.append(power)
        cones.at_most({thrust: 1.0}, 1.0)
        cones.at_most({thrust: -1.0}, -cost.least / cost.largest)
        for at, watts, slope in tangents:
            cones.at_most(
                {thrust: slope * cost.largest / most_watts, power: -1.0},
                (slope * at - watts) / most_watts,
            )
        if not _is_uneven(fin):
            cones.norm_at_most(thrust, [({k: 1.0}, 0.0) for k in along])
        for normal in normals:
            cones.at_most({along[0]: normal[0], along[1]: normal[1], thrust: -1.0}, 0.0)
        if not fin.turns_fully:
            low, high = fin.limits
            a = float(low[2]) + fin.lean
            b = float(high[2]) + fin.lean
            if b - a > np.pi:
                raise ValueError("expected arcs of half a turn at most")
            cones.at_most({along[0]: np.sin(a), along[1]: -np.cos(a)}, 0.0)
            cones.at_most({along[0]: -np.sin(b), along[1]: np.cos(b)}, 0.0)

    def give(self, target: Array) -> None:
        """Asks for a wrench (6,), over the scales."""
        for terms, value in zip(self.wrench, target, strict=True):
            self.cones.equal(terms, float(value))

    def miss(self, target: Array, axes: Sequence[int]) -> int:
        """The norm of what is missing of a wrench (6,) along some axes, over the scales."""
        miss = self.cones.number()
        parts = [
            ({k: -v for k, v in self.wrench[axis].items()}, float(target[axis])) for axis in axes
        ]
        self.cones.norm_at_most(miss, parts)
        return miss


def _shares() -> Array:
    """Shares of the largest thrust at the first tangents."""
    return np.linspace(0.0, 1.0, FIRST_TANGENTS) ** 2


def _is_uneven(fin: OracleActuator) -> bool:
    """Whether the thrust of a fin depends on its direction."""
    return fin.model["type"] == "soft" and fin.model.get("e", 0.0) != 0.0


def _gauge_slope(fin: OracleActuator, angle: float) -> Array:
    """Gradient (2,) of g(y) = |y| / u at an angle [rad] of the force, u the unevenness there: a
    tangent of g, which is convex."""
    u = float(fin.unevenness(angle - fin.lean))
    e = fin.model.get("e", 0.0)
    rise = -e * np.sin(angle - fin.lean - fin.model.get("phi_e", 0.0))  # du / d angle
    outward = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-np.sin(angle), np.cos(angle)])
    return np.asarray(outward / u - rise / u**2 * across)
