"""Thrust curves of fins whose cheapest commands have a closed form."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces.thrust_curve import DIRECTIONS, KNOTS, _curve
from finlab.physics.energy import POWER_WEIGHTS, EnergyWeights

Array = NDArray[np.float64]
LOWER, UPPER = (0.01, 0.02, -1.0), (0.5, 2.0, 2.0)


@dataclass(frozen=True)
class PowerLaw:
    """Thrust A^p f^q (1 + turn * zero direction), so that both elasticities are constant."""

    p: float
    q: float
    turn: float = 0.0

    def force_and_slopes(self, command: Array) -> tuple[Array, Array]:
        a, f, d = command[..., 0], command[..., 1], command[..., 2]
        gain = 1.0 + self.turn * d
        thrust = a**self.p * f**self.q * gain
        slopes = np.zeros((*command.shape, 3))
        slopes[..., 0, 1], slopes[..., 1, 1] = self.p * thrust / a, self.q * thrust / f
        slopes[..., 2, 1] = a**self.p * f**self.q * self.turn
        return np.stack([0 * thrust, thrust, 0 * thrust], axis=-1), slopes


def between_corners(table: Array) -> slice:
    """Knots where no limit is met, but for some next to the corners: these average over one."""
    off = (table[:, :2] > 1.01 * np.array(LOWER[:2])) & (table[:, :2] < 0.99 * np.array(UPPER[:2]))
    free = np.flatnonzero(off.all(axis=1))
    return slice(int(free[0]) + 4, int(free[-1]) - 3)


@pytest.mark.parametrize(("p", "q"), [(2.0, 2.0), (1.0, 2.0), (3.0, 1.0)])
@pytest.mark.parametrize("weights", [(1.0, 1.0, 1.0), (2.0, 1.0, 0.5), (0.5, 1.0, 0.0), (1.0, 3.0, 2.0)])
def test_energy_and_thrust_rise_alike(p: float, q: float, weights: tuple[float, float, float]) -> None:
    """At the optimum both commands gain as much thrust per energy, wherever no limit is met."""
    w = EnergyWeights(weights[0], weights[1], 0.0, weights[2])
    law: Any = PowerLaw(p, q)
    table = _curve(law, w, LOWER, UPPER, 1)[3]
    a, f = table[:, 0] / UPPER[0], table[:, 1] / UPPER[1]
    free = between_corners(table)
    assert len(a[free]) > 10
    by_a, by_f = 2 * w.amplitude * a + w.product * f, 2 * w.frequency * f + w.product * a
    assert (by_a * a / p)[free] == pytest.approx((by_f * f / q)[free], rel=1e-6)


def test_power_takes_the_amplitude_first() -> None:
    law: Any = PowerLaw(2.0, 2.0)
    table = _curve(law, POWER_WEIGHTS, LOWER, UPPER, 1)[3]
    a, f = table[:, 0] / UPPER[0], table[:, 1] / UPPER[1]
    free = between_corners(table)
    assert (f / a)[free] == pytest.approx(0.1, rel=1e-9)
    assert table[-1, :2] == pytest.approx(UPPER[:2])


def test_the_strongest_of_all_directions_counts_and_the_weakest_is_told() -> None:
    """One that was asked alone is the nearest to zero; two are the stops; more lie evenly between them."""
    law: Any = PowerLaw(2.0, 2.0, 0.25)
    most = (UPPER[0] * UPPER[1]) ** 2
    low, high, spread, _ = _curve(law, EnergyWeights(), LOWER, UPPER, 1)
    assert (high, spread) == pytest.approx((most, 0.0))
    assert low == pytest.approx((LOWER[0] * LOWER[1]) ** 2)
    for n in (2, 3, DIRECTIONS):
        low, high, spread, table = _curve(law, EnergyWeights(), LOWER, UPPER, n)
        assert high == pytest.approx(1.5 * most) and spread == pytest.approx(0.75 * most)
        assert low == pytest.approx(1.5 * (LOWER[0] * LOWER[1]) ** 2)
        assert table.shape == (KNOTS, 3)
    for lower, upper, nearest in ((0.5, 2.0, 0.5), (-2.0, -0.5, -0.5), (-1.0, 1.0, 0.0)):
        high = _curve(law, EnergyWeights(), (*LOWER[:2], lower), (*UPPER[:2], upper), 1)[1]
        assert high == pytest.approx((1.0 + 0.25 * nearest) * most)
