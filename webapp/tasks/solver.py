"""From a state to an answer with all that a page shows of it: picks the allocator and keeps it."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.allocation.allocator import Allocator
from finlab.allocation.evaluate import evaluate
from finlab.allocation.methods import load_allocator
from finlab.allocation.modes import Mode
from finlab.allocation.solution import Candidates
from finlab.forces.reach import axis_ranges
from finlab.layout import Layout
from webapp.session.state import State
from webapp.tasks.mode_names import Modes, known_modes, listed_modes

Load = Callable[..., Allocator]


@dataclass(frozen=True, eq=False)
class Reply:
    """An answer and what belongs to it."""

    state: State
    """The question."""
    answer: Allocation
    """The answer itself."""
    modes: Modes
    """Those of its modes that are known anyway: a few."""
    in_reach: bool
    """Whether any command of the working fins gives what is asked."""


class Solver:
    """Answers states. Used from one thread only, the worker's."""

    def __init__(self, checkpoint: str | Path | None = None, load: Load = load_allocator) -> None:
        """`checkpoint` is a name or folder, None for the shipped one; `load` is replaced in tests."""
        self._checkpoint = checkpoint
        self._load = load
        self._allocators: dict[tuple[str, str], Allocator] = {}

    @cached_property
    def aside(self) -> "Solver":
        """Another solver with the same checkpoint, for another thread."""
        return Solver(self._checkpoint, self._load)

    def loaded(self, method: str, objective: str) -> Allocator:
        """The allocator of a method as it is shipped, loaded once for each objective that it knows.

        Raises:
            FinlabError: it cannot be loaded.
        """
        known = self._allocators
        if (method, objective) not in known:
            checkpoint = None if method == "paper" else self._checkpoint
            allocator = self._load(method, checkpoint=checkpoint)
            if "objective" in allocator.option_names():
                allocator = allocator.with_settings(objective=objective)
            known[method, objective] = allocator
        return known[method, objective]

    def allocator(self, state: State) -> Allocator:
        """The allocator for the state's method with the state's settings.

        Raises:
            FinlabError: it cannot be loaded.
        """
        allocator = self.loaded(state.method, state.objective)
        known = allocator.options
        own = {key: v for key, v in state.drawing.items() if getattr(state, key) is not None and key in known}
        changes = {key: value for key, value in own.items() if value != known[key]}
        return allocator.with_settings(**changes) if changes else allocator

    def reply(self, state: State) -> Reply:
        """The answer to a state with all that a page shows of it, computed to the end.

        Raises:
            FinlabError: the method cannot be loaded or cannot answer.
        """
        answer, failed = judged(self.solve(state)), state.failed
        modes = listed_modes(known_modes(answer), answer.samples)
        in_reach = answer.reachable or is_within(answer.layout, state.target, failed)
        return Reply(state, answer, modes, in_reach)

    def modes(self, reply: Reply) -> Modes:
        """All distinct ways to do what an answer does: a search of its own, tens of milliseconds."""
        answer = reply.answer
        return listed_modes(judged_modes(answer, self.allocator(reply.state).explore(answer)), answer.samples)

    def solve(self, state: State) -> Allocation:
        """The answer to a state.

        Raises:
            FinlabError: the method cannot be loaded or cannot answer.
        """
        return self.allocator(state).allocate(
            state.layout, state.target, failed=state.failed, policy=state.policy, health=state.health, seed=0
        )


def judged(answer: Allocation) -> Allocation:
    """An answer whose candidates and samples tell what the fins' own laws make of them, as it does itself.

    A method with a learned model ranks them by what that believes.
    """
    if answer.wrench_surrogate is None:
        return answer
    told = (
        None if found is None else _judged(answer, found) for found in (answer.candidates, answer.samples)
    )
    candidates, samples = told
    return replace(answer, candidates=candidates, samples=samples)


def _judged(answer: Allocation, found: Candidates) -> Candidates:
    verdict = evaluate(answer.layout, found.command, np.tile(answer.target, (len(found), 1)), answer.sigma)
    return replace(found, wrench=verdict.wrench, err_norm=verdict.err_norm)


def judged_modes(answer: Allocation, modes: tuple[Mode, ...]) -> tuple[Mode, ...]:
    """The same for modes."""
    if answer.wrench_surrogate is None or not modes:
        return modes
    command = np.stack([mode.command for mode in modes])
    verdict = evaluate(answer.layout, command, np.tile(answer.target, (len(modes), 1)), answer.sigma)
    return tuple(
        replace(mode, wrench=wrench, err_norm=float(error))
        for mode, wrench, error in zip(modes, verdict.wrench, verdict.err_norm, strict=True)
    )


EDGE = 1e-4
"""Share of a range by which a component may lie beyond its end and still count as within."""


def is_within(layout: Layout, target: tuple[float, ...], failed: Collection[str]) -> bool:
    """Whether the working fins can give a wrench (6,): no component is beyond its range beside the others."""
    low, high = axis_ranges(layout, target, failed)
    slack = EDGE * (np.abs(high) + np.abs(low)) + EDGE
    return bool((np.isfinite(low) & (low - slack <= target) & (target <= high + slack)).all())
