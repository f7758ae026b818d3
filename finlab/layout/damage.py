"""Actuators that do not work as they should: five words, and what is left of the robot."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Annotated, Any, Literal

from msgspec import Meta

from finlab.actuators.actuator import Faults
from finlab.actuators.fin.fin_model import Amplitude, Frequency
from finlab.axes import Vector
from finlab.errors import AllocationError
from finlab.files.schema import checked
from finlab.layout.layout import Layout

Kind = Literal["lost", "weak", "torn", "stuck", "running", "whole"]
"""What may be true of an actuator."""
Share = Annotated[float, Meta(gt=0.0, le=1.0)]
Angle = Annotated[float, Meta(ge=-1e6, le=1e6)]
_VALUES: Mapping[str, Any] = {
    "weak": Share,
    "torn": Share,
    "stuck": Angle,
    "running": tuple[Amplitude, Frequency, Angle],
}


def lost_names(lost: Sequence[str]) -> tuple[str, ...]:
    """Returns the names of what is lost. Raises AllocationError: they are no list of names."""
    if isinstance(lost, str) or not (
        isinstance(lost, Sequence) and all(isinstance(name, str) for name in lost)
    ):
        hint = f"the text {lost!r}; write [{lost!r}]" if isinstance(lost, str) else repr(lost)
        raise AllocationError(f"lost: expected a list of names, got {hint}")
    return tuple(lost)


@dataclass(frozen=True)
class Damage:
    """What is known of damaged actuators, by name; those that are not named are whole.

    All but `lost` is a layout with other limits, or with a smaller fin, so that every method accounts for it
    and limits hold as always. Not to be changed. Raises AllocationError: a share out of range, an angle that
    is no number, names that are no list.
    """

    lost: Sequence[str] = ()
    """Those that give no force and leave the layout."""
    weak: Mapping[str, float] = field(default_factory=dict, hash=False)
    """Share, above 0 and up to 1, that is left of the largest amplitude and frequency, or of the force."""
    torn: Mapping[str, float] = field(default_factory=dict, hash=False)
    """Share of its law's thrust that one gives at every command, as a fin with a torn blade does."""
    stuck: Mapping[str, float] = field(default_factory=dict, hash=False)
    """Angle [rad] at which one no longer turns; it still pushes."""
    running: Mapping[str, Vector] = field(default_factory=dict, hash=False)
    """Command (amplitude [rad], frequency [Hz], zero direction [rad]) that a fin keeps whatever is asked."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "lost", lost_names(self.lost))
        for kind, value in _VALUES.items():
            known = checked(getattr(self, kind), dict[str, Any], AllocationError, f"damage: {kind}")
            each = {
                name: checked(own, value, AllocationError, f"damage: {kind} {name}")
                for name, own in known.items()
            }
            object.__setattr__(self, kind, each)
        if both := set(self.stuck) & set(self.running):
            raise AllocationError(f"damage: an actuator is stuck or running, got both of {', '.join(both)}")

    @property
    def partly(self) -> dict[str, Mapping[str, Any]]:
        """What is known of those that work in part, by kind of fault."""
        return {kind: getattr(self, kind) for kind in _VALUES if getattr(self, kind)}

    def of(self, name: str) -> dict[str, Any]:
        """Returns the faults of one actuator that still works, by kind."""
        return {kind: known[name] for kind, known in self.partly.items() if name in known}

    def with_fault(self, name: str, kind: str, value: Any) -> "Damage":
        """Returns it with another fault of an actuator, with a value as of that field (of `lost` any); None
        mends that fault. What is stuck does not run. Errors are as on construction."""
        if kind == "lost":
            others = tuple(other for other in self.lost if other != name)
            return replace(self, lost=others if value is None else (*others, name))
        out = ("stuck", "running") if kind in ("stuck", "running") and value is not None else (kind,)
        kept: dict[str, Any] = {
            own: {k: v for k, v in getattr(self, own).items() if k != name} for own in out
        }
        if value is not None:
            kept[kind][name] = value
        return replace(self, **kept)

    def renamed(self, names: Mapping[str, str]) -> "Damage":
        """Returns it for actuators with new names, by their old ones; others are forgotten."""
        known = {
            kind: {names[k]: v for k, v in own.items() if k in names} for kind, own in self.partly.items()
        }
        return Damage([names[name] for name in self.lost if name in names], **known)

    @classmethod
    def known(
        cls, layout: Layout, lost: Sequence[str], torn: Mapping[str, float], stuck: Mapping[str, float]
    ) -> "Damage":
        """What actuators that are lost, torn (the share of their force that is left) and stuck (where) leave.

        What cannot be used any more counts as lost: a stuck rudder or thruster, whose force is no choice. A
        torn thruster is weak: it gives the force that it is allocated where it is asked for more.
        """
        may = {part.name: part.FAULTS for part in layout.actuators}
        turning = {name: at for name, at in stuck.items() if "stuck" in may[name]}
        blades = {name: share for name, share in torn.items() if "torn" in may[name]}
        weak = {name: share for name, share in torn.items() if name not in blades}
        return cls((*lost, *(name for name in stuck if name not in turning)), weak, blades, turning)

    @classmethod
    def parse(
        cls,
        lost: Sequence[str] = (),
        weak: Sequence[str] = (),
        torn: Sequence[str] = (),
        stuck: Sequence[str] = (),
        running: Sequence[str] = (),
    ) -> "Damage":
        """Returns damage from texts, angles in degrees: `bow=0.5` for a share, `bow=20` for an angle,
        `bow=0.3,1.0,20` for a command. Raises AllocationError: a text that says something else."""
        kept = _named("running", running, 3).items()
        return cls(
            lost,
            {name: share for name, (share,) in _named("weak", weak, 1).items()},
            {name: share for name, (share,) in _named("torn", torn, 1).items()},
            {name: math.radians(angle) for name, (angle,) in _named("stuck", stuck, 1).items()},
            {name: (a, f, math.radians(angle)) for name, (a, f, angle) in kept},
        )

    def applied_to(self, layout: Layout) -> Layout:
        """Returns the layout with the limits that are left; the lost ones are still there. Raises
        LayoutError: there is no actuator of a name, or one whose law is a table is torn; AllocationError: its
        kind cannot be damaged so."""
        return _applied(self, layout) if self.partly else layout


WHOLE = Damage()
"""Nothing is damaged."""


@lru_cache(maxsize=64)
def _applied(damage: Damage, layout: Layout) -> Layout:
    for kind, known in damage.partly.items():
        for part in map(layout.part, known):
            if kind not in part.FAULTS:
                may = ", ".join((*part.FAULTS, "lost"))
                raise AllocationError(f"damage of {part.name!r}: {part.type}s may be {may}, got {kind}")
    parts = (part.damaged(Faults(**damage.of(part.name))) for part in layout.actuators)
    return replace(layout, actuators=tuple(parts))


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
