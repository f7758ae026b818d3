"""Lower bounds of the power within power budgets by weak duality (Eq. 28).

An answer has multipliers lambda of its wrench in units of the power itself, in which buses share a
price; the prices mu_b = 1 + zeta_b of their budgets are found here, for any of which

    g = lambda.w - sum over b of (mu_b c*_b(B'lambda / mu_b) + (mu_b - 1) P_b)

is a bound, c*_b being the sum of the conjugates of a bus and mu 1 without one. Where lambda = t l
along given multipliers l, the best mu_b is the larger one of 1 and t r_b, with r_b that at which a
bus takes what it has, and g is concave in t.
"""

from collections.abc import Callable

import numpy as np

from finlab.allocation.dual.bound import conjugates_by_laws
from finlab.allocation.dual.compiled import Compiled
from finlab.arrays import ROUNDING, Array
from finlab.core.calls import Conditions

CANDIDATES = 48
"""Numbers that a round of a search tries."""
ROUNDS = 6
"""Rounds of a search, each between the neighbours of the best number of the one before."""
LARGEST_FACTOR = 1e9
"""Of prices, over those of an answer: a miss costs `MISS_COST` times the power."""


def bounds_within_budgets(
    compiled: Compiled, wrench: Array, multipliers: Array, conditions: Conditions
) -> Array:
    """Returns lower bounds of the power within budgets, with conjugates by the laws.

    Args:
        compiled: the robot.
        wrench: (N, 6) [N, N m] that is given.
        multipliers: lambda (N, 6) [W/N, W/(N m)]; any prove a bound.
        conditions: what holds of the robot, with its budget.

    Returns:
        Power (N,) [W] that no answer undercuts which gives these wrenches within the budgets.
    """
    pairs = zip(wrench, multipliers, strict=True)
    return np.array([_BusDual(compiled, w, each, conditions).bound() for w, each in pairs])


class _BusDual:
    """The dual of one answer, by the prices of its buses."""

    def __init__(
        self, compiled: Compiled, wrench: Array, multipliers: Array, conditions: Conditions
    ) -> None:
        budget = conditions.budget
        assert budget is not None
        buses = int(budget["buses"][0])
        bus_of = budget["bus_of"][0, : compiled.core.n]
        self._compiled = compiled
        # What turning costs is no power, and is not made dearer: it counts as nothing.
        self._conditions = conditions._replace(calm=0.0, budget=None)
        self._multipliers = np.where(np.isfinite(multipliers), multipliers, 0.0)
        works = np.ones(len(bus_of), bool) if conditions.lost is None else ~conditions.lost
        offset = compiled.wrench_offset
        if conditions.lost is not None:
            offset = compiled.wrench_offset_of(works)
        self._paid = float(self._multipliers @ (wrench - offset))
        self._watts = budget["watts"][0, :buses]
        self._members = np.array([(bus_of == b + 1) & works for b in range(buses)])
        self._unfed = (bus_of == 0) & works

    def bound(self) -> float:
        """The largest bound along the multipliers [W]."""
        buses = len(self._watts)
        end = np.log(LARGEST_FACTOR)
        ends = np.full(buses, end)
        ratio = np.exp(_argmax(self._profit_of_budgets, -ends, ends))  # r_b

        def dual(log_size: Array) -> Array:
            return self._dual(np.exp(log_size[0]), ratio)[None]

        log_size = _argmax(dual, np.array([-end]), np.array([end]))
        return float(self._dual(np.exp(log_size), ratio)[0])

    def _conjugates(self, factor: Array) -> Array:
        """Conjugates (k, m, n) [W] at the multipliers times factors (k, m)."""
        rows = (factor[..., None] * self._multipliers).reshape(-1, 6)
        conjugate = conjugates_by_laws(self._compiled, rows, self._conditions)
        return conjugate.reshape(*factor.shape, -1)

    def _profit_of_budgets(self, log_ratio: Array) -> Array:
        """- r_b c*_b(B'l / r_b) - r_b P_b (b, m) [W] at logarithms of r (b, m)."""
        ratio = np.exp(log_ratio)
        conjugate = self._conjugates(1.0 / ratio)
        of_bus = np.einsum("bmn,bn->bm", conjugate, self._members)
        return np.asarray(-ratio * (of_bus + self._watts[:, None]))

    def _dual(self, size: Array, ratio: Array) -> Array:
        """g (m,) [W] at sizes t (m,), less its rounding."""
        mu = np.maximum(1.0, size[None] * ratio[:, None])
        seen = np.concatenate([size[None] / mu, size[None]])  # t / mu_b, and t without a bus
        conjugate = self._conjugates(seen)
        dear = mu * np.einsum("bmn,bn->bm", conjugate[:-1], self._members)
        bought = (mu - 1.0) * self._watts[:, None]
        usual = conjugate[-1] @ self._unfed
        paid = size * self._paid
        costs = np.concatenate([dear, bought, usual[None]])
        rounding = ROUNDING * (np.abs(paid) + np.abs(costs).sum(axis=0))
        return np.asarray(paid - costs.sum(axis=0) - rounding)


def _argmax(score: Callable[[Array], Array], low: Array, high: Array) -> Array:
    """The numbers (k,) between two ends (k,) at which scores (k, m) of numbers (k, m), each with
    one peak, are largest."""
    for _ in range(ROUNDS):
        tried = np.linspace(low, high, CANDIDATES, axis=1)
        best = score(tried).argmax(axis=1)
        rows = np.arange(len(low))
        low = tried[rows, np.maximum(best - 1, 0)]
        high = tried[rows, np.minimum(best + 1, CANDIDATES - 1)]
        found = tried[rows, best]
    return np.asarray(found)
