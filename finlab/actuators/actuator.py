"""The contract of a kind of actuator: all that is special about a kind stands in one file, in its
class.

A kind is a frozen dataclass, a subclass of `Actuator`, whose fields are what a layout file says of
one. It declares facts (class variables), its law and its answer to a price among them, and
overrides what is not as usual. One line in `finlab.actuators.kinds` makes it known to all of
finlab; `docs/howto/kind.md` makes one in thirty lines.

Own frames are right-handed, their rows in the body frame. A command is a row of three numbers, of
which a kind may use fewer; what it does not have is 0.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import ArrayLike, NDArray

from finlab import axes
from finlab.actuators.law import ActuatorLaw
from finlab.arrays import Array
from finlab.errors import FinlabError, LayoutError
from finlab.files.schema import Checked, Name

Places = NDArray[np.intp]
"""Places of actuators among others."""
Metres = Annotated[float, Meta(ge=-100.0, le=100.0)]
"""A coordinate of a place on a robot, or an arm of torque [m]."""
Place = tuple[Metres, Metres, Metres]
Seconds = Annotated[float, Meta(ge=0.0, le=1000.0)]
Diameter = Annotated[float, Meta(ge=1e-3, le=20.0)]
TurnRate = Annotated[float, Meta(ge=1e-3, le=1000.0)]
TurnRateDegrees = Annotated[float, Meta(ge=0.06, le=57000.0)]


@dataclass(frozen=True)
class Uncertainty(Checked):
    """Standard deviation of an actuator's force. Checked on construction.

    Along each own direction of the actuator it is the root of (share |F|)^2 + floor^2 at a force F.
    """

    KEYS = {"floor": "floor_n"}

    share: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.0
    """Its part that grows with the force, as a share of the force."""
    floor: Annotated[float, Meta(ge=0.0, le=1e6)] = 0.0
    """Its part that is there at any force [N]."""
    common: Name | None = None
    """Name of what the error comes from, such as a fit or a measurement; actuators of one name err
    together, by the same share along and across their forces. None for an actuator that errs by
    itself."""
    correlation: Annotated[float, Meta(ge=0.0, le=1.0)] = 1.0
    """Share of the error's variance that actuators of one `common` have together."""


class Command(Struct, frozen=True, omit_defaults=True):
    """A command as users see it: the numbers of the row by name, and what follows from them."""

    @property
    def words(self) -> str:
        """The command with its units, in a table."""
        return ", ".join(f"{getattr(self, name):.3f}" for name in self.__struct_fields__)


class Faults(NamedTuple):
    """What has become of one actuator that still works; None for what has not."""

    weak: float | None = None
    """Share of its largest force that is left, above 0 and up to 1."""
    torn: float | None = None
    """Share of its force that it gives at every command, as one with a torn blade does."""
    stuck: float | None = None
    """Where it stays: the angle [rad] at which one that turns no longer turns, though it still
    pushes; the force [N] at which a thruster hangs."""
    running: tuple[float, ...] | None = None
    """Command that it keeps whatever is asked, the kind's `NUMBERS` in order."""


class Box(NamedTuple):
    """A number of an actuator that people edit, or two: least and greatest."""

    label: str
    """With the unit."""
    key: str
    """Field of the actuator, of its limits or of its law."""
    hint: str = ""
    step: float = 0.1
    degrees: bool = False
    """Whether the field is in radians."""
    free: bool = False
    """Whether it may be empty: nothing is said of it then; 0 empties it."""
    law: str = ""
    """Type of the model that it belongs to, if to one."""
    usual: float = 0.0
    """What is shown of an actuator without it."""
    pair: bool = False


