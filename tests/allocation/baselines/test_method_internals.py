"""What model-based methods do inside: starts, chunks, arcs and bounds, by hand or by brute force."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from finlab.allocation.baselines import multistart, sqp
from finlab.allocation.baselines.analytic import Analytic
from finlab.allocation.baselines.box_least_squares import solve_box_quadratics
from finlab.allocation.baselines.model_based import TimeLimit
from finlab.allocation.baselines.multistart import Multistart
from finlab.allocation.baselines.pseudo_inverse import PseudoInverse, _least_change
from finlab.allocation.baselines.qp import LinearMap, Qp
from finlab.allocation.baselines.scipy_solvers import Slsqp, Trf
from finlab.allocation.baselines.sqp import Sqp
from finlab.allocation.method import Method
from finlab.inference.normalization import Normalization
from finlab.layout import Fin, Layout, Limits, layout_effectiveness
from finlab.physics import Plant, plant_of
from finlab.physics.energy import EnergyWeights
from finlab.physics.objective import Name, Objective

SIGMA = np.array([1.4, 1.2, 2.0, 0.35, 0.3, 0.4])
NORMALIZATION = Normalization(np.zeros(6), SIGMA)
ARC = Limits((0.1, 0.5), (0.3, 1.4), (0.3, 1.7))


@pytest.fixture
def plant() -> Plant:
    """A strong fin that turns freely and a weaker one in an arc."""
    return plant_of(
        Layout("two", (Fin("a", (0.2, 0.1, 0.0), 0.4), Fin("b", (-0.3, 0.2, 0.1), 2.0, limits=ARC)))
    )


@pytest.mark.parametrize(
    ("method", "options"),
    [
        (Analytic, {"rcond": 1e-3}),
        (Qp, {"regularization": 1.0}),
        (Sqp, {"n_steps": 30, "n_starts": 4, "regularization": 1e-4, "time_limit_s": 0.6}),
        (Multistart, {"n_candidates": 16, "n_steps": 20, "energy_tradeoff": 1e-4, "time_limit_s": 0.6}),
        (Trf, {"n_starts": 8, "max_evaluations": 100, "time_limit_s": 0.6}),
        (Slsqp, {"n_starts": 8, "max_iterations": 200, "time_limit_s": 0.6}),
    ],
)
def test_published_figures_belong_to_these_settings(method: type[Method], options: dict[str, float]) -> None:
    aim = {"objective": "power", "energy_weights": EnergyWeights(), "copper_loss": 0.0}
    assert method(NORMALIZATION).options == options | aim  # type: ignore[call-arg]


# Analytic.


def test_each_fin_gives_its_force_by_the_cheapest_command(plant: Plant) -> None:
    """Of all amplitudes that give the same force within the limits, none costs less."""
    inverse = PseudoInverse(plant, SIGMA, Objective())
    target = 0.4 * plant.wrench(0.5 * (plant.lower + plant.upper))
    command = inverse.command(target[None])[0]
    force = np.hypot(*plant.force(command)[:, 1:].T)
    amplitude = np.linspace(plant.lower[:, 0], plant.upper[:, 0], 400)
    frequency = np.sqrt(force / 4.737410112522892) / np.sin(amplitude)
    inside = (frequency >= plant.lower[:, 1]) & (frequency <= plant.upper[:, 1])
    others = np.stack([amplitude, frequency, np.zeros_like(amplitude)], axis=-1)
    power = np.where(inside, plant.power(others), np.inf).min(axis=0)
    assert (plant.power(command) <= 1.002 * power).all()
    assert (plant.lower <= command).all() and (command <= plant.upper).all()


@pytest.mark.parametrize("share", [0.2, 0.9])
@pytest.mark.parametrize("objective", [Objective(), Objective("effort")])
def test_fins_give_what_the_pseudo_inverse_asks_for(plant: Plant, objective: Objective, share: float) -> None:
    """The looked-up command is made exact by the fin's own law: each fin alone, whatever its envelope."""
    inverse = PseudoInverse(plant, SIGMA, objective)
    direction = np.array([2.0, 1.0])
    size = share * 4.737410112522892 * (np.sin(plant.upper[:, 0]) * plant.upper[:, 1]) ** 2
    wanted = size[:, None] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    target = layout_effectiveness(plant.layout) @ wanted.ravel()
    command = inverse.command(target[None])
    np.testing.assert_allclose(target @ inverse.inverse, wanted.ravel(), atol=1e-9)
    np.testing.assert_allclose(plant.force(command)[0, :, 1:], wanted, atol=2e-6)


