"""`Actuator`, the contract of a kind of actuator: all that is special about a kind stands in its
class, in one file.

A kind is a frozen dataclass, a subclass of `Actuator`, whose fields are what a layout file says of
one actuator. It declares its `KIND`, one value with named fields (law, responses to prices, numbers
of a command), which layouts, allocation, simulation, files and the app read without asking for its
type, and overrides what is not as usual. One line in `finlab.actuators.kinds` makes it known to all
of finlab; `docs/howto/kind.md` makes one in thirty lines.

Frames of actuators are right-handed, their rows unit vectors in the body frame (x forward, y left,
z up). A command is a row of three numbers, of which a kind may use fewer; the others are 0.
"""

import inspect
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import ArrayLike, NDArray

from finlab import axes
from finlab.actuators.law import ActuatorLaw
from finlab.arrays import Array
from finlab.axes import Vector3
from finlab.display import prefix_of
from finlab.errors import FinlabError, LayoutError
from finlab.files.schema import Checked, Name, Part

if TYPE_CHECKING:
    from typing_extensions import Self  # Python 3.10 has none of its own

Indices = NDArray[np.intp]
"""Indices (m,) of actuators in a layout, or in a sequence of some."""
CommandRow = tuple[float, float, float]
"""Numbers of one command [rad, Hz or N, by kind], or their limits, or their rates per second."""
Metres = Annotated[float, Meta(ge=-1000.0, le=1000.0)]
"""A coordinate of a point on a robot, or a lever arm [m]."""
Place = tuple[Metres, Metres, Metres]
"""A point on a robot, body frame [m]."""
Seconds = Annotated[float, Meta(ge=0.0, le=1000.0)]
"""A time constant [s]."""
Diameter = Annotated[float, Meta(ge=1e-3, le=20.0)]
"""Diameter of a jet [m]."""
TurnRate = Annotated[float, Meta(ge=1e-3, le=1000.0)]
"""An angular speed [rad/s]."""
TurnRateDegrees = Annotated[float, Meta(ge=0.06, le=57000.0)]
"""The same in a file [deg/s]."""
RANGE_SHARE = 0.2
"""Share of a command's range whose time at the largest rate counts as delay: a typical step."""
ACROSS = "across"
"""Name of the own axis across two declared ones, first x second: the third row of the frame."""

DRAWN_AS = ("fin", "thruster", "pod", "foil")
"""Shapes as which an actuator may be drawn."""


@dataclass(frozen=True)
class Uncertainty(Checked):
    """Standard deviation of an actuator's force. Checked on construction.

    Along each own axis of the actuator it is sqrt((share |F|)^2 + floor^2) at a force F.

    Args:
        share: part that grows with the force, over the force [1].
        floor: part that is there at any force [N].
        common: name of the error's source, such as a fit or a measurement; actuators of one name
            err together, by the same share along and across their forces. None for an actuator
            whose error is independent.
        correlation: share of the error's variance that actuators of one `common` have together
            [1].
    """

    KEYS = {"floor": "floor_n"}

    share: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.0
    floor: Annotated[float, Meta(ge=0.0, le=1e9)] = 0.0
    common: Name | None = None
    correlation: Annotated[float, Meta(ge=0.0, le=1.0)] = 1.0


class Faults(NamedTuple):
    """Damage of one actuator that still works; None where there is none of that sort."""

    weak: float | None = None
    """Share of its largest force that is left, above 0 and up to 1."""
    torn: float | None = None
    """Share of its force that it gives at every command, as one with a torn blade does."""
    stuck: float | None = None
    """Value that it keeps: the angle [rad] of one that no longer turns, though it still pushes; the
    force [N] at which a thruster hangs."""
    running: tuple[float, ...] | None = None
    """Command that it keeps whatever is asked, the numbers of its kind in order."""


