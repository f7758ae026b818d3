"""From a state to an answer: picks the allocator for the state's settings and keeps it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.methods import load_allocator
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
        self._allocators: dict[str, tuple[dict[str, Any], Allocator]] = {}

    def allocator(self, state: State) -> Allocator:
        """The allocator for the state's method and settings; loads it when they have changed."""
        options: dict[str, Any] = {}
        if state.method in SAMPLING_METHODS:
            options = {
                "n_candidates": state.n_candidates,
                "temperature": state.temperature,
                "gamma": state.gamma,
            }
        known = self._allocators.get(state.method)
        if known is None or known[0] != options:
            checkpoint = None if state.method == "paper" else self._checkpoint
            known = (options, self._load(checkpoint, method=state.method, **options))
            self._allocators[state.method] = known
        return known[1]

    def solve(self, state: State) -> Allocation:
        """The answer to a state.

        Raises:
            FinlabError: the method cannot be loaded or cannot answer.
        """
        return self.allocator(state).allocate(state.layout, state.target, failed=state.failed, seed=0)
