"""One step of going down to cheaper commands: its model by differences, its systems by dense algebra."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.optimize import minimize

import finlab.allocation.search.cheaper_commands as module
from finlab.allocation.search.cheaper_commands import (
    DESCENT,
    _balance,
    _free_step,
    _Model,
    _model,
    _regular,
    _step,
    cheaper_commands,
)
from finlab.allocation.search.levenberg_marquardt import CommandProblem
from finlab.arrays import Array
from finlab.layout import Limits, random_layout
from finlab.physics import plant_of
from finlab.physics.objective import Objective

SIGMA = np.array([1.4, 1.2, 2.0, 0.35, 0.3, 0.4])
ROWS, FINS = 3, 4


@pytest.fixture
def problem() -> CommandProblem:
    """Four fins, the first two of which turn freely."""
    layout = random_layout(np.random.default_rng(5), n_fins=FINS, limits="nominal")
    arc = Limits((0.1, 0.5), (0.3, 1.4), (0.3, 1.7))
    fins = (*layout.fins[:2], *(replace(fin, limits=arc) for fin in layout.fins[2:]))
    plant = plant_of(replace(layout, fins=fins))
    return CommandProblem(plant, plant.columns / SIGMA, plant.lower, plant.upper, plant.full_turn)


def drawn_model(seed: int) -> _Model:
    rng = np.random.default_rng(seed)
    by_cost = rng.normal(size=(ROWS, FINS, 3, 3))
    return _Model(
        0.1 * rng.normal(size=(ROWS, 6)),
        rng.normal(size=(ROWS, FINS, 3, 6)),
        rng.normal(size=(ROWS, FINS, 3)),
        0.3 * rng.normal(size=(ROWS, FINS, 3, 3, 6)),
        by_cost + by_cost.swapaxes(-1, -2),
    )


def drawn_curvature(seed: int) -> Array:
    """Positive definite blocks (R, n, 3, 3)."""
    root = np.random.default_rng(seed).normal(size=(ROWS, FINS, 3, 3))
    return np.asarray(root @ root.swapaxes(-1, -2) + 0.5 * np.eye(3))


def whole(blocks: Array) -> Array:
    """One matrix (3 n, 3 n) of a row's blocks (n, 3, 3)."""
    matrix = np.zeros((3 * FINS, 3 * FINS))
    for i, block in enumerate(blocks):
        matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = block
    return matrix


# The model.


@pytest.mark.parametrize("objective", ["power", "effort"])
def test_the_model_is_that_of_the_fins_by_differences(problem: CommandProblem, objective: Any) -> None:
    plant = problem.fin
    cost = Objective(objective).meter(plant_of(plant.layout))  # type: ignore[attr-defined]
    rng = np.random.default_rng(0)
    command = problem.lower + rng.uniform(0.2, 0.8, (ROWS, FINS, 3)) * problem.width
    target = rng.normal(size=(ROWS, 6))
    found = _model(problem, cost, target, command)
    np.testing.assert_allclose(found.missing, target - problem.wrench(command), atol=1e-12)
    for i, k in np.ndindex(FINS, 3):
        offset = np.zeros((FINS, 3))
        offset[i, k] = 1e-5 * problem.width[i, k]
        more, less = command + offset, command - offset
        jacobian = (problem.wrench(more) - problem.wrench(less)) / 2e-5
        np.testing.assert_allclose(found.jacobian[:, i, k], jacobian, rtol=1e-5, atol=1e-7)
        np.testing.assert_allclose(found.slope[:, i, k], (cost(more) - cost(less)) / 2e-5, rtol=1e-5)
        bend = (cost.slopes(more) - cost.slopes(less))[:, i] * problem.width[i] / 2e-5
        np.testing.assert_allclose(
            found.by_cost[:, i, k], bend, atol=2e-3 * np.abs(found.by_cost[:, i]).max()
        )
        slopes = [problem.fin.force_and_slopes(side)[1][:, i] for side in (more, less)]
        bend = (slopes[0] - slopes[1]) @ problem.columns[i] * problem.width[i][:, None] / 2e-5
        largest = np.abs(found.by_force[:, i]).max()
        np.testing.assert_allclose(found.by_force[:, i, k], bend, atol=2e-3 * largest)


def test_slopes_are_compared_within_the_limits_except_over_the_seam(problem: CommandProblem) -> None:
    asked: list[Array] = []

    class Recorded:
        def force_and_slopes(self, command: Array) -> tuple[Array, Array]:
            asked.append(command)
            return problem.fin.force_and_slopes(command)

        def force(self, command: Array) -> Array:
            return problem.fin.force(command)

    seen = CommandProblem(
        Recorded(),
        problem.columns,
        problem.lower,
        problem.upper,
        problem.full_turn,
    )
    cost = SimpleNamespace(slopes=lambda command: np.ones(command.shape))
    command = np.stack([problem.lower, problem.upper, problem.upper - 0.5 * DESCENT.spacing * problem.width])
    _model(seen, cast(Any, cost), np.zeros((3, 6)), command)
    (points,) = asked
    points = points.reshape(4, 3, FINS, 3)
    np.testing.assert_array_equal(points[0], command)
    for k in range(3):
        moved = (points[k + 1] - command) / problem.width
        sign = np.array([1.0, -1.0, -1.0])[:, None].repeat(FINS, 1)
        if k == 2:
            sign[:, problem.full_turn] = 1.0
        np.testing.assert_allclose(moved[..., k], DESCENT.spacing * sign, rtol=1e-6)
        assert (np.delete(moved, k, axis=-1) == 0.0).all()


