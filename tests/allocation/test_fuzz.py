"""Any robot that a layout may describe gets an answer: within its limits, finite, its error told as
it is."""

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest

from finlab.allocation import Allocator, Policy
from finlab.errors import LayoutError
from finlab.layout import Damage, Layout
from finlab.physics import plant_of
from tests.allocator_cache import AllocatorCache
from tests.hostile_robots import hostile_robot
from tests.sampled_cases import sampled

N_CASES = 400
"""How many random robots there are; each day a share of them is asked."""
METHODS = ("dual", "dual", "mdn", "analytic", "qp", "sqp", "paper")
"""Methods to draw from; the default one twice as often."""


@cache
def quick_method(name: str) -> Allocator:
    """A method by its name, or `sqp-power` with its objective, with settings that answer
    quickly."""
    kind, _, objective = name.partition("-")
    options: dict[str, Any] = {"objective": objective} if objective else {}
    if kind == "paper":
        options = {"n_candidates": 4, "n_steps": 2}
    if kind == "sqp":
        options |= {"n_starts": 1, "n_steps": 4}
    return AllocatorCache(kind, **options)


def choose(rng: np.random.Generator, values: Any) -> Any:
    """One of some values."""
    return values[int(rng.integers(len(values)))]


def random_policy(rng: np.random.Generator) -> Policy:
    """A policy with weights that differ by many orders of magnitude, or of another kind."""
    kind = choose(rng, ("closest", "closest", "direction", "priority"))
    weights = choose(
        rng, ((1.0,) * 6, (1.0, 0.0, 1e-6, 1.0, 1e6, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    )
    return Policy(kind, axis_weights=weights if kind == "closest" else (1.0,) * 6)


def random_damage(rng: np.random.Generator, robot: Layout) -> dict[str, Any]:
    """Arguments `lost` and `damage` of a question, each of them in three of ten."""
    names = [str(name) for name in rng.permutation(robot.names)]
    arguments: dict[str, Any] = {}
    if len(names) > 1 and rng.random() < 0.3:
        arguments["lost"] = names[: int(rng.integers(1, len(names)))]
    if rng.random() < 0.3:
        kind = choose(rng, ("weak", "stuck", "running", "torn"))
        value = {"weak": 1e-3, "stuck": 0.7, "running": (0.3, 1.0, 0.5), "torn": 1e-3}[kind]
        arguments["damage"] = Damage(**{kind: {names[-1]: value}})
    return arguments


def question(rng: np.random.Generator, robot: Layout) -> dict[str, Any]:
    """What is asked of a robot, other than the wrench."""
    plant = plant_of(robot)
    arguments = random_damage(rng, robot)
    choice = rng.integers(6)
    if choice == 0:
        arguments["previous"] = plant.sample(rng, (1,))[0]
    elif choice == 1:
        arguments["previous"] = np.where(rng.random((robot.n_fins, 1)) < 0.5, np.nan, plant.upper)
    elif choice == 2:
        arguments["previous"] = rng.normal(size=(robot.n_fins, 3)) * 1e6
    if rng.random() < 0.1:
        arguments["reference"] = rng.normal(size=(4, 6))
    return arguments


def ask(seed: int) -> None:
    """Ask a drawn robot, and look at what it answers."""
    rng = np.random.default_rng([2026, seed])
    name = choose(rng, METHODS)
    robot = hostile_robot(seed, 2026)
    allocator = quick_method(name)
    how = random_policy(rng)
    if name not in ("dual", "mdn") and not how.is_plain:
        how = Policy()
    plant = plant_of(robot)
    arguments = question(rng, robot)
    reached = plant.wrench(plant.sample(rng, (1,)))[0]
    anywhere = rng.normal(size=6) * 10.0 ** rng.uniform(-12, 6)
    target = np.clip(
        choose(
            rng, (reached, 0.5 * reached, 2.0 * reached, anywhere, np.zeros(6), 1e-12 * reached)
        ),
        -1e6,
        1e6,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            result = allocator.allocate(robot, target, policy=how, **arguments)
        except LayoutError as error:  # what damage leaves of a fin may be below all bounds
            assert "must be at least" in str(error) and "damage" in arguments
            return
        if result.bound is not None and result.reachable:
            assert 0.0 <= result.bound <= result.power * (1 + 1e-6) + 1e-12
        batch = allocator.allocate_batch(
            robot, [target, 0.3 * target], policy=how, lost=arguments.get("lost", ())
        )
    for found, limited in (
        (result.command, result.layout),
        *((each, robot) for each in batch.command),
    ):
        works = [fin not in result.lost for fin in robot.names]
        assert (
            np.isfinite(found[works]).all()
            and np.isnan(np.delete(found, np.flatnonzero(works), 0)).all()
        )
        assert ((found >= limited.lower) & (found <= limited.upper))[works].all()
    healthy = result.layout.without(result.lost) if result.lost else result.layout
    wrench = plant_of(healthy).wrench(result.command[works])
    rounding = 1e-12 * 20.0 * np.abs(result.forces).sum()
    np.testing.assert_allclose(result.wrench, wrench, rtol=1e-9, atol=rounding)
    missing = np.linalg.norm((wrench - result.target) / result.scale)
    assert result.err_norm == pytest.approx(missing, rel=1e-6, abs=1e-9)
    assert (
        np.isfinite([result.err_norm, result.power, result.effort]).all()
        and np.isfinite(batch.err_norm).all()
    )


@pytest.mark.parametrize("seed", sampled(range(N_CASES), 20))
def test_any_robot_gets_an_answer(seed: int) -> None:
    ask(seed)
