"""Files of a ship's particulars: what the loads and the thrust of DNV-ST-0111 are computed from.

A file is YAML or JSON with one block, `ship:`. Lengths are measured as in the standard ([2.8.2]):
x forward and y to port from the middle of the length between perpendiculars, z up from the keel.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, Struct

from finlab.errors import LayoutError
from finlab.files import parse_json, parse_yaml
from finlab.files.guarded import read_text
from finlab.files.schema import Name, checked

MAX_BYTES = 100_000
"""Largest file of a ship [bytes]; a real one has a few thousand."""

Positive = Annotated[float, Meta(gt=0.0, le=1e6)]
"""A length [m] or an area [m2]."""
Place = Annotated[float, Meta(ge=-1e3, le=1e3)]
"""A coordinate [m]."""
ActuatorType = Literal["azimuth", "pod", "cycloidal", "tunnel", "shaft_line"]
"""Types of actuators of the standard's tables."""


class Waterline(Struct, forbid_unknown_fields=True):
    """Form of the hull at and below the waterline."""

    length_m: Positive
    """Length over all of what is submerged, `Los`."""
    center_m: Place
    """Middle of that length, x."""
    aft_area_m2: Positive
    """Area of the waterplane behind the middle of the ship."""
    bow_angle_deg: Annotated[float, Meta(gt=0.0, le=90.0)]
    """Angle between the waterline and the centreline at the bow."""


class Wind(Struct, forbid_unknown_fields=True):
    """Projected areas above the water."""

    frontal_area_m2: Positive
    lateral_area_m2: Positive
    lateral_center_m: Place
    """Centre of the lateral area, x."""


class Current(Struct, forbid_unknown_fields=True):
    """Projected area below the water."""

    lateral_area_m2: Positive
    lateral_center_m: Place
    """Centre of the lateral area, x."""


class ShipActuator(Struct, forbid_unknown_fields=True):
    """What the standard asks of an actuator besides its place."""

    type: ActuatorType | None = None
    """None: an azimuth of the layout is an azimuth, a thruster across the ship a tunnel, one along
    it a shaft line."""
    diameter_m: Annotated[float, Meta(gt=0.0, le=50.0)] | None = None
    """Of its propeller; without it there are no losses by ventilation, flushing and skegs."""
    power_kw: Annotated[float, Meta(gt=0.0, le=1e6)] | None = None
    """Brake power in DP; the layout's limits of force are the nominal thrust where it is None."""
    height_m: Place | None = None
    """Height above the keel; without it there is no loss by ventilation."""
    pitch: Literal["fixed", "controllable"] = "fixed"
    ducted: bool = False
    contra_rotating: bool = False
    permanent_magnet: bool = False
    inlet: Literal["broken", "rounded", "other"] = "other"
    """Shape of a tunnel's inlet."""


class Ship(Struct, forbid_unknown_fields=True):
    """Particulars of a ship (DNV-ST-0111, Tables A-2 and A-3)."""

    length_pp_m: Positive
    """Length between perpendiculars, `Lpp`."""
    breadth_m: Positive
    draft_m: Positive
    waterline: Waterline
    wind: Wind
    current: Current
    midship_m: Place = 0.0
    """x of the middle of `Lpp` in the layout's frame."""
    skegs_m: tuple[tuple[Place, Place], ...] = ()
    """x and y of the aftmost point of each skeg."""
    actuators: dict[Name, ShipActuator] = {}
    """By their names in the layout."""
    groups: dict[Name, tuple[Name, ...]] = {}
    """Actuators that are lost together, such as those of a switchboard."""


class ShipFile(Struct, forbid_unknown_fields=True):
    """A file of a ship."""

    ship: Ship


def read_ship(path: str | os.PathLike[str]) -> Ship:
    """Returns the particulars in a file.

    Raises:
        LayoutError: it cannot be read, or a value does not fit; the message names file and key.
    """
    source = str(path)
    text = read_text(path, MAX_BYTES, "a file of a ship (.yaml or .json)", LayoutError)
    parse = parse_json if Path(source).suffix.lower() == ".json" else parse_yaml
    values = parse(text, source, LayoutError)
    return checked(values, ShipFile, LayoutError, source).ship
