"""The one interface of every allocation method: check the problem, solve it, answer with an `Allocation`."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation.allocation import Allocation, BatchAllocation
from finlab.allocation.evaluate import evaluate
from finlab.allocation.method import AllocationMethod
from finlab.allocation.modes import Mode, find_modes, force_sizes
from finlab.allocation.notes import fin_notes
from finlab.allocation.policy import CLOSEST, Policy, as_policy
from finlab.allocation.question import (
    Fins,
    check_flow,
    check_layout_and_seed,
    check_previous,
    check_wrenches,
    usable_fins,
)
from finlab.allocation.solution import Candidates
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.layout import FinModelSpec, Layout
from finlab.layout.damage import Health

SAME_COMMAND = 1e-6
"""Two commands [rad, Hz, rad] that differ by less are one answer, given on two machines."""


class Allocator(AllocationMethod):
    """Turns a target wrench into one command per fin.

    Failed fins are removed before a method solves and put back (as NaN) after, so no method can use one.
    """

    def allocate(
        self,
        layout: Layout,
        wrench: ArrayLike,
        *,
        failed: Sequence[str] = (),
        previous: ArrayLike | None = None,
        reference: ArrayLike | None = None,
        policy: Policy | str = CLOSEST,
        health: Health | None = None,
        flow: ArrayLike | None = None,
        seed: int = 0,
    ) -> Allocation:
        """Commands for one target.

        Args:
            layout: the robot.
            wrench: desired wrench (6,) [N, N m] in the body frame.
            failed: names of fins that do not work; they leave the graph.
            previous: command (n, 3) of the previous tick: fins then turn slowly, and the robot changes the
                way it moves only when that pays.
            reference: wrenches (K, 6) that are expected to be asked for at the next K ticks. A method that
                knows how late its fins follow answers the one that they will be in time for, which is then
                the result's target; others answer the present one.
            policy: what to do when the wrench is out of reach; see `Policy`.
            health: fins that are weak, stuck at an angle or running on; the result's layout has the limits
                that are left.
            flow: velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at rest.
            seed: the same target, layout and seed give the same answer.

        Raises:
            CommandError: the wrench or the flow is not six finite numbers, or `previous` or `reference` has
                another shape.
            AllocationError: the method does not know the policy.
            LayoutError: an unknown fin, or none left.
            DataError: a fin's force table cannot be read.
        """
        target, policy = check_wrenches(wrench, single=True), as_policy(policy)
        check_layout_and_seed(layout, seed)
        self._check_policy(policy)
        fins = usable_fins(layout, failed, health)
        water = check_flow(flow)
        before = None if previous is None else check_previous(previous, layout)[fins.alive]
        start = time.perf_counter()
        if reference is not None:
            expected = check_wrenches(reference, single=False, name="reference")
            target = self._in_time(fins.healthy, target, expected)
        method = self.at(water)
        solution = method._solve_by(policy, fins.healthy, target[None], seed=seed, previous=before)
        solve_ms = (time.perf_counter() - start) * 1e3
        command = fins.among_all(solution.command)
        verdict = evaluate(fins.layout, command, target[None], self.normalization.std, water)
        return Allocation(
            layout=fins.layout,
            failed=fins.failed,
            target=target,
            command=command[0].copy(),
            fin_forces=verdict.fin_forces[0],
            wrench=verdict.wrench[0],
            err_norm=float(verdict.err_norm[0]),
            effort=float(verdict.effort[0]),
            power=float(verdict.power[0]),
            sigma=self.normalization.std,
            evaluated_by=verdict.evaluated_by,
            method=self.name,
            solve_ms=solve_ms,
            checkpoint=self.checkpoint,
            settings=self.options,
            policy=policy,
            seed=seed,
            flow=water,
            previous=None if before is None else fins.among_all(before),
            wrench_surrogate=None if solution.wrench_surrogate is None else solution.wrench_surrogate[0],
            unknown_fins=self.unknown_fins(fins.healthy),
            notes=self._notes(fins.healthy, water),
            candidates=_made(solution.candidates, fins),
            samples=_made(solution.samples, fins),
        )

    def explore(self, result: Allocation) -> tuple[Mode, ...]:
        """Distinct ways to deliver the wrench of an answer, the chosen one first, by a search of tens of
        milliseconds. Methods that have a single answer know none.

        Raises:
            AllocationError: the method, as it is set, gives another answer to that question.
        """
        found = self.alternatives(result)
        if found is None:
            return ()
        layout = result.layout
        return find_modes(found, force_sizes(layout, found.command, result.flow), layout.lower, layout.upper)

    def alternatives(self, result: Allocation) -> Candidates | None:
        """Many refined answers to the question of a result, its own first, by a wide search.

        None for methods that have a single answer.

        Raises:
            AllocationError: the method gives another answer to that question.
        """
        fins = usable_fins(result.layout, result.failed)
        previous = None if result.previous is None else result.previous[fins.alive]
        solution = self.at(result.flow)._solve_by(
            result.policy, fins.healthy, result.target[None], seed=result.seed, previous=previous
        )
        again = fins.among_all(solution.command[0])
        if not np.allclose(again, result.command, rtol=0.0, atol=SAME_COMMAND, equal_nan=True):
            raise AllocationError(
                f"method {self.name!r} with checkpoint {self.checkpoint!r} gives another answer than this "
                "one; ask the allocator that answered, with its settings"
            )
        return _made(solution.alternatives or solution.candidates, fins)

    def _notes(self, layout: Layout, flow: Array | None) -> tuple[str, ...]:
        """Sentences that the user should read before trusting an answer for this layout."""
        unknown, notes = self.unknown_fins(layout), fin_notes(layout, flow)
        if not unknown or self.fin_model is None:
            return notes
        return (
            f"the method does not know these fins: {', '.join(unknown)}; checkpoint {self.checkpoint!r} "
            f"takes them for fins of model {_listed(self.fin_model)}: trust the plant's error or train a "
            "surrogate for them",
            *notes,
        )

    def allocate_batch(
        self,
        layout: Layout,
        wrenches: ArrayLike,
        *,
        failed: Sequence[str] = (),
        policy: Policy | str = CLOSEST,
        health: Health | None = None,
        flow: ArrayLike | None = None,
        seed: int = 0,
    ) -> BatchAllocation:
        """Commands for many targets (N, 6) on one layout; arguments and errors as in `allocate`."""
        targets, policy = check_wrenches(wrenches, single=False), as_policy(policy)
        check_layout_and_seed(layout, seed)
        self._check_policy(policy)
        fins, water = usable_fins(layout, failed, health), check_flow(flow)
        start = time.perf_counter()
        solution = self.at(water)._solve_many(policy, fins.healthy, targets, seed=seed)
        elapsed_ms = (time.perf_counter() - start) * 1e3
        command = fins.among_all(solution.command)
        verdict = evaluate(fins.layout, command, targets, self.normalization.std, water)
        return BatchAllocation(
            layout=fins.layout,
            failed=fins.failed,
            target=targets,
            command=command,
            fin_forces=verdict.fin_forces,
            wrench=verdict.wrench,
            err_norm=verdict.err_norm,
            effort=verdict.effort,
            power=verdict.power,
            sigma=self.normalization.std,
            evaluated_by=verdict.evaluated_by,
            method=self.name,
            solve_ms=np.full(len(targets), elapsed_ms / max(len(targets), 1)),
            checkpoint=self.checkpoint,
            policy=policy,
            seed=seed,
            flow=water,
            wrench_surrogate=solution.wrench_surrogate,
            unknown_fins=self.unknown_fins(fins.healthy),
            notes=self._notes(fins.healthy, water),
        )


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
