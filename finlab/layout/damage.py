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
from typing import Literal, NamedTuple

import numpy as np

from finlab.errors import AllocationError
from finlab.layout.actuator import Actuator
from finlab.layout.azimuth import Azimuth
from finlab.layout.fin import Fin, Limits
from finlab.layout.layout import Layout
from finlab.layout.rudder import Rudder
from finlab.layout.thruster import Thruster

Kind = Literal["lost", "weak", "torn", "stuck", "running", "whole"]
"""What may be true of a fin."""
Command = tuple[float, float, float]


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
        types = {part.name: part for part in layout.actuators}
        turning = {name: at for name, at in stuck.items() if isinstance(types[name], Fin | Azimuth)}
        weak = {name: share for name, share in torn.items() if isinstance(types[name], Thruster | Azimuth)}
        thrust = {name: share for name, share in torn.items() if name not in weak}
        gone = (*lost, *(name for name in stuck if name not in turning))
        partly = torn or turning
        return cls(gone, Health.of(weak=weak, thrust=thrust, stuck=turning) if partly else None)


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
        for name, share in (*self.weak, *self.thrust):
            if not 0.0 < share <= 1.0:
                raise AllocationError(
                    f"health of {name}: expected a share above 0 and up to 1, got {share}; "
                    "a fin that gives nothing is failed"
                )
        for name, angle in self.stuck:
            if not np.isfinite(angle):
                raise AllocationError(f"stuck {name}: expected a finite angle in radians, got {angle}")
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
        """Health from dictionaries, by the fins' names.

        Raises:
            AllocationError: a share out of range, an angle that is no number.
        """
        try:
            shares, angles, thrusts = (
                {k: float(v) for k, v in (d or {}).items()} for d in (weak, stuck, thrust)
            )
            kept = {name: (float(a), float(f), float(d)) for name, (a, f, d) in (running or {}).items()}
        except (TypeError, ValueError, AttributeError) as error:
            raise AllocationError(
                "health: expected dictionaries by fin name, of shares, of angles and of commands "
                f"(amplitude, frequency, zero direction), got weak={weak}, stuck={stuck}, running={running}, "
                f"thrust={thrust}"
            ) from error
        return cls(tuple(shares.items()), tuple(angles.items()), tuple(kept.items()), tuple(thrusts.items()))

    @classmethod
    def parse(
        cls, weak: Sequence[str], torn: Sequence[str], stuck: Sequence[str], running: Sequence[str]
    ) -> Health | None:
        """Health from texts, angles in degrees: `bow=0.5`, `bow=20`, `bow=0.3,1.0,20`; None where all are
        whole.

        Raises:
            AllocationError: a text that says something else.
        """
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
        """The layout with the limits that are left.

        Raises:
            LayoutError: there is no fin of a name, or a fin that is a table is said to have lost thrust.
            AllocationError: an actuator that is no fin cannot be damaged so.
        """
        return _applied(self, layout)


@lru_cache(maxsize=64)
def _applied(health: Health, layout: Layout) -> Layout:
    weak, stuck, running = dict(health.weak), dict(health.stuck), dict(health.running)
    thrust = dict(health.thrust)
    layout.indices((*weak, *stuck, *running, *thrust))
    parts: list[Actuator] = []
    for part in layout.actuators:
        name = part.name
        if not isinstance(part, Fin):
            if isinstance(part, Rudder) and name in thrust:
                part = replace(part, area=thrust[name] * part.area)
            elif name in running or name in thrust:
                raise AllocationError(
                    f"health of {name!r}: {part.type}s may be weak or failed, and azimuths stuck; only fins "
                    "run on, and only fins and rudders lose thrust"
                )
            parts.append(_damaged_other(part, weak.get(name), stuck.get(name)))
            continue
        fin = part if name not in thrust else replace(part, model=part.model.scaled(thrust[name]))
        parts.append(_damaged(fin, weak.get(name), stuck.get(name), running.get(name)))
    return replace(layout, actuators=tuple(parts))


def _damaged_other(
    part: Thruster | Azimuth | Rudder, share: float | None, angle: float | None
) -> Thruster | Azimuth | Rudder:
    """The actuator, no fin, with the limits that are left of it."""
    if share is not None:
        if isinstance(part, Rudder):
            raise AllocationError(f"health of {part.name!r}: a rudder is failed or whole, not weak")
        low, high = part.force
        least = min(low, share * high) if isinstance(part, Azimuth) else share * low
        part = replace(part, force=(least, share * high))
    if angle is not None:
        if not isinstance(part, Azimuth):
            raise AllocationError(f"stuck {part.name!r}: only fins and azimuths turn")
        held = _held(angle, part.arc)
        part = replace(part, arc=(held, held))
    return part


def _damaged(fin: Fin, share: float | None, angle: float | None, command: Command | None) -> Fin:
    """The fin with the limits that are left of it."""
    limits = fin.limits
    if command is not None:
        amplitude, frequency, direction = command
        return replace(fin, limits=Limits(*((value, value) for value in (amplitude, frequency, direction))))
    if share is not None:
        limits = replace(
            limits,
            amplitude=_weakened(limits.amplitude, share),
            frequency=_weakened(limits.frequency, share),
        )
    if angle is not None:
        held = _held(angle, limits.zero_direction)
        limits = replace(limits, zero_direction=(held, held))
    return fin if limits is fin.limits else replace(fin, limits=limits)


def _held(angle: float, limits: tuple[float, float]) -> float:
    """The same angle [rad], whole turns off, within limits where there is such a one."""
    return angle + round((0.5 * sum(limits) - angle) / (2 * np.pi)) * 2 * np.pi


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
