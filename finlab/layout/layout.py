"""A layout: the fins of one robot, in order, and optionally its body."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.layout.body import Body
from finlab.layout.checked import Checked, Name
from finlab.layout.fin import Fin
from finlab.layout.interaction import Interaction

MAX_FINS = 16
"""Most fins a layout may have."""
MAX_DESCRIPTION_LENGTH = 4000
"""Most characters of a description."""


@dataclass(frozen=True)
class Layout(Checked):
    """The fins of one robot. Immutable and comparable; every change returns a new layout."""

    name: Name
    """What the layout is called."""
    fins: tuple[Fin, ...]
    """The fins, 1 to 16, with unique names. Commands and arrays follow this order."""
    description: Annotated[str, Meta(max_length=MAX_DESCRIPTION_LENGTH)] = ""
    """What there is to know about it, for people."""
    body: Body | None = None
    """Hull, mass and hydrodynamics, where known."""
    interaction: Interaction | None = None
    """What the fins take from each other and from speed, where a swim has shown it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "fins", tuple(self.fins))
        if not 1 <= len(self.fins) <= MAX_FINS:
            raise LayoutError(f"expected 1 to {MAX_FINS} fins, got {len(self.fins)}", "fins")
        first_use: dict[str, int] = {}
        for i, fin in enumerate(self.fins):
            if fin.name in first_use:
                raise LayoutError(
                    f"{fin.name!r} is already the name of fins[{first_use[fin.name]}]", f"fins[{i}].name"
                )
            first_use[fin.name] = i
        for i, jet in enumerate(self.interaction.jets if self.interaction else ()):
            for key, name in (("source", jet.source), ("target", jet.target)):
                if name not in first_use:
                    raise LayoutError(f"there is no fin {name!r}", f"interaction.jets[{i}].{key}")

    @cached_property
    def _hash(self) -> int:
        return hash((self.name, self.fins, self.description, self.body, self.interaction))

    def __hash__(self) -> int:
        # Kept: every call of an allocator looks its layout up, and hashing all fins takes longer than that.
        return self._hash

    def __getstate__(self) -> dict[str, Any]:
        # Hashes of text differ between processes, and arrays are quickly made again.
        return {key: self.__dict__[key] for key in ("name", "fins", "description", "body", "interaction")}

    @cached_property
    def position(self) -> Array:
        """Where each fin's force acts (n, 3), body frame [m]; read-only."""
        return _read_only([fin.position for fin in self.fins])

    @cached_property
    def mounting_angle(self) -> Array:
        """Azimuth of each shaft (n,) [rad]; read-only."""
        return _read_only([fin.mounting_angle for fin in self.fins])

    @cached_property
    def lower(self) -> Array:
        """Least amplitude [rad], frequency [Hz] and zero direction [rad] of each fin (n, 3); read-only."""
        return _read_only([fin.limits.lower for fin in self.fins])

    @cached_property
    def upper(self) -> Array:
        """Greatest amplitude [rad], frequency [Hz] and zero direction [rad] of each fin (n, 3); read-only."""
        return _read_only([fin.limits.upper for fin in self.fins])

    @cached_property
    def servo_poles(self) -> Array:
        """Double poles of amplitude, frequency and zero direction of each fin (n, 3) [rad/s]; read-only."""
        servos = [fin.servo for fin in self.fins]
        return _read_only([(s.amplitude_pole, s.frequency_pole, s.direction_pole) for s in servos])

    @cached_property
    def servo_rates(self) -> Array:
        """How fast the commands of each fin change at most from tick to tick (n, 3) [rad/s, Hz/s, rad/s];
        read-only."""
        servos = [fin.servo for fin in self.fins]
        return _read_only([(s.amplitude_rate, s.frequency_rate, s.direction_rate) for s in servos])

    @cached_property
    def speed_limit(self) -> Array:
        """How fast each fin can turn (n,) [rad/s]; read-only."""
        return _read_only([fin.servo.speed_limit for fin in self.fins])

    @property
    def has_inflow(self) -> bool:
        """Whether the layout says what speed through the water takes from the fins."""
        return self.interaction is not None and any(self.interaction.inflow)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fins, in order."""
        return tuple(fin.name for fin in self.fins)

    @property
    def n_fins(self) -> int:
        """How many fins there are."""
        return len(self.fins)

    def index(self, name: str) -> int:
        """Returns the place of the fin called `name`.

        Raises:
            LayoutError: there is no such fin; the message lists those there are.
        """
        if name not in self.names:
            raise LayoutError(f"layout {self.name} has no fin {name!r:.60}, it has {', '.join(self.names)}")
        return self.names.index(name)

    def indices(self, names: Sequence[str]) -> tuple[int, ...]:
        """Returns the places of several fins, in the order asked for; one unknown name is an error."""
        return tuple(self.index(name) for name in names)

    def without(self, names: Iterable[str]) -> "Layout":
        """Returns the layout that is left when the fins called `names` are lost.

        Raises:
            LayoutError: a name is unknown, or no fin is left.
        """
        names = [names] if isinstance(names, str) else list(names)
        lost = set(self.indices(names))
        if len(lost) == self.n_fins:
            raise LayoutError(
                f"layout {self.name} has no fin left once {', '.join(names)} are lost; keep one"
            )
        fins = tuple(fin for i, fin in enumerate(self.fins) if i not in lost)
        left = self.interaction and self.interaction.among([fin.name for fin in fins])
        return replace(self, fins=fins, interaction=left)

    def replace_fin(self, name: str, /, **changes: Any) -> "Layout":
        """Returns the layout with some fields of one fin changed, such as `position=(0.1, 0, 0)`."""
        i = self.index(name)
        fins = list(self.fins)
        fins[i] = replace(fins[i], **changes)
        if fins[i].name != name and self.interaction is not None:
            return replace(self, fins=tuple(fins), interaction=self.interaction.renamed(name, fins[i].name))
        return replace(self, fins=tuple(fins))


def _read_only(values: ArrayLike) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