@pytest.mark.parametrize(
    ("direction", "allowed", "left"),
    [
        (1.0, 1.0, 1.0),
        (0.31, 0.31, 1.0),
        (1.9, 1.7, math.cos(0.2)),
        (0.0, 0.3, math.cos(0.3)),
        (1.9 - 2 * math.pi, 1.7, math.cos(0.2)),
    ],
)
def test_within_an_arc_the_nearest_direction_takes_what_points_there(
    plant: Plant, direction: float, allowed: float, left: float
) -> None:
    point = np.array([math.cos(direction), math.sin(direction)])
    target = layout_effectiveness(plant.layout) @ np.array([0.5, 0.0, *(0.4 * point)])
    command = PseudoInverse(plant, SIGMA, Objective()).command(target[None])[0]
    force = plant.force(command)[:, 1:]
    assert command[1, 2] == pytest.approx(allowed, abs=1e-6)
    np.testing.assert_allclose(np.hypot(*force.T), [0.5, 0.4 * left], rtol=1e-4)


def test_the_least_change_is_that_of_a_general_solver() -> None:
    rng = np.random.default_rng(0)
    slopes, missing = rng.normal(size=(20, 3, 2)), rng.normal(size=(20, 2))
    slopes[0, 1:], slopes[1] = 0.0, 0.0
    found = _least_change(slopes, missing)
    for i in range(1, 20):
        expected = np.linalg.lstsq(slopes[i].T, missing[i], rcond=1e-9)[0]
        np.testing.assert_allclose(found[i], expected, rtol=1e-6, atol=1e-9)
    assert np.isfinite(found).all()


def test_forces_are_the_weighted_least_ones(plant: Plant) -> None:
    """What the fins are asked for: the least squares of shares of each fin's largest thrust."""
    most = 4.737410112522892 * (np.sin(plant.upper[:, 0]) * plant.upper[:, 1]) ** 2
    weight = np.repeat(most, 2)
    target = np.array([0.2, 0.1, 0.3, 0.0, 0.02, 0.01])
    scaled = layout_effectiveness(plant.layout) * weight / SIGMA[:, None]
    expected = weight * np.linalg.lstsq(scaled, target / SIGMA, rcond=1e-3)[0]
    found = target @ PseudoInverse(plant, SIGMA, Objective()).inverse
    np.testing.assert_allclose(found, expected, atol=1e-9)


# QP.


def test_qp_solves_the_box_constrained_least_squares(plant: Plant) -> None:
    """Beyond the limits too: each answer is that of another solver for the same box."""
    qp, linear = Qp(NORMALIZATION, regularization=0.3), LinearMap(plant, SIGMA)
    targets = np.random.default_rng(0).normal(scale=4.0, size=(12, 6)) * SIGMA
    missing = (targets - linear.wrench) / SIGMA
    hessian = np.tile(linear.matrix.T @ linear.matrix + 0.3 * np.eye(6), (12, 1, 1))
    half = np.full((12, 6), 0.5)
    step = solve_box_quadratics(hessian, -missing @ linear.matrix, -half, half)
    found = (qp._commands(plant, targets, 0) - (plant.lower + plant.upper) / 2) / plant.width
    np.testing.assert_allclose(found.reshape(12, 6), step, atol=1e-7)
    assert np.isclose(np.abs(step), 0.5).any(axis=1).mean() > 0.5


