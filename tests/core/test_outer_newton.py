"""Newton's method on multipliers and forces at once, for robots of thrusters with jets: its answers
fulfil the conditions of Karush, Kuhn and Tucker by the plant, whatever was asked before, and take
few evaluations of the model."""

from dataclasses import replace

import numpy as np
import pytest

import finlab
from finlab import Allocator
from finlab.allocation.dual.compiled import core_policy
from finlab.allocation.dual.outer_iterations import start_factors
from finlab.allocation.policy import CLOSEST
from finlab.arrays import Array
from finlab.core.calls import NOMINAL
from finlab.core.coupled_core import CoupledCore, WrenchOffset
from finlab.interaction.jets import Jets
from finlab.physics import Plant
from finlab.research.random_layouts import random_jet_robot, random_thruster

MIN_FORCE = 1e-5
"""Forces [N] below which differences of the power say nothing of its slope."""


def thrusters(seed: int) -> finlab.Layout:
    """A random robot of thrusters with jets; the BlueROV2 Heavy for 0."""
    if seed == 0:
        return replace(finlab.load_layout("bluerov2_heavy"), interaction=Jets())
    rng = np.random.default_rng([77, seed])
    return replace(random_jet_robot(rng, "robot", (7, 8), [random_thruster]), interaction=Jets())


def targets_within(layout: finlab.Layout, share: float, count: int) -> Array:
    """Wrenches (N, 6) at a share of what the laws alone give along random rays."""
    plain = Allocator(replace(layout, interaction=None))
    directions = np.random.default_rng(2).normal(size=(count, 6)) * plain.scale
    at_rim = plain.allocate_batch(50.0 * directions, policy="direction").wrench
    return np.asarray(share * at_rim)


def gradient_left(plant: Plant, command: Array, multipliers: Array) -> Array:
    """What is left of the gradient of the Lagrange function by the forces (n,) of thrusters within
    their limits, over its largest part [1]."""
    force = command[:, 0]
    step = 1e-6 * np.maximum(np.abs(force), 1.0)
    powers = [
        plant.power(command + sign * step[:, None] * [1.0, 0.0, 0.0]).ravel() for sign in (1, -1)
    ]
    marginal_power = (powers[0] - powers[1]) / (2.0 * step)
    body_force = plant.body_forces(command)
    assert plant.interaction is not None
    _, slope = plant.interaction.effect(body_force)
    axis = np.array([actuator.axis for actuator in plant.layout.actuators])  # type: ignore[attr-defined]
    by_force = plant.effectiveness[:, 0] + np.einsum("na,naw->nw", axis, slope)
    price = by_force @ multipliers
    is_free = (
        (np.abs(force) > MIN_FORCE) & (force < plant.upper[:, 0]) & (force > plant.lower[:, 0])
    )
    largest = np.abs(marginal_power).max()
    return np.asarray(np.where(is_free, marginal_power - price, 0.0) / largest)


@pytest.mark.parametrize("seed", range(4))
def test_the_gradient_of_the_power_is_in_the_range_of_the_whole_slope(seed: int) -> None:
    layout = thrusters(seed)
    plant = Plant(layout)
    allocator = Allocator(layout)
    left = []
    for target in targets_within(layout, 0.3, 20):
        result = allocator.allocate(target)
        assert result.err_norm <= 1e-6
        left.append(np.abs(gradient_left(plant, result.command, result.multipliers)).max())
    # A few are answered by outer iterations, which end where they gain little.
    assert np.median(left) <= 1e-5
    assert np.quantile(left, 0.9) <= 5e-3


@pytest.mark.parametrize("seed", range(4))
def test_answers_do_not_depend_on_questions_before(seed: int) -> None:
    layout = thrusters(seed)
    targets = targets_within(layout, 0.3, 4)
    allocator = Allocator(layout)
    first = [allocator.allocate(target).command for target in targets]
    lost = layout.names[0]
    for target, command in zip(targets, first, strict=True):
        before = allocator.allocate(20.0 * target, policy="direction")
        allocator.allocate(target, previous=before)
        allocator.allocate(target, lost=[lost])
        allocator.allocate(target, free=["Ty"])
        np.testing.assert_array_equal(allocator.allocate(target).command, command)
        np.testing.assert_array_equal(Allocator(layout).allocate(target).command, command)


def test_an_answer_takes_few_evaluations_of_the_model() -> None:
    layout = thrusters(0)
    method = Allocator(layout)._whole.method  # type: ignore[attr-defined]
    interaction = method.plant.interaction
    count = 0

    def effect(force: Array, inflow: Array | None) -> tuple[Array, Array]:
        nonlocal count
        count += 1
        effect: tuple[Array, Array] = interaction.effect(force, inflow)
        return effect

    compiled = method.compiled
    core = CoupledCore(
        compiled.block,
        WrenchOffset(
            frames=compiled.axes @ layout.frames,
            counts=np.array(method.plant.counts),
            inflow=None,
            core_constants=None,
            effect=effect,
            starts=start_factors(compiled.is_line),
        ),
    )
    counts = []
    for target in targets_within(layout, 0.5, 30):
        count = 0
        assert core.answer_row(target, core_policy(CLOSEST), None, NOMINAL, 1e-8).is_met
        counts.append(count)
    # The first linear model and three more, and one or two for each of the two starts that may end
    # elsewhere; a force near 0, which is held, takes a dozen more.
    assert np.median(counts) <= 12
    assert max(counts) <= 120
