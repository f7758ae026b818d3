"""From a state to an answer: picks the allocator for the state's settings and keeps it."""

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
from webapp.session.state import State
from webapp.tasks.density import Densities, densities
from webapp.tasks.mode_names import Modes, known_modes, listed_modes
from webapp.tasks.refinement import refinement

Load = Callable[..., Allocator]

SAMPLING = ("n_candidates", "temperature", "gamma")
"""Fields of a state that are settings of the methods which draw candidates."""


class Attention(NamedTuple):
    """How much the fins look at each other in the network: the graph that it sees."""

    fins: tuple[str, ...]
    """The fins in the graph, n of them: those that work."""
    weight: NDArray[np.float64]
    """How much each fin (rows) looks at each (columns), (n, n); rows sum to 1, itself included."""


@dataclass(frozen=True, eq=False)
class Reply:
    """An answer and what belongs to it."""

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
            return Reply(answer, None, None, modes)
        shown = densities(insight, answer.layout, failed, state.temperature)
        return Reply(answer, shown, Attention(healthy.names, insight.attention), modes)

    def modes(self, reply: Reply) -> Modes:
        """All distinct ways to do what an answer does: a search of its own, tens of milliseconds."""
        return listed_modes(reply.answer.explore(), reply.answer.samples)

    def refinement(self, state: State, answer: Allocation) -> tuple[Allocation, ...]:
        """The steps of the refinement behind an answer to a state.

        Raises:
            FinlabError: the method refines nothing.
        """
        return refinement(self.allocator(state), answer)

    def solve(self, state: State) -> Allocation:
        """The answer to a state.

        Raises:
            FinlabError: the method cannot be loaded or cannot answer.
        """
        return self.allocator(state).allocate(
            state.layout, state.target, failed=state.failed, policy=state.policy, health=state.health, seed=0
        )
