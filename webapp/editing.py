"""Changes of a layout that a designer makes by hand. Each takes a layout and returns another one."""

import math
from dataclasses import replace

from finlab.errors import FinlabError
from finlab.layout import Fin, Layout
from webapp.state import MAX_FINS, number

MAX_COORDINATE = 2.0
"""How far out a fin may be placed in the browser [m]."""


def wrapped(angle: float) -> float:
    """The angle [rad] within (-pi, pi]."""
    return math.pi - (math.pi - angle) % (2 * math.pi)


def snapped(value: float, step: float) -> float:
    """The nearest multiple of `step`; a step of zero leaves the value alone."""
    return round(value / step) * step if step > 0 else value


def moved(layout: Layout, name: str, position: tuple[float, float, float], step: float = 0.0) -> Layout:
    """A fin at another place [m], snapped to multiples of `step` [m]."""
    checked = tuple(
        snapped(number(v, f"{axis} of {name} [m]", -MAX_COORDINATE, MAX_COORDINATE), step)
        for v, axis in zip(position, "xyz", strict=True)
    )
    return layout.replace_fin(name, position=checked)


def turned(layout: Layout, name: str, angle: float, step: float = 0.0) -> Layout:
    """A fin with another mounting angle [rad], snapped to multiples of `step` [rad]."""
    checked = number(angle, f"mounting angle of {name} [rad]", -100.0, 100.0)
    return layout.replace_fin(name, mounting_angle=wrapped(snapped(checked, step)))


def mirrored(layout: Layout, name: str) -> tuple[Layout, str]:
    """The layout with a copy of a fin on the other side of the robot, and the copy's name.

    The mirror is the xz plane: y changes sign, and so does the shaft's azimuth.
    """
    fin = layout.fins[layout.index(name)]
    x, y, z = fin.position
    if abs(y) < 1e-3:
        raise FinlabError(f"{name} sits on the mirror plane (y = 0), so its mirror image is itself")
    twin = replace(fin, position=(x, -y, z), mounting_angle=wrapped(-fin.mounting_angle))
    return _added(layout, twin, _mirror_name(name))


def duplicated(layout: Layout, name: str) -> tuple[Layout, str]:
    """The layout with a copy of a fin 5 cm above it, and the copy's name."""
    fin = layout.fins[layout.index(name)]
    x, y, z = fin.position
    return _added(layout, replace(fin, position=(x, y, z + 0.05)), name)


def added(layout: Layout) -> tuple[Layout, str]:
    """The layout with one more fin at the stern, and its name."""
    reach = max(abs(fin.position[0]) for fin in layout.fins)
    return _added(layout, Fin("fin", (-max(reach, 0.1), 0.0, 0.0), math.pi), "fin")


def deleted(layout: Layout, name: str) -> Layout:
    """The layout without a fin; the last one stays."""
    layout.index(name)
    if layout.n_fins == 1:
        raise FinlabError(f"{name} is the only fin; a layout needs at least one")
    return layout.without([name])


def _added(layout: Layout, fin: Fin, wanted: str) -> tuple[Layout, str]:
    if layout.n_fins >= MAX_FINS:
        raise FinlabError(f"the layout has {layout.n_fins} fins already; the app places at most {MAX_FINS}")
    name = _free_name(layout, wanted)
    return replace(layout, fins=(*layout.fins, replace(fin, name=name))), name


def _free_name(layout: Layout, wanted: str) -> str:
    """`wanted`, or `wanted_2`, `wanted_3`, ... if it is taken."""
    names, k = set(layout.names), 2
    name = wanted[:56]
    while name in names:
        name, k = f"{wanted[:56]}_{k}", k + 1
    return name


def _mirror_name(name: str) -> str:
    for left, right in (("left", "right"), ("port", "starboard")):
        if left in name:
            return name.replace(left, right)
        if right in name:
            return name.replace(right, left)
    return f"{name}_mirror"
