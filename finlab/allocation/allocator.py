"""The one interface of every allocation method: check the problem, solve it, answer with an `Allocation`."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from inspect import signature
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.allocation import REACHED, Allocation, BatchAllocation, Candidates, Solution
from finlab.allocation.health import Health
from finlab.allocation.policy import AXES, CLOSEST, Policy, as_policy, largest_share
from finlab.errors import AllocationError, CommandError
from finlab.inference.normalization import Normalization
from finlab.layout import FinModelSpec, Layout

Array = NDArray[np.float64]

MAX_WRENCH = 1e6
"""Largest magnitude of a target component [N, N m]; beyond it something is wrong upstream."""


class Allocator(ABC):
    """Turns a target wrench into one command per fin.

    A method implements `_solve` for the healthy fins of one layout; failed fins are removed before
    and put back (as NaN) after, so no method can use one.
    """

    name: str
    """What the method is called."""
    normalization: Normalization
    """Yardstick of the error."""
    checkpoint: str | None = None
    """Name of the checkpoint that the networks come from; None for methods without networks."""
    fin_model: FinModelSpec | None = None
    """Fin model that the networks have learned; None for methods that ask every fin's own model."""

    def unknown_fins(self, layout: Layout) -> tuple[str, ...]:
        """Names of the fins whose model the networks have not learned; answers for them are wrong."""
        return () if self.fin_model is None else _other_fins(layout, self.fin_model)

    @classmethod
    def option_names(cls) -> list[str]:
        """Names of what can be set when the method is made."""
        return list(signature(cls).parameters)[1:]

    @property
    def options(self) -> dict[str, Any]:
        """Present values of all that can be set, by name; `load_allocator` makes the same method of them."""
        return {name: getattr(self, name) for name in self.option_names()}

    def with_settings(self, **changes: Any) -> Self:
        """The same method with other settings. This one stays as it is; what it has loaded is shared.

        Raises:
            AllocationError: the method knows no such setting, or cannot work with its value.
        """
        self.check_options(changes)
        return self._made_with({**self.options, **changes})

    @classmethod
    def check_options(cls, names: Iterable[str]) -> None:
        """Raise an `AllocationError` at a setting that the method does not know."""
        known = cls.option_names()
        if unknown := [name for name in names if name not in known]:
            raise AllocationError(
                f"method {cls.name!r} knows the options {', '.join(known) or 'none'}, got {unknown[0]!r}"
            )

    def _made_with(self, options: dict[str, Any]) -> Self:
        """The same method made again; those with networks override this."""
        return type(self)(self.normalization, **options)  # type: ignore[call-arg]

    @abstractmethod
    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        """Solve for targets (N, 6) on a layout whose fins are all healthy.

        Args:
            layout: the healthy fins.
            targets: desired wrenches (N, 6).
            seed: makes the answer repeatable.
            previous: command (n, 3) of the previous tick, or None.
        """

    def allocate(
        self,
        layout: Layout,
        wrench: ArrayLike,
        *,
        failed: Sequence[str] = (),
        previous: ArrayLike | None = None,
        policy: Policy | str = CLOSEST,
        health: Health | None = None,
        seed: int = 0,
    ) -> Allocation:
        """Commands for one target.

        Args:
            layout: the robot.
            wrench: desired wrench (6,) [N, N m] in the body frame.
            failed: names of fins that do not work; they leave the graph.
            previous: command (n, 3) of the previous tick: fins then turn slowly, and the robot changes the
                way it moves only when that pays.
            policy: what to do when the wrench is out of reach; see `Policy`.
            health: fins that are weak, stuck at an angle or running on; the result's layout has the limits
                that are left.
            seed: the same target, layout and seed give the same answer.

        Raises:
            CommandError: the wrench is not six finite numbers, or `previous` has another shape.
            AllocationError: the method does not know the policy.
            LayoutError: an unknown fin, or none left.
        """
        target, policy = check_wrenches(wrench, single=True), as_policy(policy)
        check_layout_and_seed(layout, seed)
        layout = layout if health is None else health.applied_to(layout)
        healthy, alive = remove_failed(layout, failed)
        before = None if previous is None else check_previous(previous, layout)[alive]
        start = time.perf_counter()
        solution = self._solve_by(policy, healthy, target[None], seed=seed, previous=before)
        solve_ms = (time.perf_counter() - start) * 1e3
        return Allocation(
            layout=layout,
            failed=tuple(failed),
            target=target,
            command=_with_failed(solution.command[0], alive),
            sigma=self.normalization.std,
            method=self.name,
            solve_ms=solve_ms,
            checkpoint=self.checkpoint,
            wrench_surrogate=None if solution.wrench_surrogate is None else solution.wrench_surrogate[0],
            notes=self._notes(healthy),
            make_candidates=lambda: _candidates_with_failed(solution.candidates, alive),
            make_samples=lambda: _candidates_with_failed(solution.samples, alive),
            make_alternatives=lambda: _candidates_with_failed(solution.alternatives, alive),
            previous=None if before is None else _with_failed(before, alive),
        )

    def _notes(self, layout: Layout) -> tuple[str, ...]:
        """Sentences that the user should read before trusting an answer for this layout."""
        unknown = self.unknown_fins(layout)
        if not unknown or self.fin_model is None:
            return ()
        return (
            f"checkpoint {self.checkpoint!r} knows fins of model {self.fin_model.type!r} and takes these for "
            f"such: {', '.join(unknown)}; trust the plant's error or train a surrogate for them",
        )

    def _solve_by(
        self, policy: Policy, layout: Layout, target: Array, *, seed: int, previous: Array | None
    ) -> Solution:
        """Solve for one target (1, 6) under a policy. Methods that minimize the plain error override this."""
        if policy.kind == "direction":
            return self._solve_direction(layout, target, seed=seed, previous=previous)
        if policy.kind == "priority" or len(set(policy.axis_weights)) > 1:
            raise AllocationError(
                f"policy: method {self.name!r} minimizes the plain error and knows neither axis weights nor "
                "priorities; use method 'learned', or policy 'closest' or 'direction'"
            )
        return self._solve(layout, target, seed=seed, previous=previous)

    def _solve_direction(
        self, layout: Layout, target: Array, *, seed: int, previous: Array | None
    ) -> Solution:
        """The largest share of the target that is delivered whole."""
        whole = self._solve(layout, target, seed=seed, previous=previous)
        if self._reaches(layout, whole, target)[0]:
            return whole

        def reached(shares: Array) -> NDArray[np.bool_]:
            targets = shares[:, None] * target
            return self._reaches(layout, self._solve(layout, targets, seed=seed, previous=None), targets)

        return self._solve(layout, largest_share(reached) * target, seed=seed, previous=previous)

    def _reaches(self, layout: Layout, solution: Solution, targets: Array) -> NDArray[np.bool_]:
        """Which of the targets (N, 6) are met, by the method's own model, or the plant where it has none."""
        wrench = solution.wrench_surrogate
        if wrench is None:
            from finlab.physics import Plant  # torch is loaded only where the plant is asked

            wrench = Plant(layout).wrench(solution.command)
        return self.normalization.error(wrench, targets) <= REACHED

    def allocate_batch(
        self,
        layout: Layout,
        wrenches: ArrayLike,
        *,
        failed: Sequence[str] = (),
        health: Health | None = None,
        seed: int = 0,
    ) -> BatchAllocation:
        """Commands for many targets (N, 6) on one layout; errors as in `allocate`."""
        targets = check_wrenches(wrenches, single=False)
        check_layout_and_seed(layout, seed)
        layout = layout if health is None else health.applied_to(layout)
        healthy, alive = remove_failed(layout, failed)
        start = time.perf_counter()
        if len(targets) == 0:
            return BatchAllocation(np.empty((0, layout.n_fins, 3)), None, np.empty(0))
        solution = self._solve(healthy, targets, seed=seed, previous=None)
        elapsed_ms = (time.perf_counter() - start) * 1e3
        return BatchAllocation(
            _with_failed(solution.command, alive),
            solution.wrench_surrogate,
            np.full(len(targets), elapsed_ms / max(len(targets), 1)),
        )


