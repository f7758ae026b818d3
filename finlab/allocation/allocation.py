"""The answer of an allocation method: commands, what they give, and what is left undone.

`Allocator` makes one; it is plain data, and can be read where no allocator is.
"""

import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.actuator import Command
from finlab.allocation.policy import Policy
from finlab.allocation.question import MethodQuestion
from finlab.allocation.report import allocation_blocks, answer_notes, doubts, next_measurement
from finlab.allocation.solution import (
    CANDIDATE_ARRAYS,
    Candidates,
    PlainData,
    Solved,
    without_locks,
)
from finlab.arrays import Array, has_nan
from finlab.core.calls import AnswerRow, CommandFigures
from finlab.display import html, text
from finlab.layout.damage import Damage
from finlab.layout.effectiveness import body_force
from finlab.layout.layout import Layout
from finlab.physics.objective import REACHED, effort_of_one, judged_effort, judged_power
from finlab.physics.plant import Plant, plant_of

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

    from finlab.allocation.power_budget import PowerBudget
    from finlab.allocation.robot_state import PreparedQuestion, RobotState

Number = TypeVar("Number", float, Array)
"""A figure of one answer, or of each of many (N,)."""
NOTHING_ASKED = 1e-14
"""Square of a normalized target below which nothing is asked."""
CHUNK = 1024
"""Answers that are judged together; keeps memory flat for any number of targets."""


def read_only(array: Array) -> Array:
    """Makes an array read-only, which nobody else writes to, and returns it."""
    array.setflags(write=False)
    return array


def _none() -> None:
    """Default of fields that are set when they are first read: a default value itself would be
    found in the class."""


class LazyFigures(NamedTuple):
    """The figures that a result computes when they are first read."""

    state: "RobotState"
    """Of the robot that was asked."""
    question: MethodQuestion
    """What its method was asked."""
    wrenches: Array
    """Desired wrenches as they came, (6,) or (N, 6) [N, N m]."""
    solution: Solved
    """What the method answered."""
    is_of_command: bool = True
    """Whether the command is the one of `solution`; not so where it was put in place of it."""

    @property
    def plant(self) -> Plant:
        """Judge of commands: the laws of all actuators, lost ones included, in the question's
        flow."""
        return self.state.plant.at(self.question.flow)

    def fields(self) -> dict[str, Any]:
        """Returns the fields of a result that follow from the question, by name."""
        question = self.question
        return {
            **self.state.fields_of_results,
            "policy": question.policy,
            "flow": question.flow,
            "seed": question.seed,
            "budget": question.budget,
        }

    def fields_of_one(self) -> dict[str, Any]:
        """Returns the same of a single answer, with those that follow from the solution."""
        expected = self.solution.wrench
        multipliers = self.solution.multipliers
        values = self.fields()
        values["target"] = read_only(self.state.shown(self.question.targets[0]))
        values["wrench_expected"] = None if expected is None else read_only(expected[0])
        values["multipliers"] = None if multipliers is None else read_only(multipliers[0])
        values["settings"] = vars(self.state.method.settings).copy()
        return values

    def notes(self) -> tuple[str, ...]:
        """Returns sentences about the robot and the method, not about single answers."""
        state = self.state
        wrenches = self.wrenches
        if state.freed is not None:
            # What was asked of an axis that the layout does not command stays: a note tells of it.
            wrenches = np.where(state.freed, 0.0, wrenches)
        of_solution = () if self.solution.notes is None else self.solution.notes()
        return answer_notes(state.healthy, state.method, self.question.flow, wrenches, of_solution)

    def candidates(self) -> Candidates | None:
        """Returns the refined candidates of all n actuators; None where the method has none."""
        return self._candidates_of_all(self.solution.candidates)

    def samples(self) -> Candidates | None:
        """Returns the candidates before refinement; None where the method has none."""
        return self._candidates_of_all(self.solution.samples)

    def bound(self, force: Array | None = None) -> Array | None:
        """Returns the lower bound (N,) of the power [W]; None where the method proves none.

        Args:
            force: forces (N, n, 3) [N] of the solution's commands, own frames; None where they are
                not known yet.
        """
        bound = self.solution.bound
        if bound is None:
            return None
        command = self.solution.command
        return bound(command, self.plant.forces(command) if force is None else force)

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


