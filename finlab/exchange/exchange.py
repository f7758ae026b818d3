"""One exchange: what is taken where a file of others is silent, and the sentences on what was
lost."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from finlab.actuators.thrust_model import PowerLaw
from finlab.arrays import Array
from finlab.axes import Vector3
from finlab.errors import LayoutError
from finlab.layout import Layout, Thruster

T200_FORCE, T200_POWER = (-39.91, 51.44), PowerLaw(0.997, 1.449)
"""Least and most force [N] of a Blue Robotics T200 at 16 V (the maker's table), and a fit of its
power."""
TO_FRD = np.array([[1.0], [-1.0], [-1.0], [1.0], [-1.0], [-1.0]])
"""Turns wrenches (6, n) from x forward, y left, z up to x forward, y right, z down, or back."""


@dataclass
class Exchange:
    """What a reader takes where the file is silent, and notes of what it took or could not
    write."""

    fins: Sequence[str] = ()
    """Links of a robot description that are fins."""
    thrusters: Sequence[str] = ()
    """Links that are thrusters, although no plugin drives their joint."""
    origin: Literal["gravity", "base"] = "gravity"
    """Where the layout's origin goes: the centre of gravity of all links, or the description's
    own."""
    force: tuple[float, float] | None = None
    """Least and most force of every thruster [N]; the file's, else those of a T200, when None."""
    frame: Literal["FLU", "FRD"] | None = None
    """Frame of a matrix or of places; the file's, else FLU, when None."""
    rows: Literal["axes", "thrusters"] | None = None
    """What the rows of a matrix without labels are, where it may be both."""
    model: str | None = None
    """Name of the model to take from a robot description of several; the first with thrusters when
    None."""
    path: Path | None = None
    """The file; None for one from a browser, which may open no other."""
    notes: list[str] = field(default_factory=list)
    """Sentences."""

    def note(self, sentence: str) -> None:
        """Adds a sentence once."""
        if sentence not in self.notes:
            self.notes.append(sentence)

    def thruster(
        self,
        name: str,
        place: Array,
        axis: Array,
        force: tuple[float, float] | None,
        reaction: float = 0.0,
    ) -> Thruster:
        """Returns a thruster by its place (3,) [m], axis (3,), the file's force [N], None where it
        says none, and its reaction torque per newton [m]. Raises LayoutError: a value is out of
        bounds."""
        if self.force is None and force is None:
            self.note(
                "It has no limits of force: those of a T200 at 16 V are taken; correct `force_n`."
            )
        self.note("It has no power: that of a T200 at 16 V is taken; write your own as `model`.")
        ends = self.force or force or T200_FORCE
        return Thruster(
            name, vector(place), vector(axis), ends, T200_POWER, torque_per_newton=reaction
        )

    def of_column(self, name: str, column: Array, force: tuple[float, float] | None) -> Thruster:
        """Returns the thruster whose wrench per unit of its command is `column` (6,) [N, N m];
        `force` has the limits of the command. It sits on the line of its force nearest to the
        origin. Raises LayoutError: the column holds no force."""
        size = float(np.linalg.norm(column[:3]))
        if not 1e-9 < size < 1e9:
            raise LayoutError(
                f"{name!r:.60} has no force; no actuator of finlab gives torque alone"
            )
        self.note(
            "It has no places: thrusters sit where lines of their forces are nearest to the origin."
        )
        axis = column[:3] / size
        torque = column[3:] / size
        ends = None if force is None else (force[0] * size, force[1] * size)
        return self.thruster(name, np.cross(axis, torque), axis, ends, float(torque @ axis))

    def thrusters_of(self, layout: Layout, form: str, *lost: str) -> Layout:
        """Returns a layout's thrusters alone, for a form with no place for others, nor for what is
        `lost`. Raises LayoutError: there is none."""
        others = {
            part.name: part.type for part in layout.actuators if not isinstance(part, Thruster)
        }
        if len(others) == layout.n:
            raise LayoutError(
                f"layout {layout.name} has no thruster, and {form} has a place for these alone"
            )
        if others:
            left = ", ".join(f"{name} ({kind})" for name, kind in others.items())
            self.note(f"{form} has a place for thrusters alone; left out are {left}.")
        self.note(f"{form} has no place for {', '.join(('power', 'dead bands', 'rates', *lost))}.")
        return layout.without(others) if others else layout


def vector(values: Array) -> Vector3:
    """Returns numbers (3,) as plain ones; rounding errors of 0 become 0."""
    x, y, z = (0.0 if abs(value) < 1e-15 else float(value) for value in values)
    return x, y, z
