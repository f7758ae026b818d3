"""The weighted sum of error and energy, against exact answers and a general solver."""

import numpy as np
import pytest
from scipy.optimize import minimize

from finlab import load_allocator
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.errors import AllocationError
from finlab.layout import random_layout
from finlab.physics import Plant
from finlab.physics.energy import EnergyWeights, command_energy

INERTIAL = EnergyWeights(0.0, 0.0, 0.0, 0.0, 1.0)


def cases(limits: str, count: int = 8):  # type: ignore[no-untyped-def]
    for seed in range(5200, 5200 + count):
        rng = np.random.default_rng(seed)
        layout = random_layout(rng, n_fins=int(rng.integers(2, 6)), limits=limits)  # type: ignore[arg-type]
        lower, upper = (np.array([getattr(f.limits, e) for f in layout.fins]) for e in ("lower", "upper"))
        yield layout, Plant(layout).wrench(lower + rng.uniform(size=lower.shape) * (upper - lower))


@pytest.mark.parametrize("limits", ["nominal", "varied"])
@pytest.mark.parametrize("weight", [1e-3, 3e-2])
def test_no_small_change_lowers_the_sum(effort: SearchAllocator, limits: str, weight: float) -> None:
    """SciPy, started from the answer on the analytic fin model, finds nothing much better next to it."""
    allocator = load_allocator(objective="effort", energy_tradeoff=weight)
    sigma = allocator.normalization.std
    for layout, target in cases(limits):
        answer = allocator.allocate(layout, target)
        plant = Plant(layout)
        bounds = [
            (lo, hi) for f in layout.fins for lo, hi in zip(f.limits.lower, f.limits.upper, strict=True)
        ]
        upper = layout.upper

        def total(flat: np.ndarray, plant=plant, target=target, upper=upper) -> float:  # type: ignore[no-untyped-def]
            command = flat.reshape(-1, 3)
            error = (plant.wrench(command) - target) / sigma
            return float(error @ error + weight * command_energy(command, upper))

        mine = total(answer.command.ravel())
        better = minimize(total, answer.command.ravel(), bounds=bounds, method="L-BFGS-B").fun
        assert mine <= 1.01 * better + 1e-6
        exact = effort.allocate(layout, target)
        assert mine <= total(exact.command.ravel()) * (1 + 1e-6) + 1e-6
        assert answer.energy <= exact.energy * (1 + 1e-6)


def test_more_weight_gives_up_more_of_the_wrench() -> None:
    layout, target = next(iter(cases("nominal")))
    answers = [
        load_allocator(objective="effort", energy_tradeoff=w).allocate(layout, target)
        for w in (0.0, 1e-3, 1e-2, 1e-1, 1.0)
    ]
    errors, energies = [a.err_norm for a in answers], [a.energy for a in answers]
    assert errors == sorted(errors) and energies == sorted(energies, reverse=True)
    assert errors[0] < 1e-3 < 0.05 < errors[-1]


def test_with_the_previous_command_fins_still_turn_slowly() -> None:
    allocator = load_allocator(objective="effort", energy_tradeoff=1e-2)
    layout, target = next(iter(cases("nominal")))
    first = allocator.allocate(layout, target)
    second = allocator.allocate(layout, target * 1.02, previous=first.command)
    turn = np.angle(np.exp(1j * (second.command - first.command)[:, 2]))
    assert np.abs(turn).max() <= 0.6


def test_what_cannot_be_weighed_is_refused() -> None:
    with pytest.raises(AllocationError, match="from 0, got -1"):
        load_allocator(objective="effort", energy_tradeoff=-1)
    with pytest.raises(
        AllocationError, match="the weighted sum is one of error and effort, got objective 'power'"
    ):
        load_allocator(energy_tradeoff=0.1)


def test_inertial_effort_is_weighed_too() -> None:
    """Also where the effort is no quadratic form: more weight, less effort, more error."""
    layout, target = next(iter(cases("nominal")))
    answers = [
        load_allocator(objective="effort", energy_weights=INERTIAL, energy_tradeoff=w).allocate(
            layout, target
        )
        for w in (0.0, 1e-2, 1.0)
    ]
    effort = [float(command_energy(answer.command, layout.upper, INERTIAL)) for answer in answers]
    errors = [answer.err_norm for answer in answers]
    assert errors == sorted(errors) and effort == sorted(effort, reverse=True)
    assert errors[0] < 1e-3 < errors[-1] and effort[-1] < 0.9 * effort[0]
