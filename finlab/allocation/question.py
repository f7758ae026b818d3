"""One question to an allocator: the state of the robot, which asks its method, what a result
computes later, and the checks of all arguments.

`Allocator` makes a `RobotState` for each damage and set of free axes, and `LazyFigures` for each
result, which compute from state and solution what is first read later.
The checks return their argument in the form in which methods take it, or raise an error that says
what was got and what was expected. They stand here and in no file of their own since `finlab
allocate` is to load few files.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.allocation.method import Method, MethodQuestion
from finlab.allocation.policy import Policy
from finlab.allocation.report import answer_notes
from finlab.allocation.solution import Candidates, Solution, among_all
from finlab.arrays import Array
from finlab.axes import AXES, mask_of
from finlab.errors import AllocationError, CommandError
from finlab.layout.damage import NO_DAMAGE, Damage, lost_names
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant

MAX_WRENCH = 1e6
"""Largest magnitude of a component of a wrench [N, N m]; beyond it something is wrong upstream."""

MAX_FLOW = 100.0
"""Largest magnitude of a component of the flow [m/s, rad/s]; beyond it something is wrong
upstream."""

_NO_TARGETS = np.empty((0, 6))
"""Stands for the wrenches of a question that has none yet."""

MAX_SIZE_IN_PYTHON = 100
"""Arrays of up to so many numbers are measured by Python's own functions, which is quicker than
numpy's calls are for them; every tick pays for it."""


def working_actuators(damaged: Layout, damage: Damage) -> NDArray[np.bool_]:
    """Returns which actuators of a robot work.

    Args:
        damaged: the robot of n actuators, with the limits that damage has left.
        damage: what is known of it.

    Returns:
        Mask (n,), False for the lost ones.

    Raises:
        LayoutError: an actuator that is lost is unknown, or none is left.
    """
    lost = set(damage.lost)
    works = np.array([name not in lost for name in damaged.names])
    lost_here = damaged.n - int(works.sum())
    if lost and (not works.any() or len(lost) > lost_here):
        damaged.without(damage.lost, "lost")  # raises the error that says what is wrong
    return works


def without_lost(damaged: Layout, damage: Damage) -> Layout:
    """Takes the lost actuators out of a robot.

    Args:
        damaged: the robot, with the limits that damage has left.
        damage: what is known of it.

    Returns:
        The robot of the actuators that are not lost; itself where none is.
    """
    return damaged.without(damage.lost) if damage.lost else damaged


