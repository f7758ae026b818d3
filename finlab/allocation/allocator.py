"""The one interface of every allocation method: check the problem, solve it, answer with an `Allocation`."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from inspect import signature
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.allocation import Allocation
from finlab.allocation.batch import BatchAllocation
from finlab.allocation.health import Health
from finlab.allocation.insight import Insight
from finlab.allocation.judging import REACHED, Verdict, judge, verdict_of
from finlab.allocation.policy import CLOSEST, Policy, as_policy, largest_share
from finlab.allocation.question import (
    Fins,
    check_layout_and_seed,
    check_previous,
    check_wrenches,
    usable_fins,
)
from finlab.allocation.solution import Candidates, Solution
from finlab.errors import AllocationError, DataError
from finlab.inference.normalization import Normalization
from finlab.inference.weights import TrainedWeights
from finlab.layout import FinModelSpec, Layout

Array = NDArray[np.float64]

SAME_COMMAND = 1e-6
"""Two commands [rad, Hz, rad] that differ by less are one answer, given on two machines."""


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
    weights: TrainedWeights | None = None
    """The trained networks; None for methods without networks."""
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
        try:
            return self._made_with({**self.options, **changes})
        except (TypeError, AttributeError) as error:  # what a value of the wrong type meets first
            raise AllocationError(f"method {self.name!r}: a setting has the wrong type ({error})") from error

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
        self._check_policy(policy)
        fins = usable_fins(layout, failed, health)
        before = None if previous is None else check_previous(previous, layout)[fins.alive]
        start = time.perf_counter()
        solution = self._solve_by(policy, fins.healthy, target[None], seed=seed, previous=before)
        solve_ms = (time.perf_counter() - start) * 1e3
        command = fins.among_all(solution.command)
        verdict, notes = self._judge(fins, solution, command, target[None])
        return Allocation(
            layout=fins.layout,
            failed=fins.failed,
            target=target,
            command=command[0].copy(),
            fin_forces=verdict.fin_forces[0],
            wrench=verdict.wrench[0],
            err_norm=float(verdict.err_norm[0]),
            energy=float(verdict.energy[0]),
            sigma=self.normalization.std,
            judged_by=verdict.judged_by,
            method=self.name,
            solve_ms=solve_ms,
            checkpoint=self.checkpoint,
            settings=self.options,
            policy=policy,
            seed=seed,
            previous=None if before is None else fins.among_all(before),
            wrench_surrogate=None if solution.wrench_surrogate is None else solution.wrench_surrogate[0],
            unknown_fins=self.unknown_fins(fins.healthy),
            notes=(*self._notes(fins.healthy), *notes),
            candidates=_made(solution.candidates, fins),
            samples=_made(solution.samples, fins),
            _allocator=self,
        )

    def alternatives(self, result: Allocation) -> Candidates | None:
        """Many refined answers to the question of a result, its own first, by a wide search.

        None for methods that have a single answer.

        Raises:
            AllocationError: the method gives another answer to that question.
        """
        fins = usable_fins(result.layout, result.failed)
        previous = None if result.previous is None else result.previous[fins.alive]
        solution = self._solve_by(
            result.policy, fins.healthy, result.target[None], seed=result.seed, previous=previous
        )
        again = fins.among_all(solution.command[0])
        if not np.allclose(again, result.command, rtol=0.0, atol=SAME_COMMAND, equal_nan=True):
            raise AllocationError(
                f"method {self.name!r} with checkpoint {self.checkpoint!r} gives another answer than this "
                "one; hand over the allocator that answered: result.explore(allocator)"
            )
        return _made(solution.alternatives or solution.candidates, fins)

    def _judge(
        self, fins: Fins, solution: Solution, command: Array, targets: Array
    ) -> tuple[Verdict, tuple[str, ...]]:
        """What commands (N, n, 3) give, and a note where it is not the plant that says so."""
        sigma = self.normalization.std
        try:
            return judge(fins.layout, command, targets, sigma), ()
        except DataError as error:  # a force table that is not here, as on a robot
            forces = self._surrogate_forces(fins.healthy, solution.command)
            if forces is None:
                raise
            forces = np.nan_to_num(fins.among_all(forces))
            torques = np.cross(fins.layout.position, forces)
            wrench = np.concatenate([forces.sum(1), torques.sum(1)], axis=-1)
            verdict = verdict_of(fins.layout, command, forces, wrench, targets, sigma)
            return verdict._replace(judged_by="surrogate"), (f"judged by the surrogate: {error}",)

    def _surrogate_forces(self, layout: Layout, command: Array) -> Array | None:
        """Forces (N, n, 3) [N] in the body frame by the method's own model, for methods that have one."""
        return None

    def _notes(self, layout: Layout) -> tuple[str, ...]:
        """Sentences that the user should read before trusting an answer for this layout."""
        unknown = self.unknown_fins(layout)
        if not unknown or self.fin_model is None:
            return ()
        return (
            f"the method does not know these fins: {', '.join(unknown)}; checkpoint {self.checkpoint!r} "
            f"takes them for fins of model {_listed(self.fin_model)}: trust the plant's error or train a "
            "surrogate for them",
        )

    def _check_policy(self, policy: Policy) -> None:
        """Refuse a policy that the method does not know; those that know all override this."""
        if not policy.is_plain and policy.kind != "direction":
            raise AllocationError(
                f"policy: method {self.name!r} minimizes the plain error and knows neither axis weights nor "
                "priorities; use method 'learned', or policy 'closest' or 'direction'"
            )

    def insight(self, layout: Layout, wrench: ArrayLike) -> Insight | None:
        """What the networks make of a target (6,) [N, N m] for a layout whose fins all work.

        None for methods without networks, or whose networks see one fin at a time.
        """
        return None

    def refined(self, layout: Layout, wrench: ArrayLike, command: Array, n_steps: int) -> Array:
        """A command (n, 3) of fins that all work after some steps of the method's own refinement.

        Raises:
            AllocationError: the method refines no candidates.
        """
        raise AllocationError(f"method {self.name!r} refines no candidates; use method 'learned'")

    def _solve_by(
        self, policy: Policy, layout: Layout, target: Array, *, seed: int, previous: Array | None
    ) -> Solution:
        """Solve for one target (1, 6) under a policy. Methods that minimize the plain error override this."""
        if policy.kind == "direction":
            return self._solve_direction(layout, target, seed=seed, previous=previous)
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
        policy: Policy | str = CLOSEST,
        health: Health | None = None,
        seed: int = 0,
    ) -> BatchAllocation:
        """Commands for many targets (N, 6) on one layout; arguments and errors as in `allocate`."""
        targets, policy = check_wrenches(wrenches, single=False), as_policy(policy)
        check_layout_and_seed(layout, seed)
        self._check_policy(policy)
        fins = usable_fins(layout, failed, health)
        start = time.perf_counter()
        solution = self._solve_many(policy, fins.healthy, targets, seed=seed)
        elapsed_ms = (time.perf_counter() - start) * 1e3
        command = fins.among_all(solution.command)
        verdict, notes = self._judge(fins, solution, command, targets)
        return BatchAllocation(
            layout=fins.layout,
            failed=fins.failed,
            target=targets,
            command=command,
            fin_forces=verdict.fin_forces,
            wrench=verdict.wrench,
            err_norm=verdict.err_norm,
            energy=verdict.energy,
            sigma=self.normalization.std,
            judged_by=verdict.judged_by,
            method=self.name,
            solve_ms=np.full(len(targets), elapsed_ms / max(len(targets), 1)),
            checkpoint=self.checkpoint,
            policy=policy,
            seed=seed,
            wrench_surrogate=solution.wrench_surrogate,
            unknown_fins=self.unknown_fins(fins.healthy),
            notes=(*self._notes(fins.healthy), *notes),
        )

    def _solve_many(self, policy: Policy, layout: Layout, targets: Array, *, seed: int) -> Solution:
        """Solve for targets (N, 6) together, then for those out of reach one by one, as the policy says."""
        if len(targets) == 0:
            return Solution(np.empty((0, layout.n_fins, 3)))
        solution = self._solve(layout, targets, seed=seed, previous=None)
        if policy.is_plain:
            return solution
        command, wrench = solution.command.copy(), solution.wrench_surrogate
        wrench = None if wrench is None else wrench.copy()
        for row in np.flatnonzero(~self._reaches(layout, solution, targets)):
            answer = self._solve_by(policy, layout, targets[row : row + 1], seed=seed, previous=None)
            command[row] = answer.command[0]
            if wrench is not None and answer.wrench_surrogate is not None:
                wrench[row] = answer.wrench_surrogate[0]
        return Solution(command, wrench)


def _made(make: Callable[[], Candidates] | None, fins: Fins) -> Candidates | None:
    """Candidates of the healthy fins, put among all."""
    if make is None:
        return None
    found = make()
    return found if len(fins.failed) == 0 else replace(found, command=fins.among_all(found.command))


def _listed(model: FinModelSpec) -> str:
    """A fin model with its parameters in words."""
    values = [f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in model.values().items()]
    return f"{model.type!r} ({', '.join(values)})"


@lru_cache(maxsize=256)
def _other_fins(layout: Layout, known: FinModelSpec) -> tuple[str, ...]:
    """Names of the fins of another model than the known one."""
    return tuple(
        fin.name
        for fin in layout.fins
        if fin.model.type != known.type or fin.model.values() != known.values()
    )
