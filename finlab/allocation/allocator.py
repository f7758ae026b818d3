"""The one interface of every allocation method: made for a robot, it checks questions and answers
them."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation import methods
from finlab.allocation.allocation import Allocation, BatchAllocation, chunks
from finlab.allocation.method import Checkpoint, Method, Networks
from finlab.allocation.policy import CLOSEST, Policy, PolicyName, as_policy
from finlab.allocation.question import (
    Usable,
    check_flow,
    check_layout,
    check_previous,
    check_reference,
    check_seed,
    check_target,
    check_wrenches,
    damage_of,
    free_mask,
    usable,
)
from finlab.allocation.report import answer_notes
from finlab.allocation.settings import Settings
from finlab.allocation.solution import Candidates, Rows, Solution, joined
from finlab.arrays import Array
from finlab.axes import Axis, axes_in
from finlab.errors import AllocationError
from finlab.layout.damage import WHOLE, Damage
from finlab.layout.layout import Layout
from finlab.physics.objective import yardstick
from finlab.physics.plant import Plant, plant_of

MOST_PREPARED = 32
"""Damaged states of the robot that an allocator keeps prepared."""


class Ready(NamedTuple):
    """A state of the robot that is ready for questions."""

    robot: Usable
    """Which actuators may be used."""
    method: Method
    """Made for these, or for all where it takes losses with the question."""
    plant: Plant
    """Of all actuators; judges."""
    free: NDArray[np.bool_] | None
    """Axes (6,) that do not count; None where all do."""

    def freed(self, wrenches: Array, value: float) -> Array:
        """Wrenches (..., 6) with a value in the axes that do not count; themselves where all do."""
        return wrenches if self.free is None else np.where(self.free, value, wrenches)


class Question(NamedTuple):
    """A checked question but for its wrenches."""

    ready: Ready
    policy: Policy
    flow: Array | None
    seed: int

    def solution(
        self, targets: Array, previous: Array | None = None, offset: int = 0, **options: Any
    ) -> Solution:
        """The answer to targets (N, 6) for all actuators, NaN for lost ones; in a tick after
        commands (n, 3) never outside of what the drives' limits and rates allow, else with rest for
        actuators that have nothing to do."""
        robot, method, *_ = self.ready
        if method.takes_losses:
            options["lost"] = robot.lost
            options["free"] = self.ready.free
        elif previous is not None:
            options["previous"] = previous[robot.alive]
        if method.takes_losses and previous is not None:
            options["previous"] = previous
        solution = method.solve(
            targets, policy=self.policy, flow=self.flow, seed=self.seed + offset, **options
        )
        if previous is None:
            return solution._replace(command=method.plant.rested(solution.command))
        box = method.rates.box(options["previous"])
        return solution._replace(command=box.held(solution.command, method.plant))


class Answered(NamedTuple):
    """A question with its answer: what a result computes when it is first read."""

    question: Question
    wrenches: Array
    """As they came, (6,) or (N, 6)."""
    solution: Solution

    @property
    def plant(self) -> Plant:
        return self.question.ready.plant.at(self.question.flow)

    def notes(self) -> tuple[str, ...]:
        (robot, method, _, free), _, flow, _ = self.question
        wanted = self.wrenches
        if free is not None:  # of an axis that the layout does not command a note tells
            wanted = np.where(free & robot.layout.commanded, 0.0, wanted)
        return answer_notes(robot.healthy, method, flow, wanted, self.solution.notes)

    def candidates(self) -> Candidates | None:
        return self._among_all(self.solution.candidates)

    def samples(self) -> Candidates | None:
        return self._among_all(self.solution.samples)

    def bound(self) -> Array | None:
        own = self.solution.bound
        return None if own is None else own(self.solution.command)

    def calm_power(self) -> Array | None:
        own = self.solution.calm_power
        return None if own is None else own(self.solution.command)

    def _among_all(self, make: Callable[[], Candidates] | None) -> Candidates | None:
        """Candidates of the healthy actuators, put among all."""
        robot = self.question.ready.robot
        own = None if make is None else make()
        return (
            replace(own, command=robot.among_all(own.command)) if own and robot.damage.lost else own
        )


class Allocator:
    """Turns a target wrench into one command per actuator, for one robot.

    All that a method needs of the robot is prepared when the allocator is made. A damaged robot is
    prepared when it is first asked about; lost actuators are removed before a method solves and put
    back (as NaN) after, so no method can use one. Force tables are read once. An allocator can be
    copied and pickled.
    """

    def __init__(
        self,
        layout: Layout,
        method: methods.MethodName | type[Method] = "dual",
        *,
        checkpoint: Checkpoint = None,
        robust: float | None = None,
        period_s: float | None = None,
        calm: float | None = None,
        **settings: Any,
    ) -> None:
        """Prepare a method for a robot.

        The settings of method `dual` are arguments of their own; None is the method's own value.

        Args:
            layout: the robot.
            method: one of `finlab.allocation.METHODS`, or a class of your own.
            checkpoint: for methods with networks: a checkpoint folder, the name of a shipped
                checkpoint, or what `read_checkpoint` gives; by default the shipped one.
            robust: what an expected miss of 1 % of the wrench scale is worth [W], growing with its
                square; from 0 to 1e9, 0 by default: how far actuators may be from their laws then
                costs nothing.
            period_s: time between ticks [s], above 0 and up to 1000, 0.1 by default: with the rates
                of the drives it says how far a command may change from `previous`. Method `mdn` has
                it, too.
            calm: what turning costs in a tick, from 0 to 10, 2 by default: 0 is nothing, 2 spends
                some power for half the turning of azimuths and tilts.
            settings: of other methods, by name.

        Raises:
            AllocationError: unknown method or setting, or a value out of its range.
            CheckpointError: missing, corrupt or foreign checkpoint.
            DataError: a fin's force table cannot be read.
        """
        check_layout(layout)
        named = {"robust": robust, "period_s": period_s, "calm": calm}
        settings |= {name: value for name, value in named.items() if value is not None}
        if isinstance(method, str):
            self._made(layout, methods.choose_method(method, checkpoint, **settings))
        elif isinstance(method, type) and issubclass(method, Method):
            known = methods.checked_settings(method, settings)
            self._made(
                layout, methods.MethodChoice(method, known, method.read_networks(checkpoint))
            )
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
        from finlab.allocation.bundled_method import bundled_method
        from finlab.bundle_files import read_bundle_files
        from finlab.layout.load import load_layout

        choice = bundled_method(read_bundle_files(path), str(path))
        return cls.of_choice(load_layout(path), choice)

    @classmethod
    def of_choice(cls, layout: Layout, choice: methods.MethodChoice) -> Allocator:
        """The allocator of a robot by a method with its networks and settings."""
        made = cls.__new__(cls)
        made._made(layout, choice)
        return made

    def _made(self, layout: Layout, choice: methods.MethodChoice) -> None:
        self._layout = layout
        self._choice = choice
        self._scale = yardstick(layout)
        self._whole = self._make(WHOLE)
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
        """Yardstick (6,) of the robot's errors [N, N m]; see `finlab.physics.objective`."""
        return self._scale

    @property
    def weights(self) -> Networks | None:
        """Trained networks; None for methods without."""
        return self._choice.weights

    @property
    def checkpoint(self) -> str | None:
        """Name of the checkpoint that the networks come from; None for methods without."""
        return None if self.weights is None else self.weights.name

    @property
    def policy_under_way(self) -> PolicyName:
        """What a control loop asks for by default where a wrench is out of reach."""
        return self._choice.kind.policy_under_way

    @property
    def unknown_fins(self) -> tuple[str, ...]:
        """Names of the fins whose model the networks have not learned; answers for them are
        wrong."""
        return self._whole.method.unknown_fins

    def on(self, layout: Layout) -> Allocator:
        """Another allocator by the same method, networks and settings, for another robot."""
        return self.of_choice(layout, self._choice)

    def allocate(
        self,
        wrench: ArrayLike,
        *,
        lost: Sequence[str] = (),
        damage: Damage | None = None,
        previous: ArrayLike | Allocation | None = None,
        reference: ArrayLike | None = None,
        free: Sequence[Axis] = (),
        policy: Policy | PolicyName = CLOSEST,
        flow: ArrayLike | None = None,
        seed: int = 0,
    ) -> Allocation:
        """Commands for one target.

        Args:
            wrench: desired wrench (6,) [N, N m] in the body frame.
            lost: names of actuators that do not work; they leave the graph.
            damage: these and actuators that work in part; the result's layout has what is left of
                their limits.
            previous: command (n, 3) of the previous tick: what follows stays within the rates of
                the actuators. Or the answer that gave it: the search then begins there, which is
                quicker.
            reference: expected wrenches (K, 6) of the next K ticks. A method that knows how late
                actuators follow answers the one that they will be in time for, which is then the
                result's target; but pods, whose turning costs, turn in time for what comes, and the
                target stays the wrench.
            free: names of axes that are free here: they take what the cheapest answer gives them,
                as those do that the layout does not command.
            policy: what to do when the wrench is out of reach; see `Policy`.
            flow: velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at
            rest.
            seed: the same target and seed give the same answer.

        Raises:
            CommandError: the wrench is not six finite numbers, no axis counts, or another array has
                a wrong shape.
            AllocationError: the method does not know the policy.
            LayoutError: an unknown actuator, or none left.
            DataError: a fin's force table cannot be read.
        """
        values = check_target(wrench)
        known = damage_of(damage, lost)
        question = self._question(known, policy, flow, seed, free)
        ready = question.ready
        robot = ready.robot
        method = ready.method
        options: dict[str, Any] = {}
        if isinstance(previous, Allocation):
            if method.begins_at_prices and previous.prices is not None:
                options["prices"] = previous.prices
            previous = previous.command
        before = None if previous is None else check_previous(previous, robot.layout)
        start = time.perf_counter()
        target = values
        if reference is not None:
            expected = check_reference(reference)
            target = method.in_time(target, expected)
            if method.looks_ahead:
                options["reference"] = ready.freed(expected, 0.0)
        solution = question.solution(ready.freed(target, 0.0)[None], before, **options)
        solve_ms = (time.perf_counter() - start) * 1e3
        return Allocation.of(
            **self._about(question, ready.freed(target, np.nan).copy(), values, solution),
            command=robot.among_all(solution.command)[0].copy(),
            solve_ms=solve_ms,
            settings=vars(self.settings).copy(),
            previous=before,
            wrench_expected=None if solution.wrench is None else solution.wrench[0],
            prices=None if solution.prices is None else solution.prices[0],
        )

    def refinement(self, result: Allocation) -> tuple[Candidates, ...]:
        """What a network proposes for the question of a result, whoever answered it, then the same
        rows after each step of their refinement; nothing for methods that have no such proposals.

        Raises:
            AllocationError: the answer is of another robot.
        """
        ready = self._ready_for(result)
        ways = ready.method.refinement(
            np.nan_to_num(result.target), flow=result.flow, seed=result.seed
        )
        if ready.robot.alive.all():
            return ways
        return tuple(replace(way, command=ready.robot.among_all(way.command)) for way in ways)

    def allocate_batch(
        self,
        wrenches: ArrayLike,
        *,
        lost: Sequence[str] = (),
        damage: Damage | None = None,
        free: Sequence[Axis] = (),
        policy: Policy | PolicyName = CLOSEST,
        flow: ArrayLike | None = None,
        seed: int = 0,
    ) -> BatchAllocation:
        """Commands for many targets (N, 6); arguments and errors as in `allocate`.

        The answer keeps a copy of the targets, and the commands; what else there is to tell is
        computed when it is asked for.
        """
        values = check_wrenches(wrenches)
        known = damage_of(damage, lost)
        question = self._question(known, policy, flow, seed, free)
        ready = question.ready
        start = time.perf_counter()

        def parts() -> Iterator[tuple[Rows, Solution]]:
            for rows in chunks(len(values)):
                targets = ready.freed(values[rows], 0.0)
                yield rows, question.solution(targets, offset=rows.start)

        solution = joined(parts(), len(values), ready.robot.alive)
        targets = ready.freed(values, np.nan)
        elapsed_ms = (time.perf_counter() - start) * 1e3
        return BatchAllocation.of(
            **self._about(question, targets, values, solution),
            command=solution.command,
            solve_ms=np.broadcast_to(elapsed_ms / max(len(targets), 1), len(targets)),
            wrench_expected=solution.wrench,
        )

    def _question(
        self,
        damage: Damage,
        policy: Policy | PolicyName,
        flow: ArrayLike | None,
        seed: int,
        free: Sequence[str] = (),
    ) -> Question:
        policy = as_policy(policy)
        check_seed(seed)
        water = check_flow(flow)
        ready = self._ready(damage, free)
        ready.method.check_policy(policy)
        return Question(ready, policy, water, int(seed))

    def _about(
        self, question: Question, target: Array, values: Array, solution: Solution
    ) -> dict[str, Any]:
        """Fields that answers to one target and to many share; `values` are the wrenches as they
        came."""
        (robot, method, *_), policy, flow, seed = question
        return dict(
            layout=robot.layout,
            damage=robot.damage,
            target=target,
            scale=self._scale,
            method=method.name,
            checkpoint=self.checkpoint,
            policy=policy,
            flow=flow,
            seed=seed,
            unknown_fins=method.unknown_fins,
            later=Answered(question, values, solution),
        )

    def _ready_for(self, result: Allocation) -> Ready:
        """The robot as it was when it was asked."""
        ready = self._ready(result.damage)
        if ready.robot.layout != result.layout:
            raise AllocationError(
                f"this answer is of layout {result.layout.name!r:.60}, and this allocator is for "
                f"{self._layout.name!r:.60} as it was made; ask the allocator that answered"
            )
        return ready

    def _ready(self, damage: Damage, free: Sequence[str] = ()) -> Ready:
        """The robot in a state, asked for all axes but some, prepared now or kept from an earlier
        question."""
        if damage == WHOLE and not len(free):
            return self._whole
        mask = free_mask(self._layout, free)
        key = damage, None if mask is None else mask.tobytes()
        ready = self._prepared.pop(key, None) or self._make(damage, mask)
        self._prepared[key] = ready  # the newest is last
        while len(self._prepared) > MOST_PREPARED:
            self._prepared.pop(next(iter(self._prepared)), None)
        return ready

    def _make(self, damage: Damage, free: NDArray[np.bool_] | None = None) -> Ready:
        """The robot in a state. A method that takes losses with the question is that of the state
        without any, and a loss prepares nothing."""
        robot = usable(self._layout, damage)
        choice = self._choice
        counts = self._layout.commanded if free is None else self._layout.commanded & ~free
        none_count = None if counts.all() else ~counts
        if choice.kind.takes_losses and (robot.damage.lost or free is not None):
            rest = self._ready(replace(damage, lost=()))
            return Ready(robot, rest.method, rest.plant, none_count)
        layout = robot.healthy if free is None else replace(robot.healthy, axes=axes_in(counts))
        method = choice.kind(layout, choice.settings, self._scale, choice.weights)
        return Ready(robot, method, plant_of(robot.layout), none_count)

    def __repr__(self) -> str:
        return f"Allocator({self._layout.name!r:.60}, method={self.method!r})"
