"""An allocator that needs no trained network, with candidates and samples as method `mdn` has them."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocator import Allocator
from finlab.allocation.baselines.sqp import Sqp
from finlab.allocation.evaluate import costs
from finlab.allocation.methods import METHODS
from finlab.allocation.settings import Settings, number
from finlab.allocation.solution import Candidates, Solution
from finlab.errors import AllocationError
from finlab.layout import Layout
from finlab.networks.normalization import Normalization
from finlab.physics import Plant

NORMALIZATION = Normalization(np.zeros(6), np.array([1.4, 1.4, 2.0, 0.3, 0.3, 0.35]))
N_REFINED = 4
Array = NDArray[np.float64]


@dataclass(frozen=True)
class StandInSettings(Settings):
    """What can be set of it."""

    n_candidates: int = number(64, 1, 4096, "samples")
    temperature: float = number(0.02, 0.0, 100.0, "width of the samples")
    gamma: float = number(0.01, 0.0, 1.0, "without effect")


class StandIn(Allocator):
    """Answers of `sqp` for power and for effort as candidates, noise around them as samples."""

    name = "mdn"

    settings_class = StandInSettings
    settings: StandInSettings

    def __init__(self, normalization: Normalization = NORMALIZATION, **settings: Any) -> None:
        """Settings as method `mdn` has them; the temperature widens the samples."""
        self.normalization, self.settings = normalization, StandInSettings(**settings)
        self._inner = Sqp(NORMALIZATION, n_starts=1)
        self._other = Sqp(NORMALIZATION, n_starts=1, objective="effort")

    def _made_with(self, options: dict[str, Any]) -> Self:
        return type(self)(self.normalization, **options)

    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        if len(targets) > 1:  # a policy asks for many at once, and for commands alone
            return self._inner._solve(layout, targets, seed=seed, previous=None)
        methods = (self._inner, self._other)
        starts = [methods[k % 2]._solve(layout, targets, seed=seed, previous=None) for k in range(N_REFINED)]
        refined = np.concatenate([start.command for start in starts])
        rng = np.random.default_rng(seed)
        chosen = rng.integers(0, N_REFINED, self.settings.n_candidates)
        noise = rng.normal(size=(self.settings.n_candidates, layout.n_fins, 3)) * (
            0.05 + self.settings.temperature
        )
        sampled = np.clip(refined[chosen] + noise * [0.5, 1.5, 2.0], layout.lower, layout.upper)
        samples = _ranked(layout, sampled, targets[0], chosen)
        candidates = _ranked(layout, refined, targets[0], np.arange(N_REFINED))
        return Solution(candidates.command[:1], candidates=lambda: candidates, samples=lambda: samples)


def _ranked(layout: Layout, command: Array, target: Array, component: NDArray[np.int64]) -> Candidates:
    wrench = Plant(layout).wrench(command)
    error = NORMALIZATION.error(wrench, target)
    effort, power = costs(layout, command)
    order = np.argsort(error**2 + 1e-4 * effort)
    source = tuple(f"component {k + 1}" for k in component[order].tolist())
    return Candidates(command[order], wrench[order], error[order], effort[order], power[order], source)


def load_stand_in(method: str = "dual", *, checkpoint: Any = None) -> Allocator:
    """As `load_allocator`: `search` and `mdn` are the stand-in, `ipopt` fails, the rest is `sqp`."""
    if method == "ipopt":
        raise AllocationError("ipopt is out of order in this test")
    if method not in METHODS:
        raise AllocationError(f"method: expected one of {', '.join(METHODS)}, got {method!r}")
    return StandIn() if method in ("dual", "mdn") else Sqp(NORMALIZATION)
