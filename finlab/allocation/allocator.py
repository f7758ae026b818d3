"""The one interface of every allocation method: made for a robot, it checks questions and answers
them."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation import methods
from finlab.allocation.allocation import Allocation, BatchAllocation, LazyFigures, chunks
from finlab.allocation.method import Checkpoint, Method, Networks, Settings
from finlab.allocation.policy import CLOSEST, Policy, PolicyName, as_policy
from finlab.allocation.question import (
    check_flow,
    check_layout,
    check_previous,
    check_reference,
    check_seed,
    check_target,
    check_threads,
    check_wrenches,
    damage_of,
    free_mask,
)
from finlab.allocation.robot_state import RobotState, without_lost, working_actuators
from finlab.allocation.solution import Candidates, Rows, Solved, joined, written
from finlab.arrays import Array
from finlab.axes import Axis, axes_in
from finlab.errors import AllocationError
from finlab.layout.damage import NO_DAMAGE, Damage
from finlab.layout.layout import Layout
from finlab.physics.objective import wrench_scale_of
from finlab.physics.plant import plant_of

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own


_NAME_LISTS = (tuple, list)
"""Types of lists of names by which states are found."""
_NO_NAMES: tuple[str, ...] = ()
"""Default of lists of names. It is compared by identity, as are the seed and the policy: what is
equal and no such object goes another way, to the same answer."""
_USUAL_SEED = 0
"""Default of the seed."""
MAX_NAMED = 32
"""Sets of names by which states are found; where they are more, all are forgotten."""
MAX_STATES = 32
"""States of the robot, other than undamaged with all axes, that an allocator keeps prepared."""


def _check_arcs(layout: Layout, kind: type[Method]) -> None:
    """Refuses a robot with several arcs where its method would push in the zones between them."""
    if kind.keeps_arcs:
        return
    for actuator in layout.actuators:
        if getattr(actuator, "barred", ()):
            raise AllocationError(
                f"method {kind.name!r}: knows one arc of an actuator, {actuator.name!r} has "
                f"{actuator.angle_words(0.0, 0.0)}; expected one arc, or method 'dual'"
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
            robust: what an expected miss of 1 % of the wrench scale costs [W]; ranges and defaults
                are in `finlab.allocation.dual.method.DualSettings`.
            period_s: time between ticks [s]: with the rates of the drives it says how far a command
                may change from `previous`. Method `mdn` has it, too.
            calm: what turning costs in a tick [1]; see `DualSettings`.
            settings: of other methods, by name; see the `settings_class` of each.

        Raises:
            AllocationError: unknown method or setting, or a value out of its range.
            CheckpointError: missing, corrupt or foreign checkpoint.
            DataError: a fin's force table cannot be read.
        """
        check_layout(layout)
        named = {"robust": robust, "period_s": period_s, "calm": calm}
        settings |= {name: value for name, value in named.items() if value is not None}
        if isinstance(method, str):
            choice = methods.choose_method(method, checkpoint, **settings)
        elif isinstance(method, type) and issubclass(method, Method):
            checked = methods.checked_settings(method, settings)
            choice = methods.MethodChoice(method, checked, method.read_networks(checkpoint))
        else:
            raise AllocationError(f"method: expected the name of a method, got {method!r:.60}")
        self._prepare(layout, choice)

    @classmethod
    def from_bundle(cls, path: str | os.PathLike[str]) -> Allocator:
        """Makes the allocator of a bundle's robot, as `finlab export` wrote it.

        Args:
            path: of the bundle, a folder or a zip archive.

        Returns:
            An allocator with the layout, method, networks and settings of the bundle.

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
        """Makes the allocator of a robot.

        Args:
            layout: the robot.
            choice: the method, with its networks and settings.

        Returns:
            The allocator, whose robot is undamaged.
        """
        made = cls.__new__(cls)
        made._prepare(layout, choice)
        return made

    def _prepare(self, layout: Layout, choice: methods.MethodChoice) -> None:
        """Prepares the undamaged robot; all constructors end here."""
        _check_arcs(layout, choice.kind)
        self._layout = layout
        self._choice = choice
        self._scale = wrench_scale_of(layout)
        self._whole = self._make_state(NO_DAMAGE)
        self._states: dict[object, RobotState] = {}
        """States that were asked for, by damage and free axes; the one asked for last is last."""
        self._states_by_names: dict[tuple[object, ...], RobotState] = {}
        """States by what questions have named: damage, lost actuators, free axes."""
        if "losses" in choice.kind.reads and 1 < layout.n <= MAX_STATES:
            # A control loop that loses an actuator is to answer as soon as ever.
            for name in layout.names:
                self._state_of_question(None, (name,), ())

    def __getstate__(self) -> dict[str, Any]:
        return {"layout": self._layout, "choice": self._choice}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._prepare(state["layout"], state["choice"])

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
    def networks(self) -> Networks | None:
        """Trained networks; None for methods without."""
        return self._choice.networks

    @property
    def checkpoint(self) -> str | None:
        """Name of the checkpoint that the networks come from; None for methods without."""
        return None if self.networks is None else self.networks.name

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
        """Returns an allocator by the same method, networks and settings, for another robot."""
        return self.of_choice(layout, self._choice)

    def with_settings(self, **settings: Any) -> Allocator:
        """Returns an allocator for the same robot, by the same method and networks, with other
        settings; those that are not named stay as they are.

        Args:
            **settings: of the method, by name, such as `period_s=0.02`.

        Raises:
            AllocationError: the method knows no such setting, or a value is out of its range.
        """
        kind = self._choice.kind
        checked = methods.checked_settings(kind, {**vars(self.settings), **settings})
        return self.of_choice(self._layout, replace(self._choice, settings=checked))

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
        power: float | Mapping[str, float] | None = None,
    ) -> Allocation:
        """Finds the commands for one target.

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
            power: the most that all actuators may take together [W], in place of what the layout
                says, or of buses of the layout by their names; a wrench that takes more is out of
                reach. None for what the layout says, infinity for no limit.

        Returns:
            Commands of all actuators, and what they give.

        Raises:
            CommandError: the wrench is not six finite numbers, no axis counts, or another array has
                a wrong shape.
            AllocationError: the method does not know the policy, or keeps no power budget.
            LayoutError: an unknown actuator, or none left.
            DataError: a fin's force table cannot be read.
        """
        state = self._whole
        if damage is not None or lost is not _NO_NAMES or free is not _NO_NAMES:
            state = self._state_of_question(damage, lost, free)
        multipliers: Array | None = None
        if isinstance(previous, Allocation):
            multipliers = previous.multipliers
            previous = previous.command
        if flow is None and reference is None and seed is _USUAL_SEED:
            if power is not None:
                prepared = state.prepared_within(policy, power)
            elif policy is CLOSEST:
                prepared = state.closest
            else:
                prepared = state.prepared_question(policy)
            start = time.perf_counter()
            row = prepared.answer(wrench, previous, multipliers)
            if row is not None:
                return Allocation.of_row(row, (time.perf_counter() - start) * 1e3, prepared)
        wrench_asked = check_target(wrench)
        checked_policy = policy if policy is CLOSEST else as_policy(policy)
        checked_seed = check_seed(seed)
        checked_flow = None if flow is None else check_flow(flow)
        checked_previous: Array | None = None
        if previous is not None:
            checked_previous = check_previous(previous, state.layout)

        budget = state.budget_of(power)
        start = time.perf_counter()
        target = wrench_asked
        checked_reference: Array | None = None
        if reference is not None:
            checked_reference = check_reference(reference)
            target = state.method.in_time(target, checked_reference)
        question = state.question(
            target[None],
            checked_policy,
            checked_flow,
            checked_seed,
            checked_previous,
            multipliers,
            checked_reference,
            budget,
        )
        solution = state.solve(question)
        solve_ms = (time.perf_counter() - start) * 1e3

        command = state.among_all(solution.command)[0]
        answered = LazyFigures(state, question, wrench_asked, solution)
        return Allocation.to_read(command, checked_previous, solve_ms, answered)

    def refinement(self, result: Allocation) -> tuple[Candidates, ...]:
        """Returns what a network proposes for the question of a result, step by step.

        Args:
            result: an answer of this allocator, or of another one for the same robot.

        Returns:
            The proposals, then the same rows after each step of their refinement; nothing for
            methods without proposals.

        Raises:
            AllocationError: the answer is of another robot.
        """
        state = self._state_of(result)
        steps = state.method.refinement(
            np.nan_to_num(result.target), flow=result.flow, seed=result.seed
        )
        if state.works.all():
            return steps
        return tuple(replace(step, command=state.among_all(step.command)) for step in steps)

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
        threads: int = 1,
        power: float | Mapping[str, float] | None = None,
    ) -> BatchAllocation:
        """Finds the commands for many targets.

        Args:
            wrenches: desired wrenches (N, 6) [N, N m] in the body frame.
            lost: as in `allocate`, as are all that follow.
            damage: actuators that work in part.
            free: names of axes that may take any wrench.
            policy: what to do where a wrench is out of reach.
            flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.
            seed: the same target and seed give the same answer, whatever the batch.
            threads: how many threads share the targets; each keeps a core busy. The answers do not
                depend on it.
            power: the most that actuators may take together [W], as in `allocate`.

        Returns:
            The targets and the commands; what else there is to tell is computed when it is first
            read.

        Raises:
            CommandError: the wrenches are no (N, 6) of finite numbers, or as in `allocate`.
            AllocationError: the method does not know the policy, or `threads` is no whole number
                from 1.
            LayoutError: an unknown actuator, or none left.
            DataError: a fin's force table cannot be read.
        """
        wrenches_asked = check_wrenches(wrenches)
        thread_count = check_threads(threads)
        state = self._state_of_question(damage, lost, free)
        checked_policy = as_policy(policy)
        checked_seed = check_seed(seed)
        checked_flow = check_flow(flow)
        start = time.perf_counter()
        budget = state.budget_of(power)
        question = state.question(
            wrenches_asked, checked_policy, checked_flow, checked_seed, budget=budget
        )

        parts = chunks(len(wrenches_asked), thread_count, state.method.most_targets)
        command = np.empty((len(wrenches_asked), len(state.works), 3)) if len(parts) > 1 else None

        def solved(rows: slice) -> tuple[Rows, Solved]:
            part = state.solve(question.part(rows))
            return rows, part if command is None else written(part, command[rows])

        if thread_count == 1:
            solutions = [solved(rows) for rows in parts]
        else:
            from finlab.allocation.shared_work import in_threads

            solutions = in_threads(solved, parts, thread_count)
        solution = joined(solutions, len(wrenches_asked), state.works, command)
        targets_shown = state.shown(wrenches_asked)
        elapsed_ms = (time.perf_counter() - start) * 1e3
        count = len(targets_shown)
        answered = LazyFigures(state, question, wrenches_asked, solution)
        return BatchAllocation.of(
            **answered.fields(),
            target=targets_shown,
            command=solution.command,
            solve_ms=np.full(count, elapsed_ms / max(count, 1)),
            wrench_expected=solution.wrench,
            answered=answered,
        )

    def _state_of(self, result: Allocation) -> RobotState:
        """Returns the state of the robot for which a result was made."""
        state = self._state(result.damage)
        if state.layout != result.layout:
            raise AllocationError(
                f"this answer is of layout {result.layout.name!r:.60}, and this allocator is for "
                f"{self._layout.name!r:.60} as it was made; ask the allocator that answered"
            )
        return state

    def _state_of_question(
        self, damage: Damage | None, lost: Sequence[str], free: Sequence[str]
    ) -> RobotState:
        """Returns the robot that a question is about; its arguments are those of `allocate`."""
        if damage is None and not len(lost) and not len(free):
            return self._whole
        # A control loop names the same in each tick, as tuples or lists.
        names: tuple[object, ...] | None = None
        if type(lost) in _NAME_LISTS and type(free) in _NAME_LISTS:
            names = damage, tuple(lost), tuple(free)
            state = self._state_named(names)
            if state is not None:
                return state
        state = self._state(damage_of(damage, lost), free)
        if names is not None:
            if len(self._states_by_names) >= MAX_NAMED:
                self._states_by_names.clear()
            self._states_by_names[names] = state
        return state

    def _state_named(self, names: tuple[object, ...]) -> RobotState | None:
        """Returns the state that a question has named so before; None for another one."""
        try:
            return self._states_by_names.get(names)
        except TypeError:  # what cannot be hashed is no list of names, which is said later
            return None

    def _state(self, damage: Damage, free: Sequence[str] = ()) -> RobotState:
        """Returns the robot with a damage, asked for all axes but some: from the cache, or prepared
        now."""
        if damage == NO_DAMAGE and not len(free):
            return self._whole
        mask = free_mask(self._layout, free)
        key = damage, None if mask is None else mask.tobytes()
        state = self._states.pop(key, None) or self._make_state(damage, mask)
        self._states[key] = state  # at the end, so that the first is the one to leave
        while len(self._states) > MAX_STATES:
            self._states.pop(next(iter(self._states)), None)
        return state

    def _make_state(self, damage: Damage, free: NDArray[np.bool_] | None = None) -> RobotState:
        """Prepares the robot with a damage, asked for all axes but some (6,).

        A method that reads losses from the question is that of the state without any: a loss, or a
        free axis, prepares nothing.
        """
        damaged = damage.applied_to(self._layout)
        works = working_actuators(damaged, damage)
        choice = self._choice
        commanded = self._layout.commanded if free is None else self._layout.commanded & ~free
        free_axes = None if commanded.all() else ~commanded
        if "losses" in choice.kind.reads and (damage.lost or free is not None):
            without_loss = self._whole
            if damage.faults_by_kind:
                without_loss = self._state(replace(damage, lost=()))
            return RobotState(
                damaged, damage, works, without_loss.method, without_loss.plant, free_axes
            )
        layout = without_lost(damaged, damage)
        if free is not None:
            layout = replace(layout, axes=axes_in(commanded))
        method = choice.kind(layout, choice.settings, self._scale, choice.networks)
        return RobotState(damaged, damage, works, method, plant_of(damaged), free_axes)

    def __repr__(self) -> str:
        return f"Allocator({self._layout.name!r:.60}, method={self.method!r})"
