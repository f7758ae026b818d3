"""`robust`: watts and the expected squared miss together, against SciPy and by their figures."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from finlab.actuators.response import RadialTable, price_grid
from finlab.allocation import Allocator
from finlab.allocation.allocation import BatchAllocation
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.layout import Layout, Uncertainty, load_layout
from finlab.physics import plant_of
from tests.random_robots import load, random_flow, random_robot

HEAVY = load_layout("bluerov2_heavy")
"""Eight thrusters, to whose forces the tests give standard deviations."""


def doubtful(layout: Layout, shares: Array) -> Layout:
    """The robot with actuators that err by shares (n,) of their forces, each by itself."""
    parts = zip(layout.actuators, shares, strict=True)
    return replace(
        layout,
        actuators=tuple(replace(part, uncertainty=Uncertainty(float(s))) for part, s in parts),
    )


def total(answer: BatchAllocation, robust: float) -> Array:
    """What `robust` keeps least (N,) [W]."""
    return np.asarray(answer.power + robust * (answer.expected_error / 0.01) ** 2)


def test_a_table_with_a_square_answers_as_the_cost_says() -> None:
    table = RadialTable.of_forces(3.0, 2.0 + 5.0 * (price_grid(3.0) / 3.0) ** 2, 0.0)
    weight = 0.4
    dearer = table.with_square(weight)
    force = np.linspace(2.0, 7.0, 20_001)
    cost = 2.0 * (force - 2.0) ** 1.5 / np.sqrt(5.0) + weight * force**2
    for price, found in zip(price_grid(dearer.price_max)[::64], dearer.force[::64], strict=True):
        best = force[np.argmax(price * force - cost)]
        assert abs(found - best) < 1e-3, price
    assert (
        dearer.power_at_least == table.power_at_least + weight * 4.0
        and dearer.largest == table.largest
    )


@pytest.mark.parametrize("robust", [1.0, 30.0])
def test_thrusters_answer_as_scipy_does(robust: float) -> None:
    layout = doubtful(HEAVY, np.array([0.3, *7 * [0.03]]))
    plant = plant_of(layout)
    allocator = Allocator(layout, robust=robust)
    rows = plant.effectiveness[:, 0] / (0.01 * allocator.scale)
    weight = robust * np.array([0.3, *7 * [0.03]]) ** 2 * (rows**2).sum(axis=1)
    rng = np.random.default_rng(4)
    targets = 0.4 * plant.wrench(plant.sample(rng, (5,)))
    answers = allocator.allocate_batch(targets)
    for target, answer in zip(targets, total(answers, robust), strict=True):

        def value(force: Array) -> float:
            command = np.pad(force[:, None], ((0, 0), (0, 2)))
            return float(plant.power(command).sum() + weight @ force**2)

        def missing(force: Array, target: Array = target) -> Array:
            return np.asarray((force @ plant.effectiveness[:, 0] - target) / allocator.scale)

        ends = list(zip(layout.lower[:, 0], layout.upper[:, 0], strict=True))
        start = np.linalg.lstsq(plant.effectiveness[:, 0].T, target)[0]
        constraint = {"type": "eq", "fun": missing}
        best = minimize(
            value, start, bounds=ends, constraints=constraint, method="SLSQP", tol=1e-10
        )
        assert answer <= best.fun * (1.0 + 1e-4)


@pytest.mark.parametrize("kind", ["azimuths", "fins any shaft", "fins uneven", "mixed", "rudders"])
def test_no_price_of_doubt_is_better_by_its_own_measure_than_the_one_asked_for(kind: str) -> None:
    layout = load(random_robot(kind, 2, 6))
    flow = random_flow(kind, 2, 6)
    rng = np.random.default_rng(8)
    layout = doubtful(layout, 10.0 ** rng.uniform(-2.0, -0.5, layout.n))
    plant = plant_of(layout).at(flow)
    targets = 0.4 * plant.wrench(plant.sample(rng, (12,)))
    prices = (0.0, 1.0, 10.0, 100.0)
    answers = [
        Allocator(layout, robust=price).allocate_batch(targets, flow=flow) for price in prices
    ]
    within = np.all([answer.reachable for answer in answers], axis=0)
    assert within.sum() >= 6
    # Fins that are not alike all round count by their mean; drag errs, too, and has more than one
    # valley.
    slack = {"fins uneven": 1.02, "rudders": 1.5}.get(kind, 1.001)
    for price, own in zip(prices, answers, strict=True):
        least = np.min([total(other, price) for other in answers], axis=0)
        assert (total(own, price)[within] <= least[within] * slack + 1e-9).all(), price
        assert np.median(total(own, price)[within] / least[within]) < 1.001
    assert answers[-1].expected_error[within].sum() < answers[0].expected_error[within].sum()


@pytest.mark.parametrize("worst", [0, 3, 6])
def test_one_doubtful_thruster_costs_few_watts_to_avoid(worst: int) -> None:
    shares = np.full(8, 0.03)
    shares[worst] = 0.3
    layout = doubtful(HEAVY, shares)
    rng = np.random.default_rng(worst)
    least = Allocator(layout)
    trusted = Allocator(layout, robust=5.0)
    directions = rng.standard_normal((60, 6)) * least.scale
    rim = least.allocate_batch(100.0 * directions, policy="direction").wrench
    targets = rng.uniform(0.2, 0.6, (60, 1)) * rim
    cheap = least.allocate_batch(targets)
    sure = trusted.allocate_batch(targets)
    assert sure.err_norm.max() < 1e-6 and sure.bound is None
    miss = [np.sqrt(np.mean(answer.expected_error**2)) for answer in (cheap, sure)]
    assert miss[1] < 0.8 * miss[0]
    assert sure.power.sum() < 1.07 * cheap.power.sum()


def test_without_uncertainty_answers_are_what_they_were() -> None:
    targets = np.random.default_rng(3).normal(0.0, 20.0, (20, 6))
    answers = [
        Allocator(layout, robust=robust).allocate_batch(targets)
        for layout, robust in ((HEAVY, 0.0), (HEAVY, 9.0), (doubtful(HEAVY, np.full(8, 0.1)), 0.0))
    ]
    for other in answers[1:]:
        np.testing.assert_array_equal(other.command, answers[0].command)
        np.testing.assert_array_equal(other.bound, answers[0].bound)


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(AllocationError, match="robust: expected a number from 0 to"):
        Allocator(HEAVY, robust=-1.0)
