"""Changes of a layout that a designer makes by hand. Each takes a layout and returns another
one."""

import math
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from finlab.actuators.kinds import KINDS
from finlab.analysis.moves import is_mirrored
from finlab.arrays import Array
from finlab.axes import Vector3, rotation, wrapped
from finlab.errors import FinlabError
from finlab.layout import Actuator, Body, Fin, Layout
from finlab.layout.body import HULL_SHAPES, Hull
from finlab.layout.layout import MAX_ACTUATORS
from finlab.swim.hull import hull_of
from webapp.session.state import Links, chosen, number, numbers

UNTOUCHED = 1e-6
"""Change [m], [rad] up to which a coordinate or an angle counts as left alone: a page's own
rounding."""
MAX_COORDINATE = 10.0
"""How far out an actuator may be placed in the browser [m]."""
CLOSE = 0.005
"""How far [m, rad] an actuator may be from another one's mirror image to count as it."""
CLEAR, STEP_UP = 0.12, 0.05
"""How far a new fin, and a copy, stands from all others if there is room [m]."""
ROUND = (180, 150, -150, 120, -120, 90, -90, 60, -60, 30, -30, 0)
"""Directions [deg] in which a new fin is put, the stern first."""
STAND_OFF = 0.02
"""Distance of a new actuator from the hull: room for the servo [m]."""

DYNAMICS = tuple(field.name for field in fields(Body) if field.name != "hull")


def moved(layout: Layout, name: str, position: Vector3) -> Layout:
    """An actuator at another place [m]."""
    place = numbers(position, f"of {name} [m]", -MAX_COORDINATE, MAX_COORDINATE)
    return layout.replace_actuator(name, position=place)


def turned(layout: Layout, name: str, angle: float) -> Layout:
    """A fin with a horizontal shaft, with another mounting angle [rad]."""
    checked = number(angle, f"mounting angle of {name} [rad]", -100.0, 100.0)
    part = layout.part(name)
    if not isinstance(part, Fin) or part.mounting_angle is None:
        raise FinlabError(f"{name} has no mounting angle; give a direction")
    same = abs(math.remainder(checked - part.mounting_angle, math.tau)) <= UNTOUCHED
    return layout if same else layout.replace_actuator(name, mounting_angle=float(wrapped(checked)))


def pointed(layout: Layout, name: str, direction: Vector3) -> Layout:
    """An actuator along a direction of any length, see `Actuator.facing`."""
    x, y, z = (number(v, f"direction of {name}", -1e6, 1e6) for v in direction)
    return layout.with_part(layout.part(name).facing((x, y, z)))


def keeping_hull(before: Layout, after: Layout) -> Layout:
    """A layout after an edit, with the hull that was drawn before where none is described: one that
    is made to fit the fins would stretch with each of them."""
    if any(layout.body is not None and layout.body.hull is not None for layout in (after, before)):
        return after
    return with_hull(after, _drawn_hull(before))


def mirrored(layout: Layout, name: str) -> tuple[Layout, str]:
    """The layout with an actuator's image on the other side of the robot, and the image's name. One
    that already stands there is taken for the image, and nothing is added."""
    part = layout.part(name)
    if abs(part.position[1]) < 1e-3:
        raise FinlabError(f"{name} sits on the mirror plane (y = 0), so its mirror image is itself")
    others = (other for other in layout.actuators if other.name != name)
    there = next((other.name for other in others if is_mirrored(part, other, CLOSE)), None)
    return (
        (layout, there) if there is not None else _added(layout, part.image(), _mirror_name(name))
    )


def ring(layout: Layout, name: str, count: int, around: str) -> Layout:
    """The layout with copies of an actuator, so that `count` of them stand evenly around a body
    axis. FinlabError: the actuator stands on the axis, or there is no such axis."""
    part = layout.part(name)
    axis = np.eye(3)["xyz".index(chosen(around, "axis", tuple("xyz")))]
    if np.linalg.norm(np.cross(axis, part.position)) < 1e-3:
        raise FinlabError(
            f"{name} stands on the {around} axis, so its copies would all be in one place"
        )
    all_of_them = round(number(count, "copies around the axis", 2, MAX_ACTUATORS))
    for k in range(1, all_of_them):
        layout, _ = _added(layout, _rotated(part, axis, math.tau * k / all_of_them), name)
    return layout


