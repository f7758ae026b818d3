"""Changes of a layout that a designer makes by hand. Each takes a layout and returns another one."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from finlab.errors import FinlabError
from finlab.layout import Body, Fin, FinModelSpec, Layout
from finlab.layout.angles import wrapped
from finlab.layout.body import HULL_SHAPES, Hull
from finlab.layout.layout import MAX_ACTUATORS
from webapp.scene.meshes.hull import hull_of
from webapp.session.links import existing_image, image
from webapp.session.state import chosen, number

UNTOUCHED = 1e-6
"""Change [m], [rad] up to which a coordinate or an angle counts as left alone: a page's own rounding."""
MAX_COORDINATE = 2.0
"""How far out a fin may be placed in the browser [m]."""
CLEAR, STEP_UP = 0.12, 0.05
"""How far a new fin, and a copy, stands from all others if there is room [m]."""
ROUND = (180, 150, -150, 120, -120, 90, -90, 60, -60, 30, -30, 0)
"""Directions [deg] in which a new fin is put, the stern first."""
STAND_OFF = 0.02
"""Distance of a fin that sticks to the hull from its surface: room for the servo [m]."""

Vector = tuple[float, float, float]


def moved(layout: Layout, name: str, position: Vector) -> Layout:
    """A fin at another place [m]."""
    checked = [
        number(value, f"{axis} of {name} [m]", -MAX_COORDINATE, MAX_COORDINATE)
        for value, axis in zip(position, "xyz", strict=True)
    ]
    return layout.replace_actuator(name, position=tuple(checked))


def turned(layout: Layout, name: str, angle: float) -> Layout:
    """A fin with another mounting angle [rad]."""
    checked = number(angle, f"mounting angle of {name} [rad]", -100.0, 100.0)
    now = layout.fins[layout.index(name)].shaft_azimuth
    same = abs(math.remainder(checked - now, math.tau)) <= UNTOUCHED
    return layout.replace_actuator(name, mounting_angle=now if same else float(wrapped(checked)))


def keeping_hull(before: Layout, after: Layout) -> Layout:
    """A layout after an edit, with the hull that was drawn before where none is described.

    One that is made to fit the fins would stretch with each of them.
    """
    if after.body is not None and after.body.hull is not None:
        return after
    if before.body is not None and before.body.hull is not None:
        return after
    drawn = hull_of(before)
    x, y, z = drawn.half
    return with_hull(after, Hull(shape=drawn.shape, size_m=(2 * x, 2 * y, 2 * z), center_m=drawn.center))


def mirrored(layout: Layout, name: str) -> tuple[Layout, str]:
    """The layout with a fin's image on the other side of the robot, and the image's name.

    A fin that already stands there is taken for the image, and nothing is added.
    """
    fin = layout.fins[layout.index(name)]
    if abs(fin.position[1]) < 1e-3:
        raise FinlabError(f"{name} sits on the mirror plane (y = 0), so its mirror image is itself")
    there = existing_image(layout, name)
    return (layout, there) if there is not None else _added(layout, image(fin), _mirror_name(name))


def ring(layout: Layout, name: str, count: int) -> Layout:
    """The layout with copies of a fin, so that `count` of them stand evenly around the vertical body axis.

    Raises:
        FinlabError: the fin stands on the axis.
    """
    fin = layout.fins[layout.index(name)]
    x, y, z = fin.position
    if math.hypot(x, y) < 1e-3:
        raise FinlabError(f"{name} stands on the vertical axis, so its copies would all be in one place")
    whole = round(number(count, "fins around the axis", 2, MAX_ACTUATORS))
    for k in range(1, whole):
        turn = 2 * math.pi * k / whole
        c, s = math.cos(turn), math.sin(turn)
        place = round(c * x - s * y, 9), round(s * x + c * y, 9), z
        azimuth = float(wrapped(fin.shaft_azimuth + turn))
        layout, _ = _added(layout, replace(fin, position=place, mounting_angle=azimuth), name)
    return layout


def stuck(layout: Layout, name: str) -> Layout:
    """The layout with a fin moved onto the hull's surface, its shaft along the surface's normal.

    Shafts are horizontal, so of the normal only the azimuth is taken; where it points straight up or down
    the shaft stays.
    """
    fin = layout.fins[layout.index(name)]
    point, normal = hull_of(layout).nearest(np.array(fin.position))
    azimuth = fin.shaft_azimuth if np.hypot(*normal[:2]) < 0.2 else math.atan2(normal[1], normal[0])
    x, y, z = (round(float(v), 4) for v in point + STAND_OFF * normal)
    return layout.replace_actuator(name, position=(x, y, z), mounting_angle=float(wrapped(azimuth)))