class Actuator(Checked, ABC):
    """One actuator of a robot, and the contract of its kind."""

    LAW: ClassVar[type[Any]]
    """The `ActuatorLaw` of m actuators; kinds that have it in common are answered together."""
    GROUP: ClassVar[type[Any]]
    """The `Group` of answers to prices, of m actuators and an effectiveness (m, 3, 6)."""
    NUMBERS: ClassVar[tuple[tuple[str, str], ...]]
    """Numbers of the command in order, name and unit: columns of swims and of the graph file."""
    COMMAND: ClassVar[type[Command]]
    """The command as users see it; made of the numbers in order."""
    LIMITS: ClassVar[tuple[str, ...]]
    """Fields with the least and greatest of each command."""
    RATES: ClassVar[tuple[str, ...]]
    """Fields with how fast each command changes at most; None in one where nothing limits it."""
    AXES: ClassVar[tuple[str, ...]]
    """Fields with own axes: one, or two that stand across each other, the first rows of the
    frame."""
    POINTED: ClassVar[int] = 0
    """Which of these is pointed, by hand and by a search."""
    PUSHES: ClassVar[tuple[int, ...]]
    """Own axes along which it pushes at will."""
    THRUST: ClassVar[int | None] = None
    """Which command is a force, if one is."""
    ANGLE: ClassVar[int | None] = None
    """Which command is an angle at which the force is the same, so that a full turn has no ends."""
    HELD: ClassVar[int] = 0
    """Which command stays as it is where it sticks."""
    TURNS: ClassVar[bool] = True
    """Whether that is an angle."""
    ARC: ClassVar[str] = ""
    """The field with the angles that it turns through, as they are mirrored; nothing where there is
    none."""
    LAGS: ClassVar[int] = 0
    """Which command it follows with its time constant; another one at its rate."""
    BY_FLOW: ClassVar[bool] = False
    """Whether its force is that of the water that flows past, so that it gives nothing at rest."""
    FAULTS: ClassVar[tuple[str, ...]] = ()
    """What may become of it, beside being lost: `weak`, `torn`, `stuck`, `running`."""
    LOOKS: ClassVar[str]
    """How it is drawn: `fin`, `thruster`, `pod` or `foil`."""
    OTHER: ClassVar[str] = ""
    """What people call the axis that is not pointed."""
    BOXES: ClassVar[tuple[Box, ...]] = ()
    """What its inspector offers."""
    LAW_BOXES: ClassVar[tuple[Box, ...]] = ()
    """The same of its law."""
    MODELS: ClassVar[tuple[str, ...]] = ()
    """Formulas that its law may follow, by the type of its `model`; none where there is one law."""

    name: Name
    position: Place
    uncertainty: Uncertainty | None

    def __post_init__(self) -> None:
        """Raises LayoutError: an argument, or what several say together, is refused; the message
        names it and the actuator."""
        try:
            super().__post_init__()
            self.check_together()
        except LayoutError as error:
            raise error.about(f"{self.type} {self.name!r:.66}") from None

    def check_together(self) -> None:
        """Checks what arguments say together, each being right by itself, and makes axes exact.
        Raises LayoutError: the message names the argument."""
        if len(self.AXES) == 2:
            first, second = ((name, getattr(self, name)) for name in self.AXES)
            for (name, _), axis in zip(
                (first, second), axes.axes_across(first, second), strict=True
            ):
                object.__setattr__(self, name, axis)

    @classmethod
    def laws(cls, parts: Sequence[Any]) -> Sequence[tuple[Places, ActuatorLaw]]:
        """Returns the laws of m actuators of the kind, few for many of them, each with its places
        among these m. Raises DataError: a file that a law reads is bad."""
        return [(np.arange(len(parts)), cls.LAW(parts))]

    @classmethod
    @abstractmethod
    def sample(cls) -> Self:
        """Returns one as the app adds it, at the origin, named after its kind."""

    @property
    def lower(self) -> axes.Vector:
        """Least command (3,), in radians and newtons; what the actuator does not have is 0."""
        return _three([getattr(self, name)[0] for name in self.LIMITS], 0.0)

    @property
    def upper(self) -> axes.Vector:
        """Greatest command, as `lower`."""
        return _three([getattr(self, name)[1] for name in self.LIMITS], 0.0)

    @property
    def rates(self) -> axes.Vector:
        """Fastest changes of the command [rad/s, N/s]; infinite where nothing limits them."""
        return _three([getattr(self, name) or math.inf for name in self.RATES], math.inf)

    @property
    def frame(self) -> tuple[axes.Vector, axes.Vector, axes.Vector]:
        """Own axes in the body frame: those of `AXES`, and what stands across them."""
        first, *others = (getattr(self, name) for name in self.AXES)
        if not others:
            some = [0.0, 0.0, 0.0]
            some[min(range(3), key=lambda i: abs(first[i]))] = 1.0
            x, y, z = axes.cross(first, (some[0], some[1], some[2]))
            size = math.hypot(x, y, z)
            others = [(x / size, y / size, z / size)]
        return first, others[0], axes.cross(first, others[0])

    @property
    def direction(self) -> axes.Vector:
        """What of it is pointed: its axis, its shaft, or zero."""
        return self.frame[self.POINTED]

    @property
    def reads(self) -> str | None:
        """Path of the file that its law reads, None where it reads none."""
        return None

    @property
    def stamp(self) -> tuple[int, int] | None:
        """Time and size of that file, for what is kept until it changes; None where it reads
        none."""
        if self.reads is None:
            return None
        from finlab.bundle_files import file_stamp

        return file_stamp(self.reads)

    def reading(self, path: str) -> Self:
        """Returns it with another file that its law reads."""
        return self

    @property
    def is_uncertain(self) -> bool:
        """Whether something is known of the error of its force: it is said, or a table tells."""
        return self.uncertainty is not None or self.model_type == "table"

    @property
    def model_type(self) -> str:
        """Type of its `model`; how it looks where there is one law."""
        return str(getattr(getattr(self, "model", None), "type", self.LOOKS))

    def value(self, key: str) -> Any:
        """Returns what it has under a key: a field of it, of its limits or of its model; None if
        nothing."""
        holders = (self, getattr(self, "limits", None), getattr(self, "model", None))
        return next((getattr(one, key) for one in holders if hasattr(one, key)), None)

    def with_value(self, key: str, value: Any) -> Self:
        """Returns it with another value under a key, as `value`; as it is where it has no such key.
        None forgets what may be left unsaid. Raises LayoutError: it may not have that value."""
        return (
            replace(self, **{key: value}) if key in {field.name for field in fields(self)} else self
        )

    def with_model(self, kind: str) -> Self:
        """Returns it with a model of another type of `MODELS`; what both know stays."""
        return self

    @property
    def takes(self) -> tuple[str, ...]:
        """The faults of `FAULTS` that may befall this one."""
        return self.FAULTS

    @property
    def jet(self) -> float:
        """Diameter of the jet with which it pushes, where that begins [m]; 0 of one without a
        jet."""
        return 0.0

    @property
    def advance(self) -> float | None:
        """Share of thrust lost per speed along the thrust over that of the jet; None where it is
        unknown."""
        return None

    @property
    def delay_s(self) -> float:
        """How late it follows [s]: its time constant, and the time in which it comes through a
        fifth of its range at its rate."""
        ranges = zip(self.lower, self.upper, self.rates, strict=True)
        return float(getattr(self, "time_constant", 0.0)) + max(
            0.2 * (b - a) / rate for a, b, rate in ranges
        )

    def largest(self, speed: float) -> float:
        """Returns its largest force [N], of one `BY_FLOW` at a speed [m/s] through the water."""
        return max(abs(self.lower[self.THRUST or 0]), abs(self.upper[self.THRUST or 0]))

    def command(self, row: Array) -> Command | None:
        """Returns a row (3,) as the kind's own type; None for a lost one, whose row is NaN."""
        return None if np.isnan(row[0]) else self.COMMAND(*row[: len(self.NUMBERS)].tolist())

    def commands(self, rows: Array) -> Command:
        """Returns N rows (N, 3) as the kind's own type, with an array (N,) in place of each
        number."""
        return self.COMMAND(*rows[:, : len(self.NUMBERS)].T)

    def neutral(self, now: Array | None = None) -> Array:
        """Returns the command (3,) that pushes least, given the present one (3,)."""
        row: Array = np.clip(0.0, np.array(self.lower), np.array(self.upper))
        return row

    def pushing(self, force: Array) -> Array:
        """Returns the command (3,) of a force along its directions `PUSHES` [N], limits apart."""
        row = np.zeros(3)
        if self.THRUST is not None:
            row[self.THRUST] = force[0] if len(force) == 1 else math.hypot(*force)
            if len(force) > 1:
                row[self.HELD] = math.atan2(force[1], force[0])
        return row

    @abstractmethod
    def damaged(self, faults: Faults) -> Self:
        """Returns it with the law and the limits that faults, those of `FAULTS`, leave."""

    @abstractmethod
    def scaled(self, share: float) -> Self:
        """Returns one that gives a share of the force at every command; one that reads a file
        stays."""

    @property
    def limits_words(self) -> str:
        """Its limits and its law in a few words, in a table."""
        ends = zip(self.NUMBERS, self.lower, self.upper, strict=False)
        parts = (
            axes.arc_words(low, high) if unit == "rad" else f"{low:g}..{high:g} {unit}"
            for (_, unit), low, high in ends
        )
        return ", ".join((*parts, self.model_type))

    @property
    def direction_words(self) -> str:
        """Where it points: the axes that its file gives, in the body frame."""
        words = zip(self.AXES, self.frame, strict=False)
        return ", ".join(
            f"{name.replace('_', ' ')} {axes.vector_words(axis)}" for name, axis in words
        )

    @property
    def joints(self) -> Iterator[tuple[str, axes.Vector, tuple[float, float] | None]]:
        """Joints of a robot description, from the hull on: suffix of the link's name, axis, and
        limits of the angle [rad]."""
        yield "", self.frame[0], None

    def turned(self, frame: ArrayLike, position: ArrayLike | None = None, **changes: Any) -> Self:
        """Returns it with other own axes (3, 3), rows in the body frame, at another place (3,) [m],
        and with other changes."""
        changes |= dict(zip(self.AXES, map(tuple, _plain(frame)), strict=False))
        if position is not None:
            changes["position"] = tuple(_plain(position))
        return replace(self, **changes)

    def image(self) -> Self:
        """Returns it on the other side of the plane y = 0, under the same name. What turns one way
        about a shaft turns the other way about its image: arcs and the reaction torque change
        sign."""
        changes: dict[str, Any] = {}
        if self.ARC:
            changes[self.ARC] = tuple(-end + 0.0 for end in reversed(getattr(self, self.ARC)))
        if hasattr(self, "torque_per_newton"):
            changes["torque_per_newton"] = -self.torque_per_newton + 0.0
        frame = np.array(self.frame) * axes.MIRROR
        place = np.array(self.position) * axes.MIRROR
        return self.turned(frame, place, **changes)

    def facing(self, towards: axes.Vector) -> Self:
        """Returns it with its `direction` along a vector of any length; the other axis turns along
        as little as can be, or as its kind has it. Raises FinlabError: the vector has no length."""
        length = math.hypot(*towards)
        if not axes.SHORT < length < math.inf:
            raise FinlabError(
                f"direction of {self.name}: expected a vector with a length, got {towards}"
            )
        wanted = np.array(towards) / length
        frame = np.array(self.frame)
        k = self.POINTED
        if np.abs(wanted - frame[k]).max() < axes.SHORT:
            return self
        frame = frame @ axes.least_turn(frame[k], wanted, frame[2 if k == 0 else 0]).T
        frame[k] = wanted
        return self.turned(self.settled(frame))

    def settled(self, frame: Array) -> Array:
        """Returns own axes (3, 3) after it was pointed, the first where it is wanted."""
        return frame

    def turned_about(self, towards: axes.Vector) -> Self:
        """Returns it turned about its `direction`, with its other axis as near to a vector of any
        length as stands across it. Raises FinlabError: the vector points along the direction."""
        if len(self.AXES) == 1:
            return self
        frame = np.array(self.frame)
        wanted = np.array(towards, dtype=np.float64)
        k = self.POINTED
        if not axes.SHORT < np.linalg.norm(np.cross(frame[k], wanted)) < math.inf:
            raise FinlabError(
                f"{self.name}: expected a direction across its {self.AXES[k]}, got {towards}"
            )
        frame[1 - k] = axes.across(frame[k], wanted)
        return self.turned(frame)


def key_words(key: str) -> str:
    """Returns a key of a layout file as people write it: `drag_coefficient` is Drag coefficient."""
    text = key.replace("_", " ")
    return text if len(text) <= 2 or text == "phi e" else text[0].upper() + text[1:]


def held_limits(angle: float | None, limits: tuple[float, float]) -> tuple[float, float]:
    """Returns an angle [rad] as both limits, whole turns off, within them where there is such a
    one; themselves where it is None."""
    if angle is None:
        return limits
    held = angle + round((0.5 * sum(limits) - angle) / axes.TURN) * axes.TURN
    return held, held


def weakened(interval: tuple[float, float], share: float | None) -> tuple[float, float]:
    """Returns an interval up to a share of its greatest; itself where that is None."""
    low, high = interval
    return interval if share is None else (min(low, share * high), share * high)


def _plain(values: ArrayLike) -> Any:
    return (np.round(np.asarray(values, dtype=np.float64), axes.DIGITS) + 0.0).tolist()


def _three(values: list[Any], rest: float) -> axes.Vector:
    first, second, third = (*values, rest, rest, rest)[:3]
    return first, second, third