@dataclass(frozen=True, eq=False)
class RobotState:
    """A robot as damage has left it, asked for some axes of the wrench, with a method that is ready
    for it."""

    layout: Layout
    """All n actuators, with the limits that damage has left."""
    damage: Damage
    """What is known of those that are damaged."""
    works: NDArray[np.bool_]
    """Mask (n,) of the actuators that are not lost."""
    method: Method
    """Made for the m actuators that work, or for all n where it takes losses with the question."""
    plant: Plant
    """Of all n actuators at rest in the water; judges answers."""
    free: NDArray[np.bool_] | None
    """Axes (6,) of the wrench that may take any value; None where all are commanded."""

    @cached_property
    def healthy(self) -> Layout:
        """The robot of the m actuators that work alone."""
        return without_lost(self.layout, self.damage)

    @cached_property
    def lost(self) -> NDArray[np.bool_] | None:
        """Mask (n,) of the actuators that are lost; None where none is."""
        return ~self.works if self.damage.lost else None

    def among_all(self, command: Array) -> Array:
        """Returns commands (..., m, 3) of the actuators that work as those (..., n, 3) of all, NaN
        for the lost ones."""
        return among_all(command, self.works)

    def with_free_axes(self, wrench: Array, value: float) -> Array:
        """Marks the free axes of wrenches.

        Args:
            wrench: (..., 6) [N, N m].
            value: along the free axes: methods take 0 there, results show NaN.

        Returns:
            Wrenches (..., 6); the same array where no axis is free.
        """
        return wrench if self.free is None else np.where(self.free, value, wrench)

    def question(self, policy: Policy, flow: Array | None, seed: int) -> MethodQuestion:
        """Returns a question to the method, but for its wrenches: with the losses and free axes
        where the method reads these, else it is made for the actuators that work alone.

        Args:
            policy: what to give for a wrench out of reach.
            flow: velocity (6,) of the body relative to the water [m/s, rad/s]; None at rest.
            seed: makes the answer repeatable.
        """
        reads_losses = "losses" in self.method.reads
        return MethodQuestion(
            _NO_TARGETS,
            policy=policy,
            flow=flow,
            seed=seed,
            lost=self.lost if reads_losses else None,
            free=self.free if reads_losses else None,
        )

    def solve(self, question: MethodQuestion) -> Solution:
        """Asks the method.

        Args:
            question: with its wrenches; its `previous` is that of all n actuators.

        Returns:
            The method's solution. In a tick its commands lie within the limits and rates of the
            drives; outside of ticks actuators that have nothing to do are at rest.
        """
        method = self.method
        previous = question.previous
        if previous is None:
            solution = method.solve(question)
            return solution._replace(command=method.plant.rested(solution.command))
        if "losses" not in method.reads:
            previous = previous[self.works]
            question = question._replace(previous=previous)
        solution = method.solve(question)
        box = method.rates.box(previous)
        return solution._replace(command=box.clip_feasible(solution.command, method.plant))


class LazyFigures(NamedTuple):
    """The figures that a result computes when they are first read."""

    state: RobotState
    """Of the robot that was asked."""
    flow: Array | None
    """Velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at rest."""
    wrenches: Array
    """Desired wrenches as they came, (6,) or (N, 6) [N, N m]."""
    solution: Solution
    """What the method answered."""

    @property
    def plant(self) -> Plant:
        """Judge of commands: the laws of all actuators, lost ones included, in the question's
        flow."""
        return self.state.plant.at(self.flow)

    def notes(self) -> tuple[str, ...]:
        """Returns sentences about the robot and the method, not about single answers."""
        state = self.state
        asked = self.wrenches
        if state.free is not None:
            # What was asked of an axis that the layout does not command stays: a note tells of it.
            asked = np.where(state.free & state.layout.commanded, 0.0, asked)
        return answer_notes(state.healthy, state.method, self.flow, asked, self.solution.notes)

    def candidates(self) -> Candidates | None:
        """Returns the refined candidates of all n actuators; None where the method has none."""
        return self._candidates_of_all(self.solution.candidates)

    def samples(self) -> Candidates | None:
        """Returns the candidates before refinement; None where the method has none."""
        return self._candidates_of_all(self.solution.samples)

    def bound(self) -> Array | None:
        """Returns the lower bound (N,) of the power [W]; None where the method proves none."""
        bound = self.solution.bound
        return None if bound is None else bound(self.solution.command)

    def calm_power(self) -> Array | None:
        """Returns the part (N,) of the power [W] that goes into less turning; None where the method
        weighs no turning."""
        calm_power = self.solution.calm_power
        return None if calm_power is None else calm_power(self.solution.command)

    def _candidates_of_all(self, make: Callable[[], Candidates] | None) -> Candidates | None:
        """Candidates of the actuators that work, with rows for all n."""
        if make is None:
            return None
        candidates = make()
        if not candidates or not self.state.damage.lost:
            return candidates
        return replace(candidates, command=self.state.among_all(candidates.command))


def check_layout(layout: object) -> None:
    """Refuses what is no layout.

    Raises:
        AllocationError: it is none.
    """
    if not isinstance(layout, Layout):
        raise AllocationError(
            f"layout: expected a Layout, got {layout!r:.60}; read a file with finlab.load_layout"
        )