# Multipliers and steps.


def test_multipliers_that_balance_are_those_of_least_squares() -> None:
    model = drawn_model(1)
    for row, found in enumerate(_balance(model)):
        known = np.linalg.lstsq(model.jacobian[row].reshape(-1, 6), model.slope[row].ravel(), rcond=None)[0]
        np.testing.assert_allclose(found, known, rtol=1e-6)


@pytest.mark.parametrize("share", [0.0, 0.25])
def test_a_step_with_some_held_solves_the_dense_system(share: float) -> None:
    """Cheapest among the free ones under exact tracking, by the system of Karush, Kuhn and Tucker."""
    model, curvature, rng = drawn_model(2), drawn_curvature(3), np.random.default_rng(4)
    held = rng.random((ROWS, FINS, 3)) < share
    fixed = np.where(held, 0.2 * rng.normal(size=held.shape), 0.0)
    assert held.any() == (share > 0.0)
    step, multiplier = _free_step(model, curvature, fixed, held)
    for row in range(ROWS):
        free = ~held[row].ravel()
        hessian, jacobian = whole(curvature[row]), model.jacobian[row].reshape(-1, 6)
        missing = model.missing[row] - jacobian.T @ fixed[row].ravel()
        slope = model.slope[row].ravel() + hessian @ fixed[row].ravel()
        size = int(free.sum())
        matrix = np.zeros((size + 6, size + 6))
        matrix[:size, :size] = hessian[np.ix_(free, free)]
        matrix[:size, size:], matrix[size:, :size] = -jacobian[free], jacobian[free].T
        known = np.linalg.solve(matrix, np.concatenate([-slope[free], missing]))
        np.testing.assert_allclose(step[row].ravel()[free], known[:size], atol=1e-6)
        np.testing.assert_allclose(multiplier[row], known[size:], rtol=1e-6)
        np.testing.assert_array_equal(step[row][held[row]], fixed[row][held[row]])


def convex(model: _Model, multiplier: Array, damping: Array) -> Array:
    """The curvature (R, n, 3, 3) of cost minus multipliers times wrench, by the documented shares."""
    result = np.empty((ROWS, FINS, 3, 3))
    for row, fin in np.ndindex(ROWS, FINS):
        block = model.by_cost[row, fin] - model.by_force[row, fin] @ multiplier[row]
        usual = np.abs(model.slope[row]).mean()
        size, axes = np.linalg.eigh((block + block.T) / 2)
        size = np.maximum(np.abs(size), 0.02 * usual) + damping[row] * usual
        result[row, fin] = axes @ np.diag(size) @ axes.T
    return result


def test_a_step_without_limits_is_free_and_at_most_as_long_as_allowed(problem: CommandProblem) -> None:
    far = CommandProblem(
        problem.fin, problem.columns, problem.lower - 1e3, problem.upper + 1e3, problem.full_turn
    )
    model, multiplier = drawn_model(6), np.random.default_rng(6).normal(size=(ROWS, 6))
    damping = np.array([2.0, 0.2, 50.0])
    command = np.tile((problem.lower + problem.upper) / 2, (ROWS, 1, 1))
    step, answer = _step(far, model, command, multiplier, damping)
    nothing = np.zeros((ROWS, FINS, 3))
    free, known = _free_step(model, convex(model, multiplier, damping), nothing, nothing.astype(bool))
    np.testing.assert_allclose(answer, known, rtol=1e-6)
    assert DESCENT.longest < np.abs(free).max() < 0.5
    for row in range(ROWS):
        longest = np.abs(free[row]).max()
        np.testing.assert_allclose(step[row], free[row] * min(1.0, DESCENT.longest / longest), atol=1e-7)
    model = model._replace(missing=1e-3 * model.missing, slope=1e-3 * model.slope)
    short, _ = _step(far, model, command, multiplier, np.full(ROWS, 0.2))
    assert 0.0 < np.abs(short).max() < DESCENT.longest
    np.testing.assert_allclose(
        np.einsum("rnij,rni->rj", model.jacobian, short), model.missing, rtol=1e-6, atol=1e-9
    )


