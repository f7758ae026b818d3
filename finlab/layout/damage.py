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

from finlab.errors import AllocationError
from finlab.files.schema import checked
from finlab.layout.axes import TURN
from finlab.layout.fin import Amplitude, Frequency, Limits
from finlab.layout.layout import Actuator, Layout
from finlab.layout.propellers import Azimuth, Thruster
from finlab.layout.rudder import Rudder

Kind = Literal["lost", "weak", "torn", "stuck", "running", "whole"]
"""What may be true of a fin."""
Command = tuple[float, float, float]
Share = Annotated[float, Meta(gt=0.0, le=1.0)]
Angle = Annotated[float, Meta(ge=-1e6, le=1e6)]

FAULTS: Mapping[str, tuple[str, ...]] = {
    "fin": ("weak", "thrust", "stuck", "running"),
    "thruster": ("weak",),
    "azimuth": ("weak", "stuck"),
    "tilt": ("weak", "stuck"),
    "rudder": ("thrust",),
}
"""Fields of `Health` that the types of actuators may have. All may fail."""


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
        may = {part.name: FAULTS[part.type] for part in layout.actuators}
        turning = {name: at for name, at in stuck.items() if "stuck" in may[name]}
        thrust = {name: share for name, share in torn.items() if "thrust" in may[name]}
        weak = {name: share for name, share in torn.items() if name not in thrust}
        gone = (*lost, *(name for name in stuck if name not in turning))
        partly = torn or turning
        return cls(gone, Health.of(weak=weak, thrust=thrust, stuck=turning) if partly else None)


_VALUES: Mapping[str, Any] = {
    "weak": Share,
    "stuck": Angle,
    "running": tuple[Amplitude, Frequency, Angle],
    "thrust": Share,
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
    thrust: tuple[tuple[str, float], ...] = ()
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
        thrust: Mapping[str, float] | None = None,
    ) -> Health:
        """Health from dictionaries, by the fins' names. Raises AllocationError: a share out of range, an
        angle that is no number."""
        kinds = (
            checked(kind or {}, dict[str, Any], AllocationError, "health")
            for kind in (weak, stuck, running, thrust)
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
            thrust={name: share for name, (share,) in _named("torn", torn, 1).items()},
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
            part = layout.actuators[layout.index(name)]
            if kind not in FAULTS[part.type]:
                may = ", ".join(FAULTS[part.type])
                raise AllocationError(f"health of {name!r}: {part.type}s may be {may} or failed, got {kind}")
            faults[name][kind] = value
    return replace(layout, actuators=tuple(_damaged(part, **faults[part.name]) for part in layout.actuators))


def _damaged(
    part: Actuator,
    weak: float | None = None,
    stuck: float | None = None,
    running: Command | None = None,
    thrust: float | None = None,
) -> Actuator:
    """The actuator with the law and the limits that are left of it."""
    if isinstance(part, Rudder):
        return part if thrust is None else replace(part, area=thrust * part.area)
    if isinstance(part, Thruster):
        low, high = part.force
        return part if weak is None else replace(part, force=(weak * low, weak * high))
    if isinstance(part, Azimuth):
        low, high = part.force
        force = part.force if weak is None else _weakened((max(low, weak * low), high), weak)
        return replace(part, force=force, arc=_held(stuck, part.arc))
    model = part.model if thrust is None else part.model.scaled(thrust)
    if running is not None:
        amplitude, frequency, direction = ((value, value) for value in running)
        return replace(part, model=model, limits=Limits(amplitude, frequency, direction))
    limits = replace(part.limits, zero_direction=_held(stuck, part.limits.zero_direction))
    if weak is not None:
        limits = replace(
            limits,
            amplitude=_weakened(limits.amplitude, weak),
            frequency=_weakened(limits.frequency, weak),
        )
    return replace(part, model=model, limits=limits)


def _held(angle: float | None, limits: tuple[float, float]) -> tuple[float, float]:
    """An angle [rad] as both limits, whole turns off, within the limits where there is such a one; the limits
    themselves where it is None."""
    if angle is None:
        return limits
    held = angle + round((0.5 * sum(limits) - angle) / TURN) * TURN
    return held, held


def _weakened(interval: tuple[float, float], share: float) -> tuple[float, float]:
    low, high = interval
    return min(low, share * high), share * high


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