def check_seed(seed: object) -> None:
    """Refuses seeds that are no whole number from 0.

    Raises:
        AllocationError: it is none.
    """
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise AllocationError(f"seed: expected a whole number from 0, got {seed!r}")


def damage_of(damage: Damage | None, lost: Sequence[str]) -> Damage:
    """Returns the damage that a question names in either of its two arguments.

    Args:
        damage: damage of any kind; None for none.
        lost: names of actuators that are lost besides.

    Returns:
        One damage with both.

    Raises:
        AllocationError: `damage` is no `Damage`, or `lost` is no list of names.
    """
    if damage is None:
        known = NO_DAMAGE
    elif isinstance(damage, Damage):
        known = damage
    else:
        raise AllocationError(f"damage: expected a Damage, got {damage!r:.100}")
    if not len(lost):
        return known
    return replace(known, lost=[*known.lost, *lost_names(lost)])


def free_mask(layout: Layout, free: Sequence[str]) -> NDArray[np.bool_] | None:
    """Returns which axes of the wrench are free for one question.

    Args:
        layout: the robot.
        free: names of axes, such as `("Ty",)`.

    Returns:
        Mask (6,) of the axes that are named; None where there are none.

    Raises:
        CommandError: it is no list of names of axes, or no axis is left that the robot commands.
    """
    if not len(free):
        return None
    if isinstance(free, str) or not isinstance(free, Sequence):
        raise CommandError(f'free: expected a list of axes such as ("Ty",), got {free!r:.100}')
    unknown = [axis for axis in free if axis not in AXES]
    if unknown:
        raise CommandError(f"free: expected axes among {', '.join(AXES)}, got {unknown[0]!r:.60}")
    mask = mask_of(free)
    if not (layout.commanded & ~mask).any():
        raise CommandError(
            f"free: names each axis that layout {layout.name} commands "
            f"({', '.join(layout.axes)}), expected one of them to be left"
        )
    return mask


def check_target(wrench: ArrayLike) -> Array:
    """Returns a desired wrench (6,) [N, N m] as finite float64, a copy.

    Raises:
        CommandError: it is not six finite numbers of at most `MAX_WRENCH`.
    """
    array = _numbers(wrench, "wrench", _ONE_WRENCH)
    if array.shape != (6,):
        raise _wrong_shape("wrench", _ONE_WRENCH, array)
    return _within_limit(array, "wrench")


def check_wrenches(wrench: ArrayLike) -> Array:
    """Returns desired wrenches (N, 6) [N, N m] as finite float64, a copy.

    Raises:
        CommandError: they are no such array of finite numbers of at most `MAX_WRENCH`.
    """
    return _wrenches(wrench, "wrench")


def check_reference(reference: ArrayLike) -> Array:
    """Returns the expected wrenches (K, 6) [N, N m] of the next K ticks, a copy.

    Raises:
        CommandError: as of `check_wrenches`.
    """
    return _wrenches(reference, "reference")


_ONE_WRENCH = "six numbers [Fx, Fy, Fz, Tx, Ty, Tz] in N and N m"
"""What is expected of one wrench, in words."""
_MANY_WRENCHES = "an array of shape (N, 6) in N and N m"
"""What is expected of many wrenches, in words."""


def _wrenches(wrenches: ArrayLike, argument: str) -> Array:
    """Checked wrenches (N, 6), which an argument of that name gave."""
    array = _numbers(wrenches, argument, _MANY_WRENCHES)
    if array.ndim != 2 or array.shape[1] != 6:
        raise _wrong_shape(argument, _MANY_WRENCHES, array)
    return _within_limit(array, argument)


def _wrong_shape(argument: str, expected: str, array: Array) -> CommandError:
    """The error of an argument whose array has another shape than is expected."""
    return CommandError(f"{argument}: expected {expected}, got an array of shape {array.shape}")


