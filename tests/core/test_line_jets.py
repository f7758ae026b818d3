"""Jets of thrusters at rest by rates of pairs: what `fl_jets` says, for forces of any size, either
way, and near rest."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest

import finlab
from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.dual.outer_iterations import coupled_core
from finlab.arrays import Array
from finlab.core.coupled_core import CoupledCore
from finlab.interaction.jets import Jets
from finlab.physics import Plant
from finlab.research.random_layouts import random_jet_robot, random_thruster
from tests.core.internal_functions import Span, at, functions

OFFSET_OFF = 1e-10
"""Share of an offset by which cubics may be off."""
SLOPE_OFF = 1e-8
"""The same of its slope."""


def robot_of(number: int) -> tuple[Plant, CoupledCore]:
    """A random robot of thrusters with jets, and the core's; shipped ones for the first numbers."""
    if number < 2:
        layout = finlab.load_layout(("bluerov2_heavy", "bluerov2")[number])
    else:
        rng = np.random.default_rng([78, number])
        layout = random_jet_robot(rng, "robot", (7, 9), [random_thruster])
    plant = Plant(replace(layout, interaction=Jets()))
    return plant, coupled_core(plant, Compiled.of(replace(layout, interaction=None)))


def offset_of(core: CoupledCore, force: Array, lost: list[int]) -> tuple[Array, Array]:
    """The offset (6,) of forces (n,) [N] along the laws' axes, and its derivatives (n, 6)."""
    span = Span()
    for i in lost:
        span.is_lost[i] = 1
    along = np.zeros((core.n, 3))
    along[:, 0] = force
    offset = np.zeros(6)
    slope = np.zeros((core.n, 3, 6))
    functions().fl_jets_of_lines(
        ctypes.c_void_p(core._robot_address), ctypes.byref(span), at(along), at(offset), at(slope)
    )
    return offset, slope[:, 0]


def expected_of(plant: Plant, core: CoupledCore, force: Array) -> tuple[Array, Array]:
    """The same by `fl_jets`."""
    axes = core._wrench_offset.frames[:, 0]
    assert plant.interaction is not None
    offset, slope = plant.interaction.effect(force[:, None] * axes)
    return offset, np.einsum("na,naw->nw", axes, slope)


def assert_same(got: tuple[Array, Array], expected: tuple[Array, Array]) -> None:
    """Fails unless offset and slope are the same."""
    for one, other, off in zip(got, expected, (OFFSET_OFF, SLOPE_OFF), strict=True):
        np.testing.assert_allclose(one, other, atol=off * np.abs(other).max())


@pytest.mark.parametrize("number", range(5))
def test_offsets_and_slopes_are_those_of_the_formula(number: int) -> None:
    plant, core = robot_of(number)
    rng = np.random.default_rng([1, number])
    for _ in range(100):
        force = rng.normal(size=core.n) * 10.0 ** rng.uniform(-4.0, 2.0)
        assert_same(offset_of(core, force, []), expected_of(plant, core, force))


@pytest.mark.parametrize("number", range(2))
def test_forces_near_rest_are_those_of_the_formula(number: int) -> None:
    plant, core = robot_of(number)
    rng = np.random.default_rng([2, number])
    for near in (0.0, 1e-9, -1e-6, 1e-3, -0.02, 0.06, -0.07, 0.1):
        force = 10.0 * rng.normal(size=core.n)
        force[rng.integers(core.n)] = near
        assert_same(offset_of(core, force, []), expected_of(plant, core, force))


def test_a_lost_thruster_has_no_jet_but_stands_in_those_of_others() -> None:
    plant, core = robot_of(0)
    rng = np.random.default_rng(3)
    lost = [2, 5]
    force = 10.0 * rng.normal(size=core.n)
    force[lost] = 0.0
    offset, slope = offset_of(core, force, lost)
    expected, expected_slope = expected_of(plant, core, force)
    works = [i for i in range(core.n) if i not in lost]
    assert_same((offset, slope[works]), (expected, expected_slope[works]))


def test_other_robots_have_none() -> None:
    layout = finlab.load_layout("A")
    plant = Plant(replace(layout, interaction=Jets()))
    core = coupled_core(plant, Compiled.of(replace(layout, interaction=None)))
    assert len(core.line_jets) == 0
    assert int(core._robot["line_jets"][0]) == 0
    moving, _core = robot_of(0)
    in_flow = moving.at(np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]))
    compiled = Compiled.of(replace(moving.layout, interaction=None))
    assert len(coupled_core(in_flow, compiled).line_jets) == 0
