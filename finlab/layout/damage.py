"""Damage of actuators (lost, weak, torn, stuck, running), and the layout that it leaves."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Annotated, Any, Literal

from msgspec import Meta

from finlab.actuators.actuator import Actuator, Faults
from finlab.errors import AllocationError, LayoutError
from finlab.files.schema import checked
from finlab.layout.layout import Layout

FaultKind = Literal["lost", "weak", "torn", "stuck", "running", "whole"]
"""State of an actuator."""
Share = Annotated[float, Meta(gt=0.0, le=1.0)]
"""A share of a force [1]."""
Kept = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""A number of a command, such as an angle [rad] or a force [N]."""
FAULT_VALUES: Mapping[str, Any] = {
    "weak": Share,
    "torn": Share,
    "stuck": Kept,
    "running": Annotated[tuple[Kept, ...], Meta(min_length=1, max_length=3)],
}
"""Damage of an actuator that still works -> type of its value."""


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
    """Damage of actuators, by name; those that are not named are whole. Not to be changed.

    All but `lost` leaves a layout with other limits, or with a smaller fin, so that every method
    accounts for it and limits hold as always: what hangs at a command has that one alone, and the
    others compensate for it. How many numbers a command has, and which forces are possible, is
    known with the layout: see `applied_to`.

    Args:
        lost: names of those that give no force and leave the layout.
        weak: share that is left of the largest amplitude and frequency, or of the force, above 0
            and up to 1 [1].
        torn: share of its law's thrust that one gives at every command, as a fin with a torn blade
            does [1].
        stuck: value that one keeps: the angle at which a fin, an azimuth or a tilt no longer turns,
            though it still pushes [rad]; the force at which a thruster hangs [N].
        running: command that one keeps whatever is asked: of a fin (amplitude [rad], frequency
            [Hz], zero direction [rad]), of an azimuth or a tilt (angle [rad], force [N]), of a
            thruster (force [N],).

    Raises:
        AllocationError: a share is out of range, an angle is no number, names are no list, or one
            is both stuck and running.
    """

    lost: Sequence[str] = ()
    weak: Mapping[str, float] = field(default_factory=dict, hash=False)
    torn: Mapping[str, float] = field(default_factory=dict, hash=False)
    stuck: Mapping[str, float] = field(default_factory=dict, hash=False)
    running: Mapping[str, tuple[float, ...]] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "lost", lost_names(self.lost))
        for kind, value in FAULT_VALUES.items():
            named = checked(getattr(self, kind), dict[str, Any], AllocationError, f"damage: {kind}")
            by_name = {}
            for name, own in named.items():
                by_name[name] = checked(own, value, AllocationError, f"damage: {kind} {name}")
            object.__setattr__(self, kind, by_name)
        if both := set(self.stuck) & set(self.running):
            raise AllocationError(
                f"damage: an actuator is stuck or running, got both of {', '.join(both)}"
            )

    @property
    def partly(self) -> dict[str, Mapping[str, Any]]:
        """What is known of those that work in part, by kind of fault."""
        return {kind: getattr(self, kind) for kind in FAULT_VALUES if getattr(self, kind)}

    def of(self, name: str) -> dict[str, Any]:
        """Returns the faults of one actuator that still works, by kind."""
        return {kind: known[name] for kind, known in self.partly.items() if name in known}

    def with_fault(self, name: str, kind: str, value: Any) -> "Damage":
        """Returns it with another fault of an actuator, with a value as of that field (of `lost`
        any); None mends that fault. What is stuck does not run. Errors are as on construction."""
        if kind == "lost":
            others = tuple(other for other in self.lost if other != name)
            return replace(self, lost=others if value is None else (*others, name))
        replaced: tuple[str, ...] = (kind,)
        if kind in ("stuck", "running") and value is not None:
            replaced = ("stuck", "running")
        changed: dict[str, Any] = {}
        for each in replaced:
            changed[each] = dict(getattr(self, each))
            changed[each].pop(name, None)
        if value is not None:
            changed[kind][name] = value
        return replace(self, **changed)

    def renamed(self, names: Mapping[str, str]) -> "Damage":
        """Returns it for actuators with new names, by their old ones; others are forgotten."""
        known = {
            kind: {names[k]: v for k, v in own.items() if k in names}
            for kind, own in self.partly.items()
        }
        return Damage([names[name] for name in self.lost if name in names], **known)

    @classmethod
    def known(
        cls,
        layout: Layout,
        lost: Sequence[str],
        torn: Mapping[str, float],
        stuck: Mapping[str, float],
    ) -> "Damage":
        """What actuators that are lost, torn (the share of their force that is left) and stuck
        (where: an angle [rad], of a thruster its force [N]) leave.

        What cannot be used any more counts as lost: a stuck rudder. A torn thruster is weak: it
        gives the force that it is allocated where it is asked for more; one that is stuck as well
        gives its share.
        """
        may = {part.name: part.KIND.faults for part in layout.actuators}
        known = {name: at for name, at in stuck.items() if "stuck" in may[name]}
        blades = {name: share for name, share in torn.items() if "torn" in may[name]}
        weak = {name: share for name, share in torn.items() if name not in blades}
        for name in set(weak) & set(known):
            if not layout.part(name).KIND.sticks_at_angle:
                known[name] *= weak.pop(name)
        return cls((*lost, *(name for name in stuck if name not in known)), weak, blades, known)

    @classmethod
    def parse(
        cls,
        layout: Layout,
        lost: Sequence[str] = (),
        weak: Sequence[str] = (),
        torn: Sequence[str] = (),
        stuck: Sequence[str] = (),
        running: Sequence[str] = (),
    ) -> "Damage":
        """Returns damage of a layout from texts, directions in degrees: `bow=0.5` for a share;
        `bow=20` for where one is stuck, a fin or a pod at 20 deg, a thruster at 20 N; for a command
        `bow=0.3,1.0,20` of a fin [rad, Hz, deg], `bow=20,5` of a pod [deg, N], `bow=5` of a
        thruster [N].

        Raises AllocationError: a text that says something else; LayoutError: there is no actuator
        of a name.
        """
        shares = {
            kind: {name: share for name, (share,) in _named(kind, texts, 1).items()}
            for kind, texts in (("weak", weak), ("torn", torn))
        }
        held: dict[str, float] = {}
        for name, (value,) in _named("stuck", stuck, 1).items():
            held[name] = math.radians(value) if layout.part(name).KIND.sticks_at_angle else value
        kept: dict[str, tuple[float, ...]] = {}
        for name, values in _named("running", running, None).items():
            part = layout.part(name)
            turns = part.KIND.stuck_number if part.KIND.sticks_at_angle else None
            # Of a kind that cannot run on, that is said where the damage is applied.
            if "running" in part.KIND.faults and len(values) != len(part.KIND.numbers):
                labels = [number.label for number in part.KIND.numbers]
                if turns is not None:
                    labels[turns] = f"{part.KIND.numbers[turns].name} [deg]"
                wanted = ",".join(labels)
                got = ",".join(f"{value:g}" for value in values)
                raise AllocationError(
                    f"running: expected NAME={wanted} of the {part.type} {name!r}, got "
                    f"'{name}={got}'"
                )
            kept[name] = tuple(math.radians(v) if k == turns else v for k, v in enumerate(values))
        return cls(lost, shares["weak"], shares["torn"], held, kept)

    def applied_to(self, layout: Layout) -> Layout:
        """Returns the layout with the limits that are left; the lost ones are still there. Raises
        LayoutError: there is no actuator of a name, or one whose law is a table is torn;
        AllocationError: its kind cannot be damaged so, its command has another number of values, or
        a thruster or a pod cannot give the force at which it is said to hang."""
        return _applied(self, layout) if self.partly else layout


