"""The paper's SQP and U-CAT's on-board law beside SLSQP, optimality conditions and a formula by hand."""

import math

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.baselines.linear import PaperSqp, PaperSqpSettings, box_qp
from finlab.allocation.yardstick import yardstick
from finlab.layout import Fin, Layout, load_layout, random_layout
from finlab.physics import plant_of


def targets_of(layout: Layout, count: int, seed: int) -> np.ndarray:
    plant = plant_of(layout)
    return plant.wrench(plant.sample(np.random.default_rng(seed), (count,)))


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_the_papers_sqp_is_as_exact_as_slsqp_where_wrenches_can_be_had(name: str) -> None:
    layout = load_layout(name)
    targets = targets_of(layout, 6, 17)
    for method in ("paper_sqp", "sqp"):
        answer = Allocator(layout, method, time_limit_s=60.0).allocate_batch(targets)
        assert answer.reachable.all() and answer.err_norm.max() < 2e-6, method


@pytest.mark.parametrize("reach", [1.0, 6.0])
@pytest.mark.parametrize("seed", range(4))
def test_a_descent_never_goes_up_nor_out(seed: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    layout = random_layout(rng, limits="varied")
    method, plant = PaperSqp(layout, PaperSqpSettings(), yardstick(layout)), plant_of(layout)
    target = reach * targets_of(layout, 1, seed)[0]
    end, errors = method.descent(target, plant.sample(rng, (1,))[0])
    assert len(errors) > 2 and (np.diff(errors) <= 0.0).all()
    missing = (plant.wrench(end) - target) / method.sigma
    assert errors[-1] == pytest.approx(missing @ missing, rel=1e-9, abs=1e-15)
    assert (end >= layout.lower).all() and (end <= layout.upper).all()


def test_a_box_qp_meets_its_optimality_conditions() -> None:
    rng = np.random.default_rng(3)
    held = 0
    for _ in range(20):
        matrix, wanted = rng.normal(size=(6, 9)), 4.0 * rng.normal(size=6)
        low, high = -rng.uniform(0.0, 1.0, 9), rng.uniform(0.1, 1.0, 9)
        x = box_qp(matrix, wanted, 0.1, low, high)
        pull = -(matrix.T @ (matrix @ x - wanted) + 0.1 * x)  # downhill
        at_low, at_high = np.isclose(x, low, atol=1e-12), np.isclose(x, high, atol=1e-12)
        held += int(at_low.sum() + at_high.sum())
        np.testing.assert_allclose(pull[~at_low & ~at_high], 0.0, atol=1e-8)
        assert (pull[at_low] <= 1e-8).all() and (pull[at_high] >= -1e-8).all()
    assert held > 20


@pytest.mark.parametrize("frequency", [1.1, 2.1])
def test_on_board_the_force_sets_amplitude_and_direction(frequency: float) -> None:
    layout = Layout("one", (Fin("fin", (0.0, 0.0, 0.0), 0.0),))  # pushes along y and z
    allocator = Allocator(layout, "fixed_frequency", frequency=frequency)
    for force, angle in ((0.3, 2.5), (0.9, -1.0), (1.5, 0.4)):
        target = [0.0, force * math.cos(angle), force * math.sin(angle), 0.0, 0.0, 0.0]
        most = 2.0 * 1000.0 * 0.15 * 0.02 * 0.1**2 * (2.0 * math.pi * frequency) ** 2
        amplitude = 0.5 * math.acos(1.0 - force / most)
        np.testing.assert_allclose(
            allocator.allocate(target).command[0], [amplitude, frequency, angle], atol=2e-4
        )
    np.testing.assert_allclose(
        allocator.allocate([0.0, 1e-3, 0.0, 0.0, 0.0, 0.0]).command[0, :2], [0.05, 0.1]
    )


def test_on_board_all_forces_are_scaled_down_together() -> None:
    layout = load_layout("A")
    targets = 40.0 * targets_of(layout, 10, 5)
    answer = Allocator(layout, "fixed_frequency").allocate_batch(targets)
    assert set(np.unique(answer.command[..., 1])) <= {0.1, 2.1}
    cosine = np.einsum("ni,ni->n", answer.wrench, targets)
    cosine /= np.linalg.norm(answer.wrench, axis=1) * np.linalg.norm(targets, axis=1)
    assert (cosine > 0.999).all() and (answer.err_norm > 0.1).all()
    np.testing.assert_allclose(answer.command[..., 0].max(axis=1), 0.6, atol=1e-3)
