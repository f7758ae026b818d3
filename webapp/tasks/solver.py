"""From a state to an answer with all that a page shows of it: picks the allocator and keeps it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import load_allocator
from finlab.allocation.solution import Insight
from finlab.errors import AllocationError
from finlab.layout import Layout
from webapp.session.state import State
from webapp.tasks.mode_names import Modes, known_modes, listed_modes

Array = NDArray[np.float64]

POINTS = 161
"""Places at which a density is drawn."""
NARROWEST = 0.006
"""Least standard deviation drawn, in normalized commands; a narrower peak would fall between places."""

STEPS = 6
"""Steps of Levenberg-Marquardt that are shown; the error has long vanished by then."""

Load = Callable[..., Allocator]

SAMPLING = ("n_candidates", "temperature", "gamma")
"""Fields of a state that are settings of the methods which draw candidates."""


class Densities(NamedTuple):
    """Curves of one layout, each with its highest point at 1."""

    places: Array
    """Amplitude [deg], frequency [Hz] and zero direction [deg] at which the curves are known (3, POINTS)."""
    curves: Array
    """Densities (n, 3, POINTS) of all fins in the layout's order; NaN for failed ones."""


def densities(insight: Insight, layout: Layout, failed: tuple[str, ...], temperature: float) -> Densities:
    """The mixture for a target, with its variances times the temperature as the sampling has them.

    Args:
        insight: what the network makes of the target and the fins that work.
        layout: the robot.
        failed: names of failed fins.
        temperature: T of the sampling.
    """
    healthy = layout.without(failed) if failed else layout
    weight, mean, std = insight.weight, insight.mean, insight.std
    std = np.maximum(std * np.sqrt(temperature), NARROWEST)
    lower, upper = healthy.lower, healthy.upper
    places = np.linspace(lower.min(axis=0), upper.max(axis=0), POINTS, axis=1)  # (3, P)
    width = np.maximum(upper - lower, 1e-9)
    at = 2 * (places[None] - lower[:, :, None]) / width[:, :, None] - 1  # (n, 3, P), normalized
    distance = (at[:, None] - mean[..., None]) / std[..., None]  # (n, M, 3, P)
    peaks = np.exp(-0.5 * distance**2) / std[..., None]
    inside = np.einsum("m,nmcp->ncp", weight, peaks) * (np.abs(at) <= 1 + 1e-9)
    curves = np.full((layout.n_fins, 3, POINTS), np.nan)
    rows = [i for i, name in enumerate(layout.names) if name not in failed]
    curves[rows] = inside / np.maximum(inside.max(axis=-1, keepdims=True), 1e-12)
    degrees = np.array([180 / np.pi, 1.0, 180 / np.pi])
    return Densities(places * degrees[:, None], curves)


class Attention(NamedTuple):
    """How much the fins look at each other in the network: the graph that it sees."""

    fins: tuple[str, ...]
    """The fins in the graph, n of them: those that work."""
    weight: NDArray[np.float64]
    """How much each fin (rows) looks at each (columns), (n, n); rows sum to 1, itself included."""


@dataclass(frozen=True, eq=False)
class Reply:
    """An answer and what belongs to it."""

    state: State
    """The question."""
    answer: Allocation
    """The answer itself."""
    densities: Densities | None
    """What the network proposed, for methods with one."""
    attention: Attention | None
    """How much its fins look at each other, for methods with a network."""
    modes: Modes
    """Those of its modes that are known anyway: a few."""


class Solver:
    """Answers states. Used from one thread only, the worker's."""

    def __init__(self, checkpoint: str | Path | None = None, load: Load = load_allocator) -> None:
        """`checkpoint` is a name or folder, None for the shipped one; `load` is replaced in tests."""
        self._checkpoint = checkpoint
        self._load = load
        self._allocators: dict[str, Allocator] = {}

    @cached_property
    def aside(self) -> "Solver":
        """Another solver with the same checkpoint, for another thread."""
        return Solver(self._checkpoint, self._load)

    def loaded(self, method: str) -> Allocator:
        """The allocator of a method as it is shipped, loaded once.

        Raises:
            FinlabError: it cannot be loaded.
        """
        if method not in self._allocators:
            checkpoint = None if method == "paper" else self._checkpoint
            self._allocators[method] = self._load(method, checkpoint=checkpoint)
        return self._allocators[method]

    def allocator(self, state: State) -> Allocator:
        """The allocator for the state's method with the state's settings.

        Raises:
            FinlabError: it cannot be loaded.
        """
        allocator = self.loaded(state.method)
        if not set(SAMPLING) <= set(allocator.option_names()):
            return allocator
        return allocator.with_settings(**{key: getattr(state, key) for key in SAMPLING})

    def reply(self, state: State) -> Reply:
        """The answer to a state with all that a page shows of it, computed to the end.

        Raises:
            FinlabError: the method cannot be loaded or cannot answer.
        """
        answer, failed = self.solve(state), state.failed
        healthy = answer.layout.without(failed) if failed else answer.layout
        insight = self.allocator(state).insight(healthy, state.target)
        modes = listed_modes(known_modes(answer), answer.samples)
        if insight is None:
            return Reply(state, answer, None, None, modes)
        shown = densities(insight, answer.layout, failed, state.temperature)
        return Reply(state, answer, shown, Attention(healthy.names, insight.attention), modes)

    def modes(self, reply: Reply) -> Modes:
        """All distinct ways to do what an answer does: a search of its own, tens of milliseconds."""
        return listed_modes(reply.answer.explore(), reply.answer.samples)

    def refinement(self, reply: Reply) -> tuple[Allocation, ...]:
        """The best raw candidate of an answer, what each step makes of it, and the answer itself at the end.

        Raises:
            AllocationError: the method draws no candidates and refines none.
        """
        allocator, answer = self.allocator(reply.state), reply.answer
        if answer.samples is None:
            raise AllocationError(f"method {allocator.name!r} draws no candidates; use method 'learned'")
        layout = answer.layout.without(answer.failed) if answer.failed else answer.layout
        alive = np.isfinite(answer.command[:, 0])
        raw = answer.samples.command[0][alive]
        frames = []
        for steps in range(STEPS + 1):
            command = np.full_like(answer.command, np.nan)
            command[alive] = allocator.refined(layout, answer.target, raw, steps)
            frames.append(answer.with_command(command))
        return (*frames, answer)

    def solve(self, state: State) -> Allocation:
        """The answer to a state.

        Raises:
            FinlabError: the method cannot be loaded or cannot answer.
        """
        return self.allocator(state).allocate(
            state.layout, state.target, failed=state.failed, policy=state.policy, health=state.health, seed=0
        )
