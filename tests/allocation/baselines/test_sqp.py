"""The program that SciPy solves for method `sqp`: its start, its gradients, its limits."""

from typing import Any

import numpy as np
import pytest

from finlab.allocation.baselines import sqp
from finlab.allocation.baselines.linear import LinearMap
from finlab.allocation.baselines.sqp import cheapest_program
from finlab.arrays import Array
from finlab.layout import Fin, Layout, Limits, load_layout
from finlab.physics import Plant, plant_of
from finlab.physics.objective import cost_meter, wrench_scale_of


def some_fins() -> Layout:
    """Fins of which one beats at one frequency alone."""
    fins = load_layout("A").fins
    held = Fin("held", fins[1].position, fins[1].mounting_angle, Limits((0.05, 0.6), (1.0, 1.0)))
    return Layout("some", (fins[0], held, fins[2]))


class Asked:
    """Stands for SciPy's `minimize`: keeps what it is asked, and ends at some shares."""

    def __init__(self, end: Array | None = None) -> None:
        self.end = end
        self.said: dict[str, Any] = {}

    def __call__(self, cost: Any, first: Array, **said: Any) -> Any:
        self.said = {"cost": cost, "first": first, **said}
        self.x = first if self.end is None else self.end
        return self


@pytest.fixture
def plant() -> Plant:
    return plant_of(some_fins())


def program(plant: Plant, scale: Array) -> Any:
    """The program of least power."""
    return cheapest_program(plant, cost_meter("power", plant), scale, 10)


def test_it_begins_at_its_start_and_ends_within_the_limits(
    plant: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    scale = wrench_scale_of(plant.layout)
    start = plant.sample(np.random.default_rng(1), ())
    asked = Asked()
    monkeypatch.setattr(sqp, "minimize", asked)
    end = program(plant, scale)(np.zeros(6), start)
    np.testing.assert_allclose(end, start, atol=1e-12)
    assert len(asked.said["first"]) == 8  # what has no range is left out
    assert (asked.said["first"] >= 0.0).all() and (asked.said["first"] <= 1.0).all()
    asked.end = np.linspace(-0.5, 1.5, 8)
    end = program(plant, scale)(np.zeros(6), start)
    share = ((end - plant.lower) / np.where(plant.width > 0.0, plant.width, 1.0)).ravel()
    np.testing.assert_allclose(share[plant.width.ravel() > 0.0], asked.end.clip(0.0, 1.0))
    asked.end = np.full(8, np.nan)
    np.testing.assert_array_equal(program(plant, scale)(np.zeros(6), start), start)


def test_its_gradients_are_those_of_differences(
    plant: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    scale = wrench_scale_of(plant.layout)
    rng = np.random.default_rng(2)
    start = plant.sample(rng, ())
    target = rng.normal(size=6)
    asked = Asked()
    monkeypatch.setattr(sqp, "minimize", asked)
    program(plant, scale)(target, start)
    cost, slope = asked.said["cost"], asked.said["jac"]
    missing, rows = (asked.said["constraints"][name] for name in ("fun", "jac"))
    x = rng.uniform(0.2, 0.8, 8)
    steps = 1e-6 * np.eye(8)
    by_differences = [(cost(x + step) - cost(x - step)) / 2e-6 for step in steps]
    np.testing.assert_allclose(slope(x), by_differences, rtol=1e-4, atol=1e-6)
    columns = [(missing(x + step) - missing(x - step)) / 2e-6 for step in steps]
    np.testing.assert_allclose(rows(x), np.array(columns).T, atol=1e-5)
    # Nothing is missing where the command gives the target, along what the fins push at all.
    share = np.zeros(9)
    share[plant.width.ravel() > 0.0] = x
    command = plant.lower + share.reshape(-1, 3) * plant.width
    program(plant, scale)(plant.wrench(command) / scale, start)
    np.testing.assert_allclose(asked.said["constraints"]["fun"](x), 0.0, atol=1e-9)
    # The cost is over a usual one: of random commands it is about 1.
    usual = np.mean([cost(one) for one in rng.random((200, 8))])
    assert usual == pytest.approx(1.0, rel=0.5)


@pytest.mark.parametrize("name", ["bluerov2_heavy", "A"])
def test_a_linear_map_is_the_tangent_at_the_middle_of_the_limits(name: str) -> None:
    plant = plant_of(load_layout(name))
    scale = 0.1 * wrench_scale_of(plant.layout)
    linear = LinearMap(plant, scale)
    np.testing.assert_allclose(linear.reference, 0.5 * (plant.lower + plant.upper))
    np.testing.assert_allclose(linear.wrench, plant.wrench(linear.reference))
    rng = np.random.default_rng(3)
    for _ in range(5):
        share = 1e-3 * rng.normal(size=plant.width.shape)
        moved = plant.wrench(linear.reference + share * plant.width)
        told = linear.matrix @ share.ravel()[linear.has_range]
        np.testing.assert_allclose(told, (moved - linear.wrench) / scale, atol=2e-3)
