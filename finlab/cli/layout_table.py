"""A layout in words and a table: what it is, and its actuators."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from finlab.layout import Actuator, Fin, Layout

PLACE = ("x [m]", "y [m]", "z [m]")
COLUMNS = ("actuator", "type", *PLACE, "direction", "limits")
FIN_COLUMNS = (
    "fin",
    *PLACE,
    "angle [deg]",
    "A max [rad]",
    "f max [Hz]",
    "directions [deg]",
    "model",
)
"""Columns for fins with horizontal shafts."""


def counted(layout: Layout) -> str:
    """How many actuators there are of each type, such as `4 fins and 2 thrusters`."""
    counts = Counter(part.type for part in layout.actuators)
    return " and ".join(f"{n} {kind}s" for kind, n in counts.items())


def layout_text(layout: Layout) -> str:
    """A layout in words, and a table of its actuators; of fins alone where all shafts are horizontal."""
    from finlab.cli.score_card import table

    horizontal = layout.is_of_fins and all(fin.mounting_angle is not None for fin in layout.fins)
    if horizontal:
        lines = table(FIN_COLUMNS, [_fin_row(fin) for fin in layout.fins])
    else:
        lines = table(COLUMNS, [_row(part) for part in layout.actuators])
    title = f"{layout.name}: {layout.description}" if layout.description else layout.name
    return "\n".join([title, "", *lines])


def _fin_row(fin: Fin) -> tuple[str, ...]:
    largest = (f"{fin.limits.amplitude[1]:.3f}", f"{fin.limits.frequency[1]:.3f}")
    directions = _arc(*fin.limits.zero_direction)
    angle = f"{math.degrees(fin.shaft_azimuth):.1f}"
    return (fin.name, *_place(fin), angle, *largest, directions, fin.model.type)


def _row(part: Actuator) -> tuple[str, ...]:
    return (part.name, part.type, *_place(part), _direction(part), _limits(part))


def _place(part: Actuator) -> tuple[str, ...]:
    return tuple(f"{value:6.3f}" for value in part.position)


def _direction(part: Actuator) -> str:
    """Where an actuator points: the axes that its file gives, in the body frame."""
    from finlab.layout import Azimuth, Fin, Rudder

    if isinstance(part, Fin) and part.mounting_angle is not None:
        return f"shaft at {math.degrees(part.mounting_angle):.1f} deg"
    first, second, _ = part.frame
    if isinstance(part, Fin | Rudder):
        return f"shaft {_vector(first)}, zero {_vector(second)}"
    if isinstance(part, Azimuth):
        return f"turns about {_vector(first)}, zero {_vector(second)}"
    return f"axis {_vector(first)}"


def _limits(part: Actuator) -> str:
    """What an actuator may be commanded, in words."""
    from finlab.layout import Azimuth, Fin, Rudder

    if isinstance(part, Rudder):
        return f"{_arc(*part.deflection)} deg, {part.area:g} m^2"
    if isinstance(part, Fin):
        (a, b), (c, d) = part.limits.amplitude, part.limits.frequency
        arc = _arc(*part.limits.zero_direction, unit=" deg")
        return f"A {a:g}..{b:g} rad, f {c:g}..{d:g} Hz, {arc}, {part.model.type}"
    low, high = part.force
    force = f"{low:g}..{high:g} N, {part.model.type}"
    return f"{_arc(*part.arc, unit=' deg')}, {force}" if isinstance(part, Azimuth) else force


def _arc(low: float, high: float, unit: str = "") -> str:
    """An arc [rad] in degrees."""
    low, high = math.degrees(low), math.degrees(high)
    if high - low >= 360.0 - 1e-6:
        return "any direction" if unit else "any"
    return f"{low:.0f}..{high:.0f}{unit}"


def _vector(values: Iterable[float]) -> str:
    return f"({', '.join(f'{value:.3g}' for value in values)})"