@without_locks
@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Answer(PlainData, Generic[Number]):
    """What answers to one target and to many have, as plain data; many have N rows of each array.

    Arrays are read-only, and nobody else's: no figure changes because an array was written to.
    Properties that take time are computed when they are first read, and kept; copies have all of
    them.
    """

    LAZY: ClassVar[tuple[str, ...]] = (
        "forces",
        "wrench",
        "err_norm",
        "power",
        "effort",
        "bound",
        "expected_miss",
        "notes",
    )
    """Properties that are computed when they are first read."""
    ARRAYS: ClassVar[tuple[str, ...]] = ("target", "command", "scale", "flow", "wrench_expected")
    """Fields with arrays."""
    NOT_COPIED: ClassVar[tuple[str, ...]] = ("_plant", "expected_error")
    """What is kept, and quickly made again."""

    layout: Layout
    """The whole layout, lost actuators included, with the limits that damage has left."""
    damage: Damage = field(default_factory=Damage)
    """What was known of damaged actuators; the lost ones were left out."""
    target: Array
    """Desired wrench (6,) or (N, 6), [N, N m], body frame; NaN along axes that do not count."""
    command: Array
    """Command (n, 3) or (N, n, 3) of every actuator, as its law takes it; NaN if lost."""
    scale: Array
    """Wrench scale (6,) of the error [N, N m]; see `finlab.physics.objective`."""
    method: str
    """Name of the method that answered."""
    checkpoint: str | None = field(default_factory=_none)
    """Name of the checkpoint that was used, if any."""
    policy: Policy = field(default_factory=Policy)
    """What was to be done if a target was out of reach."""
    flow: Array | None = field(default_factory=_none)
    """Velocity (6,) of the body relative to the water [m/s, rad/s], body frame; None at rest."""
    seed: int = field(default_factory=int)
    """Seed that makes the answer repeatable."""
    budget: "PowerBudget | None" = field(default_factory=_none)
    """What the actuators might take together; None where nothing limited it."""
    wrench_expected: Array | None = field(default_factory=_none)
    """Wrench (6,) or (N, 6) that the method itself expected, if it used a model of its own."""
    unknown_fins: tuple[str, ...] = field(default_factory=tuple)
    """Names of fins whose model the method's networks have not learned; answers for them are
    wrong."""
    answered: LazyFigures | None = field(default_factory=_none, compare=False)
    """Computes the lazy properties; None in copies, which have them all."""

    def __post_init__(self) -> None:
        for name, value in self.__dict__.items():
            if isinstance(value, np.ndarray) and value.flags.writeable:
                object.__setattr__(self, name, read_only(value.copy()))

    @classmethod
    def of(cls, **values: Any) -> "Self":
        """Makes an answer, see `PlainData`; its arrays, which nobody else may write to, are made
        read-only."""
        for name in cls.ARRAYS:
            value = values.get(name)
            if value is not None:
                value.setflags(write=False)
        return super().of(**values)

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the actuators that were left out."""
        return tuple(self.damage.lost)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the actuators, in the order of `command`."""
        return self.layout.names

    @cached_property
    def unallocated(self) -> Array:
        """Target minus delivered wrench (6,) or (N, 6); 0 along axes that do not count."""
        missing = self.target - self.wrench
        if has_nan(missing):
            missing[np.isnan(missing)] = 0.0
        return read_only(missing)

    @cached_property
    def forces(self) -> Array:
        """Force (n, 3) or (N, n, 3) of each actuator [N], body frame, by its own law; 0 if lost."""
        return self._body_forces()

    def _body_forces(self) -> Array:
        """The forces in the body frame, by the plant."""
        return self._of_forces(lambda plant, force: body_force(force, plant.layout.frames))

    @cached_property
    def wrench(self) -> Array:
        """Delivered wrench (6,) or (N, 6) [N, N m] by the actuators' own laws and tables."""
        return self._of_forces(Plant.wrench_of)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Sentences that the user should read, such as about a fin model that the checkpoint never
        saw."""
        return self._general_notes + self._doubts()

    @cached_property
    def _general_notes(self) -> tuple[str, ...]:
        """Sentences about the robot and the method."""
        return () if self.answered is None else self.answered.notes()

    def _doubts(self) -> tuple[str, ...]:
        """Sentences about this very answer."""
        return ()

    @cached_property
    def expected_miss(self) -> Array:
        """Standard deviation (6,) or (N, 6) of the wrench [N, N m] by what is uncertain of the
        actuators: what the layout says, or a table's own; zeros where nothing is known to be."""
        if not self._plant.is_uncertain:
            return read_only(np.zeros((*self.command.shape[:-2], 6)))
        from finlab.physics.expected_miss import expected_miss

        return self._judged(expected_miss)

    @cached_property
    def err_norm(self) -> Number:
        """Size of what is missing from a target, each axis over its `scale`."""
        scaled = self.unallocated / self.scale
        return self._number(np.sqrt((scaled * scaled).sum(axis=-1)))

    @cached_property
    def expected_error(self) -> Number:
        """Size of `expected_miss`, each axis over its `scale`: by how much the true wrench may be
        off."""
        if not self._plant.is_uncertain:
            return self._number(np.zeros(self.target.shape[:-1]))
        counted = np.where(np.isnan(self.target), 0.0, self.expected_miss / self.scale)
        return self._number(np.linalg.norm(counted, axis=-1))

    @cached_property
    def power(self) -> Number:
        """Mean power [W] of a command, by the actuators' own models: of fins mechanical."""
        return self._power()

    def _power(self) -> Number:
        """The power by the plant."""
        return self._number(self._judged(judged_power))

    @cached_property
    def effort(self) -> Number | None:
        """Effort `J_en` of a command, the paper's energy proxy; None where not all actuators are
        fins."""
        if not self.layout.is_of_fins:
            return None
        return self._number(self._judged(lambda plant, rows: judged_effort(plant.layout, rows)))

    @cached_property
    def bound(self) -> Number | None:
        """Power [W] that no answer for the same wrench can undercut; None for methods that prove
        none."""
        bound = None if self.answered is None else self._proved_bound(self.answered)
        return None if bound is None else self._number(bound)

    def _proved_bound(self, answered: LazyFigures) -> Array | None:
        """The bounds (N,) [W] that the method proves; None where it proves none."""
        return answered.bound()

    def _number(self, values: Array) -> Number:
        """Figures (N,) of rows; of one answer the plain number."""
        if self.command.ndim == 3:
            return read_only(values)  # type: ignore[return-value]
        return values.item()  # type: ignore[return-value]

    @cached_property
    def _plant(self) -> Plant:
        """What judges the commands, in the flow of the question."""
        return plant_of(self.layout).at(self.flow) if self.answered is None else self.answered.plant

    def _judged(self, figure: Callable[[Plant, Array], Array]) -> Array:
        """Figures of the commands by the plant, of many in chunks; `figure` takes (N, n, 3)."""
        plant = self._plant
        if self.command.ndim == 2:
            return read_only(np.asarray(figure(plant, self.command[None])[0]))
        if len(self.command) <= CHUNK:
            return read_only(figure(plant, self.command))
        parts = [figure(plant, self.command[rows]) for rows in chunks(len(self.command))]
        return read_only(np.concatenate(parts))

    def _of_forces(self, figure: Callable[[Plant, Array], Array]) -> Array:
        """Figures of the forces of the commands; `figure` takes (N, n, 3) [N], own frames."""
        return self._judged(lambda plant, rows: figure(plant, plant.forces(rows)))

    def _equal_names(self) -> list[str]:
        """Fields, and what is computed of them: two answers are equal if they say the same."""
        return [*super()._equal_names(), *self.LAZY]

    def __getstate__(self) -> dict[str, Any]:
        for name in (*self.LAZY, "_general_notes"):
            getattr(self, name)
        state = {**self.__dict__, "answered": None}
        for name in self.NOT_COPIED:
            state.pop(name, None)
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)  # a pickle does not keep that
            if isinstance(value, Candidates):
                value = _read_only_candidates(value)
            self.__dict__[name] = value


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class BatchAllocation(Answer[Array]):
    """Answers to N targets on one layout: plain data, as an `Allocation` is."""

    ARRAYS: ClassVar[tuple[str, ...]] = (*Answer.ARRAYS, "solve_ms")
    NOT_COPIED: ClassVar[tuple[str, ...]] = (*Answer.NOT_COPIED, "commands")

    solve_ms: Array = field(compare=False)
    """Time per target (N,) [ms]: the whole time divided by N."""

    @cached_property
    def commands(self) -> dict[str, Command | None]:
        """Commands of each actuator by its name, in a type of its own whose numbers are arrays
        (N,), such as `commands["lift"].force`; with `input`, what a table of thrust says to send.
        None for a lost one."""
        lost = set(self.lost)
        rows_of_actuators = np.moveaxis(self.command, 1, 0)
        commands: dict[str, Command | None] = {}
        for actuator, rows in zip(self.layout.actuators, rows_of_actuators, strict=True):
            is_lost = actuator.name in lost
            commands[actuator.name] = None if is_lost else actuator.commands(rows)
        return commands

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """Which targets are delivered (N,): an `err_norm` of at most 0.001."""
        return self.err_norm <= REACHED

    def __len__(self) -> int:
        return len(self.target)

    def __repr__(self) -> str:
        worst = f"{self.err_norm.max():.2e}" if len(self) else "none"
        return (
            f"BatchAllocation({len(self)} targets, layout={self.layout.name!r:.60}, "
            f"actuators={len(self.names)}, method={self.method!r}, "
            f"delivered={int(self.reachable.sum())}, largest err_norm={worst})"
        )