WHOLE = Damage()
"""Nothing is damaged."""


@lru_cache(maxsize=64)
def _applied(damage: Damage, layout: Layout) -> Layout:
    for kind, known in damage.partly.items():
        for part in [layout.part(name, f"damage: {kind}") for name in known]:
            if kind not in part.KIND.faults:
                may = ", ".join((*part.KIND.faults, "lost"))
                raise AllocationError(
                    f"damage of {part.name!r}: {part.type}s may be {may}, got {kind}"
                )
    for name, command in damage.running.items():
        _check_count(layout.part(name), command)
    parts = []
    for part in layout.actuators:
        try:
            parts.append(part.damaged(Faults(**damage.of(part.name))))
        except LayoutError as error:
            raise LayoutError(error.problem, error.key, f"damage of {part.name!r}") from None
    return replace(layout, actuators=tuple(parts))


def _check_count(part: Actuator, command: Sequence[float]) -> None:
    """Refuses a command that an actuator is said to keep, if it has another number of values than
    its kind's. Raises AllocationError."""
    if len(command) != len(part.KIND.numbers):
        wanted = ", ".join(number.label for number in part.KIND.numbers)
        got = ", ".join(f"{value:g}" for value in command)
        raise AllocationError(
            f"damage of {part.name!r}: running: expected the command that {part.type}s have "
            f"({wanted}), "
            f"{len(part.KIND.numbers)} in all, got {len(command)} ({got})"
        )


def _named(option: str, texts: Sequence[str], count: int | None) -> dict[str, tuple[float, ...]]:
    """Numbers by name, of texts NAME=NUMBER,..., so many of each, where that is not None; errors
    say which option."""
    named = {}
    for text in texts:
        name, _, numbers = text.partition("=")
        try:
            values = tuple(float(number) for number in numbers.split(","))
        except ValueError:
            values = ()
        if not name or not values or count not in (None, len(values)):
            wanted = (
                "NAME=NUMBER"
                if count == 1
                else "NAME=A,F,DEG of a fin, NAME=DEG,N of a pod, or NAME=N"
            )
            raise AllocationError(f"{option}: expected {wanted}, got {text!r}")
        named[name] = values
    return named
