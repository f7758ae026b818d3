"""Laws that are formulas in the core: figures of commands, and conjugates of propellers, held
against those of the laws in numpy."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.allocation.dual.bound import bound_by_laws
from finlab.allocation.dual.compiled import Compiled
from finlab.arrays import Array
from finlab.core.calls import NOMINAL, Conditions
from finlab.layout import Layout, load_layout
from finlab.layout.effectiveness import body_force
from finlab.physics import plant_of
from finlab.physics.objective import judged_power
from tests.random_robots import load, random_robot, with_dead_bands, with_rates

CLOSE = 1e-12
"""Share by which two ways to sum the same may differ."""
FORMULA_KINDS = ("thrusters", "azimuths", "fins", "fins any shaft", "fins uneven", "holes")
"""Kinds of random robots, of which most have formulas alone."""
COMMANDS = 20
"""Random commands of each robot."""


def robot(kind: str, number: int) -> Layout:
    """A random robot, whose thrusters have dead bands where it has any."""
    mapping = random_robot(kind, number, seed=5)
    if kind == "thrusters":
        mapping = with_dead_bands(mapping, np.random.default_rng(number))
    return load(mapping)


def check_figures(layout: Layout, command: Array) -> None:
    """Figures of one command (n, 3) are those of the plant."""
    plant = plant_of(layout)
    figures = plant.figures(command)
    assert figures is not None
    force = plant.forces(command[None])
    largest = abs(force).max() + 1e-9
    np.testing.assert_allclose(figures.own_force, force, rtol=0.0, atol=CLOSE * largest)
    in_body = body_force(force, layout.frames)[0]
    np.testing.assert_allclose(figures.force, in_body, rtol=0.0, atol=CLOSE * largest)
    wrench = plant.wrench_of(force)[0]
    sizes = (abs(force)[..., None] * abs(plant.effectiveness)).sum(axis=(0, 1, 2))
    assert np.all(abs(figures.wrench - wrench) <= CLOSE * (sizes + 1e-9))
    assert figures.power == pytest.approx(float(judged_power(plant, command[None])[0]), rel=CLOSE)


@pytest.mark.parametrize("number", range(3))
@pytest.mark.parametrize("kind", FORMULA_KINDS)
def test_figures_are_those_of_the_plant(kind: str, number: int) -> None:
    layout = robot(kind, number)
    plant = plant_of(layout)
    rng = np.random.default_rng(number)
    commands = plant.sample(rng, (COMMANDS,))
    if plant.figures(commands[0]) is None:
        has_tables = any(
            getattr(actuator, "model", None) is not None and actuator.model.type == "table"
            for actuator in layout.actuators
        )
        assert has_tables, "only a table is no formula"
        return
    for k, command in enumerate(commands):
        command[k % layout.n] *= k % 3 != 0  # some rest
        check_figures(layout, command)
        command[(k + 1) % layout.n] = np.nan  # one is lost
        check_figures(layout, command)


@pytest.mark.parametrize("name", ["A", "fish", "bluerov2_heavy", "catamaran", "turtle_hybrid"])
def test_shipped_robots_are_judged_by_formulas(name: str) -> None:
    layout = load_layout(name)
    commands = plant_of(layout).sample(np.random.default_rng(1), (COMMANDS,))
    for command in commands:
        check_figures(layout, command)


def test_axes_that_do_not_count_are_0() -> None:
    layout = load_layout("A")
    plant = plant_of(layout)
    command = plant.sample(np.random.default_rng(2), ())
    assert plant.figures(command) is not None  # made before the axes are left out
    counting = plant.counting(np.arange(6) < 3)
    figures = counting.figures(command)
    assert figures is not None and not figures.wrench[3:].any() and figures.wrench[:3].any()


@pytest.mark.parametrize("bad", [np.inf, -np.inf, np.nan, 1e300])
def test_no_command_of_the_robot_has_no_figures(bad: float) -> None:
    plant = plant_of(load_layout("A"))
    command = plant.sample(np.random.default_rng(3), ())
    assert plant.figures(command[1:]) is None
    command[0, 1] = bad
    assert plant.figures(command) is None


def test_tables_foils_and_jets_are_judged_by_the_plant() -> None:
    from finlab.interaction.jets import Jets

    heavy = load_layout("bluerov2_heavy")
    for layout in (
        load_layout("bluerov2"),  # tables
        load_layout("torpedo"),  # foils
        replace(heavy, interaction=Jets()),
    ):
        plant = plant_of(layout)
        assert plant.figures(plant.sample(np.random.default_rng(4), ())) is None


def test_a_single_answer_and_a_batch_say_the_same() -> None:
    for name in ("A", "fish", "bluerov2_heavy"):
        allocator = Allocator(load_layout(name))
        wrenches = np.array([[1.0, 0.2, 0.1, 0.01, 0.0, 0.05], [40.0, 0.0, 3.0, 0.0, 0.0, 9.0]])
        batch = allocator.allocate_batch(wrenches)
        for k, wrench in enumerate(wrenches):
            single = allocator.allocate(wrench)
            for figure in ("wrench", "forces", "unallocated"):
                np.testing.assert_allclose(
                    getattr(single, figure), getattr(batch, figure)[k], rtol=0.0, atol=1e-9
                )
            for figure in ("power", "err_norm", "bound"):
                many = getattr(batch, figure)[k]
                assert getattr(single, figure) == pytest.approx(many, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("number", range(3))
@pytest.mark.parametrize("kind", ["thrusters", "azimuths", "mixed"])
def test_bounds_of_propellers_are_those_of_their_laws(kind: str, number: int) -> None:
    layout = load(with_rates(random_robot(kind, number, seed=3)))
    compiled = Compiled.of(layout)
    margins = compiled.conjugate_margins
    assert compiled.is_certified == margins.are_complete
    if not compiled.is_certified:
        return
    rng = np.random.default_rng(number)
    largest_power = max(compiled.largest_power, 1.0)
    sizes = np.exp(2.0 * rng.normal(size=(50, 1)))
    multipliers = rng.normal(size=(50, 6)) * sizes * largest_power / compiled.axis_scale
    wrench = 0.3 * rng.normal(size=(50, 6)) * compiled.axis_scale
    is_first = np.arange(layout.n) == 0
    previous = plant_of(layout).sample(rng, ())
    for conditions in (
        NOMINAL,
        Conditions(None, is_first),
        Conditions(previous),
        Conditions(previous, ~is_first),
    ):
        by_core = compiled.core.power_bounds(multipliers, wrench, margins, conditions)
        by_laws = np.maximum(bound_by_laws(compiled, wrench, multipliers, conditions), 0.0)
        np.testing.assert_allclose(by_core, by_laws, rtol=1e-10, atol=1e-10 * largest_power)


def test_a_dead_band_leaves_the_bound_to_the_laws() -> None:
    layout = robot("thrusters", 0)
    assert not Compiled.of(layout).is_certified
    without = replace(
        layout, actuators=tuple(replace(each, dead_band=0.0) for each in layout.actuators)
    )
    assert Compiled.of(without).is_certified
