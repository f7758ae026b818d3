"""The options and the notes of one conversion from or to a file of another program.

Every reader of this package takes an `Exchange`, builds its thrusters by it, so that all readers
have the same defaults, and leaves a sentence in it for each value that was assumed or dropped.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from finlab.actuators.thrust_model import PowerLaw
from finlab.arrays import Array
from finlab.axes import Vector3
from finlab.errors import LayoutError
from finlab.exchange.notes import Note
from finlab.exchange.questions import Choice, Question
from finlab.layout import Layout, Thruster

T200_FORCE = (-39.91, 51.44)
"""Least and most force of a Blue Robotics T200 at 16 V [N], by the maker's table."""
KNOWN_THRUSTERS: dict[str, tuple[float, float]] = {
    "T200 at 12 V": (-28.48, 36.42),
    "T200 at 16 V": T200_FORCE,
    "T200 at 20 V": (-49.38, 65.92),
}
"""Least and most force of thrusters by their makers' tables [N]; the T200 is Blue Robotics'."""
T200_POWER = PowerLaw(0.997, 1.449)
"""A fit of that table's electric power over force: 0.997 F^1.5 ahead, 1.449 |F|^1.5 astern [W]."""
WHICH_FORCE = Question(
    "missing_force",
    "How strong are the thrusters?",
    "The file has no limits of their forces, or not of all: these are for those without.",
    tuple(
        Choice(name, f"Blue Robotics {name}", f"{low:g} to {high:g} N")
        for name, (low, high) in KNOWN_THRUSTERS.items()
    ),
    ("T200 at 16 V",),
    takes_numbers=True,
)
"""The question for the force of thrusters."""
NO_TORQUE = 1e-12
"""Reaction torque over the force up to which it is a rounding error [m]."""
TO_FRD = np.array([[1.0], [-1.0], [-1.0], [1.0], [-1.0], [-1.0]])
"""Signs (6, 1) that turn wrenches (6, n) from FLU (x forward, y left, z up) to FRD (x forward,
y right, z down), and back."""