def test_qp_linearizes_at_the_middle_of_the_limits(plant: Plant) -> None:
    linear = LinearMap(plant, SIGMA)
    middle = (plant.lower + plant.upper) / 2
    wrench, slope = plant.linearize(middle[None])
    np.testing.assert_allclose(linear.reference, middle)
    np.testing.assert_allclose(linear.wrench, wrench[0])
    np.testing.assert_allclose(linear.matrix, slope[0] * plant.width.ravel() / SIGMA[:, None], atol=1e-6)


# SQP.


def test_sqp_starts_from_the_pseudo_inverse_the_middle_and_at_random(
    plant: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sqp, "STAGES", ())
    target = np.array([[0.4, 0.1, 0.5, 0.0, 0.0, 0.1]])
    for n_starts in (1, 3):
        method = Sqp(NORMALIZATION, n_steps=0, n_starts=n_starts)
        starts = [
            PseudoInverse(plant, SIGMA, Objective()).command(target)[0],
            (plant.lower + plant.upper) / 2,
        ]
        starts += [*plant.sample(np.random.default_rng(0), (n_starts - 1,))]
        errors = [NORMALIZATION.error(plant.wrench(start[None]), target)[0] for start in starts]
        np.testing.assert_array_equal(method._commands(plant, target, 0)[0], starts[int(np.argmin(errors))])


