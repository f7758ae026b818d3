"""Targets that the first search does not reach: hard ones are found, and those out of reach cost little."""

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.allocation.learned.refined_candidates import MISSED, RANKING, RefinedCandidates, reduce_energy
from finlab.forces.force_space import polar, realize
from finlab.layout import Fin, Layout, Limits
from finlab.physics import Plant
from finlab.physics.energy import POWER_WEIGHTS, EnergyMeter


def with_arcs(seed: int) -> tuple[Layout, np.ndarray]:
    """A robot whose fins have arcs of any width, 12 wrenches within its reach and 12 mostly out of it."""
    rng = np.random.default_rng(seed)
    fins = []
    for i in range(int(rng.integers(2, 9))):
        first, width = rng.uniform(-3, 2.5), rng.uniform(0.2, 6)
        position = rng.uniform(-1, 1, 3) * [0.3, 0.3, 0.1]
        x, y, z = (float(value) for value in position)
        angle = float(rng.uniform(-3, 3))
        amplitude, frequency = float(rng.choice([0.05, 0.3])), float(rng.choice([0.1, 1.5]))
        limits = Limits((amplitude, 0.6), (frequency, 2.1), (float(first), float(min(first + width, 3.14))))
        fins.append(Fin(f"f{i}", (x, y, z), angle, limits))
    layout = Layout("arcs", tuple(fins))
    plant = Plant(layout)
    wrench = plant.wrench(plant.sample(rng, (24,)))
    return layout, np.concatenate([wrench[:12], 2.5 * wrench[12:]])


@pytest.mark.parametrize(("seed", "target", "least"), [(5065, 14, 2.367)])
def test_enough_fresh_starts_find_what_fins_with_arcs_can_do(
    learned: LearnedAllocator, seed: int, target: int, least: float
) -> None:
    """With two starts in place of 32 the first error is 2.52."""
    layout, targets = with_arcs(seed)
    answer = learned.allocate_batch(layout, targets)
    assert answer.wrench_surrogate is not None
    error = learned.normalization.error(answer.wrench_surrogate, targets)
    assert error[target] < 1.005 * least


@pytest.mark.parametrize(("seed", "target"), [(5084, 17), (5092, 13)])
def test_out_of_reach_forces_are_given_at_little_power(seed: int, target: int) -> None:
    """Without the last refinement these need 4 % more than their forces are to be had for."""
    allocator = load_allocator(energy_weights=POWER_WEIGHTS)
    assert isinstance(allocator, LearnedAllocator)
    layout, targets = with_arcs(seed)
    command = allocator.allocate_batch(layout, targets).command[target : target + 1]
    planar, commands = allocator.pipeline.prepare(layout).planar, allocator.pipeline.prepare(layout).commands
    cheapest, _ = realize(planar, polar(planar, commands.fin.force(command)[..., 1:]))
    energy = EnergyMeter(layout.upper, POWER_WEIGHTS)
    assert energy(command)[0] < 1.01 * energy(cheapest)[0]


def test_a_dear_inexact_answer_becomes_cheap(learned: LearnedAllocator) -> None:
    layout = Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0),))
    prepared = learned.pipeline.prepare(layout)
    dear = np.array([[[[0.1, 2.1, 0.3]]]])  # small strokes, quick beats
    wrench = prepared.commands.wrench(dear[0])
    aside = np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]])  # a torque, which a fin at the origin cannot give
    error = np.ones((1, 1))
    candidates = RefinedCandidates(dear.copy(), wrench[None], error, prepared.energy(dear[0])[None])
    before = candidates.energy[0, 0]
    reduce_energy(prepared, wrench + aside, candidates, MISSED.energy_lm_steps)
    assert candidates.energy[0, 0] < 0.95 * before
    assert candidates.error[0, 0] <= 1.0 + RANKING.error_resolution
