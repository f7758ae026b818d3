"""Every model-based method on small problems with known answers, at its limits and on degenerate
layouts."""

import math
from typing import Any

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.baselines.linear import PaperSqp, PaperSqpSettings, box_qp
from finlab.allocation.question import MethodQuestion
from finlab.errors import LayoutError
from finlab.files.checkpoint_config import WrenchNormalization
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout
from finlab.physics import Plant, plant_of
from finlab.physics.objective import wrench_scale_of
from finlab.research.random_layouts import random_layout
from tests.allocator_cache import AllocatorCache, normalized_error

NORMALIZATION = WrenchNormalization(np.zeros(6), np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35]))
"""Scale of errors in the six axes [N, N m]."""
METHODS_THAT_SERVE_EXACTLY = ("analytic", "sqp", "ipopt")
"""Methods that have no error left on a wrench within reach."""
METHODS = (*METHODS_THAT_SERVE_EXACTLY, "qp")
"""The model-based methods; `qp` works on a linear model and stays near."""
THRUST = 4.737410112522892
"""Thrust of the default fin over f^2 sin^2(A) [N s^2]."""


def make(method: str, **aim: Any) -> AllocatorCache:
    """A method, the slow ones with few starts."""
    if method == "ipopt":
        pytest.importorskip("casadi", reason="method ipopt is an optional extra")
        return AllocatorCache(method, n_starts=4, **aim)
    return AllocatorCache(method, **aim)


def one_fin(**changes: object) -> Layout:
    """A fin at the origin whose shaft points forward: it pushes along y and z and turns nothing."""
    return Layout("one", (Fin("fin", (0.0, 0.0, 0.0), 0.0, **changes),))  # type: ignore[arg-type]


def is_within_limits(command: np.ndarray, layout: Layout) -> bool:
    """Whether commands (..., n, 3) are finite and within the limits of a robot."""
    lower = layout.lower
    upper = layout.upper
    return bool(
        np.isfinite(command).all() and (command >= lower).all() and (command <= upper).all()
    )


@pytest.mark.parametrize("method", METHODS_THAT_SERVE_EXACTLY)
@pytest.mark.parametrize("direction", [0.0, math.pi / 2, 2.5, -1.0])
def test_one_fin_pushes_where_it_is_asked(method: str, direction: float) -> None:
    target = [0.0, 1.5 * math.cos(direction), 1.5 * math.sin(direction), 0.0, 0.0, 0.0]
    result = make(method).allocate(one_fin(), target)
    amplitude, frequency, zero_direction = result.command[0]
    assert THRUST * (frequency * math.sin(amplitude)) ** 2 == pytest.approx(1.5, abs=2e-3)
    assert math.remainder(zero_direction - direction, 2 * math.pi) == pytest.approx(0.0, abs=2e-3)
    assert result.err_norm < 2e-4


@pytest.mark.parametrize("method", METHODS)
def test_asked_too_much_one_fin_gives_all_it_has(method: str) -> None:
    command = make(method).allocate(one_fin(), [0.0, 50.0, 0.0, 0.0, 0.0, 0.0]).command[0]
    np.testing.assert_allclose(command, [0.6, 2.1, 0.0], atol=1e-3)


@pytest.mark.parametrize("method", METHODS_THAT_SERVE_EXACTLY)
def test_two_fins_turn_the_robot(method: str) -> None:
    layout = Layout(
        "pair",
        (Fin("left", (0.0, 0.2, 0.0), math.pi / 2), Fin("right", (0.0, -0.2, 0.0), -math.pi / 2)),
    )
    result = make(method).allocate(layout, [0.0, 0.0, 0.0, 0.0, 0.0, 0.4])
    # Each gives 1 N: the left one backward, the right one forward. Shafts point outwards, so that a
    # positive zero direction 0 pushes the left fin backward and the right one forward.
    np.testing.assert_allclose(
        Plant(layout).body_forces(result.command), [[-1, 0, 0], [1, 0, 0]], atol=3e-3
    )