@without_locks
@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Allocation(Answer[float]):
    """The answer to one allocation problem, as plain data: it can be compared, copied, pickled and
    printed.

    `print(result)` shows it as a table.
    """

    LAZY: ClassVar[tuple[str, ...]] = (*Answer.LAZY, "calm_power", "candidates", "samples")
    ARRAYS: ClassVar[tuple[str, ...]] = (*Answer.ARRAYS, "previous", "multipliers")
    NOT_COPIED: ClassVar[tuple[str, ...]] = (
        *Answer.NOT_COPIED,
        "_figures",
        "_missing",
        "_own_forces",
        "_asked",
    )

    solve_ms: float = field(compare=False)
    """Time spent solving [ms], judging not included."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Settings of the method, by name."""
    previous: Array | None = field(default_factory=_none)
    """Command (n, 3) of the previous tick, if it was given."""
    multipliers: Array | None = field(default_factory=_none, compare=False)
    """Multipliers (6,) [W/N, W/(N m)] of the wrench, what one more unit of each axis costs; None
    where the method has none."""

    @classmethod
    def to_read(
        cls, command: Array, previous: Array | None, solve_ms: float, answered: LazyFigures
    ) -> "Self":
        """Makes an answer whose other fields are set when the first of them is read: a control loop
        reads the command alone.

        Args:
            command: (n, 3), read-only, as all arrays.
            previous: command (n, 3) of the previous tick, if there is one.
            solve_ms: time spent solving [ms].
            answered: what the other fields follow from.

        Returns:
            The answer.
        """
        made = object.__new__(cls)
        known = {
            "command": command,
            "previous": previous,
            "solve_ms": solve_ms,
            "answered": answered,
        }
        object.__setattr__(made, "__dict__", known)
        return made

    @classmethod
    def of_row(cls, row: AnswerRow, solve_ms: float, prepared: "PreparedQuestion") -> "Self":
        """Makes an answer of what a prepared question was answered, as `to_read` does.

        Args:
            row: the answer.
            solve_ms: time spent solving [ms].
            prepared: the question.
        """
        made = object.__new__(cls)
        values = made.__dict__  # which is written to in half the time of a new one
        values["command"] = row.command
        values["solve_ms"] = solve_ms
        values["_asked"] = (prepared, row)
        return made

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Sets the fields that follow from the question, when the first of them is read."""
            values = self.__dict__
            asked = values.get("_asked")
            if asked is not None and "answered" not in values:
                prepared, row = asked
                if name == "multipliers":  # which the next tick reads alone
                    values[name] = row.multipliers[0]
                    return values[name]
                wrench = row.wrench
                question = prepared.question_of(wrench, row.previous)
                solution = prepared.solved(row, question)
                values["previous"] = question.previous
                values["answered"] = LazyFigures(prepared.state, question, wrench, solution)
            answered = values.get("answered")
            if answered is not None and "layout" not in values:
                values.update(answered.fields_of_one())
            if name in values:
                return values[name]
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    @property
    def commands(self) -> dict[str, Command | None]:
        """Command of each actuator by its name, in a type of its own; None for a lost one."""
        commands = {}
        for actuator, row in zip(self.layout.actuators, self.command, strict=True):
            commands[actuator.name] = actuator.command(row)
        return commands

    @cached_property
    def calm_power(self) -> float:
        """Part of the power [W] that goes into less turning, as the setting `calm` weighs it: what
        an answer for the same wrench in the same tick takes less where turning costs nothing. 0
        outside of ticks."""
        calm_power = None if self.answered is None else self.answered.calm_power()
        return 0.0 if calm_power is None else self._number(calm_power)

    @cached_property
    def candidates(self) -> Candidates | None:
        """Refined candidates, best first; None for methods that have a single answer."""
        return None if self.answered is None else _read_only_candidates(self.answered.candidates())

    @cached_property
    def samples(self) -> Candidates | None:
        """Raw candidates before refinement, best first; None for methods that draw none."""
        return None if self.answered is None else _read_only_candidates(self.answered.samples())

    @cached_property
    def expected_error(self) -> float:
        return super().expected_error if self._plant.is_uncertain else 0.0

    @cached_property
    def _plant(self) -> Plant:
        asked = self.__dict__.get("_asked")
        return super()._plant if asked is None else asked[0].state.plant  # at rest in the water

    @cached_property
    def _figures(self) -> CommandFigures | None:
        """All that the core judges at once; None where the plant judges each by itself."""
        return self._plant.figures(self.command)

    @cached_property
    def forces(self) -> Array:
        figures = self._figures
        return self._body_forces() if figures is None else figures.force

    @cached_property
    def wrench(self) -> Array:
        figures = self._figures
        return self._of_forces(Plant.wrench_of) if figures is None else figures.wrench

    @cached_property
    def power(self) -> float:
        figures = self._figures
        return self._power() if figures is None else figures.power

    @cached_property
    def effort(self) -> float | None:
        return effort_of_one(self.layout, self.command) if self.layout.is_of_fins else None

    @cached_property
    def _missing(self) -> list[float]:
        """Numbers (6) of `unallocated`, one by one: arrays of six take four times as long."""
        missing = map(operator.sub, self.target.tolist(), self.wrench.tolist())
        return [part if part == part else 0.0 for part in missing]  # 0 in place of NaN

    @cached_property
    def unallocated(self) -> Array:
        return read_only(np.array(self._missing))

    @cached_property
    def err_norm(self) -> float:
        squares = 0.0
        for missing, scale in zip(self._missing, self.scale.tolist(), strict=True):
            share = missing / scale
            squares += share * share
        return math.sqrt(squares)

    @cached_property
    def _own_forces(self) -> Array:
        """Forces (1, n, 3) [N], own frames, of which several figures are made."""
        figures = self._figures
        return self._plant.forces(self.command[None]) if figures is None else figures.own_force

    def _of_forces(self, figure: Callable[[Plant, Array], Array]) -> Array:
        return read_only(np.asarray(figure(self._plant, self._own_forces)[0]))

    @cached_property
    def bound(self) -> float | None:
        asked = self.__dict__.get("_asked")
        if asked is not None:
            prepared, row = asked
            bound: float | None = prepared.bound(row)
            if bound is not None:
                return bound
        return super().bound

    def _proved_bound(self, answered: LazyFigures) -> Array | None:
        return answered.bound(self._own_forces if answered.is_of_command else None)

    def _doubts(self) -> tuple[str, ...]:
        """Sentences about its forces, and about whether another one takes less power."""
        return doubts(self)

    @cached_property
    def measure_next(self) -> str:
        """The sentence about what adds most to `expected_error`; empty where that is at most
        0.001."""
        return "" if self.expected_error <= REACHED else next_measurement(self, self._plant)

    @cached_property
    def reachable(self) -> bool:
        """Whether the target is delivered: an `err_norm` of at most 0.001."""
        return self.err_norm <= REACHED

    @property
    def share(self) -> float:
        """Share of the target that is delivered in its own direction; 1 where nothing is asked."""
        target = np.nan_to_num(self.target / self.scale)
        wrench = self.wrench / self.scale
        size_squared = float(target @ target)
        if size_squared < NOTHING_ASKED:
            return 1.0
        return float(target @ wrench) / size_squared

    @property
    def binding(self) -> tuple[str, ...]:
        """Sentences about the limits, names of the buses whose power is used up, and in a tick
        sentences about the rates, that keep the robot from delivering the target.

        Empty where the target is delivered, and where the method's networks do not know the fins:
        then limits are not what keeps it.
        """
        if self.reachable or self.unknown_fins:
            return ()
        from finlab.allocation.binding import what_binds
        from finlab.allocation.method import USUAL_PERIOD_S

        period_s = float(self.settings.get("period_s", USUAL_PERIOD_S))
        missing = self.unallocated / self.scale
        power = self._plant.power(self.command)
        return what_binds(
            self.layout, self.command, missing, self.previous, period_s, self.budget, power
        )

    def with_command(self, command: Array) -> "Self":
        """Returns the same question with another command (n, 3) in place of the answer, judged by
        the plant."""
        answered = self.answered
        if answered is not None:
            answered = answered._replace(is_of_command=False)
        other = replace(self, command=command, wrench_expected=None, answered=answered)
        if answered is None:
            # A copy has computed these already, and has nothing to compute them from again.
            of_question = ("bound", "calm_power", "candidates", "samples", "_general_notes")
            other.__dict__.update({name: getattr(self, name) for name in of_question})
        return other

    def with_candidates(self, candidates: Candidates | None, samples: Candidates | None) -> "Self":
        """Puts other candidates in place of those of the answer.

        Args:
            candidates: refined ones; None for none.
            samples: raw ones; None for none.

        Returns:
            The same answer with these.
        """
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return self.of(**{**self.__dict__, **values, "candidates": candidates, "samples": samples})

    def __repr__(self) -> str:
        lost = f", lost={', '.join(self.lost)!r:.60}" if self.lost else ""
        effort = "" if self.effort is None else f", effort={self.effort:.3f}"
        return (
            f"Allocation(layout={self.layout.name!r:.60}, actuators={len(self.names)}{lost}, "
            f"method={self.method!r}, err_norm={self.err_norm:.2e}, power={self.power:.3g} "
            f"W{effort}, reachable={self.reachable}, solve_ms={self.solve_ms:.1f})"
        )

    def __str__(self) -> str:
        return text(allocation_blocks(self))

    def _repr_html_(self) -> str:
        from finlab.display.pictures import robot_picture

        return html(allocation_blocks(self), lambda: robot_picture(self.layout, self.forces))


def _read_only_candidates(candidates: Candidates | None) -> Candidates | None:
    """Candidates whose arrays are read-only."""
    if candidates is None:
        return None
    arrays: dict[str, Any] = {}
    for name in CANDIDATE_ARRAYS:
        arrays[name] = read_only(getattr(candidates, name).view())
    return replace(candidates, **arrays)


def chunks(n: int, threads: int = 1, most: int = CHUNK) -> list[slice]:
    """Divides rows into parts, all alike in size.

    Args:
        n: how many rows there are.
        threads: among which the parts are shared: their number is a multiple of it.
        most: rows of a part.

    Returns:
        Slices of the n rows in their order, none of which is empty.
    """
    if 0 < n <= most and threads == 1:
        return [slice(0, n)]
    count = threads * -(-n // (most * threads))
    ends = [n * part // max(count, 1) for part in range(count + 1)]
    return [slice(start, end) for start, end in pairwise(ends) if start < end]
