"""Fins that do not work as they should: one vocabulary, and what is left of the robot.

A fin is `lost` (it gives no force and leaves the layout: `failed=` of an allocator), `weak`, `torn`, `stuck`,
`running`, or `whole`. All but the first are a `Health`: a layout with other limits, or with a smaller fin, so
that every method accounts for it and limits hold as always.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, Any, Literal, NamedTuple

from msgspec import Meta

from finlab.actuators.actuator import Faults
from finlab.actuators.fin.fin_model import Amplitude, Frequency
from finlab.errors import AllocationError
from finlab.files.schema import checked
from finlab.layout.layout import Layout

Kind = Literal["lost", "weak", "torn", "stuck", "running", "whole"]
"""What may be true of a fin."""
Command = tuple[float, float, float]
Share = Annotated[float, Meta(gt=0.0, le=1.0)]
Angle = Annotated[float, Meta(ge=-1e6, le=1e6)]


class Damage(NamedTuple):
    """What is known of a robot's fins, as an allocator takes it: `allocate(..., **damage._asdict())`."""

    failed: tuple[str, ...] = ()
    """Names of the fins that are lost."""
    health: Health | None = None
    """What is known of fins that work in part; None where there are none."""

    @classmethod
    def of(
        cls, layout: Layout, lost: Sequence[str], torn: Mapping[str, float], stuck: Mapping[str, float]
    ) -> Damage:
        """What actuators that are lost, torn (the share of their force that is left) and stuck (where) leave.

        What cannot be used any more counts as lost: a stuck rudder or thruster, whose force is no choice. A
        torn thruster is weak: it gives the force that it is allocated where it is asked for more.
        """
        may = {part.name: part.FAULTS for part in layout.actuators}
        turning = {name: at for name, at in stuck.items() if "stuck" in may[name]}
        blades = {name: share for name, share in torn.items() if "torn" in may[name]}
        weak = {name: share for name, share in torn.items() if name not in blades}
        gone = (*lost, *(name for name in stuck if name not in turning))
        partly = torn or turning
        return cls(gone, Health.of(weak=weak, torn=blades, stuck=turning) if partly else None)


_VALUES: Mapping[str, Any] = {
    "weak": Share,
    "stuck": Angle,
    "running": tuple[Amplitude, Frequency, Angle],
    "torn": Share,
}


@dataclass(frozen=True)
class Health:
    """What is known of damaged fins, by name; those that are not named are whole. Made with `Health.of`."""

    weak: tuple[tuple[str, float], ...] = ()
    """Share, above 0 and up to 1, that is left of the largest amplitude and frequency of a fin."""
    stuck: tuple[tuple[str, float], ...] = ()
    """Zero direction [rad] at which a fin no longer turns; it still flaps."""
    running: tuple[tuple[str, Command], ...] = ()
    """Command (amplitude [rad], frequency [Hz], zero direction [rad]) that a fin keeps whatever is asked."""
    torn: tuple[tuple[str, float], ...] = ()
    """Share, above 0 and up to 1, of its law's thrust that a fin gives at every command, as one with a torn
    blade does."""

    def __post_init__(self) -> None:
        for kind, value in _VALUES.items():
            known = getattr(self, kind)
            each = [
                (name, checked(own, value, AllocationError, f"health: {kind} {name}")) for name, own in known
            ]
            object.__setattr__(self, kind, tuple(each))
        named = [name for name, _ in (*self.stuck, *self.running)]
        if len(set(named)) < len(named):
            raise AllocationError(f"health: a fin is stuck or running once, got {', '.join(named)}")

    @classmethod
    def of(
        cls,
        weak: Mapping[str, float] | None = None,
        stuck: Mapping[str, float] | None = None,
        running: Mapping[str, Command] | None = None,
        torn: Mapping[str, float] | None = None,
    ) -> Health:
        """Health from dictionaries, by the fins' names. Raises AllocationError: a share out of range, an
        angle that is no number."""
        kinds = (
            checked(kind or {}, dict[str, Any], AllocationError, "health")
            for kind in (weak, stuck, running, torn)
        )
        return cls(*(tuple(kind.items()) for kind in kinds))

    @classmethod
    def parse(
        cls, weak: Sequence[str], torn: Sequence[str], stuck: Sequence[str], running: Sequence[str]
    ) -> Health | None:
        """Health from texts, angles in degrees: `bow=0.5`, `bow=20`, `bow=0.3,1.0,20`; None where all are
        whole. Raises AllocationError: a text that says something else."""
        if not (weak or torn or stuck or running):
            return None
        kept = _named("running", running, 3).items()
        return cls.of(
            weak={name: share for name, (share,) in _named("health", weak, 1).items()},
            torn={name: share for name, (share,) in _named("torn", torn, 1).items()},
            stuck={name: math.radians(angle) for name, (angle,) in _named("stuck", stuck, 1).items()},
            running={name: (a, f, math.radians(angle)) for name, (a, f, angle) in kept},
        )

    def applied_to(self, layout: Layout) -> Layout:
        """The layout with the limits that are left. Raises LayoutError: there is no fin of a name, or a fin
        that is a table is said to have lost thrust; AllocationError: an actuator that is no fin cannot be
        damaged so."""
        return _applied(self, layout)


@lru_cache(maxsize=64)
def _applied(health: Health, layout: Layout) -> Layout:
    faults: dict[str, dict[str, Any]] = {part.name: {} for part in layout.actuators}
    for kind, known in vars(health).items():
        for name, value in known:
            part = layout.part(name)
            if kind not in part.FAULTS:
                may = ", ".join(part.FAULTS)
                raise AllocationError(f"health of {name!r}: {part.type}s may be {may} or failed, got {kind}")
            faults[name][kind] = value
    return replace(
        layout, actuators=tuple(part.damaged(Faults(**faults[part.name])) for part in layout.actuators)
    )


def _named(option: str, texts: Sequence[str], count: int) -> dict[str, tuple[float, ...]]:
    """Numbers by name, of texts NAME=NUMBER,...; errors say which option."""
    named = {}
    for text in texts:
        name, _, numbers = text.partition("=")
        try:
            values = tuple(float(number) for number in numbers.split(","))
        except ValueError:
            values = ()
        if not name or len(values) != count:
            wanted = "NAME=NUMBER" if count == 1 else "NAME=A,F,DEG"
            raise AllocationError(f"{option}: expected {wanted}, got {text!r}")
        named[name] = values
    return named
