"""Damage of actuators (lost, weak, torn, stuck, running), and the layout that it leaves.

`Allocator.allocate`, the command line and the app take a `Damage`, the fault monitor of
`finlab.swim.control` makes one. `Damage.applied_to` turns it into limits of a layout.
"""

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
"""What is wrong with an actuator; `whole` where a repair is meant."""
ForceShare = Annotated[float, Meta(gt=0.0, le=1.0)]
"""Share of a force that is left [1]."""
CommandNumber = Annotated[float, Meta(ge=-1e9, le=1e9)]
"""A number of a command, such as an angle [rad] or a force [N]."""
FAULT_VALUE_TYPES: Mapping[str, Any] = {
    "weak": ForceShare,
    "torn": ForceShare,
    "stuck": CommandNumber,
    "running": Annotated[tuple[CommandNumber, ...], Meta(min_length=1, max_length=3)],
}
"""Fault of an actuator that still works -> type of its value."""


def lost_names(lost: Sequence[str]) -> tuple[str, ...]:
    """Returns the names of lost actuators as a tuple.

    Raises:
        AllocationError: they are no list of names.
    """
    if isinstance(lost, str):
        raise AllocationError(
            f"lost: expected a list of names, got the text {lost!r}; write [{lost!r}]"
        )
    is_list = type(lost) in (tuple, list) or isinstance(lost, Sequence)  # most are: quicker to see
    if not is_list or not all(isinstance(name, str) for name in lost):
        raise AllocationError(f"lost: expected a list of names, got {lost!r}")
    return tuple(lost)