@pytest.mark.parametrize("method", METHODS_THAT_SERVE_EXACTLY)
def test_every_reachable_target_is_met(method: str) -> None:
    layout = random_layout(np.random.default_rng(3), n_fins=4)
    command = np.random.default_rng(4).uniform([0.05, 0.1, -3], [0.6, 2.1, 3], (3, 4, 3))
    targets = Plant(layout).wrench(command)
    answer = make(method).allocate_batch(layout, targets)
    assert (
        normalized_error(NORMALIZATION, Plant(layout).wrench(answer.command), targets).max() < 5e-3
    )


def test_qp_returns_its_reference_where_that_is_the_answer() -> None:
    layout = random_layout(np.random.default_rng(1), n_fins=3)
    reference = np.tile([0.325, 1.1, 0.0], (3, 1))
    result = make("qp").allocate(layout, Plant(layout).wrench(reference))
    np.testing.assert_allclose(result.command, reference, atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_a_failed_fin_is_a_removed_fin(method: str) -> None:
    layout = random_layout(np.random.default_rng(9), n_fins=3)
    target = [0.5, 0.2, -0.5, 0.0, 0.0, 0.05]
    lost = make(method).allocate(layout, target, lost=["fin_2"]).command
    choice = make(method).choice
    rest = layout.without(["fin_2"])
    alone = choice.kind(
        rest, choice.settings, wrench_scale_of(layout)
    )  # errors are those of the whole robot
    removed = alone.solve(MethodQuestion(np.array([target]))).command[0]
    assert np.isnan(lost[1]).all()
    np.testing.assert_array_equal(lost[[0, 2]], removed)


@pytest.mark.parametrize("method", METHODS)
def test_degenerate_layouts_answer_within_their_limits(method: str) -> None:
    here = (0.1, 0.1, 0.0)
    fixed = Limits((0.3, 0.3), (1.0, 1.0), (0.5, 0.5))
    coincident = Layout("coincident", (Fin("a", here, 0.3), Fin("b", here, 0.3)))
    rigid = Layout("rigid", (Fin("a", here, 0.3, fixed), Fin("b", (0.0, 0.1, 0.0), 0.3, fixed)))
    half_rigid = Layout("half", (Fin("a", here, 0.3, fixed), Fin("b", (0.0, 0.1, 0.0), 1.3)))
    for layout in (coincident, rigid, half_rigid):
        result = make(method).allocate(layout, [1.0, 0.0, 0.5, 0.0, 0.0, 0.1])
        assert is_within_limits(result.command, layout), layout.name


@pytest.mark.parametrize("method", METHODS_THAT_SERVE_EXACTLY)
def test_other_fin_models_and_mixtures_of_them(method: str) -> None:
    lighthill = FinModelSpec("lighthill")
    layout = Layout(
        "mixed", (Fin("a", (0.2, 0.1, 0.0), 0.5, model=lighthill), Fin("b", (-0.1, 0.1, 0.0), -1.0))
    )
    target = Plant(layout).wrench([[0.4, 1.5, 0.7], [0.5, 1.2, -2.0]])
    assert make(method).allocate(layout, target).err_norm < 5e-4


@pytest.mark.parametrize("method", METHODS)
def test_unknown_and_last_fins_cannot_fail(method: str) -> None:
    with pytest.raises(LayoutError):
        make(method).allocate(one_fin(), np.zeros(6), lost=["fin"])
    with pytest.raises(LayoutError, match="nobody"):
        make(method).allocate(one_fin(), np.zeros(6), lost=["nobody"])


def test_sqp_needs_hardly_more_than_the_default() -> None:
    layout = random_layout(np.random.default_rng(21), n_fins=5)
    targets = Plant(layout).wrench(
        np.random.default_rng(22).uniform([0.05, 0.1, -3], [0.6, 2.1, 3], (20, 5, 3))
    )
    least = Allocator(layout).allocate_batch(targets)
    answer = make("sqp").allocate_batch(layout, targets)
    cost = answer.power
    best = least.power
    exact = (answer.err_norm < 1e-3) & (least.err_norm < 1e-3)
    assert exact.sum() >= 15 and cost[exact].sum() < 1.06 * best[exact].sum()


def test_feasible_wraps_full_turns_and_clips_the_rest() -> None:
    rng = np.random.default_rng(1)
    layout = random_layout(rng, n_fins=5, limits="varied")
    plant = plant_of(layout)
    wild = rng.normal(scale=20.0, size=(100, 5, 3))
    tame = plant.feasible(wild)
    assert (tame >= plant.lower).all() and (tame <= plant.upper).all()
    turns = (tame - wild)[:, plant.full_turn, 2] / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)
    np.testing.assert_array_equal(plant.feasible(tame), tame)