def _rotated(part: Actuator, axis: Array, angle: float) -> Actuator:
    """The actuator turned about an axis (3,) of the body by an angle [rad], place and own axes
    alike."""
    turn = rotation(axis, angle)
    return part.turned(np.array(part.frame) @ turn.T, turn @ np.array(part.position))


def duplicated(layout: Layout, name: str) -> tuple[Layout, str]:
    """The layout with a copy of an actuator above it, 5 cm or the first place that is free, and its
    name."""
    part = layout.part(name)
    x, y, z = part.position
    places = ((x, y, round(z + STEP_UP * k, 9)) for k in range(1, MAX_ACTUATORS + 1))
    return _added(
        layout,
        replace(part, position=next(p for p in places if _is_free(layout, p, STEP_UP))),
        name,
    )


def added(layout: Layout, kind: str) -> tuple[Layout, str]:
    """The layout with one more actuator on the hull, and its name: at the stern, or where there is
    room. A fin's shaft points away from the hull; the others push or steer ahead."""
    part: Actuator = KINDS[chosen(kind, "actuator", KINDS)].sample()
    hull = hull_of(layout)
    far = 4.0 * max(hull.half)
    for clear in (CLEAR, STEP_UP, 0.0):
        for degrees in ROUND:
            way = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0.0])
            point, normal = hull.nearest(np.array(hull.center) + far * way)
            x, y, z = (round(float(v), 4) + 0.0 for v in point + STAND_OFF * normal)
            if _is_free(layout, (x, y, z), clear):
                out = normal if math.hypot(*normal[:2]) > 0.2 else way
                placed = replace(part, position=(x, y, z))
                if isinstance(placed, Fin):
                    placed = replace(placed, mounting_angle=math.atan2(out[1], out[0]))
                return _added(layout, placed, kind)
    raise AssertionError("no place is free")


def blank(kind: str) -> Layout:
    """A robot to begin with: a round hull, and one actuator of a type on its left."""
    part = replace(
        KINDS[chosen(kind, "actuator", KINDS)].sample(), name="left", position=(0.0, 0.17, 0.0)
    )
    if isinstance(part, Fin):
        part = replace(part, mounting_angle=math.pi / 2)
    return Layout(
        "New robot", (part,), body=Body(hull=Hull(shape="ellipsoid", size_m=(0.5, 0.3, 0.2)))
    )


def _is_free(layout: Layout, position: Vector3, clear: float) -> bool:
    """Whether all actuators are at least so far [m] from a place."""
    return all(math.dist(part.position, position) >= clear - 1e-9 for part in layout.actuators)


def deleted(layout: Layout, names: Sequence[str]) -> Layout:
    """The layout without some actuators; one at least stays."""
    layout.indices(names)
    if layout.n == len(set(names)):
        only = f"{names[0]} is the only actuator" if layout.n == 1 else "these are all actuators"
        raise FinlabError(f"{only}; a layout needs at least one")
    return layout.without(names)


def _added(layout: Layout, part: Actuator, wanted: str) -> tuple[Layout, str]:
    if layout.n >= MAX_ACTUATORS:
        raise FinlabError(
            f"the layout has {layout.n} actuators already; expected at most {MAX_ACTUATORS}"
        )
    stem = wanted[:56]
    names = (stem, *(f"{stem}_{k}" for k in range(2, MAX_ACTUATORS + 2)))
    name = next(name for name in names if name not in layout.names)
    return replace(layout, actuators=(*layout.actuators, replace(part, name=name))), name


def _mirror_name(name: str) -> str:
    for left, right in (("left", "right"), ("port", "starboard")):
        if left in name:
            return name.replace(left, right)
        if right in name:
            return name.replace(right, left)
    return f"{name}_mirror"