@dataclass(frozen=True)
class Damage:
    """Damage of actuators, by name; those that are not named are undamaged. Immutable.

    A fault other than `lost` changes the limits of a layout, or makes a fin smaller, so that every
    method accounts for it: an actuator that is stuck at a command has equal limits there, and the
    others compensate. Whether a command has the right count of numbers, and a force is feasible, is
    checked against the layout in `applied_to`.

    Args:
        lost: names of those that give no force and leave the layout.
        weak: remaining share of the largest amplitude and frequency, or of the force, above 0 and
            up to 1 [1].
        torn: share of its law's thrust that one gives at every command, as a fin with a torn blade
            does [1].
        stuck: value at which one is stuck: the angle at which a fin, an azimuth or a tilt no longer
            turns, though it still pushes [rad]; the force of a thruster [N].
        running: constant command that ignores the controller: of a fin (amplitude [rad], frequency
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
        for kind, value_type in FAULT_VALUE_TYPES.items():
            faults = getattr(self, kind)
            if type(faults) is dict and not faults:
                continue  # losses alone are asked for in the middle of a control loop
            unchecked = checked(faults, dict[str, Any], AllocationError, f"damage: {kind}")
            by_name = {}
            for name, fault in unchecked.items():
                source = f"damage: {kind} {name}"
                by_name[name] = checked(fault, value_type, AllocationError, source)
            object.__setattr__(self, kind, by_name)
        contradictory = set(self.stuck) & set(self.running)
        if contradictory:
            raise AllocationError(
                f"damage: an actuator is stuck or running, got both of {', '.join(contradictory)}"
            )

    @property
    def faults_by_kind(self) -> dict[str, Mapping[str, Any]]:
        """Faults of the actuators that still work: kind of fault -> name -> value."""
        faults = {kind: getattr(self, kind) for kind in FAULT_VALUE_TYPES}
        return {kind: by_name for kind, by_name in faults.items() if by_name}

    def faults_of(self, name: str) -> dict[str, Any]:
        """Returns the faults of one actuator that still works: kind of fault -> value."""
        faults = {}
        for kind, by_name in self.faults_by_kind.items():
            if name in by_name:
                faults[kind] = by_name[name]
        return faults

    def with_fault(self, name: str, kind: str, value: Any) -> "Damage":
        """Returns the damage with one fault set or repaired.

        Args:
            name: the actuator.
            kind: name of the field, such as `stuck`; a stuck actuator ceases to run, and a running
                one to be stuck.
            value: value of that field (of `lost` any); None repairs that fault.

        Raises:
            AllocationError: as on construction.
        """
        if kind == "lost":
            lost = [lost_name for lost_name in self.lost if lost_name != name]
            if value is not None:
                lost.append(name)
            return replace(self, lost=tuple(lost))
        replaced_kinds: tuple[str, ...] = (kind,)
        if kind in ("stuck", "running") and value is not None:
            replaced_kinds = ("stuck", "running")
        changes: dict[str, Any] = {}
        for replaced_kind in replaced_kinds:
            changes[replaced_kind] = dict(getattr(self, replaced_kind))
            changes[replaced_kind].pop(name, None)
        if value is not None:
            changes[kind][name] = value
        return replace(self, **changes)

    def renamed(self, names: Mapping[str, str]) -> "Damage":
        """Returns the damage of actuators that have other names.

        Args:
            names: old name -> new name; faults of actuators that it does not have are dropped.
        """
        faults: dict[str, Any] = {}
        for kind, by_name in self.faults_by_kind.items():
            faults[kind] = {}
            for name, value in by_name.items():
                if name in names:
                    faults[kind][names[name]] = value
        lost = [names[name] for name in self.lost if name in names]
        return Damage(lost, **faults)

    @classmethod
    def representing(
        cls,
        layout: Layout,
        lost: Sequence[str],
        torn: Mapping[str, float],
        stuck: Mapping[str, float],
    ) -> "Damage":
        """Returns the damage that represents faults, within what each kind of actuator may have.

        An actuator whose kind cannot be stuck, a rudder, counts as lost. One that cannot be torn, a
        thruster, counts as weak: its controller can make up for it within the smaller limit; one
        that is stuck as well gives that share of its force.

        Args:
            layout: the robot.
            lost: names of lost actuators.
            torn: remaining share of the force, by name [1].
            stuck: angle [rad], of a thruster its force [N], by name.
        """
        possible = {actuator.name: actuator.KIND.faults for actuator in layout.actuators}
        stuck_values = {}
        lost_by_stop = []
        for name, value in stuck.items():
            if "stuck" in possible[name]:
                stuck_values[name] = value
            else:
                lost_by_stop.append(name)
        torn_shares = {}
        weak_shares = {}
        for name, share in torn.items():
            if "torn" in possible[name]:
                torn_shares[name] = share
            else:
                weak_shares[name] = share
        for name in set(weak_shares) & set(stuck_values):
            if not layout.actuator(name).KIND.sticks_at_angle:
                stuck_values[name] *= weak_shares.pop(name)
        return cls((*lost, *lost_by_stop), weak_shares, torn_shares, stuck_values)

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
        """Returns damage of a layout from texts `NAME=NUMBERS`, as the command line has them.

        Args:
            layout: the robot.
            lost: names of lost actuators.
            weak: a share each, such as `bow=0.5` [1].
            torn: a share each, such as `bow=0.5` [1].
            stuck: a value each: `bow=20` is 20 deg of a fin or a pod, 20 N of a thruster.
            running: a command each: `bow=0.3,1.0,20` of a fin [rad, Hz, deg], `bow=20,5` of a pod
                [deg, N], `bow=5` of a thruster [N].

        Raises:
            AllocationError: a text has another form.
            LayoutError: there is no actuator of a name.
        """
        weak_shares = _number_by_name("weak", weak)
        torn_shares = _number_by_name("torn", torn)
        stuck_values: dict[str, float] = {}
        for name, value in _number_by_name("stuck", stuck).items():
            is_angle = layout.actuator(name).KIND.sticks_at_angle
            stuck_values[name] = math.radians(value) if is_angle else value
        commands: dict[str, tuple[float, ...]] = {}
        for name, values in _numbers_by_name("running", running, None).items():
            commands[name] = _command_in_radians(layout.actuator(name), values)
        return cls(lost, weak_shares, torn_shares, stuck_values, commands)

    def applied_to(self, layout: Layout) -> Layout:
        """Returns the layout with the limits that remain; lost actuators are not removed.

        Raises:
            LayoutError: there is no actuator of a name, or one whose law is a table is torn.
            AllocationError: its kind cannot have the fault, its command has another count of
                numbers, or a thruster or a pod cannot give the force at which it is stuck.
        """
        return _applied(self, layout) if self.faults_by_kind else layout


NO_DAMAGE = Damage()
"""No damage."""


@lru_cache(maxsize=64)
def _applied(damage: Damage, layout: Layout) -> Layout:
    """As `Damage.applied_to`, for damage beside losses; cached, since every answer of a damaged
    robot asks for it."""
    for kind, by_name in damage.faults_by_kind.items():
        damaged = [layout.actuator(name, f"damage: {kind}") for name in by_name]
        for actuator in damaged:
            if kind not in actuator.KIND.faults:
                possible = ", ".join((*actuator.KIND.faults, "lost"))
                raise AllocationError(
                    f"damage of {actuator.name!r}: {actuator.type}s may be {possible}, got {kind}"
                )
    for name, command in damage.running.items():
        _check_count(layout.actuator(name), command)
    actuators = []
    for actuator in layout.actuators:
        try:
            actuators.append(actuator.damaged(Faults(**damage.faults_of(actuator.name))))
        except LayoutError as error:
            raise LayoutError(error.problem, error.key, f"damage of {actuator.name!r}") from None
    return replace(layout, actuators=tuple(actuators))


def _check_count(actuator: Actuator, command: Sequence[float]) -> None:
    """Refuses a constant command with another count of numbers than its kind's. Raises
    AllocationError."""
    numbers = actuator.KIND.numbers
    if len(command) != len(numbers):
        labels = ", ".join(number.label for number in numbers)
        values = ", ".join(f"{value:g}" for value in command)
        raise AllocationError(
            f"damage of {actuator.name!r}: running: expected the command that {actuator.type}s "
            f"have ({labels}), {len(numbers)} in all, got {len(command)} ({values})"
        )


def _command_in_radians(actuator: Actuator, values: tuple[float, ...]) -> tuple[float, ...]:
    """A constant command from a text, whose angle at which the actuator may be stuck is in
    degrees. Raises AllocationError: it has another count of numbers than its kind's."""
    kind = actuator.KIND
    angle_number = kind.stuck_number if kind.sticks_at_angle else None
    # A kind that cannot run on is refused where the damage is applied.
    if "running" in kind.faults and len(values) != len(kind.numbers):
        labels = [number.label for number in kind.numbers]
        if angle_number is not None:
            labels[angle_number] = f"{kind.numbers[angle_number].name} [deg]"
        form = ",".join(labels)
        got = ",".join(f"{value:g}" for value in values)
        raise AllocationError(
            f"running: expected NAME={form} of the {actuator.type} {actuator.name!r}, got "
            f"'{actuator.name}={got}'"
        )
    command = list(values)
    if angle_number is not None and angle_number < len(command):
        command[angle_number] = math.radians(command[angle_number])
    return tuple(command)


def _number_by_name(option: str, texts: Sequence[str]) -> dict[str, float]:
    """One number by name, of texts NAME=NUMBER; errors name the option."""
    return {name: value for name, (value,) in _numbers_by_name(option, texts, 1).items()}


def _numbers_by_name(
    option: str, texts: Sequence[str], count: int | None
) -> dict[str, tuple[float, ...]]:
    """Numbers by name, of texts NAME=NUMBER,... with `count` numbers each, None for any; errors
    name the option."""
    by_name = {}
    for text in texts:
        name, _, numbers = text.partition("=")
        try:
            values = tuple(float(number) for number in numbers.split(","))
        except ValueError:
            values = ()
        if not name or not values or count not in (None, len(values)):
            form = "NAME=A,F,DEG of a fin, NAME=DEG,N of a pod, or NAME=N"
            if count == 1:
                form = "NAME=NUMBER"
            raise AllocationError(f"{option}: expected {form}, got {text!r}")
        by_name[name] = values
    return by_name