class Command(Struct, frozen=True, omit_defaults=True):
    """A command as users see it: its numbers by name, and what follows from them."""

    @property
    def words(self) -> str:
        """The command with its units, for a cell of a printed table."""
        return ", ".join(f"{getattr(self, name):.3f}" for name in self.__struct_fields__)


@dataclass(frozen=True, kw_only=True)
class CommandNumber:
    """One number of a command.

    Args:
        name: column of recorded swims and of the graph file, behind the actuator's name.
        unit: "rad", "Hz" or "N"; a number in newtons is the force itself.
        limits: field of the kind with its least and greatest; None where the class has `lower`
            and `upper` of its own.
        rate: field with its largest change per second; None where nothing limits it, or where
            the class has `rates` of its own.
        aims: whether it is an angle that turns the force and leaves its size, so that a full turn
            has no ends.
        lags: whether it follows with the time constant; the first number does where none says so.
        wraps: whether it is an angle that may be proposed full turns beyond its limits and is then
            brought back by these, in a narrow arc, too; one that aims is in a full turn anyway.
    """

    name: str
    unit: str
    limits: str | None = None
    rate: str | None = None
    aims: bool = False
    lags: bool = False
    wraps: bool = False

    @property
    def label(self) -> str:
        """Name and unit, such as `force [N]`."""
        return f"{self.name} [{self.unit}]"


@dataclass(frozen=True, kw_only=True)
class Kind:
    """Facts of one kind of actuator.

    Args:
        law: the `ActuatorLaw` of m actuators; kinds that share it are answered together.
        group: the `Group` of their responses, made of m actuators and an effectiveness (m, 3, 6).
        command: the command as users see it, made of the numbers in order.
        numbers: numbers of a command, in order; at most three.
        axes: fields with own axes, the first rows of the frame: one, or two at a right angle.
        pushes_along: those own axes along which it can push at will, by field, or `ACROSS`.
        pointed: the axis that is pointed, by hand and by a search.
        drawn_as: its shape in pictures, one of `DRAWN_AS`.
        faults: kinds of damage that it may have beside being lost, of `Faults`.
        arc: field with the angles that it turns through, which change sign in a mirror; empty
            where there is none.
        driven_by_flow: whether its force is that of the water that flows past: none at rest.
        described: whether robot descriptions of other programs, and their parameters, can say what
            it is; `finlab layout convert` refuses others.
        models: formulas that its law may follow, by the type of its `model`; none where there is
            one law.
    """

    law: type[Any]
    group: type[Any]
    command: type[Command]
    numbers: tuple[CommandNumber, ...]
    axes: tuple[str, ...]
    pushes_along: tuple[str, ...]
    pointed: str
    drawn_as: str
    faults: tuple[str, ...] = ()
    arc: str = ""
    driven_by_flow: bool = False
    described: bool = True
    models: tuple[str, ...] = ()

    @cached_property
    def force_number(self) -> int | None:
        """Which number is the force; None where the force follows from all of them."""
        return _first([number.unit == "N" for number in self.numbers])

    @cached_property
    def aiming_number(self) -> int | None:
        """Which number turns the force; None where none does."""
        return _first([number.aims for number in self.numbers])

    @cached_property
    def stuck_number(self) -> int:
        """Which number keeps its value where the actuator is stuck: the angle that aims, else the
        first."""
        return self.aiming_number or 0

    @cached_property
    def sticks_at_angle(self) -> bool:
        """Whether that number is an angle [rad]; a force [N] otherwise."""
        return self.numbers[self.stuck_number].unit == "rad"

    @cached_property
    def lagging_number(self) -> int:
        """Which number follows with the time constant; another one changes at its rate."""
        return _first([number.lags for number in self.numbers]) or 0

    @cached_property
    def pointed_row(self) -> int:
        """Row of the frame (3, 3) that is the axis that is pointed."""
        return self.axes.index(self.pointed)

    @cached_property
    def push_rows(self) -> tuple[int, ...]:
        """Rows of the frame (3, 3) along which it pushes."""
        rows = {name: row for row, name in enumerate(self.axes)} | {ACROSS: 2}
        return tuple(rows[name] for name in self.pushes_along)


