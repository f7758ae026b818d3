"""An allocator that needs no trained network, with candidates and samples as the learned one has them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.multistart import Multistart
from finlab.allocation.methods import METHODS
from finlab.allocation.solution import Candidates, Solution
from finlab.errors import AllocationError
from finlab.inference.normalization import Normalization
from finlab.layout import Layout
from finlab.physics import Plant
from finlab.physics.energy import command_energy

NORMALIZATION = Normalization(np.zeros(6), np.array([1.4, 1.4, 2.0, 0.3, 0.3, 0.35]))
N_REFINED = 4
Array = NDArray[np.float64]


class StandIn(Allocator):
    """Single starts of `multistart` as candidates, noise around them as samples."""

    name = "learned"

    def __init__(
        self,
        normalization: Normalization = NORMALIZATION,
        *,
        n_candidates: int = 64,
        temperature: float = 0.02,
        gamma: float = 0.01,
    ) -> None:
        """Settings as the learned method has them; the temperature widens the samples."""
        self.normalization = normalization
        self.n_candidates, self.temperature, self.gamma = n_candidates, temperature, gamma
        self._inner = Multistart(NORMALIZATION, n_candidates=2)

    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        starts = [self._inner._solve(layout, targets, seed=seed + k, previous=None) for k in range(N_REFINED)]
        refined = np.concatenate([start.command for start in starts])
        lower = layout.lower
        upper = layout.upper
        rng = np.random.default_rng(seed)
        picks = refined[rng.integers(0, N_REFINED, self.n_candidates)]
        noise = rng.normal(size=picks.shape) * (0.05 + self.temperature) * [0.5, 1.5, 2.0]
        samples = _ranked(layout, np.clip(picks + noise, lower, upper), targets[0], upper, "sampled")
        candidates = _ranked(layout, refined, targets[0], upper, "refined")
        return Solution(candidates.command[:1], candidates=lambda: candidates, samples=lambda: samples)


def _ranked(layout: Layout, command: Array, target: Array, upper: Array, source: str) -> Candidates:
    wrench = Plant(layout).wrench(command)
    error = NORMALIZATION.error(wrench, target)
    energy = command_energy(command, upper)
    order = np.argsort(error**2 + 1e-4 * energy)
    return Candidates(command[order], wrench[order], error[order], energy[order], (source,) * len(command))


def load_stand_in(method: str = "learned", *, checkpoint: Any = None) -> Allocator:
    """In place of `load_allocator`: `learned` is the stand-in, `slsqp` fails, all others are `multistart`."""
    if method == "slsqp":
        raise AllocationError("slsqp is out of order in this test")
    if method not in METHODS:
        raise AllocationError(f"method: expected one of {', '.join(METHODS)}, got {method!r}")
    return StandIn() if method == "learned" else Multistart(NORMALIZATION)
