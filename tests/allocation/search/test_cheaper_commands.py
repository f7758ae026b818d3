"""Going down to the next minimum of cost by the fins' own laws, under exact tracking."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import finlab.allocation.search.cheaper_commands
from finlab.allocation.levenberg_marquardt import CommandProblem, refine
from finlab.allocation.search.cheaper_commands import DESCENT, cheaper_commands
from finlab.arrays import Array
from finlab.evaluation.splits import make_split
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.physics.objective import CostMeter, Name, Objective
from tests.allocation.search.reference import least_cost
from tests.any_robot import AnyRobot
from tests.exhaustive import crossed
from tests.random_fins import random_robot

EXACT = 1e-5
OBJECTIVES = ("power", "effort")


def robot(kind: str, seed: int, folder: Path, limits: str = "nominal") -> Layout:
    return random_robot(np.random.default_rng(seed), (kind,), folder, n_fins=(3, 5), limits=limits)


def question(layout: Layout, objective: Name) -> tuple[CommandProblem, CostMeter, Array, Array]:
    """The robot, its cost, normalized targets (12, 6) and exact but needlessly dear answers (12, n, 3)."""
    plant, rng = plant_of(layout), np.random.default_rng(3)
    sigma = plant.wrench(plant.sample(rng, (500,))).std(axis=0)
    problem = CommandProblem(plant, plant.effectiveness / sigma, plant.lower, plant.upper, plant.full_turn)
    command = plant.sample(rng, (12,))
    return problem, Objective(objective).meter(plant), problem.wrench(command), command


@pytest.mark.parametrize(
    ("objective", "limits", "kind"),
    crossed(OBJECTIVES, ["nominal", "varied"], ["drag", "soft", "table"], every=5),
)
def test_is_as_exact_and_never_dearer(kind: str, limits: str, objective: Name, tmp_path: Path) -> None:
    saved = []
    for seed in range(3):
        problem, cost, target, command = question(robot(kind, seed, tmp_path, limits), objective)
        found = cheaper_commands(problem, cost, target, command, EXACT)
        assert (found >= problem.lower).all() and (found <= problem.upper).all()
        assert np.linalg.norm(problem.wrench(found) - target, axis=-1).max() <= EXACT
        assert (cost(found) <= cost(command) * (1.0 + 1e-9)).all()
        saved.append(1.0 - cost(found).sum() / cost(command).sum())
    assert np.mean(saved) > 0.03


def test_where_it_ends_is_a_minimum(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cost's slope is one of the wrench's where no limit holds: nothing is left to gain at first."""
    monkeypatch.setattr(finlab.allocation.search.cheaper_commands, "DESCENT", replace(DESCENT, settled=0.0))
    problem, cost, target, command = question(robot("drag", 1, tmp_path), "power")
    for _ in range(8):
        command = cheaper_commands(problem, cost, target, command, EXACT)
    left = []
    for row in command:
        _, jacobian = problem.fin.force_and_jacobian(row[None])
        jacobian = (jacobian[0] @ problem.effectiveness * problem.width[..., None]).reshape(-1, 6)
        slope = (cost.gradient(row[None])[0] * problem.width).ravel()
        inside = ((row > problem.lower + 1e-6) & (row < problem.upper - 1e-6)).ravel()
        multiplier = np.linalg.lstsq(jacobian[inside], slope[inside], rcond=1e-9)[0]
        left.append(np.linalg.norm(slope[inside] - jacobian[inside] @ multiplier) / np.linalg.norm(slope))
    assert np.median(left) < 1e-3


@pytest.mark.parametrize(("objective", "most", "mean"), [("power", 1.06, 1.01), ("effort", 1.05, 1.01)])
def test_tables_cost_what_many_starts_find(objective: Name, most: float, mean: float) -> None:
    method, aim, ratio = AnyRobot(objective=objective), Objective(objective), []
    for case in make_split("tables", 2, 1, 40):
        batch, sigma = method.allocate_batch(case.layout, case.targets), case.sigma
        assert sigma is not None
        for target, command in zip(case.targets, batch.command, strict=True):
            least = least_cost(case.layout, target, sigma, aim, n_starts=8, also=command)
            ratio.append(float(aim.meter(plant_of(case.layout))(command[None])[0]) / least)
    assert np.max(ratio) < most and np.mean(ratio) < mean


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [30.0, 1e6])
def test_what_is_far_out_of_reach_is_left_alone(size: float, tmp_path: Path) -> None:
    problem, cost, target, command = question(robot("table", 1, tmp_path), "power")
    alone = cheaper_commands(problem, cost, target, command, EXACT)
    far = size * np.random.default_rng(0).standard_normal((12, 6))
    mixed = cheaper_commands(
        problem, cost, np.concatenate([far, target]), np.concatenate([command, command]), EXACT
    )
    assert np.isfinite(mixed).all() and (cost(alone) < cost(command)).any()
    np.testing.assert_allclose(cost(mixed[12:]), cost(alone), rtol=1e-3)
    hopeless = cheaper_commands(problem, cost, far, command, EXACT)
    start = refine(problem, far, command, DESCENT.lm_steps[0]).command
    np.testing.assert_allclose(hopeless, start, atol=1e-9)