def _first(flags: list[bool]) -> int | None:
    """Index of the first flag that is set; None where none is."""
    return flags.index(True) if True in flags else None


class _PartDefault:
    """A default that is a part of its own, such as `Servo()`, in a signature: its text would be as
    long as all the others."""

    def __init__(self, part: object) -> None:
        self.part = part

    def __repr__(self) -> str:
        return f"{type(self.part).__name__}()"


class _ShortSignature:
    """Signature of a kind for `help()`: names and defaults of its arguments. Their types, with all
    bounds spelled out, take more than a thousand characters; units stand in the docstring."""

    def __get__(self, instance: object, kind: Any) -> inspect.Signature:
        if not is_dataclass(kind):
            raise AttributeError("__signature__")  # of the base, which has no fields of its own
        parameters = []
        for field in fields(kind):
            default = inspect.Parameter.empty if field.default is MISSING else field.default
            if isinstance(default, Checked | Part):
                default = _PartDefault(default)
            parameters.append(
                inspect.Parameter(
                    field.name, inspect.Parameter.POSITIONAL_OR_KEYWORD, default=default
                )
            )
        return inspect.Signature(parameters)


class Actuator(Checked, ABC):
    """One actuator of a robot, and the contract of its kind."""

    KIND: ClassVar[Kind]
    """What the rest of finlab must know of the kind."""
    __signature__: ClassVar[Any] = _ShortSignature()

    name: Name
    position: Place
    uncertainty: Uncertainty | None

    def __post_init__(self) -> None:
        """Checks all arguments. Raises LayoutError: an argument, or what several say together, is
        refused; the message names it and the actuator."""
        try:
            super().__post_init__()
            self.check_together()
        except LayoutError as error:
            raise error.for_actuator(f"{self.type} {self.name!r:.66}") from None

    def check_together(self) -> None:
        """Checks arguments against each other, each being right by itself, and makes axes exactly
        orthonormal. Raises LayoutError: the message names the argument."""
        if len(self.KIND.axes) == 2:
            first_name, second_name = self.KIND.axes
            first, second = axes.perpendicular_axes(
                (first_name, getattr(self, first_name)), (second_name, getattr(self, second_name))
            )
            object.__setattr__(self, first_name, first)
            object.__setattr__(self, second_name, second)

    @classmethod
    def laws(cls, actuators: Sequence[Any]) -> Sequence[tuple[Indices, ActuatorLaw]]:
        """Returns the laws of m actuators of the kind, few for many of them, each with the indices
        of its actuators among these m. Raises DataError: a file that a law reads is bad."""
        return [(np.arange(len(actuators)), cls.KIND.law(actuators))]

    @classmethod
    @abstractmethod
    def sample(cls) -> "Self":
        """Returns one as the app adds it, at the origin, named after its kind."""

    @property
    def lower(self) -> CommandRow:
        """Least command, by number [rad, Hz or N]; 0 where the kind has fewer numbers."""
        return _row_of([low for low, _ in self._limits()], 0.0)

    @property
    def upper(self) -> CommandRow:
        """Greatest command, as `lower`."""
        return _row_of([high for _, high in self._limits()], 0.0)

    def _limits(self) -> list[tuple[float, float]]:
        """Least and greatest of each number, from the field that it names."""
        return [getattr(self, str(number.limits)) for number in self.KIND.numbers]

    @property
    def rates(self) -> CommandRow:
        """Largest changes of the command [rad/s, N/s]; infinite where nothing limits them."""
        rates = []
        for number in self.KIND.numbers:
            rate = None if number.rate is None else getattr(self, number.rate)
            rates.append(math.inf if rate is None else rate)
        return _row_of(rates, math.inf)

    @property
    def ANGLE(self) -> int | None:
        """Which number of the command is an angle that may turn all round, so that its change is
        measured around the circle; None of kinds without: `KIND.aiming_number`, for programs that
        watch commands and ask each actuator."""
        return self.KIND.aiming_number

    @property
    def frame(self) -> tuple[Vector3, Vector3, Vector3]:
        """Own axes, unit vectors in the body frame: those that `KIND.axes` names, and one across
        them. Of a kind with one axis the second is any that stands across it."""
        first = getattr(self, self.KIND.axes[0])
        if len(self.KIND.axes) == 2:
            second = getattr(self, self.KIND.axes[1])
            return first, second, axes.cross(first, second)
        flattest = min(range(3), key=lambda i: abs(first[i]))
        helper = [0.0, 0.0, 0.0]
        helper[flattest] = 1.0
        x, y, z = axes.cross(first, (helper[0], helper[1], helper[2]))
        length = math.hypot(x, y, z)
        second = (x / length, y / length, z / length)
        return first, second, axes.cross(first, second)

    @property
    def direction(self) -> Vector3:
        """The axis that is pointed (its axis, its shaft, or zero): a unit vector, body frame."""
        return self.frame[self.KIND.pointed_row]

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of what a layout file lists as actuators of their own, and this one holds; none of
        most kinds."""
        return ()

    @property
    def parts_words(self) -> str:
        """What its `parts` are to it, as a sentence without a full stop; empty where it has
        none."""
        return ""

    @property
    def parts_damage_words(self) -> str:
        """How damage of its `parts` is told, as a sentence like `parts_words`."""
        return ""

    def copied(self, name: str) -> "Self":
        """Returns a copy under another name, whose `parts` have no names."""
        return replace(self, name=name)

    @property
    def reads(self) -> str | None:
        """Path of the file that its law reads, None where it reads none."""
        return None

    @property
    def stamp(self) -> tuple[int, int] | None:
        """Modification time [ns] and size [bytes] of that file, by which a cache of what it holds
        is known to be old; None where its law reads none."""
        if self.reads is None:
            return None
        from finlab.bundle_files import file_stamp

        return file_stamp(self.reads)

    def reading(self, path: str) -> "Self":
        """Returns it with another file that its law reads."""
        return self

    @property
    def is_uncertain(self) -> bool:
        """Whether something is known of the error of its force: by its `uncertainty`, or by its
        table."""
        return self.uncertainty is not None or self.model_type == "table"

    @property
    def model_type(self) -> str:
        """Type of its `model`; its shape in pictures where the kind has one law."""
        return str(getattr(getattr(self, "model", None), "type", self.KIND.drawn_as))

    def value(self, key: str) -> Any:
        """Returns the value of a field: its own, one of its limits or of its model; None where it
        has no such field."""
        for holder in (self, getattr(self, "limits", None), getattr(self, "model", None)):
            if hasattr(holder, key):
                return getattr(holder, key)
        return None

    def with_value(self, key: str, value: Any) -> "Self":
        """Returns it with another value of a field.

        Args:
            key: a field, as in `value`; the actuator stays as it is where it has no such field.
            value: the new one; None restores the default of a field that may be None.

        Raises:
            LayoutError: the field may not have that value.
        """
        if key not in {field.name for field in fields(self)}:
            return self
        return replace(self, **{key: value})

    def with_model(self, model_type: str) -> "Self":
        """Returns it with a model of another type of `KIND.models`; parameters that both models
        have keep their values."""
        return self

    @property
    def takes(self) -> tuple[str, ...]:
        """Faults of `KIND.faults` that this one may have."""
        return self.KIND.faults

    @property
    def jet(self) -> float:
        """Diameter of the jet with which it pushes, where that begins [m]; 0 of one without a
        jet."""
        return 0.0

    @property
    def advance(self) -> float | None:
        """Relative loss of thrust per speed along the thrust over the jet's speed [1]; None where
        it is unknown."""
        return None

    @property
    def delay_s(self) -> float:
        """Delay with which it follows a command [s]: its time constant, and the time in which its
        slowest number passes a fifth of its range."""
        times = []
        for low, high, rate in zip(self.lower, self.upper, self.rates, strict=True):
            times.append(RANGE_SHARE * (high - low) / rate)
        return float(getattr(self, "time_constant", 0.0)) + max(times)

    def largest(self, speed: float) -> float:
        """Returns its largest force [N]; of a kind that the flow drives, at a speed [m/s] through
        the water."""
        number = self.KIND.force_number or 0
        return max(abs(self.lower[number]), abs(self.upper[number]))

    def command(self, row: Array) -> Command | None:
        """Returns a row (3,) as the kind's own type; None of a lost one, whose row is NaN."""
        numbers = row.tolist()
        if math.isnan(numbers[0]):
            return None
        return self.KIND.command(*numbers[: len(self.KIND.numbers)])

    def commands(self, rows: Array) -> Command:
        """Returns N rows (N, 3) as the kind's own type, with an array (N,) in place of each
        number."""
        return self.KIND.command(*rows[:, : len(self.KIND.numbers)].T)

    def neutral(self, now: Array | None = None) -> Array:
        """Returns the command (3,) with the least force, given the present command (3,)."""
        row: Array = np.clip(0.0, np.array(self.lower), np.array(self.upper))
        return row

    def pushing(self, force: Array) -> Array:
        """Returns the command (3,) whose force along `KIND.pushes_along` is `force` (1,) or (2,)
        [N], without regard to limits."""
        row = np.zeros(3)
        if self.KIND.force_number is not None:
            row[self.KIND.force_number] = force[0] if len(force) == 1 else math.hypot(*force)
            if len(force) > 1:
                row[self.KIND.stuck_number] = math.atan2(force[1], force[0])
        return row

    @abstractmethod
    def damaged(self, faults: Faults) -> "Self":
        """Returns it with the law and the limits that faults, those of `KIND.faults`, leave."""

    @abstractmethod
    def scaled(self, share: float) -> "Self":
        """Returns one whose force is `share` of its own at every command; one that reads a file
        stays as it is."""

    @property
    def limits_words(self) -> str:
        """Its limits and its law, for a cell of a printed table."""
        words = []
        for number, low, high in zip(self.KIND.numbers, self.lower, self.upper, strict=False):
            if number.unit == "rad":
                words.append(self.angle_words(low, high))
            else:
                prefix = prefix_of(max(abs(low), abs(high)))
                low /= prefix.factor
                high /= prefix.factor
                words.append(f"{low:g}..{high:g} {prefix.symbol}{number.unit}")
        return ", ".join((*words, self.model_type))

    def angle_words(self, low: float, high: float) -> str:
        """Returns the limits of an angle [rad] in words."""
        return axes.arc_words(low, high)

    @property
    def direction_words(self) -> str:
        """Its own axes in the body frame, for a cell of a printed table."""
        words = []
        for name, axis in zip(self.KIND.axes, self.frame, strict=False):
            words.append(f"{name.replace('_', ' ')} {axes.vector_words(axis)}")
        return ", ".join(words)

    @property
    def joints(self) -> Iterator[tuple[str, Vector3, tuple[float, float] | None]]:
        """Joints of a robot description (URDF, SDF), from the hull on: suffix of the link's name,
        axis in the body frame, and limits of the angle [rad]."""
        yield "", self.frame[0], None

    def turned(self, frame: ArrayLike, position: ArrayLike | None = None, **changes: Any) -> "Self":
        """Returns it with other own axes, at another point.

        Args:
            frame: own axes (3, 3), unit vectors as rows, body frame.
            position: where the force acts (3,), body frame [m]; where it was when None.
            changes: other fields with new values.
        """
        changes |= dict(zip(self.KIND.axes, map(tuple, _rounded(frame)), strict=False))
        if position is not None:
            changes["position"] = tuple(_rounded(position))
        return replace(self, **changes)

    def image(self) -> "Self":
        """Returns its mirror image in the plane y = 0, under the same name. Rotations change their
        sense in a mirror: arcs and the reaction torque change sign."""
        changes: dict[str, Any] = {}
        if self.KIND.arc:
            changes[self.KIND.arc] = _mirrored(getattr(self, self.KIND.arc))
        if hasattr(self, "torque_per_newton"):
            changes["torque_per_newton"] = -self.torque_per_newton + 0.0
        frame = np.array(self.frame) * axes.MIRROR_SIGNS
        position = np.array(self.position) * axes.MIRROR_SIGNS
        return self.turned(frame, position, **changes)

    def facing(self, towards: Vector3) -> "Self":
        """Returns it with its `direction` along a vector of any length, body frame; the other axis
        turns along by the least rotation, or as its kind has it. Raises FinlabError: the vector has
        no length."""
        length = math.hypot(*towards)
        if not axes.MIN_LENGTH < length < math.inf:
            raise FinlabError(
                f"direction of {self.name}: expected a vector with a length, got {towards}"
            )
        wanted = np.array(towards) / length
        frame = np.array(self.frame)
        row = self.KIND.pointed_row
        if np.abs(wanted - frame[row]).max() < axes.MIN_LENGTH:
            return self
        half_turn_axis = frame[2 if row == 0 else 0]
        frame = frame @ axes.least_rotation(frame[row], wanted, half_turn_axis).T
        frame[row] = wanted
        return self.turned(self.settled(frame))

    def settled(self, frame: Array) -> Array:
        """Returns own axes (3, 3) for one that was just pointed: the pointed axis as it is, the
        others as the kind prefers them."""
        return frame

    def turned_about(self, towards: Vector3) -> "Self":
        """Returns it turned about its `direction`, with its other axis as near as a right angle
        allows to a vector of any length, body frame. Raises FinlabError: the vector is parallel to
        the direction."""
        if len(self.KIND.axes) == 1:
            return self
        frame = np.array(self.frame)
        wanted = np.array(towards, dtype=np.float64)
        row = self.KIND.pointed_row
        if not axes.MIN_LENGTH < np.linalg.norm(np.cross(frame[row], wanted)) < math.inf:
            raise FinlabError(
                f"{self.name}: expected a direction across its {self.KIND.pointed}, got {towards}"
            )
        frame[1 - row] = axes.perpendicular(frame[row], wanted)
        return self.turned(frame)


