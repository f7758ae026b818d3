"""Layouts: the actuators of one robot, in order, and optionally its body."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike, NDArray

from finlab.actuators.actuator import Actuator
from finlab.actuators.fin.fin import Fin
from finlab.arrays import Array
from finlab.axes import AXES, CommandedAxes, mask_of
from finlab.errors import LayoutError
from finlab.files.schema import Checked, Name

if TYPE_CHECKING:
    from finlab.interaction.interaction import InteractionModel
    from finlab.layout.body import Body
else:  # most robots have neither, and what checks a layout need not know more of them
    Body = InteractionModel = Checked

MAX_ACTUATORS = 64
"""Most actuators a layout may have."""
MAX_DESCRIPTION_LENGTH = 4000
"""Most characters of a description."""


@dataclass(frozen=True)
class Layout(Checked):
    """The actuators of one robot. Immutable and comparable; every change returns a new layout."""

    name: Name
    """What the layout is called."""
    actuators: tuple[Actuator, ...]
    """The actuators, 1 to 64, with unique names. Commands and arrays follow this order."""
    description: Annotated[str, Meta(max_length=MAX_DESCRIPTION_LENGTH)] = ""
    """What there is to know about it, for people."""
    body: "Body | None" = None
    """Hull, mass and hydrodynamics, where known."""
    axes: CommandedAxes = AXES
    """Axes of the wrench that the robot commands; the others take what the cheapest answer gives
    them."""
    interaction: "InteractionModel | None" = None
    """What the actuators do to each other; None where that does not count."""

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "actuators", tuple(self.actuators))
        if not 1 <= self.n <= MAX_ACTUATORS:
            raise LayoutError(f"expected 1 to {MAX_ACTUATORS} actuators, got {self.n}", "actuators")
        if len(set(self.axes)) < len(self.axes):
            raise LayoutError(f"every axis may be named once, got {', '.join(self.axes)}", "axes")
        object.__setattr__(self, "axes", tuple(axis for axis in AXES if axis in self.axes))
        first_use: dict[str, int] = {}
        for i, name in enumerate(self.names):
            if name in first_use:
                raise LayoutError(
                    f"{name!r} is already the name of actuator {first_use[name] + 1}",
                    f"actuators[{i}].name",
                )
            first_use[name] = i

    @cached_property
    def _hash(self) -> int:
        return hash(
            (self.name, self.actuators, self.description, self.body, self.axes, self.interaction)
        )

    def __hash__(self) -> int:
        # Kept: every call of an allocator looks its layout up, and hashing all parts takes longer.
        return self._hash

    def __getstate__(self) -> dict[str, Any]:
        # Hashes of text differ between processes, and arrays are quickly made again.
        return {field.name: self.__dict__[field.name] for field in fields(self)}

    def __str__(self) -> str:
        from finlab.display import text
        from finlab.layout.layout_text import layout_blocks

        return text(layout_blocks(self))

    def _repr_html_(self) -> str:
        from finlab.display import html
        from finlab.display.pictures import robot_picture
        from finlab.layout.layout_text import layout_blocks

        return html(layout_blocks(self), lambda: robot_picture(self))

    @cached_property
    def fins(self) -> tuple[Fin, ...]:
        """The actuators that are fins, in order; of a robot of fins all of them."""
        return tuple(part for part in self.actuators if isinstance(part, Fin))

    @cached_property
    def is_fin(self) -> NDArray[np.bool_]:
        """Which actuators (n,) are fins."""
        return np.array([isinstance(part, Fin) for part in self.actuators])

    @cached_property
    def by_flow(self) -> tuple[str, ...]:
        """Names of the actuators that give nothing at rest: their force is that of the flow."""
        return tuple(part.name for part in self.actuators if part.KIND.driven_by_flow)

    @cached_property
    def fins_alone(self) -> "Layout":
        """The robot with its fins alone; it has some."""
        return replace(self, actuators=self.fins)

    @cached_property
    def files(self) -> tuple[str, ...]:
        """Paths of the tables and of the network that its laws and its interaction read."""
        return tuple(part.reads for part in self._readers if part.reads)

    @property
    def stamps(self) -> tuple[tuple[int, int] | None, ...]:
        """Time and size of each file that a law reads, for what is kept until one of them
        changes."""
        return tuple(part.stamp for part in self._readers)

    @cached_property
    def _readers(self) -> "tuple[Actuator | InteractionModel, ...]":
        """What reads a file: interaction and actuators, in this order."""
        parts: tuple[Actuator | InteractionModel, ...] = self.actuators
        if self.interaction is not None:
            parts = (self.interaction, *parts)
        return tuple(part for part in parts if part.reads)

    @property
    def is_of_fins(self) -> bool:
        """Whether all actuators are fins."""
        return self.n_fins == self.n

    def only(self, what: str, kind: str = "fin", horizontal: bool = False) -> None:
        """Refuses a robot whose actuators are not all of one type, for what is made for that.
        Raises LayoutError: the sentence names `what` and the first actuator that it does not take.

        Args:
            what: what was asked for, as the sentence begins.
            kind: the type.
            horizontal: whether the fins' shafts have to be horizontal, too, with a mounting angle.
        """
        for part in self.actuators:
            if part.type != kind:
                wanted = f"robots of {kind}s"
                problem = f"is of type {part.type}"
            elif horizontal and getattr(part, "mounting_angle", None) is None:
                wanted = "fins with a mounting angle"
                problem = "has a shaft of its own direction"
            else:
                continue
            raise LayoutError(
                f"{what} works for {wanted} only, and {part.name!r} of layout {self.name} "
                f"{problem}; "
                "method dual of `finlab allocate` takes any actuator"
            )

    @cached_property
    def commanded(self) -> NDArray[np.bool_]:
        """Which axes of a wrench the robot commands (6,)."""
        return mask_of(self.axes)

    @cached_property
    def position(self) -> Array:
        """Where each actuator's force acts (n, 3), body frame [m]; read-only."""
        return _read_only([part.position for part in self.actuators])

    @cached_property
    def frames(self) -> Array:
        """Own axes of each actuator (n, 3, 3), rows in the body frame; read-only.

        Fin: shaft, zero, shaft x zero; see the other types for theirs.
        """
        return _read_only([part.frame for part in self.actuators])

    @cached_property
    def mounting_angle(self) -> Array:
        """Azimuth of each fin's shaft (n,) [rad]; read-only. Raises LayoutError: an actuator is no
        fin, or its shaft is not horizontal."""
        self.only("what asks for mounting angles", horizontal=True)
        return _read_only([fin.mounting_angle or 0.0 for fin in self.fins])

    @cached_property
    def lower(self) -> Array:
        """Least command of each actuator (n, 3), of a fin amplitude [rad], frequency [Hz] and zero
        direction [rad]; read-only."""
        return _read_only([part.lower for part in self.actuators])

    @cached_property
    def upper(self) -> Array:
        """Greatest command of each actuator (n, 3), as `lower`; read-only."""
        return _read_only([part.upper for part in self.actuators])

    @cached_property
    def servo_poles(self) -> Array:
        """Double poles of amplitude, frequency and zero direction of each fin (n, 3) [rad/s];
        read-only."""
        servos = [fin.servo for fin in self.fins]
        return _read_only([(s.amplitude_pole, s.frequency_pole, s.direction_pole) for s in servos])

    @cached_property
    def rates(self) -> Array:
        """How fast the commands of each actuator change at most from tick to tick (n, 3) [per
        second], infinite where nothing limits them; read-only."""
        return _read_only([part.rates for part in self.actuators])

    @cached_property
    def delay_s(self) -> float:
        """How late the slowest actuator follows its command [s]."""
        return max(part.delay_s for part in self.actuators)

    @cached_property
    def speed_limit(self) -> Array:
        """How fast each fin can turn (n,) [rad/s]; read-only."""
        return _read_only([fin.servo.speed_limit for fin in self.fins])

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the actuators, in order."""
        return tuple(part.name for part in self.actuators)

    @property
    def n(self) -> int:
        """How many actuators there are."""
        return len(self.actuators)

    @property
    def n_fins(self) -> int:
        """How many fins there are."""
        return len(self.fins)

    @property
    def counted(self) -> str:
        """How many actuators there are of each type, such as `4 fins and 2 thrusters`."""
        counts = Counter(part.type for part in self.actuators)
        return " and ".join(f"{n} {kind}{'s' if n > 1 else ''}" for kind, n in counts.items())

    def index(self, name: str, argument: str = "") -> int:
        """Returns the place of the actuator called `name`. Raises LayoutError: there is none; the
        message lists those there are, and begins with the `argument` that the name stood in."""
        if name not in self.names:
            what = "fin" if self.is_of_fins else "actuator"
            raise LayoutError(
                f"layout {self.name} has no {what} {name!r:.60}, it has {', '.join(self.names)}",
                argument,
            )
        return self.names.index(name)

    def indices(self, names: Sequence[str], argument: str = "") -> tuple[int, ...]:
        """Returns the places of several actuators, in the order asked for; errors as for
        `index`."""
        return tuple(self.index(name, argument) for name in names)

    def part(self, name: str, argument: str = "") -> Actuator:
        """Returns the actuator called `name`; errors as for `index`."""
        return self.actuators[self.index(name, argument)]

    def with_part(self, part: Actuator, name: str = "") -> "Layout":
        """Returns the layout with another actuator in the place of the one of that name, by default
        its own. Raises LayoutError: there is none, or the new name is another one's."""
        i = self.index(name or part.name)
        return replace(self, actuators=(*self.actuators[:i], part, *self.actuators[i + 1 :]))

    def without(self, names: Iterable[str], argument: str = "") -> "Layout":
        """Returns the layout that is left when the actuators called `names` are lost. Raises
        LayoutError: a name is unknown, or none is left; the message begins with the `argument` that
        the names stood in."""
        names = [names] if isinstance(names, str) else list(names)
        lost = set(self.indices(names, argument))
        if len(lost) == self.n:
            what = "fin" if self.is_of_fins else "actuator"
            problem = f"layout {self.name} has no {what} left once all are lost; repair one"
            raise LayoutError(problem, argument)
        left = tuple(part for i, part in enumerate(self.actuators) if i not in lost)
        return replace(self, actuators=left)

    def replace_actuator(self, name: str, /, **changes: Any) -> "Layout":
        """Returns the layout with some fields of one actuator changed, such as `position=(0.1, 0,
        0)`; errors as for `with_part`, and those of the fields."""
        return self.with_part(replace(self.part(name), **changes), name)


def _read_only(values: ArrayLike) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
