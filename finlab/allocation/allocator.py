"""The one interface of every allocation method: made for a robot, it checks questions and answers them."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation.allocation import Allocation, BatchAllocation, Later, chunks_of, first_of
from finlab.allocation.method import Method
from finlab.allocation.methods import (
    Checkpoint,
    MethodChoice,
    bundled_method,
    checked_settings,
    choose_method,
)
from finlab.allocation.notes import answer_notes
from finlab.allocation.policy import CLOSEST, Policy, as_policy
from finlab.allocation.question import (
    Axes,
    Fins,
    axes_of,
    check_flow,
    check_layout,
    check_previous,
    check_seed,
    check_wrenches,
    same_axes,
    usable_fins,
)
from finlab.allocation.settings import Settings
from finlab.allocation.solution import Candidates, Rows, Solution, joined
from finlab.allocation.yardstick import yardstick
from finlab.arrays import Array
from finlab.bundle_files import read_bundle_files
from finlab.errors import AllocationError
from finlab.layout import Layout
from finlab.layout.damage import Health
from finlab.layout.load import load_layout
from finlab.networks.trained import TrainedWeights
from finlab.physics.plant import Plant, plant_of

MOST_PREPARED = 32
"""Damaged states of the robot that an allocator keeps prepared."""


class Ready(NamedTuple):
    """A state of the robot that is ready for questions."""

    fins: Fins
    """Which fins may be used."""
    method: Method
    """Made for these."""
    plant: Plant
    """Of all fins; judges."""


class Allocator:
    """Turns a target wrench into one command per fin, for one robot.

    All that a method needs of the robot is prepared when the allocator is made. A damaged robot is prepared
    when it is first asked about; failed fins are removed before a method solves and put back (as NaN) after,
    so no method can use one. Force tables are read once. An allocator can be copied and pickled.
    """

    def __init__(
        self,
        layout: Layout,
        method: str | type[Method] = "dual",
        *,
        checkpoint: Checkpoint = None,
        **settings: Any,
    ) -> None:
        """Prepare a method for a robot.

        Args:
            layout: the robot.
            method: one of `finlab.allocation.METHODS`, or a class of your own.
            checkpoint: for methods with networks: a checkpoint folder, the name of a shipped checkpoint,
                or what `read_checkpoint` gives; by default the shipped one.
            settings: of the method, by name.

        Raises:
            AllocationError: unknown method or setting, or a value out of its range.
            CheckpointError: missing, corrupt or foreign checkpoint.
            DataError: a fin's force table cannot be read.
        """
        check_layout(layout)
        if isinstance(method, str):
            self._made(layout, choose_method(method, checkpoint, **settings))
        elif isinstance(method, type) and issubclass(method, Method):
            known = checkpoint if isinstance(checkpoint, TrainedWeights) else None
            self._made(layout, MethodChoice(method, checked_settings(method, settings), known))
        else:
            raise AllocationError(f"method: expected the name of a method, got {method!r:.60}")

    @classmethod
    def from_bundle(cls, path: str | os.PathLike[str]) -> Allocator:
        """The allocator of a bundle's robot, as `finlab export` wrote it.

        Args:
            path: of the bundle, a folder or a zip archive.

        Raises:
            DataError: the bundle cannot be read, or was changed.
            LayoutError: its layout cannot be read.
        """
        choice = bundled_method(read_bundle_files(path), str(path))
        return cls.of_choice(load_layout(path), choice)

    @classmethod
    def of_choice(cls, layout: Layout, choice: MethodChoice) -> Allocator:
        """The allocator of a robot by a method with its networks and settings."""
        made = cls.__new__(cls)
        made._made(layout, choice)
        return made

    def _made(self, layout: Layout, choice: MethodChoice) -> None:
        self._layout, self._choice = layout, choice
        self._scale = yardstick(layout)
        self._whole = self._make((), None)
        self._prepared: dict[object, Ready] = {}

    def __getstate__(self) -> dict[str, Any]:
        return {"layout": self._layout, "choice": self._choice}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._made(state["layout"], state["choice"])

    def __deepcopy__(self, memo: object) -> Self:
        return type(self).of_choice(self._layout, self._choice)  # type: ignore[return-value]

    @property
    def layout(self) -> Layout:
        """The whole robot."""
        return self._layout

    @property
    def method(self) -> str:
        """Name of the method."""
        return self._choice.kind.name

    @property
    def settings(self) -> Settings:
        """Settings of the method."""
        return self._choice.settings

    @property
    def scale(self) -> Array:
        """Yardstick (6,) of the robot's errors [N, N m]; see `finlab.allocation.yardstick`."""
        return self._scale

    @property
    def weights(self) -> TrainedWeights | None:
        """Trained networks; None for methods without."""
        return self._choice.weights

    @property
    def checkpoint(self) -> str | None:
        """Name of the checkpoint that the networks come from; None for methods without."""
        return None if self.weights is None else self.weights.name

    @property
    def policy_under_way(self) -> str:
        """What a control loop asks for by default where a wrench is out of reach."""
        return self._choice.kind.policy_under_way

    @property
    def unknown_fins(self) -> tuple[str, ...]:
        """Names of the fins whose model the networks have not learned; answers for them are wrong."""
        return self._whole.method.unknown_fins

    def on(self, layout: Layout) -> Allocator:
        """Another allocator by the same method, networks and settings, for another robot."""
        return self.of_choice(layout, self._choice)

    def allocate(
        self,
        wrench: ArrayLike,
        *,
        failed: Sequence[str] = (),
        previous: ArrayLike | Allocation | None = None,
        reference: ArrayLike | None = None,
        policy: Policy | str = CLOSEST,
        health: Health | None = None,
        flow: ArrayLike | None = None,
        seed: int = 0,
    ) -> Allocation:
        """Commands for one target.

        Args:
            wrench: desired wrench (6,) [N, N m] in the body frame; NaN for an axis that is free here: it
                takes what the cheapest answer gives it, as those do that the layout does not command.
            failed: names of fins that do not work; they leave the graph.
            previous: command (n, 3) of the previous tick: what follows stays within the rates of the
                actuators. Or the answer that gave it: the search then begins there, which is quicker.
            reference: wrenches (K, 6) that are expected to be asked for at the next K ticks. A method that
                knows how late its fins follow answers the one that they will be in time for, which is then
                the result's target; others answer the present one.
            policy: what to do when the wrench is out of reach; see `Policy`.
            health: fins that are weak, stuck at an angle or running on; the result's layout has the limits
                that are left.
            flow: velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at rest.
            seed: the same target and seed give the same answer.

        Raises:
            CommandError: the wrench is not six numbers, none of them counts, or `previous`, `reference` or
                `flow` has another shape.
            AllocationError: the method does not know the policy.
            LayoutError: an unknown fin, or none left.
            DataError: a fin's force table cannot be read.
        """
        asked, policy = check_wrenches(wrench, single=True), as_policy(policy)
        check_seed(seed)
        water = check_flow(flow)
        ready = self._ready(failed, health, axes_of(self._layout, asked))
        fins, method = ready.fins, ready.method
        method.check_policy(policy)
        options: dict[str, Any] = {}
        if isinstance(previous, Allocation):
            if method.begins_at_prices and previous.prices is not None:
                options["prices"] = previous.prices
            previous = previous.command
        before = None if previous is None else check_previous(previous, fins.layout)[fins.alive]
        start = time.perf_counter()
        counts = method.layout.commanded
        target = np.where(counts, asked, 0.0)
        if reference is not None:
            later = np.where(counts, check_wrenches(reference, single=False, name="reference"), 0.0)
            target = method.in_time(target, np.nan_to_num(later))
        solution = method.solve(
            target[None], policy=policy, previous=before, flow=water, seed=seed, **options
        )
        if before is None:
            solution = solution._replace(command=method.plant.rested(solution.command))
        solve_ms = (time.perf_counter() - start) * 1e3
        return Allocation(
            **self._about(
                np.where(counts, target, np.nan), asked, ready, solution, policy, health, water, seed
            ),
            command=fins.among_all(solution.command)[0].copy(),
            solve_ms=solve_ms,
            settings=vars(self.settings).copy(),
            previous=None if before is None else fins.among_all(before),
            wrench_expected=None if solution.wrench is None else solution.wrench[0],
            prices=None if solution.prices is None else solution.prices[0],
        )

    def refinement(self, result: Allocation) -> tuple[Candidates, ...]:
        """What a network proposes for the question of a result, whoever answered it, then the same rows after
        each step of their refinement; nothing for methods that have no such proposals.

        Raises:
            AllocationError: the answer is of another robot.
        """
        ready = self._ready_for(result)
        ways = ready.method.refinement(np.nan_to_num(result.target), flow=result.flow, seed=result.seed)
        return tuple(replace(way, command=ready.fins.among_all(way.command)) for way in ways)

    def allocate_batch(
        self,
        wrenches: ArrayLike,
        *,
        failed: Sequence[str] = (),
        policy: Policy | str = CLOSEST,
        health: Health | None = None,
        flow: ArrayLike | None = None,
        seed: int = 0,
    ) -> BatchAllocation:
        """Commands for many targets (N, 6); arguments and errors as in `allocate`.

        The answer keeps the targets as they are, not a copy, and the commands; what else there is to tell is
        computed when it is asked for.
        """
        asked, policy = check_wrenches(wrenches, single=False), as_policy(policy)
        check_seed(seed)
        water = check_flow(flow)
        ready = self._ready(failed, health)
        fins = ready.fins
        ready.method.check_policy(policy)
        start = time.perf_counter()

        def parts() -> Iterator[tuple[Rows, Solution]]:
            for axes, places in same_axes(self._layout, asked):
                one = self._ready(failed, health, axes)
                for rows in chunks_of(places, len(asked)):
                    counts = one.method.layout.commanded
                    target = asked[rows] if counts.all() else np.where(counts, asked[rows], 0.0)
                    part = one.method.solve(target, policy=policy, flow=water, seed=seed + first_of(rows))
                    yield rows, part._replace(command=one.method.plant.rested(part.command))

        solution = joined(parts(), len(asked), fins.alive)
        counts = self._layout.commanded
        targets = asked if counts.all() else np.where(counts, asked, np.nan)
        elapsed_ms = (time.perf_counter() - start) * 1e3
        return BatchAllocation(
            **self._about(targets, asked, ready, solution, policy, health, water, seed),
            command=solution.command,
            solve_ms=np.broadcast_to(elapsed_ms / max(len(targets), 1), len(targets)),
            wrench_expected=solution.wrench,
        )

    def _about(
        self,
        target: Array,
        asked: Array,
        ready: Ready,
        solution: Solution,
        policy: Policy,
        health: Health | None,
        flow: Array | None,
        seed: int,
    ) -> dict[str, Any]:
        """What answers to one target and to many tell of the question and the robot."""
        fins = ready.fins
        later = Later(
            ready.plant.at(flow),
            partial(answer_notes, fins.healthy, ready.method, self.checkpoint, flow, asked, solution.notes),
            partial(_among_all, solution.candidates, fins),
            partial(_among_all, solution.samples, fins),
            *(() if solution.bound is None else (partial(solution.bound, solution.command),)),
        )
        return {
            "target": target,
            "layout": fins.layout,
            "failed": fins.failed,
            "health": health,
            "scale": self._scale,
            "method": self.method,
            "checkpoint": self.checkpoint,
            "policy": policy,
            "flow": flow,
            "seed": int(seed),
            "unknown_fins": ready.method.unknown_fins,
            "later": later,
        }

    def _ready_for(self, result: Allocation) -> Ready:
        """The robot as it was when it was asked."""
        ready = self._ready(result.failed, result.health)
        if ready.fins.layout != result.layout:
            raise AllocationError(
                f"this answer is of layout {result.layout.name!r:.60}, and this allocator is for "
                f"{self._layout.name!r:.60} as it was made; ask the allocator that answered"
            )
        return ready

    def _ready(self, failed: Sequence[str], health: Health | None, axes: Axes | None = None) -> Ready:
        """The robot in a state, asked for some axes, prepared now or kept from an earlier question."""
        if axes is None and health is None and (failed == () or failed == []):
            return self._whole
        key = usable_fins(self._layout, failed).failed, health, axes
        found = self._prepared.pop(key, None) or self._make(failed, health, axes)
        self._prepared[key] = found  # the newest is last
        while len(self._prepared) > MOST_PREPARED:
            self._prepared.pop(next(iter(self._prepared)), None)
        return found

    def _make(self, failed: Sequence[str], health: Health | None, axes: Axes | None = None) -> Ready:
        fins, choice = usable_fins(self._layout, failed, health), self._choice
        layout = fins.healthy if axes is None else replace(fins.healthy, axes=axes)
        method = choice.kind(layout, choice.settings, self._scale, choice.weights)
        return Ready(fins, method, plant_of(fins.layout))

    def __repr__(self) -> str:
        return f"Allocator({self._layout.name!r:.60}, method={self.method!r})"


def _among_all(make: Callable[[], Candidates] | None, fins: Fins) -> Candidates | None:
    """Candidates of the healthy fins, put among all."""
    if make is None:
        return None
    found = make()
    return found if len(fins.failed) == 0 else replace(found, command=fins.among_all(found.command))
