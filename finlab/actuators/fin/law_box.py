"""The commands of a fin that are worth most at a price of its force, by its own law.

Amplitude A and frequency f maximize the profit `v T(A, f) - P(A, f)` within the limits. That is
searched on a grid of commands, and from its best point on by Newton's method on differences of the
law's gradients; it holds for any law, convex or not.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from finlab.actuators.law import FinLaw, PlanarLaw
from finlab.actuators.response import POINTS
from finlab.arrays import NEARLY, NOTHING, ROUNDING, ROUNDS, Array

GRID = (17, 33)
"""Amplitudes and frequencies of the first grid; half as many where directions are compared."""
PEAK = 1e-6
"""Share of the largest force that is given up where the price of the last newton has no bound."""
ANY_PRICE = 1e12
"""A price at which power does not count [W/N]."""
SHORTER_STEP = 0.2
"""Part of each step that is tried beside the whole of it."""
LEAST_PROBE = 1e-15
"""Least distance of the points of a difference, where a limit has no width [rad, Hz]."""
STEEP = 1e-3
"""Derivative of the force at the corner, over the largest force, above which it does not fall off
there [1/rad, 1/Hz]."""
PRICES_TRIED = 33
"""Prices in each search for the least one at which the force is the largest."""
SEARCHES = 5
"""Searches for that price, each between two neighbours of the last."""
NO_SIZE = 1e-300
"""Least size by which is divided."""


class Optimum(NamedTuple):
    """The commands with the largest profit at K prices."""

    command: Array
    """(K, 3) [rad, Hz, rad]."""
    profit: Array
    """Price times force, less the power (K,) [W]."""


class LawBox:
    """One fin's law within the limits of amplitude and frequency, in its strongest direction."""

    def __init__(self, law: FinLaw, lower: Array, upper: Array) -> None:
        """Takes the law and limits of the command (3,) [rad, Hz, rad]."""
        self.law = law
        self.lower = lower
        self.upper = upper
        self.zero_direction = float(np.clip(0.0, lower[2], upper[2]))
        """Zero direction at which its force is largest [rad]."""
        if not law.uniform:
            directions, force = self.all_round
            is_within = (directions >= lower[2] - NOTHING) & (directions <= upper[2] + NOTHING)
            if is_within.any():
                size = np.where(is_within, np.hypot(*force.T), -1.0)
                self.zero_direction = float(directions[size.argmax()])

    @cached_property
    def all_round(self) -> tuple[Array, Array]:
        """Zero directions (POINTS + 1,) [rad] and the largest forces across the shaft there
        (POINTS + 1, 2) [N], by a coarse grid."""
        low = self.lower[2]
        high = self.upper[2]
        if isinstance(self.law, PlanarLaw):  # a formula holds beyond the limits, too
            center = 0.5 * (low + high)
            low = center - np.pi
            high = center + np.pi
        directions = np.linspace(low, high, POINTS + 1)
        return directions, self.strongest(directions)

    def strongest(self, zero_direction: Array) -> Array:
        """Returns the largest forces across the shaft (K, 2) [N] at zero directions (K,) [rad], by
        a coarse grid."""
        grid = self.grid((GRID[0] // 2 + 1, GRID[1] // 2 + 1))
        command = np.tile(grid, (len(zero_direction), 1, 1))
        command[..., 2] = zero_direction[:, None]
        force = self.law.force(command.reshape(-1, 3)).reshape(command.shape)[..., 1:]
        best = np.hypot(force[..., 0], force[..., 1]).argmax(axis=1)
        return np.asarray(force[np.arange(len(zero_direction)), best])

    def command(self, beat: Array) -> Array:
        """Returns commands (..., 3) of amplitude and frequency (..., 2)."""
        direction = np.full((*beat.shape[:-1], 1), self.zero_direction)
        return np.concatenate([beat, direction], axis=-1)

    def force(self, command: Array) -> Array:
        """Returns the size of the force across the shaft (...) [N] of commands (..., 3)."""
        return np.asarray(np.linalg.norm(self.law.force(command)[..., 1:], axis=-1))

    def power(self, command: Array) -> Array:
        """Returns the power (...) [W] of commands (..., 3)."""
        return np.asarray(self.law.power(command))

    def profit(self, price: Array, command: Array) -> Array:
        """Returns price times force less power (...) [W], at prices (...) [W/N] of commands (...,
        3)."""
        return price * self.force(command) - self.power(command)

    def largest(self) -> float:
        """Returns the largest force within the limits [N]."""
        return float(self.force(self.best(np.array([ANY_PRICE])))[0])

    def grid(self, shape: tuple[int, int] = GRID) -> Array:
        """Returns commands (G, 3) on a grid of `shape` amplitudes and frequencies."""
        amplitude = np.linspace(self.lower[0], self.upper[0], shape[0])
        frequency = np.linspace(self.lower[1], self.upper[1], shape[1])
        beat = np.stack(np.meshgrid(amplitude, frequency, indexing="ij"), axis=-1)
        return self.command(beat.reshape(-1, 2))

    def best(self, price: Array) -> Array:
        """Returns the commands (K, 3) with the largest profit at prices (K,) [W/N]; see
        `optimum`."""
        return self.optimum(price).command

    def optimum(self, price: Array, starts: Array | None = None) -> Optimum:
        """Returns the commands with the largest profit, by Newton's method within the limits.

        Args:
            price: prices (K,) [W/N].
            starts: amplitudes and frequencies (S, K, 2) near the optimum, from the best of which
                each begins, and which end with a step that gains no more than rounding; a grid for
                all when None.
        """
        row = np.arange(len(price))
        least_gain = 0.0 if starts is None else ROUNDING
        if starts is None:
            grid = self.grid()
            profit = self.profit(price[:, None], grid)
            beat = grid[profit.argmax(axis=1), :2]
        else:
            profit = self.profit(price, self.command(starts)).T
            beat = starts[profit.argmax(axis=1), row]
        low = self.lower[:2]
        high = self.upper[:2]
        span = high - low
        longest = 2.0 * span / (np.array(GRID) - 1.0)
        best_profit = profit.max(axis=1)
        for _ in range(ROUNDS):
            gradient, hessian = self._profit_derivatives(price, beat, NEARLY * span + LEAST_PROBE)
            straight = np.clip(_uphill_steps(beat, gradient, hessian), -longest, longest)
            curved = self._steps_of_product(beat, gradient, hessian, longest)
            step = np.concatenate([straight, curved[None]])
            trial = np.clip(np.concatenate([step, SHORTER_STEP * step]) + beat, low, high)
            trial_profit = self.profit(price, self.command(trial))
            best_trial = trial_profit.argmax(axis=0)
            gain = trial_profit[best_trial, row] - best_profit
            is_better = gain > 0.0
            beat = np.where(is_better[:, None], trial[best_trial, row], beat)
            best_profit = np.where(is_better, trial_profit[best_trial, row], best_profit)
            if not (gain > least_gain * np.abs(best_profit)).any():
                break
        return Optimum(self.command(beat), best_profit)

    def _steps_of_product(
        self, beat: Array, gradient: Array, hessian: Array, longest: Array
    ) -> Array:
        """Steps (K, 2) uphill from amplitudes and frequencies (K, 2) along which their product
        stays, (A exp t, f exp -t), within the limits and no longer than `longest` (2,): the ridge
        of a fin whose force depends on the product, where a straight step leaves it."""
        with np.errstate(divide="ignore", invalid="ignore"):  # a limit, or a number, may be 0
            above = np.log(self.upper[:2] / beat)
            below = np.log(beat / self.lower[:2])
            most = np.log1p(longest / beat).min(axis=-1)
        high = np.minimum(np.minimum(above[:, 0], below[:, 1]), most)
        low = -np.minimum(np.minimum(below[:, 0], above[:, 1]), most)
        direction = beat * [1.0, -1.0]
        slope = np.einsum("ki,ki->k", direction, gradient)  # d profit / dt
        # d2 profit / dt2; the second derivative of (A exp t, f exp -t) is (A, f) itself.
        of_line = np.einsum("ki,kij,kj->k", direction, hessian, direction)
        curvature = of_line + np.einsum("ki,ki->k", beat, gradient)
        with np.errstate(all="ignore"):
            t = slope / np.where(curvature < 0.0, -curvature, np.abs(slope) + NO_SIZE)
            t = np.clip(np.nan_to_num(t, posinf=0.0, neginf=0.0), low, high)
            step = beat * np.expm1(np.stack([t, -t], axis=-1))
        return np.asarray(np.nan_to_num(step, posinf=0.0, neginf=0.0))

    def _profit_derivatives(self, price: Array, beat: Array, probe: Array) -> tuple[Array, Array]:
        """Gradient (K, 2) and Hessian (K, 2, 2) of the profit at prices (K,), by amplitude and
        frequency (K, 2); the Hessian by differences over steps `probe` (2,)."""
        base = np.where(beat + probe > self.upper[:2], beat - probe, beat)
        points = np.stack([beat, base, base + probe * [1, 0], base + probe * [0, 1]])
        gradient, at_base, by_amplitude, by_frequency = self._profit_gradient(price, points)
        with np.errstate(invalid="ignore", divide="ignore"):
            differences = np.stack([by_amplitude - at_base, by_frequency - at_base], axis=-1)
            hessian = differences / probe
        return gradient, 0.5 * (hessian + hessian.swapaxes(-1, -2))

    def _profit_gradient(self, price: Array, beat: Array) -> Array:
        """Gradient (..., K, 2) of the profit at prices (K,), by amplitude and frequency (..., K,
        2)."""
        command = self.command(beat)
        force, jacobian = self.law.force_and_jacobian(command)
        planar = force[..., 1:]
        size = np.maximum(np.linalg.norm(planar, axis=-1), NO_SIZE)
        # d|F| = F . dF / |F|
        by_beat = np.einsum("...ci,...i->...c", jacobian[..., :2, 1:], planar) / size[..., None]
        return np.asarray(price[:, None] * by_beat - self.law.power_gradient(command)[..., :2])

    def top_price(self, largest: float) -> float:
        """Returns the price [W/N] at which the fin gives its largest force [N], or all but `PEAK`
        of it where that price has no bound."""
        at_corner = self._top_price_at_corner(largest)
        if at_corner is not None:
            return at_corner
        low = NOTHING
        high = 1.0 / NOTHING
        for _ in range(SEARCHES):
            prices = np.geomspace(low, high, PRICES_TRIED)
            is_enough = self.force(self.best(prices)) >= (1.0 - PEAK) * largest
            first = int(is_enough.argmax()) if is_enough.any() else len(prices) - 1
            low = float(prices[max(first - 1, 0)])
            high = float(prices[first])
        return high

    def _top_price_at_corner(self, largest: float) -> float | None:
        """The marginal cost [W/N] at the largest amplitude and frequency, where the force is
        largest and still rises; None elsewhere."""
        corner = self.upper[None, :2]
        if float(self.force(self.command(corner))[0]) < largest * (1.0 - ROUNDING):
            return None
        moves = self.upper[:2] > self.lower[:2]
        price = np.zeros(1)
        at_no_price = self._profit_gradient(price, corner)
        marginal_force = (self._profit_gradient(price + 1.0, corner) - at_no_price)[0][moves]
        if not (marginal_force > STEEP * largest).all():
            return None
        marginal_costs = -at_no_price[0][moves] / marginal_force
        top = float(marginal_costs.max()) if len(marginal_costs) else NOTHING
        is_enough = float(self.force(self.best(np.array([top])))[0]) >= (1.0 - PEAK) * largest
        return top if is_enough else None


def _uphill_steps(beat: Array, gradient: Array, hessian: Array) -> Array:
    """Steps (3, K, 2) uphill from amplitudes and frequencies (K, 2): Newton's, and those along the
    amplitude and the frequency. A step is 0 where the profit is not concave."""
    a = hessian[:, 0, 0]
    b = hessian[:, 0, 1]
    c = hessian[:, 1, 1]
    determinant = a * c - b * b
    along_amplitude = np.broadcast_to([1.0, 0.0], beat.shape)
    along_frequency = np.broadcast_to([0.0, 1.0], beat.shape)
    steps = []
    with np.errstate(all="ignore"):
        # -H^-1 g, with the inverse of a 2 x 2 matrix
        newton = np.stack(
            [b * gradient[:, 1] - c * gradient[:, 0], b * gradient[:, 0] - a * gradient[:, 1]],
            axis=-1,
        )
        is_concave = (a < 0.0) & (determinant > 0.0)
        steps.append(np.where(is_concave[:, None], newton / determinant[:, None], 0.0))
        for direction in (along_amplitude, along_frequency):
            slope = np.einsum("ki,ki->k", direction, gradient)
            curvature = np.einsum("ki,kij,kj->k", direction, hessian, direction)
            # Where the profit is not concave along it, by 1: the step is clipped.
            length = slope / np.where(curvature < 0.0, -curvature, np.abs(slope) + NO_SIZE)
            steps.append(direction * length[:, None])
    return np.asarray(np.nan_to_num(np.stack(steps), posinf=0.0, neginf=0.0))