@pytest.mark.parametrize("objective", ["power", "effort"])
def test_sqp_takes_the_cheapest_of_the_ends_that_meet_the_target(
    objective: Name, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the objective; where none meets the target, the end with the smallest error."""
    free = plant_of(Layout("free", tuple(Fin(f"f{i}", (0.2, 0.1 * i, 0.0), 2.0 * i) for i in range(4))))
    asked = np.stack([share * free.wrench(free.upper[None])[0] for share in (0.3, 0.4, 20.0)])
    method, meter = Sqp(NORMALIZATION, objective=objective), Objective(objective).meter(free)
    ends: list[tuple[np.ndarray, np.ndarray]] = []
    leads = method._from

    def kept(*arguments: object) -> tuple[np.ndarray, np.ndarray]:
        ends.append(leads(*arguments))  # type: ignore[arg-type]
        return ends[-1]

    monkeypatch.setattr(method, "_from", kept)
    answer = method._commands(free, asked, 0)
    command, error = ends[0][0].reshape(3, 5, 4, 3), ends[0][1].reshape(3, 5)
    met = error <= 1e-8
    assert (met.sum(axis=1)[:2] >= 3).all() and not met[2].any()
    for k in range(2):
        cost = meter(command[k][met[k]])
        assert meter(answer[k][None])[0] == cost.min() < cost.max()
    np.testing.assert_array_equal(answer[2], command[2][error[2].argmin()])


@pytest.mark.parametrize(("objective", "most"), [("power", 0.85), ("effort", 0.95)])
def test_sqp_lowers_the_cost_and_meets_the_target_as_well(
    objective: Name, most: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the middle of the limits, beside steps on the error alone."""
    free = plant_of(Layout("free", tuple(Fin(f"f{i}", (0.2, 0.1 * i, 0.0), 2.0 * i) for i in range(4))))
    asked = 0.3 * free.wrench(free.sample(np.random.default_rng(1), (6,)))
    method, meter = Sqp(NORMALIZATION, objective=objective), Objective(objective).meter(free)
    middle = np.tile((free.lower + free.upper) / 2, (len(asked), 1, 1))
    cost = method._cost(free)
    cheap, error = method._from(free, middle, asked, cost, TimeLimit())
    monkeypatch.setattr(sqp, "STAGES", ())
    plain, reached = method._from(free, middle, asked, cost, TimeLimit())
    assert (error <= 1e-8).all() and (reached <= 1e-8).all()
    assert meter(cheap).sum() < most * meter(plain).sum()


@pytest.mark.parametrize("objective", ["power", "effort"])
def test_sqp_models_error_and_cost_by_their_slopes(plant: Plant, objective: Name) -> None:
    """Half the gradient of J is that of differences; half the Hessian is convex, and bends with the cost."""
    cost = Sqp(NORMALIZATION, objective=objective)._cost(plant)
    at = plant.lower + np.array([0.3, 0.6, 0.4]) * plant.width
    j = sqp._J(plant, plant.wrench(at[None]) * 0.7, SIGMA, cost, 1e4)
    hessian, gradient = j.model(at[None], np.array([0]), 0.0)
    step = 1e-6 * np.eye(6).reshape(6, 2, 3) * plant.width
    rows = np.zeros(6, dtype=int)
    slope = (j(at + step, rows) - j(at - step, rows)) / 2e-6
    np.testing.assert_allclose(2.0 * gradient[0], slope, rtol=1e-5, atol=1e-7)
    assert np.linalg.eigvalsh(hessian[0])[0] > 0.0
    np.testing.assert_array_equal(hessian[0], hessian[0].T)
    plain, _ = sqp._J(plant, j.targets, SIGMA, cost, 0.0).model(at[None], np.array([0]), 0.0)
    assert abs((hessian - plain)[0, 0, 1]) > 0.0 and (hessian - plain)[0, 0, 3] == 0.0


def test_sqp_knows_how_far_each_command_may_step(plant: Plant) -> None:
    at = plant.lower + np.array([0.25, 0.5, 0.75]) * plant.width
    low, high = sqp._room(plant, at[None])
    np.testing.assert_allclose(low[0], [-0.25, -0.5, -0.5, -0.25, -0.5, -0.75])
    np.testing.assert_allclose(high[0], [0.75, 0.5, 0.5, 0.75, 0.5, 0.25])


def test_sqp_halves_a_step_until_the_squared_error_falls(plant: Plant) -> None:
    """A step downhill ends at the first length of 1, 1/2, ... that pays; uphill nothing moves."""
    start = ((plant.lower + plant.upper) / 2)[None]
    target = plant.wrench(start) * 0.8
    j = sqp._J(plant, target, SIGMA, Sqp(NORMALIZATION)._cost(plant), 0.0)
    square = NORMALIZATION.error(plant.wrench(start), target) ** 2
    _, slope = plant.linearize(start)
    downhill = -(slope[0].T @ ((plant.wrench(start) - target)[0] / SIGMA**2)).reshape(1, 2, 3)
    for size in (0.01, 1.0, 5.0):
        step = size * downhill / np.abs(downhill).max()
        lengths = [0.5**k for k in range(8)]
        squares = [
            NORMALIZATION.error(plant.wrench(plant.feasible(start + length * step)), target)[0] ** 2
            for length in lengths
        ]
        first = next(k for k in range(8) if squares[k] < square[0] * (1 - 1e-4 * lengths[k]))
        command, reached = start.copy(), square.copy()
        moved = sqp._search(j, command, reached, np.array([0]), step)
        assert moved.tolist() == [True]
        np.testing.assert_allclose(command, plant.feasible(start + lengths[first] * step))
        assert reached[0] == pytest.approx(squares[first])
    command, reached = start.copy(), square.copy()
    uphill = -0.01 * downhill / np.abs(downhill).max()
    moved = sqp._search(j, command, reached, np.array([0]), uphill)
    assert moved.tolist() == [False] and reached[0] == square[0]
    np.testing.assert_array_equal(command, start)


def test_sqp_answers_all_targets_of_all_chunks(plant: Plant, monkeypatch: pytest.MonkeyPatch) -> None:
    method = Sqp(NORMALIZATION, n_steps=5, n_starts=2, time_limit_s=60.0)
    targets = 0.5 * plant.wrench(plant.sample(np.random.default_rng(1), (7,)))
    whole = method._commands(plant, targets, 0)
    monkeypatch.setattr(sqp, "CHUNK", 3)
    np.testing.assert_allclose(method._commands(plant, targets, 0), whole, atol=1e-9)


def test_sqp_has_no_answers_to_no_targets(plant: Plant) -> None:
    command = Sqp(NORMALIZATION)._commands(plant, np.empty((0, 6)), 0)
    assert command.shape == (0, 2, 3)


# Multistart.


@pytest.mark.parametrize(
    ("n_candidates", "chunks"),
    [(16, [4, 4, 1]), (64, [1] * 9), (65, [1] * 9), (5, [9]), (32, [2, 2, 2, 2, 1])],
)
def test_multistart_refines_as_many_rows_together_as_fit(
    plant: Plant, monkeypatch: pytest.MonkeyPatch, n_candidates: int, chunks: list[int]
) -> None:
    asked: list[np.ndarray] = []

    def best(plant: Plant, start: np.ndarray, targets: np.ndarray, limit: TimeLimit) -> np.ndarray:
        asked.append(targets)
        assert start.shape == (n_candidates, 2, 3)
        return np.tile(targets[:, None, :3], (1, 2, 1))

    method = Multistart(NORMALIZATION, n_candidates=n_candidates)
    monkeypatch.setattr(multistart, "CHUNK_ROWS", 64)
    monkeypatch.setattr(method, "_best", best)
    targets = np.arange(54.0).reshape(9, 6)
    command = method._commands(plant, targets, 0)
    assert [len(part) for part in asked] == chunks
    np.testing.assert_array_equal(np.concatenate(asked), targets)
    np.testing.assert_array_equal(command[:, 1], targets[:, :3])


def test_multistart_polishes_the_start_that_ends_lowest(plant: Plant) -> None:
    """Each target's winner is the best of what its starts give alone."""
    method = Multistart(NORMALIZATION, n_candidates=5, n_steps=4, energy_tradeoff=0.05)
    start, limit = plant.sample(np.random.default_rng(0), (5,)), TimeLimit()
    targets = 0.6 * plant.wrench(plant.sample(np.random.default_rng(2), (3,)))
    together = method._best(plant, start, targets, limit)
    for row, target in zip(together, targets, strict=True):
        ends = [
            multistart.descend(plant, one[None], target[None], SIGMA, method._descent, method._cost(plant))
            for one in start
        ]
        winner = min(ends, key=lambda end: end.objective[0])
        polished = multistart.descend(plant, winner.command, target[None], SIGMA, multistart.POLISH)
        np.testing.assert_allclose(row, polished.command[0], atol=1e-8)


@pytest.mark.parametrize(("place", "length"), [(1, 0.5), (3, 0.125), (7, 1 / 128)])
@pytest.mark.parametrize("pays", [True, False])
def test_sqp_asks_a_ten_thousandth_of_the_step_as_gain(place: int, length: float, pays: bool) -> None:
    """A squared error of 1 that falls at one length only, by a little more or less than is asked for it."""
    asked: list[float] = []
    gain = (1.2e-4 if pays else 0.8e-4) * length

    def wrench(command: np.ndarray) -> np.ndarray:
        asked.append(float(command[0, 0, 0]))
        return np.full((1, 6), [math.sqrt(1 - gain) if asked[-1] == length else 2.0, 0, 0, 0, 0, 0])

    fake = SimpleNamespace(wrench=wrench, feasible=lambda command: command)
    command, square = np.zeros((1, 1, 3)), np.ones(1)
    j = sqp._J(fake, np.zeros((1, 6)), np.ones(6), None, 0.0)  # type: ignore[arg-type]
    moved = sqp._search(j, command, square, np.array([0]), np.ones((1, 1, 3)))
    assert moved.tolist() == [pays]
    assert asked == [0.5**k for k in range(place + 1 if pays else 8)]
    assert command[0, 0, 0] == (length if pays else 0.0) and square[0] == pytest.approx(
        1 - gain if pays else 1.0, rel=1e-12
    )
