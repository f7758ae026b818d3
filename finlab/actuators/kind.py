"""What the rest of finlab must know of a kind of actuator beside its law: one value with named
fields, the `KIND` of the kind's class.

Layouts, allocation, simulation, files and the app read it and ask no actuator for its type.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from msgspec import Struct

ACROSS = "across"
"""Name of the own axis across two declared ones, first x second: the third row of the frame."""

DRAWN_AS = ("fin", "thruster", "pod", "foil")
"""Shapes as which an actuator may be drawn."""


class Command(Struct, frozen=True, omit_defaults=True):
    """A command as users see it: its numbers by name, and what follows from them."""

    @property
    def words(self) -> str:
        """The command with its units, for a cell of a printed table."""
        return ", ".join(f"{getattr(self, name):.3f}" for name in self.__struct_fields__)


@dataclass(frozen=True, kw_only=True)
class CommandNumber:
    """One number of a command.

    Args:
        name: column of recorded swims and of the graph file, behind the actuator's name.
        unit: "rad", "Hz" or "N"; a number in newtons is the force itself.
        limits: field of the kind with its least and greatest; None where the class has `lower`
            and `upper` of its own.
        rate: field with its largest change per second; None where nothing limits it, or where
            the class has `rates` of its own.
        aims: whether it is an angle that turns the force and leaves its size, so that a full turn
            has no ends.
        lags: whether it follows with the time constant; the first number does where none says so.
    """

    name: str
    unit: str
    limits: str | None = None
    rate: str | None = None
    aims: bool = False
    lags: bool = False

    @property
    def label(self) -> str:
        """Name and unit, such as `force [N]`."""
        return f"{self.name} [{self.unit}]"


@dataclass(frozen=True, kw_only=True)
class Kind:
    """Facts of one kind of actuator.

    Args:
        law: the `ActuatorLaw` of m actuators; kinds that share it are answered together.
        group: the `Group` of their responses, made of m actuators and an effectiveness (m, 3, 6).
        command: the command as users see it, made of the numbers in order.
        numbers: numbers of a command, in order; at most three.
        axes: fields with own axes, the first rows of the frame: one, or two at a right angle.
        pushes_along: those own axes along which it can push at will, by field, or `ACROSS`.
        pointed: the axis that is pointed, by hand and by a search.
        drawn_as: its shape in pictures, one of `DRAWN_AS`.
        faults: kinds of damage that it may have beside being lost, of `Faults`.
        arc: field with the angles that it turns through, which change sign in a mirror; empty
            where there is none.
        driven_by_flow: whether its force is that of the water that flows past: none at rest.
        models: formulas that its law may follow, by the type of its `model`; none where there is
            one law.
    """

    law: type[Any]
    group: type[Any]
    command: type[Command]
    numbers: tuple[CommandNumber, ...]
    axes: tuple[str, ...]
    pushes_along: tuple[str, ...]
    pointed: str
    drawn_as: str
    faults: tuple[str, ...] = ()
    arc: str = ""
    driven_by_flow: bool = False
    models: tuple[str, ...] = ()

    @cached_property
    def force_number(self) -> int | None:
        """Which number is the force; None where the force follows from all of them."""
        return _first([number.unit == "N" for number in self.numbers])

    @cached_property
    def aiming_number(self) -> int | None:
        """Which number turns the force; None where none does."""
        return _first([number.aims for number in self.numbers])

    @cached_property
    def stuck_number(self) -> int:
        """Which number keeps its value where the actuator is stuck: the angle that aims, else the
        first."""
        return self.aiming_number or 0

    @cached_property
    def sticks_at_angle(self) -> bool:
        """Whether that number is an angle [rad]; a force [N] otherwise."""
        return self.numbers[self.stuck_number].unit == "rad"

    @cached_property
    def lagging_number(self) -> int:
        """Which number follows with the time constant; another one changes at its rate."""
        return _first([number.lags for number in self.numbers]) or 0

    @cached_property
    def pointed_row(self) -> int:
        """Row of the frame (3, 3) that is the axis that is pointed."""
        return self.axes.index(self.pointed)

    @cached_property
    def push_rows(self) -> tuple[int, ...]:
        """Rows of the frame (3, 3) along which it pushes."""
        rows = {name: row for row, name in enumerate(self.axes)} | {ACROSS: 2}
        return tuple(rows[name] for name in self.pushes_along)


def _first(flags: list[bool]) -> int | None:
    """Index of the first flag that is set; None where none is."""
    return flags.index(True) if True in flags else None