def test_a_step_to_a_limit_is_the_cheapest_within_the_limits(problem: CommandProblem) -> None:
    """One fin is at its limits, so that a part of the free step leaves them; against SciPy."""
    multiplier, damping = np.zeros((ROWS, 6)), np.zeros(ROWS)
    command = np.tile((problem.lower + problem.upper) / 2, (ROWS, 1, 1))
    compared, solve = 0, cast(Any, minimize)
    for seed in range(12):
        model = drawn_model(seed)
        model = model._replace(missing=0.1 * model.missing, slope=0.1 * model.slope)
        nothing = np.zeros((ROWS, FINS, 3))
        curvature = convex(model, multiplier, damping)
        free, _ = _free_step(model, curvature, nothing, nothing.astype(bool))
        at = command.copy()
        at[:, 2, 0] = np.where(free[:, 2, 0] > 0.0, problem.upper[2, 0], problem.lower[2, 0])
        step, _ = _step(problem, model, at, multiplier, damping)
        low, high = (problem.lower - at) / problem.width, (problem.upper - at) / problem.width
        low[:, problem.full_turn, 2], high[:, problem.full_turn, 2] = -np.inf, np.inf
        assert (step >= low).all() and (step <= high).all()
        for row in range(ROWS):
            hessian, jacobian = whole(curvature[row]), model.jacobian[row].reshape(-1, 6)
            slope, missing = model.slope[row].ravel(), model.missing[row]
            known = solve(
                lambda d, s=slope, h=hessian: s @ d + 0.5 * d @ h @ d,
                np.zeros(3 * FINS),
                jac=lambda d, s=slope, h=hessian: s + h @ d,
                method="SLSQP",
                bounds=list(zip(low[row].ravel(), high[row].ravel(), strict=True)),
                constraints={
                    "type": "eq",
                    "fun": lambda d, j=jacobian, m=missing: j.T @ d - m,
                    "jac": lambda d, j=jacobian: j.T,
                },
                options={"maxiter": 300, "ftol": 1e-14},
            )
            if known.success and np.abs(known.x).max() < DESCENT.longest:
                compared += 1
                np.testing.assert_allclose(step[row].ravel(), known.x, atol=1e-5)
                assert step[row, 2, 0] == 0.0
    assert compared > 5


# How it goes on.


def test_damping_falls_after_a_gain_and_grows_without_one(
    problem: CommandProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = plant_of(problem.fin.layout)  # type: ignore[attr-defined]
    cost, seen = Objective("power").meter(plant), []
    taken = _step

    def spied(
        problem: CommandProblem, model: _Model, command: Array, multiplier: Array, damping: Array
    ) -> Any:
        seen.append((damping.copy(), command.copy()))
        return taken(problem, model, command, multiplier, damping)

    monkeypatch.setattr(module, "_step", spied)
    monkeypatch.setattr(module, "DESCENT", replace(DESCENT, settled=0.0))
    command = plant.sample(np.random.default_rng(7), (12,))
    cheaper_commands(problem, cost, problem.wrench(command), command, 1e-5)
    assert len(seen) == 6 and (seen[0][0] == 1e-3).all() and DESCENT.damping == (1e-3, 0.2, 10.0)
    for (before, start), (after, end) in zip(seen, seen[1:], strict=False):
        moved = (start != end).any((1, 2))
        np.testing.assert_allclose(after / before, np.where(moved, 0.2, 10.0))
    assert len({*np.concatenate([damping for damping, _ in seen[1:]])}) > 3


def test_it_ends_when_no_row_has_more_to_gain(
    problem: CommandProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps, taken = [], _step

    def counted(*given: Any) -> Any:
        steps.append(given)
        return taken(*given)

    monkeypatch.setattr(module, "_step", counted)
    monkeypatch.setattr(module, "DESCENT", replace(DESCENT, settled=1e9))
    plant = plant_of(problem.fin.layout)  # type: ignore[attr-defined]
    command = plant.sample(np.random.default_rng(7), (4,))
    cheaper_commands(problem, Objective("power").meter(plant), problem.wrench(command), command, 1e-5)
    assert len(steps) == 1


def test_a_step_that_crosses_no_limit_is_solved_once(
    problem: CommandProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    solved, taken = [], _free_step

    def counted(*given: Any) -> Any:
        solved.append(given)
        return taken(*given)

    monkeypatch.setattr(module, "_free_step", counted)
    model, damping = drawn_model(6), np.full(ROWS, 1e4)
    middle = np.tile((problem.lower + problem.upper) / 2, (ROWS, 1, 1))
    model = model._replace(missing=1e-2 * model.missing)
    _step(problem, model, middle, np.zeros((ROWS, 6)), damping)
    assert len(solved) == 1


def test_systems_are_regularized_by_their_size_and_a_trifle() -> None:
    gram = np.stack([np.zeros((6, 6)), np.diag(np.arange(1.0, 7.0))])
    ridge = _regular(gram) - gram
    np.testing.assert_allclose(ridge[0], 1e-14 * np.eye(6))
    np.testing.assert_allclose(ridge[1], 21e-10 * np.eye(6), atol=1e-14)
