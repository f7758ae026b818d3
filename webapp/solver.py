"""From a state to an answer: picks the allocator for the state's settings and keeps it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import load_allocator
from webapp.density import Densities, densities
from webapp.refinement import refinement
from webapp.state import State

Load = Callable[..., Allocator]

SAMPLING_METHODS = ("learned", "paper")
"""Methods that K, T and gamma mean something to."""


class Solver:
    """Answers states. Used from one thread only, the worker's."""

    def __init__(self, checkpoint: str | Path | None = None, load: Load = load_allocator) -> None:
        """`checkpoint` is a name or folder, None for the shipped one; `load` is replaced in tests."""
        self._checkpoint = checkpoint
        self._load = load
        self._allocators: dict[str, Allocator] = {}

    def allocator(self, state: State) -> Allocator:
        """The allocator for the state's method and settings, loaded once per method.

        Raises:
            FinlabError: it cannot be loaded.
        """
        if state.method not in self._allocators:
            checkpoint = None if state.method == "paper" else self._checkpoint
            self._allocators[state.method] = self._load(checkpoint, method=state.method)
        allocator = self._allocators[state.method]
        if state.method in SAMPLING_METHODS:
            # They take effect on the next answer; a network is not loaded again for each step of a slider.
            for key in ("n_candidates", "temperature", "gamma"):
                setattr(allocator, key, getattr(state, key))
        return allocator

    def densities(self, state: State) -> Densities | None:
        """What the network proposes for a state; None for methods without one."""
        allocator = self.allocator(state)
        return densities(allocator, state.layout, state.failed, np.array(state.target), state.temperature)

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
            state.layout, state.target, failed=state.failed, policy=state.policy, seed=0
        )
