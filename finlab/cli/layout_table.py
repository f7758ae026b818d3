"""A layout in words and a table: what it is, and its actuators."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from finlab.layout import Actuator, Layout

COLUMNS = ("actuator", "type", "x [m]", "y [m]", "z [m]", "direction", "limits")


def layout_text(layout: Layout) -> str:
    """A layout in words, and a table of its actuators."""
    from finlab.cli.score_card import table

    rows = [
        (part.name, part.type, *(f"{x:6.3f}" for x in part.position), direction_text(part), _limits(part))
        for part in layout.actuators
    ]
    title = f"{layout.name}: {layout.description}" if layout.description else layout.name
    return "\n".join([title, "", *table(COLUMNS, rows)])


def direction_text(part: Actuator) -> str:
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
        return f"{_arc(*part.deflection)}, {part.area:g} m^2"
    if isinstance(part, Fin):
        (a, b), (c, d) = part.limits.amplitude, part.limits.frequency
        arc = _arc(*part.limits.zero_direction)
        return f"A {a:g}..{b:g} rad, f {c:g}..{d:g} Hz, {arc}, {part.model.type}"
    low, high = part.force
    force = f"{low:g}..{high:g} N, {part.model.type}"
    return f"{_arc(*part.arc)}, {force}" if isinstance(part, Azimuth) else force


def _arc(low: float, high: float) -> str:
    """An arc [rad] in degrees."""
    low, high = math.degrees(low), math.degrees(high)
    return "any direction" if high - low >= 360.0 - 1e-6 else f"{low:.0f}..{high:.0f} deg"


def _vector(values: Iterable[float]) -> str:
    return f"({', '.join(f'{value:.3g}' for value in values)})"