def reachable_wrenches(layout: Layout, count: int, seed: int) -> np.ndarray:
    """Wrenches (count, 6) that random commands of a robot give."""
    plant = plant_of(layout)
    return plant.wrench(plant.sample(np.random.default_rng(seed), (count,)))


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_the_papers_sqp_is_as_exact_as_slsqp_where_wrenches_can_be_had(name: str) -> None:
    layout = load_layout(name)
    targets = reachable_wrenches(layout, 6, 17)
    for method in ("paper_sqp", "sqp"):
        answer = Allocator(layout, method, time_limit_s=60.0).allocate_batch(targets)
        assert answer.reachable.all() and answer.err_norm.max() < 2e-6, method


def test_the_papers_sqp_goes_on_to_other_starts_until_one_delivers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    errors = iter([4.0, 1.0, 2.0, 0.0, 0.0])
    starts = []

    def descent(
        self: PaperSqp, target: np.ndarray, start: np.ndarray
    ) -> tuple[np.ndarray, list[float]]:
        starts.append(start)
        return start, [9.0, next(errors)]

    monkeypatch.setattr(PaperSqp, "descent", descent)
    answer = Allocator(load_layout("A"), "paper_sqp", n_starts=5, time_limit_s=60.0).allocate(
        np.ones(6)
    )
    assert len(starts) == 4  # the fourth delivers
    np.testing.assert_array_equal(answer.command, starts[3])


@pytest.mark.parametrize("reach", [1.0, 6.0])
@pytest.mark.parametrize("seed", range(4))
def test_a_descent_never_goes_up_nor_out(seed: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    layout = random_layout(rng, limits="varied")
    method = PaperSqp(layout, PaperSqpSettings(), wrench_scale_of(layout))
    plant = plant_of(layout)
    target = reach * reachable_wrenches(layout, 1, seed)[0]
    end, errors = method.descent(target, plant.sample(rng, (1,))[0])
    assert len(errors) > 2 and (np.diff(errors) <= 0.0).all()
    missing = (plant.wrench(end) - target) / method.asked_scale
    assert errors[-1] == pytest.approx(missing @ missing, rel=1e-9, abs=1e-15)
    assert (end >= layout.lower).all() and (end <= layout.upper).all()


def test_a_box_qp_meets_its_optimality_conditions() -> None:
    rng = np.random.default_rng(3)
    held = 0
    for _ in range(20):
        matrix = rng.normal(size=(6, 9))
        target = 4.0 * rng.normal(size=6)
        low = -rng.uniform(0.0, 1.0, 9)
        high = rng.uniform(0.1, 1.0, 9)
        x = box_qp(matrix, target, 0.1, low, high)
        pull = -(matrix.T @ (matrix @ x - target) + 0.1 * x)  # downhill
        at_low = np.isclose(x, low, atol=1e-12)
        at_high = np.isclose(x, high, atol=1e-12)
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
    targets = 40.0 * reachable_wrenches(layout, 10, 5)
    answer = Allocator(layout, "fixed_frequency").allocate_batch(targets)
    assert set(np.unique(answer.command[..., 1])) <= {0.1, 2.1}
    cosine = np.einsum("ni,ni->n", answer.wrench, targets)
    cosine /= np.linalg.norm(answer.wrench, axis=1) * np.linalg.norm(targets, axis=1)
    assert (cosine > 0.999).all() and (answer.err_norm > 0.1).all()
    np.testing.assert_allclose(answer.command[..., 0].max(axis=1), 0.6, atol=1e-3)
