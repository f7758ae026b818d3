"""Targets that the first search does not reach: hard ones are found, and those out of reach cost little."""

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.search.refined_candidates import MISSED, RANKING, RefinedCandidates, reduce_cost
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.forces.force_space import polar, realize
from finlab.layout import Fin, Layout, Limits
from finlab.physics import Plant
from finlab.physics.energy import EnergyWeights
from finlab.physics.objective import Name


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


@pytest.mark.parametrize("seed", range(5060, 5100, 3))
@pytest.mark.parametrize("objective", ["power", "effort"])
def test_what_is_within_reach_is_found(objective: Name, seed: int) -> None:
    method = load_allocator(objective=objective)
    layout, targets = with_arcs(seed)
    assert method.allocate_batch(layout, targets[:12]).err_norm.max() < 1e-5


@pytest.mark.parametrize(("seed", "target", "least"), [(5065, 14, 2.367)])
def test_enough_fresh_starts_find_what_fins_with_arcs_can_do(
    search: SearchAllocator, seed: int, target: int, least: float
) -> None:
    layout, targets = with_arcs(seed)
    assert search.allocate_batch(layout, targets).err_norm[target] < 1.001 * least


@pytest.mark.parametrize("objective", ["power", "effort"])
@pytest.mark.parametrize(("seed", "target"), [(5064, 17), (5080, 21), (5087, 12), (5087, 14), (5099, 14)])
def test_out_of_reach_forces_are_given_at_little_cost(seed: int, target: int, objective: Name) -> None:
    """No more than what these forces are to be had for, the direction of a fin at rest left out."""
    allocator = load_allocator(objective=objective, energy_weights=EnergyWeights(zero_direction=0.0))
    layout, targets = with_arcs(seed)
    answer = allocator.allocate_batch(layout, targets[target : target + 1])
    assert answer.err_norm > 0.5
    prepared = allocator.pipeline.prepare(layout)
    force = prepared.plant.force(answer.command)[..., 1:]
    cheapest, _ = realize(prepared.planar, polar(prepared.planar, force))
    least = prepared.cost(prepared.commands.feasible(cheapest))[0]
    assert prepared.cost(answer.command)[0] < {"power": 1.01, "effort": 1.03}[objective] * least


@pytest.mark.parametrize("objective", ["power", "effort"])
def test_a_dear_inexact_answer_becomes_cheap(objective: Name) -> None:
    layout = Layout("one", (Fin("a", (0.0, 0.0, 0.0), 0.0),))
    allocator = load_allocator(objective=objective)
    prepared = allocator.pipeline.prepare(layout)
    dear = np.array([[[[0.1, 2.1, 0.3]]]])  # small strokes, quick beats
    if objective == "power":
        dear = np.array([[[[0.6, 0.35, 0.3]]]])  # large strokes, slow beats, which drag brakes
    wrench = prepared.commands.wrench(dear[0])
    aside = np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]])  # a torque, which a fin at the origin cannot give
    error, origin = np.ones((1, 1)), np.zeros((1, 1), np.intp)
    candidates = RefinedCandidates(dear.copy(), wrench[None], error, prepared.cost(dear[0])[None], origin)
    before = candidates.cost[0, 0]
    reduce_cost(prepared, wrench + aside, candidates, MISSED.cost_lm_steps)
    assert candidates.cost[0, 0] < 0.999 * before
    assert candidates.error[0, 0] <= 1.0 + RANKING.error_resolution