def _mirrored(arc: tuple[Any, ...]) -> tuple[Any, ...]:
    """The mirror image of an arc, or of several."""
    if isinstance(arc[0], tuple):
        return tuple(map(_mirrored, reversed(arc)))
    low, high = arc
    return -high + 0.0, -low + 0.0


def held_limits(angle: float | None, limits: tuple[float, float]) -> tuple[float, float]:
    """Returns an angle [rad] as both limits, shifted by whole turns to within `limits` where one
    such angle lies there; `limits` themselves where the angle is None."""
    if angle is None:
        return limits
    middle = 0.5 * sum(limits)
    held = angle + round((middle - angle) / axes.TURN) * axes.TURN
    return held, held


def weakened(interval: tuple[float, float], share: float | None) -> tuple[float, float]:
    """Returns an interval up to a share of its greatest; itself where that is None."""
    if share is None:
        return interval
    low, high = interval
    return min(low, share * high), share * high


def _rounded(values: ArrayLike) -> Any:
    """Lists of numbers without digits of rounding, and without minus zeros, as files have them."""
    return (np.round(np.asarray(values, dtype=np.float64), axes.DECIMALS) + 0.0).tolist()


def _row_of(numbers: list[Any], missing: float) -> CommandRow:
    """One to three numbers as a row, `missing` in place of those that there are not."""
    first, second, third = (*numbers, missing, missing, missing)[:3]
    return first, second, third