def _within_limit(wrench: Array, argument: str) -> Array:
    """Returns wrenches (..., 6) themselves; raises a `CommandError` at the first component that is
    not finite, or above `MAX_WRENCH`."""
    if _size_bound(wrench) <= MAX_WRENCH:
        return wrench
    bad = ~(np.abs(wrench) <= MAX_WRENCH)  # NaN, too
    if not bad.any():
        return wrench
    axis = AXES[int(np.argwhere(bad)[0][-1])]
    value = wrench[bad][0]
    sentence = f"{argument}: {axis} must be a number of at most {MAX_WRENCH:g} in size, got {value}"
    if not np.isfinite(value):
        sentence += f'; an axis that may take any wrench is named: free=("{axis}",)'
    raise CommandError(sentence)


def check_flow(flow: ArrayLike | None) -> Array | None:
    """Returns the velocity of the body relative to the water.

    Args:
        flow: (6,) [m/s, rad/s], body frame; None at rest.

    Returns:
        The same (6,) as finite float64; None at rest.

    Raises:
        CommandError: it is not six finite numbers of at most `MAX_FLOW`.
    """
    if flow is None:
        return None
    expected = "six numbers [VX, VY, VZ, WX, WY, WZ] in m/s and rad/s, body relative to the water"
    array = _numbers(flow, "flow", expected)
    if array.shape != (6,):
        raise _wrong_shape("flow", expected, array)
    if not (np.abs(array) <= MAX_FLOW).all():
        raise CommandError(
            f"flow: each component must be finite and at most {MAX_FLOW:g} in size, got "
            f"{flow!r:.100}"
        )
    return array if array.any() else None


def check_previous(previous: ArrayLike, layout: Layout) -> Array:
    """Returns the command of the tick before.

    Args:
        previous: (n, 3), in which lost actuators may hold NaN.
        layout: the robot of n actuators.

    Returns:
        The same (n, 3) as float64, a copy.

    Raises:
        CommandError: it has another shape, or holds infinity or what is no number.
    """
    array = _numbers(previous, "previous", f"a command of shape ({layout.n}, 3)")
    # The bound is NaN where an actuator is lost: then each number is looked at.
    if not _size_bound(array) < math.inf and np.isinf(array).any():
        raise CommandError(
            "previous: expected finite commands (NaN only for lost fins), got infinity"
        )
    if array.shape != (layout.n, 3):
        raise CommandError(
            f"previous: expected a command of shape ({layout.n}, 3) for layout {layout.name!r}, "
            f"got shape {array.shape}; pass the `command` of the last allocation"
        )
    return array


def _numbers(values: ArrayLike, argument: str, expected: str) -> Array:
    """A copy as float64 of what an argument gave, or a `CommandError` that says what was expected;
    truth values and text are no numbers, also where they could be read as such."""
    try:
        array = np.array(values)
        if array.dtype.kind not in "iufO" or _has_non_numbers(values):
            raise TypeError("no numbers")
        return array.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise CommandError(f"{argument}: expected {expected}, got {values!r:.100}") from error


def _has_non_numbers(values: object) -> bool:
    """Whether truth values or text are among numbers, in lists of any depth: numpy reads `True`
    beside numbers as 1."""
    if isinstance(values, np.ndarray):
        if values.dtype.kind == "O":
            return _has_non_numbers(values.tolist())
        return values.dtype.kind not in "iuf"
    if isinstance(values, list | tuple):
        # Most are plain numbers, and every tick asks.
        others = [value for value in values if type(value) is not float]
        return any(map(_has_non_numbers, others))
    return isinstance(values, bool | np.bool_ | str | bytes)


def _size_bound(array: Array) -> float:
    """An upper bound of the sizes of an array's numbers; NaN where one of them is and none is
    infinite."""
    if array.size <= MAX_SIZE_IN_PYTHON:
        return math.hypot(*array.ravel().tolist())
    return float(np.abs(array).max())