def shaped(layout: Layout, shape: str, size: Vector3) -> Layout:
    """The layout with a parametric hull of a size [m]; its centre stays where it is."""
    chosen(shape, "hull", HULL_SHAPES)
    checked = numbers(size, "of the hull [m]", 0.02, 5.0, ("length", "width", "height"))
    return with_hull(layout, Hull(shape=shape, size_m=checked, center_m=hull_of(layout).center))


def with_hull(layout: Layout, hull: Hull) -> Layout:
    """The layout with a hull; everything else about its body stays."""
    return replace(layout, body=replace(layout.body or Body(), hull=hull))


def _drawn_hull(layout: Layout) -> Hull:
    """The hull that is drawn where none is described."""
    drawn = hull_of(layout)
    return Hull(shape=drawn.shape, size_m=tuple(2 * v for v in drawn.half), center_m=drawn.center)


def center_of_gravity(layout: Layout) -> Vector3:
    """Where the centre of gravity lies as seen from the hull's middle [m]."""
    x, y, z = hull_of(layout).center
    return -x + 0.0, -y + 0.0, -z + 0.0


def balanced(layout: Layout, center: Vector3) -> Layout:
    """The layout with the centre of gravity at a place in the hull [m]. The body frame has its
    origin there, so hull, actuators and the centre of buoyancy move the other way."""
    checked = numbers(center, "of the centre of gravity [m]", -2.0, 2.0)
    x, y, z = np.subtract(center_of_gravity(layout), checked).tolist()

    def moved(point: tuple[float, ...]) -> Vector3:
        return point[0] + x, point[1] + y, point[2] + z

    body = layout.body or Body()
    hull = replace(body.hull or _drawn_hull(layout), center_m=moved(hull_of(layout).center))
    buoyancy = body.center_of_buoyancy_m
    body = replace(
        body, hull=hull, center_of_buoyancy_m=None if buoyancy is None else moved(buoyancy)
    )
    parts = tuple(replace(part, position=moved(part.position)) for part in layout.actuators)
    return replace(layout, actuators=parts, body=body)


def with_dynamics(layout: Layout, **values: Any) -> Layout:
    """The layout with other fields of `DYNAMICS` of its body; None forgets one."""
    for key in values:
        chosen(key, "field of the body", DYNAMICS)
    return replace(layout, body=replace(layout.body or Body(), **values))


def modelled(part: Actuator, kind: str) -> Actuator:
    """The actuator with another kind of model, see `Actuator.with_model`; as it is where its kind
    has no such one. FinlabError: there is no such model, or it needs a file."""
    if not part.KIND.models or kind == part.model_type:
        return part
    if kind == "table":
        raise FinlabError(
            f"a table for {part.name} comes from a file; drop its CSV, or fit measurements"
        )
    chosen(kind, "model", [model for own in KINDS.values() for model in own.KIND.models])
    return part.with_model(kind) if kind in part.KIND.models else part


def partner(links: Links, name: str) -> str | None:
    """The actuator that `name` is linked to, if any."""
    return next((pair[1 - pair.index(name)] for pair in links if name in pair), None)


def unlinked(links: Links, name: str) -> Links:
    """The links without the pair of an actuator."""
    return tuple(pair for pair in links if name not in pair)


def followed(before: Layout, layout: Layout, links: Links, name: str) -> Layout:
    """The layout after the twin of `name`, if any, took its mirrored place; axes that pointed the
    other way than the image's `before` stay so."""
    twin = partner(links, name)
    if twin is None or twin not in layout.names:
        return layout
    wanted = layout.part(name).image()
    old = layout.part(twin)
    count = len(old.KIND.axes)
    past = np.sum(np.array(before.part(name).image().frame) * before.part(twin).frame, axis=1)
    frame = np.array(wanted.frame) * np.where(past < 0.0, -1.0, 1.0)[:, None]
    return layout.with_part(old.turned(frame[:count], wanted.position))