def duplicated(layout: Layout, name: str) -> tuple[Layout, str]:
    """The layout with a copy of a fin above it, 5 cm or the first place that is free, and the copy's name."""
    fin = layout.fins[layout.index(name)]
    x, y, z = fin.position
    places = ((x, y, round(z + STEP_UP * k, 9)) for k in range(1, MAX_ACTUATORS + 1))
    return _added(
        layout, replace(fin, position=next(p for p in places if _is_free(layout, p, STEP_UP))), name
    )


def added(layout: Layout) -> tuple[Layout, str]:
    """The layout with one more fin on the hull, and its name: at the stern, or where there is room."""
    hull = hull_of(layout)
    far = 4.0 * max(hull.half)
    for clear in (CLEAR, STEP_UP, 0.0):
        for degrees in ROUND:
            way = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0.0])
            point, normal = hull.nearest(np.array(hull.center) + far * way)
            x, y, z = (round(float(v), 4) + 0.0 for v in point + STAND_OFF * normal)
            if _is_free(layout, (x, y, z), clear):
                azimuth = (
                    math.atan2(normal[1], normal[0])
                    if math.hypot(*normal[:2]) > 0.2
                    else math.radians(degrees)
                )
                return _added(layout, Fin("fin", (x, y, z), float(wrapped(azimuth))), "fin")
    raise AssertionError("no place is free")


def blank() -> Layout:
    """A robot to begin with: a round hull, and a fin on its left that pushes ahead, back, up and down."""
    hull = Hull(shape="ellipsoid", size_m=(0.5, 0.3, 0.2))
    fin = Fin("left", (0.0, 0.15 + STAND_OFF, 0.0), math.pi / 2)
    return Layout("New robot", (fin,), body=Body(hull=hull))


def _is_free(layout: Layout, position: Vector, clear: float) -> bool:
    """Whether all fins are at least so far [m] from a place."""
    return all(math.dist(fin.position, position) >= clear - 1e-9 for fin in layout.fins)


def deleted(layout: Layout, names: Sequence[str]) -> Layout:
    """The layout without some fins; one at least stays."""
    layout.indices(names)
    if layout.n_fins == len(set(names)):
        only = f"{names[0]} is the only fin" if layout.n_fins == 1 else "these are all fins"
        raise FinlabError(f"{only}; a layout needs at least one")
    return layout.without(names)


def _added(layout: Layout, fin: Fin, wanted: str) -> tuple[Layout, str]:
    if layout.n_fins >= MAX_ACTUATORS:
        raise FinlabError(f"the layout has {layout.n_fins} fins already; expected at most {MAX_ACTUATORS}")
    name = _free_name(layout, wanted)
    return replace(layout, actuators=(*layout.fins, replace(fin, name=name))), name


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


def with_model(layout: Layout, names: Sequence[str], model: FinModelSpec) -> Layout:
    """The layout with another model on some fins."""
    for name in names:
        layout = layout.replace_actuator(name, model=model)
    return layout


def shaped(layout: Layout, shape: str, size: Vector) -> Layout:
    """The layout with a parametric hull of a size [m]; its centre stays where it is."""
    chosen(shape, "hull", HULL_SHAPES)
    checked = tuple(
        number(v, f"{word} of the hull [m]", 0.02, 5.0)
        for v, word in zip(size, ("length", "width", "height"), strict=True)
    )
    return with_hull(layout, Hull(shape=shape, size_m=checked, center_m=hull_of(layout).center))


def with_hull(layout: Layout, hull: Hull) -> Layout:
    """The layout with a hull; everything else about its body stays."""
    return replace(layout, body=replace(layout.body or Body(), hull=hull))


def center_of_gravity(layout: Layout) -> Vector:
    """Where the centre of gravity lies as seen from the hull's middle [m]."""
    x, y, z = hull_of(layout).center
    return -x + 0.0, -y + 0.0, -z + 0.0


def balanced(layout: Layout, center: Vector) -> Layout:
    """The layout with the centre of gravity at a place in the hull [m].

    The body frame has its origin there, so hull, fins and the centre of buoyancy move the other way.
    """
    checked = [
        number(v, f"{axis} of the centre of gravity [m]", -2.0, 2.0)
        for v, axis in zip(center, "xyz", strict=True)
    ]
    x, y, z = np.subtract(center_of_gravity(layout), checked).tolist()

    def moved(point: tuple[float, ...]) -> Vector:
        return point[0] + x, point[1] + y, point[2] + z

    drawn = hull_of(layout)
    body = layout.body or Body()
    described = body.hull or Hull(shape=drawn.shape, size_m=tuple(2 * v for v in drawn.half))
    hull = replace(described, center_m=moved(drawn.center))
    buoyancy = body.center_of_buoyancy_m
    body = replace(body, hull=hull, center_of_buoyancy_m=None if buoyancy is None else moved(buoyancy))
    parts = tuple(replace(part, position=moved(part.position)) for part in layout.actuators)
    return replace(layout, actuators=parts, body=body)