def check_wrenches(wrench: ArrayLike, *, single: bool) -> Array:
    """One wrench (6,) or many (N, 6) as finite float64, or a `CommandError` that says what is wrong."""
    expected = "six numbers [Fx, Fy, Fz, Tx, Ty, Tz]" if single else "an array of shape (N, 6)"
    try:
        if np.iscomplexobj(wrench):
            raise TypeError("complex")
        array = np.array(wrench, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise CommandError(f"wrench: expected {expected} in N and N m, got {wrench!r}") from error
    if array.shape != (6,) if single else (array.ndim != 2 or array.shape[1] != 6):
        raise CommandError(f"wrench: expected {expected} in N and N m, got an array of shape {array.shape}")
    bad = ~(np.abs(array) <= MAX_WRENCH)
    if bad.any():
        axis = AXES[int(np.argwhere(bad)[0][-1])]
        value = array[bad][0]
        raise CommandError(f"wrench: {axis} must be finite and at most {MAX_WRENCH:g} in size, got {value}")
    return array


def check_layout_and_seed(layout: object, seed: object) -> None:
    """Refuse what is no layout, and seeds that are no whole number from 0."""
    if not isinstance(layout, Layout):
        raise AllocationError(
            f"layout: expected a Layout, got {layout!r}; read a file with finlab.load_layout"
        )
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise AllocationError(f"seed: expected a whole number from 0, got {seed!r}")


def check_previous(previous: ArrayLike, layout: Layout) -> Array:
    """The previous command (n, 3), failed fins may hold NaN."""
    try:
        array = np.array(previous, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise CommandError(
            f"previous: expected a command of shape ({layout.n_fins}, 3), got {previous!r}"
        ) from error
    if np.isinf(array).any():
        raise CommandError("previous: expected finite commands (NaN only for failed fins), got infinity")
    if array.shape != (layout.n_fins, 3):
        raise CommandError(
            f"previous: expected a command of shape ({layout.n_fins}, 3) for layout {layout.name!r}, "
            f"got shape {array.shape}; pass the `command` of the last allocation"
        )
    return array


def remove_failed(layout: Layout, failed: Sequence[str]) -> tuple[Layout, NDArray[np.bool_]]:
    """The layout without its failed fins, and the mask (n,) of the healthy ones."""
    if isinstance(failed, str):
        raise AllocationError(
            f"failed: expected a list of fin names, got the text {failed!r}; write [{failed!r}]"
        )
    if not isinstance(failed, Sequence) or not all(isinstance(name, str) for name in failed):
        raise AllocationError(f"failed: expected a list of fin names, got {failed!r}")
    if not failed:
        return layout, np.ones(layout.n_fins, dtype=bool)
    alive = np.array([name not in set(failed) for name in layout.names])
    return layout.without(failed), alive


@lru_cache(maxsize=256)
def _other_fins(layout: Layout, known: FinModelSpec) -> tuple[str, ...]:
    """Names of the fins of another model than the known one."""
    return tuple(
        fin.name
        for fin in layout.fins
        if fin.model.type != known.type or fin.model.values() != known.values()
    )


def _with_failed(command: Array, alive: NDArray[np.bool_]) -> Array:
    """Put the healthy fins' commands (..., m, 3) back among all n fins; the failed ones are NaN."""
    if len(alive) == command.shape[-2]:
        return command
    full = np.full((*command.shape[:-2], len(alive), 3), np.nan)
    full[..., alive, :] = command
    return full


def _candidates_with_failed(
    make: Callable[[], Candidates] | None, alive: NDArray[np.bool_]
) -> Candidates | None:
    if make is None:
        return None
    candidates = make()
    return candidates._replace(command=_with_failed(candidates.command, alive))
