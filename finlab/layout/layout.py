"""The layout of a robot: its actuators, in order, and optionally its body and an interaction.

What is asked of all actuators together, such as limits and own axes, is here as padded arrays.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
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
else:  # most robots have neither: their modules are imported only for those that do
    Body = InteractionModel = Checked

MAX_ACTUATORS = 256
"""Most actuators a layout may have."""
MAX_DESCRIPTION_LENGTH = 4000
"""Most characters of a description."""


Power = Annotated[float, Meta(gt=0.0, le=1e12)]
"""The most power that actuators may take together [W]; beyond the largest something is wrong
upstream."""
MirrorPair = tuple[Name, Name]
"""Names of two actuators that a designer keeps each other's mirror image."""


@dataclass(frozen=True)
class Bus(Checked):
    """A power bus, which limits what the actuators that it feeds take together. Checked on
    construction.

    Raises:
        LayoutError: a value is out of bounds; the message names the argument.
    """

    name: Name
    """Name of the bus."""
    power_w: Power
    """The most that its actuators may take together [W]."""
    actuators: Annotated[tuple[Name, ...], Meta(min_length=1, max_length=MAX_ACTUATORS)]
    """Names of the actuators that it feeds."""


@dataclass(frozen=True)
class Layout(Checked):
    """The actuators of one robot. Immutable and comparable; every change returns a new layout."""

    name: Name
    """Name of the layout."""
    actuators: tuple[Actuator, ...]
    """The actuators, 1 to 256, with unique names. Commands and arrays follow this order."""
    description: Annotated[str, Meta(max_length=MAX_DESCRIPTION_LENGTH)] = ""
    """Description for people."""
    body: "Body | None" = None
    """Hull, mass and hydrodynamics, where known."""
    axes: CommandedAxes = AXES
    """Axes of the wrench that the robot commands; the others take what the cheapest answer gives
    them."""
    interaction: "InteractionModel | None" = None
    """Model of the hydrodynamic interaction of the actuators; None to neglect it."""
    power_w: Power | None = None
    """The most power that all actuators may take together [W]; None for no limit."""
    buses: tuple[Bus, ...] = ()
    """Power buses, each of which feeds some of the actuators; in place of `power_w`."""
    mirror_pairs: Annotated[tuple[MirrorPair, ...], Meta(max_length=MAX_ACTUATORS // 2)] = ()
    """Actuators that move together as mirror images in the plane y = 0 while the robot is designed;
    each is in one pair at most. No answer depends on it."""

    def __post_init__(self) -> None:
        """Puts the axes in the order of a wrench. Raises LayoutError: a value does not fit, or a
        name or an axis stands twice."""
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
        self._check_parts(first_use)
        object.__setattr__(self, "buses", tuple(self.buses))
        self._check_buses()
        pairs = tuple([(first, second) for first, second in self.mirror_pairs])
        object.__setattr__(self, "mirror_pairs", pairs)
        self._check_mirror_pairs()

    def _check_parts(self, first_use: Mapping[str, int]) -> None:
        """Raises LayoutError: a part of an actuator has the name of an actuator, or of another
        part.

        Args:
            first_use: indices of the actuators by their names.
        """
        taken = {name: f"actuator {i + 1}" for name, i in first_use.items()}
        for i, actuator in enumerate(self.actuators):
            for part in actuator.parts:
                if part in taken:
                    raise LayoutError(
                        f"its part {part!r} has the name of {taken[part]}, and a question by that "
                        "name would mean both; expected another one",
                        f"actuators[{i}]",
                    )
                taken[part] = f"a part of actuator {i + 1}"

    def _check_mirror_pairs(self) -> None:
        """Raises LayoutError: a pair has an actuator that there is not, or one that is in a pair
        already."""
        names = set(self.names)
        paired: set[str] = set()
        for i, pair in enumerate(self.mirror_pairs):
            for j, name in enumerate(pair):
                key = f"mirror_pairs[{i}][{j}]"
                if name not in names:
                    raise LayoutError(
                        f"there is no actuator {name!r}, expected names of {', '.join(self.names)}",
                        key,
                    )
                if name in paired:
                    raise LayoutError(
                        f"{name!r} is in a pair already, and an actuator has one mirror image; "
                        "leave one of them out",
                        key,
                    )
                paired.add(name)

    def _check_buses(self) -> None:
        """Raises LayoutError: a bus feeds an actuator that there is not, or that another one
        feeds."""
        if self.buses and self.power_w is not None:
            raise LayoutError(
                "expected either power_w, of all actuators together, or buses, got both", "power_w"
            )
        names = set(self.names)
        buses: set[str] = set()
        fed: dict[str, str] = {}
        for bus in self.buses:
            if bus.name in buses:
                raise LayoutError(f"{bus.name!r} is already the name of a bus", "buses")
            buses.add(bus.name)
            key = f"buses.{bus.name}.actuators"
            for name in bus.actuators:
                if name not in names:
                    raise LayoutError(
                        f"there is no actuator {name!r}, expected names of {', '.join(self.names)}",
                        key,
                    )
                if name in fed:
                    raise LayoutError(
                        f"bus {fed[name]!r} feeds {name!r} already, and an actuator has one bus",
                        key,
                    )
                fed[name] = bus.name

    @cached_property
    def _hash(self) -> int:
        """Hash of all fields."""
        return hash(
            (
                self.name,
                self.actuators,
                self.description,
                self.body,
                self.axes,
                self.interaction,
                self.power_w,
                self.buses,
                self.mirror_pairs,
            )
        )

    def __hash__(self) -> int:
        # Cached: every call of an allocator looks its layout up, and hashing all fields is slow.
        return self._hash

    def __getstate__(self) -> dict[str, Any]:
        # Fields alone: hashes of text differ between processes, and arrays are quickly made again.
        return {field.name: self.__dict__[field.name] for field in fields(self)}

    def __str__(self) -> str:
        """Returns the layout as a table of its actuators."""
        from finlab.display import text
        from finlab.layout.layout_text import layout_blocks

        return text(layout_blocks(self))

    def _repr_html_(self) -> str:
        """Returns the layout as a notebook shows it: its table, and a picture."""
        from finlab.display import html
        from finlab.display.pictures import robot_picture
        from finlab.layout.layout_text import layout_blocks

        return html(layout_blocks(self), lambda: robot_picture(self))

    @cached_property
    def unpaired(self) -> "Layout":
        """The layout without its mirror pairs: what answers and figures depend on."""
        return replace(self, mirror_pairs=()) if self.mirror_pairs else self

    @cached_property
    def fins(self) -> tuple[Fin, ...]:
        """The actuators that are fins, in order; of a robot of fins all of them."""
        return tuple(actuator for actuator in self.actuators if isinstance(actuator, Fin))

    @cached_property
    def is_fin(self) -> NDArray[np.bool_]:
        """Which actuators (n,) are fins."""
        return np.array([isinstance(actuator, Fin) for actuator in self.actuators])

    @cached_property
    def flow_driven(self) -> tuple[str, ...]:
        """Names of the actuators that give nothing at rest: their force is that of the flow."""
        return tuple(actuator.name for actuator in self.actuators if actuator.KIND.driven_by_flow)

    @cached_property
    def fins_alone(self) -> "Layout":
        """The robot with its fins alone; it has some."""
        return self.with_actuators(self.fins)

    @cached_property
    def files(self) -> tuple[str, ...]:
        """Paths of the tables and of the network that its laws and its interaction read."""
        return tuple(reader.reads for reader in self._readers if reader.reads)

    @property
    def stamps(self) -> tuple[tuple[int, int] | None, ...]:
        """Time and size of each file that a law or the interaction reads; a cache is valid until
        one of them changes."""
        readers = self._readers
        return tuple([reader.stamp for reader in readers]) if readers else ()

    @cached_property
    def _readers(self) -> "tuple[Actuator | InteractionModel, ...]":
        """The interaction and the actuators, in this order, that read a file."""
        candidates: tuple[Actuator | InteractionModel, ...] = self.actuators
        if self.interaction is not None:
            candidates = (self.interaction, *candidates)
        return tuple(candidate for candidate in candidates if candidate.reads)

    @cached_property
    def is_of_fins(self) -> bool:
        """Whether all actuators are fins."""
        return self.n_fins == self.n

    def require_kind(self, what: str, kind: str = "fin", horizontal: bool = False) -> None:
        """Refuses a robot whose actuators are not all of one type.

        Args:
            what: the feature that needs it, with which the error's sentence begins.
            kind: the type.
            horizontal: whether the fins' shafts have to be horizontal, too, with a mounting angle.

        Raises:
            LayoutError: an actuator is of another type; the sentence names the first one.
        """
        for actuator in self.actuators:
            if actuator.type != kind:
                accepted = f"robots of {kind}s"
                problem = f"is of type {actuator.type}"
            elif horizontal and getattr(actuator, "mounting_angle", None) is None:
                accepted = "fins with a mounting angle"
                problem = "has a shaft of its own direction"
            else:
                continue
            raise LayoutError(
                f"{what} works for {accepted} only, and {actuator.name!r} of layout {self.name} "
                f"{problem}; method dual of `finlab allocate` takes any actuator"
            )

    @property
    def has_budget(self) -> bool:
        """Whether it limits the power of all actuators together, or of those of a bus."""
        return self.power_w is not None or bool(self.buses)

    @cached_property
    def commanded(self) -> NDArray[np.bool_]:
        """Which axes of a wrench the robot commands (6,)."""
        return mask_of(self.axes)

    @cached_property
    def position(self) -> Array:
        """Points (n, 3) where the actuators' forces act, body frame [m]; read-only."""
        return _read_only([actuator.position for actuator in self.actuators])

    @cached_property
    def frames(self) -> Array:
        """Own axes of each actuator (n, 3, 3), rows in the body frame; read-only.

        Fin: shaft, zero, shaft x zero; see the other types for theirs.
        """
        return _read_only([actuator.frame for actuator in self.actuators])

    @cached_property
    def mounting_angle(self) -> Array:
        """Azimuth of each fin's shaft (n,) [rad]; read-only.

        Raises:
            LayoutError: an actuator is no fin, or its shaft is not horizontal.
        """
        self.require_kind("what asks for mounting angles", horizontal=True)
        return _read_only([fin.mounting_angle or 0.0 for fin in self.fins])

    @cached_property
    def lower(self) -> Array:
        """Least command of each actuator (n, 3), of a fin amplitude [rad], frequency [Hz] and zero
        direction [rad]; read-only."""
        return _read_only([actuator.lower for actuator in self.actuators])

    @cached_property
    def upper(self) -> Array:
        """Greatest command of each actuator (n, 3), as `lower`; read-only."""
        return _read_only([actuator.upper for actuator in self.actuators])

    @cached_property
    def servo_poles(self) -> Array:
        """Double poles of amplitude, frequency and zero direction of each fin (n, 3) [rad/s];
        read-only."""
        servos = [fin.servo for fin in self.fins]
        poles = [
            (servo.amplitude_pole, servo.frequency_pole, servo.direction_pole) for servo in servos
        ]
        return _read_only(poles)

    @cached_property
    def rates(self) -> Array:
        """Largest rates of the commands (n, 3) [rad/s, Hz/s, N/s], infinite where nothing limits
        them; read-only."""
        return _read_only([actuator.rates for actuator in self.actuators])

    @cached_property
    def delay_s(self) -> float:
        """Delay of the slowest actuator after its command [s]."""
        return max(actuator.delay_s for actuator in self.actuators)

    @cached_property
    def speed_limit(self) -> Array:
        """Largest angular speeds of the fins (n_fins,) [rad/s]; read-only."""
        return _read_only([fin.servo.speed_limit for fin in self.fins])

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the actuators, in order."""
        return tuple(actuator.name for actuator in self.actuators)

    @property
    def n(self) -> int:
        """Number of actuators."""
        return len(self.actuators)

    @property
    def n_fins(self) -> int:
        """Number of fins."""
        return len(self.fins)

    @property
    def counts_in_words(self) -> str:
        """Number of actuators of each type in words, such as `4 fins and 2 thrusters`."""
        counts = Counter(actuator.type for actuator in self.actuators)
        terms = []
        for kind, count in counts.items():
            plural = "s" if count > 1 else ""
            terms.append(f"{count} {kind}{plural}")
        return " and ".join(terms)

    def index(self, name: str, argument: str = "") -> int:
        """Returns the index of an actuator.

        Args:
            name: the actuator.
            argument: the argument that holds the name, with which an error begins.

        Raises:
            LayoutError: there is none of this name; the message lists the names of all.
        """
        if name not in self.names:
            what = "fin" if self.is_of_fins else "actuator"
            problem = f"layout {self.name} has no {what} {name!r:.60}, it has "
            problem += ", ".join(self.names)
            holder = self.holder_of(name)
            if holder is not None:
                problem += f"; {holder.parts_words}; {holder.parts_damage_words}"
            raise LayoutError(problem, argument)
        return self.names.index(name)

    def holder_of(self, name: str) -> Actuator | None:
        """Returns the actuator of which something of a name is part, such as the propeller of a
        rudder in its slipstream; None where there is none."""
        for actuator in self.actuators:
            if name in actuator.parts:
                return actuator
        return None

    @property
    def parts_notes(self) -> tuple[str, ...]:
        """What a file lists apart and is part of an actuator, as sentences without a full stop."""
        return tuple(actuator.parts_words for actuator in self.actuators if actuator.parts)

    def indices(self, names: Sequence[str], argument: str = "") -> tuple[int, ...]:
        """Returns the indices of several actuators.

        Args:
            names: the actuators.
            argument: as for `index`.

        Returns:
            Their indices, in the order of the names.

        Raises:
            LayoutError: as for `index`.
        """
        return tuple(self.index(name, argument) for name in names)

    def actuator(self, name: str, argument: str = "") -> Actuator:
        """Returns the actuator of a name.

        Args:
            name: the actuator.
            argument: as for `index`.

        Raises:
            LayoutError: as for `index`.
        """
        return self.actuators[self.index(name, argument)]

    def with_actuator(self, actuator: Actuator, name: str = "") -> "Layout":
        """Returns the layout with one actuator replaced.

        Args:
            actuator: the new actuator.
            name: the one that it replaces; by default that of the new one's name.

        Raises:
            LayoutError: there is none of that name, or the new name is that of another one.
        """
        i = self.index(name or actuator.name)
        actuators = (*self.actuators[:i], actuator, *self.actuators[i + 1 :])
        return self.with_actuators(actuators, {self.names[i]: actuator.name})

    def with_actuators(
        self, actuators: Sequence[Actuator], new_names: Mapping[str, str] | None = None
    ) -> "Layout":
        """Returns the layout with other actuators; buses feed those that remain, and mirror pairs
        are those of which both remain.

        Args:
            actuators: the new ones.
            new_names: of those that are called otherwise now, by their old names; None for none.

        Raises:
            LayoutError: none is left, or a name stands twice.
        """
        new_names = new_names or {}
        names = {actuator.name for actuator in actuators}
        buses = []
        for bus in self.buses:
            called = [new_names.get(name, name) for name in bus.actuators]
            fed = tuple(name for name in called if name in names)
            if fed:
                buses.append(replace(bus, actuators=fed))
        pairs = []
        for first, second in self.mirror_pairs:
            pair = new_names.get(first, first), new_names.get(second, second)
            if names.issuperset(pair):
                pairs.append(pair)
        return replace(
            self, actuators=tuple(actuators), buses=tuple(buses), mirror_pairs=tuple(pairs)
        )

    def without(self, names: Iterable[str], argument: str = "") -> "Layout":
        """Returns the layout without some actuators.

        Args:
            names: the actuators to remove.
            argument: the argument that holds the names, with which an error begins.

        Raises:
            LayoutError: there is no actuator of a name, or none remains.
        """
        names = [names] if isinstance(names, str) else list(names)
        lost = set(self.indices(names, argument))
        if len(lost) == self.n:
            what = "fin" if self.is_of_fins else "actuator"
            problem = f"layout {self.name} has no {what} left once all are lost; repair one"
            raise LayoutError(problem, argument)
        working = tuple(actuator for i, actuator in enumerate(self.actuators) if i not in lost)
        return self.with_actuators(working)

    def replace_actuator(self, name: str, /, **changes: Any) -> "Layout":
        """Returns the layout with some fields of one actuator changed.

        Args:
            name: the actuator.
            changes: new values by field, such as `position=(0.1, 0, 0)`.

        Raises:
            LayoutError: as for `with_actuator`, or a value does not fit its field.
        """
        return self.with_actuator(replace(self.actuator(name), **changes), name)


def _read_only(values: ArrayLike) -> Array:
    """A copy of values as an array that cannot be changed, since layouts share it."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