@dataclass
class Exchange:
    """Defaults for what a file does not say, and notes on what was assumed or not written."""

    fins: Sequence[str] = ()
    """Links of a robot description that are fins."""
    thrusters: Sequence[str] = ()
    """Links that are thrusters, although no plugin drives their joint."""
    origin: Literal["gravity", "base"] = "gravity"
    """Where the layout's origin goes: the centre of gravity of all links, or the description's
    own."""
    force: tuple[float, float] | None = None
    """Least and most force of every thruster [N]; the file's, else those of a T200, when None."""
    missing_force: tuple[float, float] | None = None
    """Least and most force [N] of a thruster whose force the file does not say; of a T200 when
    None."""
    frame: Literal["FLU", "FRD"] | None = None
    """Frame of a matrix or of places; the file's, else FLU, when None."""
    rows: Literal["axes", "thrusters"] | None = None
    """What the rows of a matrix without labels are, where it may be both."""
    length: Literal["m", "cm", "mm"] | None = None
    """Unit of positions whose key names none; metres, if they may be, when None."""
    angle_unit: float | None = None
    """What an angle of 1 stands for where its key names no unit [rad]; set by the reader."""
    model: str | None = None
    """Name of the model to take from a robot description of several; the first with thrusters when
    None."""
    path: Path | None = None
    """The file; None for one from a browser, which may open no other."""
    taken: list[Note] = field(default_factory=list)
    """Notes for the user, in the order in which they arose."""

    @property
    def notes(self) -> list[str]:
        """The same as sentences, by the options of the command line and keys of layout files."""
        return [str(note) for note in self.taken]

    def note(
        self,
        sentence: str,
        remedy: str = "",
        *,
        field: str = "",
        actuators: Sequence[str] = (),
        question: Question | None = None,
    ) -> None:
        """Adds a note once; one that differs by its actuators alone gets these.

        Args:
            sentence: it, with or without a full stop.
            remedy: what the command line's user can do about it.
            field: as `Note` has it, like the others.
            actuators: names of those that the field is of; all of them when empty.
            question: the question whose default was taken.
        """
        made = Note(sentence.removesuffix("."), remedy, field, tuple(actuators), question)
        for place, known in enumerate(self.taken):
            if (known.sentence, known.remedy) == (made.sentence, made.remedy):
                names = dict.fromkeys((*known.actuators, *made.actuators))
                self.taken[place] = replace(known, actuators=tuple(names))
                return
        self.taken.append(made)

    def thruster(
        self,
        name: str,
        position: Array,
        axis: Array,
        force: tuple[float, float] | None,
        torque_per_newton: float = 0.0,
    ) -> Thruster:
        """Returns a thruster with the power of a T200, in the frame of the layout.

        Args:
            name: its name.
            position: where its force acts, (3,) [m].
            axis: direction of a positive force, a unit vector (3,).
            force: least and most force of the file [N]; None where it says none.
            torque_per_newton: reaction torque about the axis over the force [m].

        Raises:
            LayoutError: a value is out of bounds.
        """
        if self.force is None and self.missing_force is None and force is None:
            self.note(
                "It has no limits of force: those of a T200 at 16 V are taken",
                "correct `force_n`",
                field="force",
                actuators=(name,),
                question=WHICH_FORCE,
            )
        self.note(
            "It has no power: that of a T200 at 16 V is taken",
            "write your own as `model`",
            field="model",
            actuators=(name,),
        )
        return Thruster(
            name,
            vector(position),
            vector(axis),
            self.force or force or self.missing_force or T200_FORCE,
            T200_POWER,
            torque_per_newton=torque_per_newton if abs(torque_per_newton) > NO_TORQUE else 0.0,
        )

    def thruster_of_column(
        self, name: str, column: Array, limits: tuple[float, float] | None
    ) -> Thruster:
        """Returns the thruster that has a given column of an allocation matrix.

        A column (f, t) fixes the line of the force, and not the place on it. With the axis
        a = f / |f| and tau = t / |f|, the point of the line nearest to the origin is a x tau, and
        the reaction torque per newton is the component a . tau along the axis.

        Args:
            name: its name.
            column: wrench per unit of its command, (6,) [N, N m].
            limits: least and most command; None where the file says none.

        Raises:
            LayoutError: the column holds no force.
        """
        force_per_command = float(np.linalg.norm(column[:3]))
        if not 1e-9 < force_per_command < 1e9:
            raise LayoutError(
                f"{name!r:.60} has no force; no actuator of finlab gives torque alone"
            )
        self.note(
            "It has no places: thrusters sit where lines of their forces are nearest to the origin",
            field="position",
            actuators=(name,),
        )
        axis = column[:3] / force_per_command
        torque = column[3:] / force_per_command
        force = None
        if limits is not None:
            force = (limits[0] * force_per_command, limits[1] * force_per_command)
        position = np.cross(axis, torque)
        return self.thruster(name, position, axis, force, float(torque @ axis))

    def thrusters_of(self, layout: Layout, form: str, *not_written: str) -> Layout:
        """Returns the layout without the actuators that a format cannot hold: all but thrusters.

        Args:
            layout: the layout to write.
            form: the format, as the sentences name it.
            not_written: properties of thrusters that it cannot hold, besides power and rates.

        Raises:
            LayoutError: there is no thruster.
        """
        names = {thruster.name for thruster in thrusters_in(layout)}
        kinds = {
            actuator.name: actuator.type
            for actuator in layout.actuators
            if actuator.name not in names
        }
        if len(kinds) == layout.n:
            within = form.replace("A ", "a ", 1) if form.startswith("A ") else form
            raise LayoutError(
                f"layout {layout.name} has no thruster, and {within} has a place for these alone"
            )
        if kinds:
            left_out = ", ".join(f"{name} ({kind})" for name, kind in kinds.items())
            self.note(f"{form} has a place for thrusters alone; left out are {left_out}.")
        properties = ", ".join(("power", "dead bands", "rates", *not_written))
        self.note(f"{form} has no place for {properties}.")
        return layout.without(kinds) if kinds else layout


def thrusters_in(layout: Layout) -> tuple[Thruster, ...]:
    """Returns the actuators of a layout that are thrusters, in order."""
    return tuple(actuator for actuator in layout.actuators if isinstance(actuator, Thruster))


def vector(values: Array) -> Vector3:
    """Returns an array (3,) as a tuple of floats; rounding errors of 0 become 0."""
    x, y, z = (0.0 if abs(value) < 1e-15 else float(value) for value in values)
    return x, y, z
