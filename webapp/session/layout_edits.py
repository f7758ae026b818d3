"""Changes of a layout that a designer makes by hand. Each takes a layout and returns another one.

The intents of a session (`editing.py`) call them; what undo calls a change, and what is selected
after it, is decided there.
"""

import math
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from finlab.actuators.kinds import KINDS
from finlab.allocation.power_budget import MOST_WATTS
from finlab.analysis.moves import is_mirrored
from finlab.arrays import Array
from finlab.axes import Vector3, rotation, wrapped
from finlab.errors import FinlabError
from finlab.layout import Actuator, Body, Fin, Layout
from finlab.layout.body import HULL_SHAPES, Hull
from finlab.layout.layout import MAX_ACTUATORS
from finlab.swim.hull import hull_of
from webapp.session.state import number, numbers, one_of

UNTOUCHED = 1e-6
"""Change [m], [rad] up to which a coordinate or an angle counts as left alone: a page's own
rounding."""
MIN_RANGE = 10.0
"""How far out an actuator of any robot may be placed in the browser [m]."""
RANGE_SHARE = 2.0
"""How far out it may be placed on a large robot, over the largest coordinate of an actuator."""
MAX_RANGE = 1000.0
"""How far out an actuator of a layout file may be [m]."""
CLOSE = 0.005
"""How far [m, rad] an actuator may be from another one's mirror image to count as it."""
CLEARANCE = 0.12
"""How far a new actuator stands from all others if there is room [m]."""
STEP_UP = 0.05
"""How far above an actuator its copy stands if there is room [m]."""
AZIMUTHS = (180, 150, -150, 120, -120, 90, -90, 60, -60, 30, -30, 0)
"""Directions [deg] in which a new fin is put, the stern first."""
STAND_OFF = 0.02
"""Distance of a new actuator from the hull: room for the servo [m]."""

LEAST_BUDGET = 1e-6
"""Smallest power budget that the page may ask for [W]."""
DYNAMICS = tuple(field.name for field in fields(Body) if field.name != "hull")
"""Fields of a body that say how it moves."""


def moved(layout: Layout, name: str, position: Vector3) -> Layout:
    """The layout with an actuator at another position [m] in the body frame."""
    most = place_range(layout)
    checked = numbers(position, f"of {name} [m]", -most, most)
    return layout.replace_actuator(name, position=checked)


def place_range(layout: Layout) -> float:
    """Largest coordinate [m] to which an actuator of a robot may be moved in the browser: it
    follows the size of the robot, since 30 m are a slip of the hand on a small one."""
    farthest = float(np.abs(layout.position).max(initial=0.0))
    return min(max(MIN_RANGE, RANGE_SHARE * farthest), MAX_RANGE)


def with_mounting_angle(layout: Layout, name: str, angle: float) -> Layout:
    """The layout with a fin whose shaft is horizontal at another mounting angle [rad]."""
    checked = number(angle, f"mounting angle of {name} [rad]", -100.0, 100.0)
    actuator = layout.actuator(name)
    if not isinstance(actuator, Fin) or actuator.mounting_angle is None:
        raise FinlabError(f"{name} has no mounting angle; give a direction")
    change = math.remainder(checked - actuator.mounting_angle, math.tau)
    if abs(change) <= UNTOUCHED:
        return layout
    return layout.replace_actuator(name, mounting_angle=float(wrapped(checked)))


def pointed(layout: Layout, name: str, direction: Vector3) -> Layout:
    """The layout with an actuator along a direction of any length, see `Actuator.facing`. What the
    page's rounding has left of a component counts as none: [3e-7, 0, 1] is straight up."""
    checked = [number(value, f"direction of {name}", -1e6, 1e6) for value in direction]
    least = UNTOUCHED * max(abs(value) for value in checked)
    x, y, z = [value if abs(value) > least else 0.0 for value in checked]
    return layout.with_actuator(layout.actuator(name).facing((x, y, z)))


def keeping_hull(old_layout: Layout, layout: Layout) -> Layout:
    """A layout after an edit, with the hull that was drawn before where none is described: one that
    is made to fit the actuators would stretch with each of them.

    Args:
        old_layout: before the edit.
        layout: after it.
    """
    if _describes_hull(layout) or _describes_hull(old_layout):
        return layout
    return with_hull(layout, _drawn_hull(old_layout))


def _describes_hull(layout: Layout) -> bool:
    return layout.body is not None and layout.body.hull is not None


def mirrored(layout: Layout, name: str) -> tuple[Layout, str]:
    """The layout with an actuator's image on the other side of the robot, and the image's name. One
    that already stands there is taken for the image, and nothing is added."""
    actuator = layout.actuator(name)
    if abs(actuator.position[1]) < 1e-3:
        raise FinlabError(f"{name} sits on the mirror plane (y = 0), so its mirror image is itself")
    for other in layout.actuators:
        if other.name != name and is_mirrored(actuator, other, CLOSE):
            return layout, other.name
    return _added(layout, actuator.image(), _mirror_name(name))


def ring(layout: Layout, name: str, count: int, around: str) -> Layout:
    """The layout with copies of an actuator that stand evenly around a body axis.

    Args:
        layout: the robot.
        name: of the actuator.
        count: how many stand around the axis then, the actuator itself among them.
        around: the axis, "x", "y" or "z".

    Raises:
        FinlabError: the actuator stands on the axis, or there is no such axis.
    """
    actuator = layout.actuator(name)
    axis = np.eye(3)["xyz".index(one_of(around, "axis", tuple("xyz")))]
    if np.linalg.norm(np.cross(axis, actuator.position)) < 1e-3:
        raise FinlabError(
            f"{name} stands on the {around} axis, so its copies would all be in one place"
        )
    checked = round(number(count, "copies around the axis", 2, MAX_ACTUATORS))
    for k in range(1, checked):
        layout, _ = _added(layout, _rotated(actuator, axis, math.tau * k / checked), name)
    return layout


def _rotated(actuator: Actuator, axis: Array, angle: float) -> Actuator:
    """The actuator turned about an axis (3,) of the body by an angle [rad], place and own axes
    alike."""
    turn = rotation(axis, angle)
    return actuator.turned(np.array(actuator.frame) @ turn.T, turn @ np.array(actuator.position))


def duplicated(layout: Layout, name: str) -> tuple[Layout, str]:
    """The layout with a copy of an actuator above it, `STEP_UP` or the first position that is free,
    and the copy's name."""
    actuator = layout.actuator(name)
    x, y, z = actuator.position
    for k in range(1, MAX_ACTUATORS + 1):
        position = (x, y, round(z + STEP_UP * k, 9))
        if _is_free(layout, position, STEP_UP):
            return _added(layout, replace(actuator, position=position), name)
    raise AssertionError("no position is free")


def added(layout: Layout, kind: str) -> tuple[Layout, str]:
    """The layout with one more actuator on the hull, and its name: at the stern, or where there is
    room. A fin's shaft points away from the hull; the others push or steer ahead.

    Args:
        layout: the robot.
        kind: type of the actuator, a key of `KINDS`.
    """
    actuator: Actuator = KINDS[one_of(kind, "actuator", KINDS)].sample()
    hull = hull_of(layout)
    for clearance in (CLEARANCE, STEP_UP, 0.0):
        for azimuth in AZIMUTHS:
            angle = math.radians(azimuth)
            direction = np.array([math.cos(angle), math.sin(angle), 0.0])
            outside = np.array(hull.center) + 4.0 * max(hull.half) * direction
            point, normal = hull.nearest(outside)
            x, y, z = (round(float(value), 4) + 0.0 for value in point + STAND_OFF * normal)
            if not _is_free(layout, (x, y, z), clearance):
                continue
            placed = replace(actuator, position=(x, y, z))
            if isinstance(placed, Fin):
                # On a deck or keel the normal has no azimuth to speak of.
                outward = normal if math.hypot(*normal[:2]) > 0.2 else direction
                placed = replace(placed, mounting_angle=math.atan2(outward[1], outward[0]))
            return _added(layout, placed, kind)
    raise AssertionError("no position is free")


def blank(kind: str) -> Layout:
    """A robot to begin with: a round hull, and one actuator of a type on its left."""
    sample = KINDS[one_of(kind, "actuator", KINDS)].sample()
    actuator = replace(sample, name="left", position=(0.0, 0.17, 0.0))
    if isinstance(actuator, Fin):
        actuator = replace(actuator, mounting_angle=math.pi / 2)
    hull = Hull(shape="ellipsoid", size_m=(0.5, 0.3, 0.2))
    return Layout("New robot", (actuator,), body=Body(hull=hull))


def _is_free(layout: Layout, position: Vector3, clearance: float) -> bool:
    """Whether all actuators are at least so far [m] from a position [m]."""
    for actuator in layout.actuators:
        if math.dist(actuator.position, position) < clearance - 1e-9:
            return False
    return True


def deleted(layout: Layout, names: Sequence[str]) -> Layout:
    """The layout without some actuators; one at least stays."""
    layout.indices(names)
    if layout.n == len(set(names)):
        only = f"{names[0]} is the only actuator" if layout.n == 1 else "these are all actuators"
        raise FinlabError(f"{only}; a layout needs at least one")
    return layout.without(names)


def _added(layout: Layout, actuator: Actuator, stem: str) -> tuple[Layout, str]:
    """The layout with one more actuator, and the name that it gets: `stem`, with a number where
    there is one of that name."""
    if layout.n >= MAX_ACTUATORS:
        raise FinlabError(
            f"the layout has {layout.n} actuators already; expected at most {MAX_ACTUATORS}"
        )
    short = stem[:56]  # leaves room for the number
    name = short
    number = 2
    while name in layout.names:
        name = f"{short}_{number}"
        number += 1
    return replace(layout, actuators=(*layout.actuators, actuator.copied(name))), name


def _mirror_name(name: str) -> str:
    """What the image of an actuator is called."""
    for one_side, other_side in (("left", "right"), ("port", "starboard")):
        if one_side in name:
            return name.replace(one_side, other_side)
        if other_side in name:
            return name.replace(other_side, one_side)
    return f"{name}_mirror"


def shaped(layout: Layout, shape: str, size: Vector3) -> Layout:
    """The layout with a parametric hull of a size [m]; its centre stays where it is."""
    one_of(shape, "hull", HULL_SHAPES)
    checked = numbers(size, "of the hull [m]", 0.02, 5.0, ("length", "width", "height"))
    return with_hull(layout, Hull(shape=shape, size_m=checked, center_m=hull_of(layout).center))


def with_hull(layout: Layout, hull: Hull) -> Layout:
    """The layout with a hull; everything else about its body stays."""
    return replace(layout, body=replace(layout.body or Body(), hull=hull))


def _drawn_hull(layout: Layout) -> Hull:
    """The hull that is drawn where none is described."""
    hull = hull_of(layout)
    size = tuple([2 * half for half in hull.half])
    return Hull(shape=hull.shape, size_m=size, center_m=hull.center)


def center_of_gravity(layout: Layout) -> Vector3:
    """Where the centre of gravity lies as seen from the hull's middle [m]."""
    x, y, z = hull_of(layout).center
    return -x + 0.0, -y + 0.0, -z + 0.0


def balanced(layout: Layout, center: Vector3) -> Layout:
    """The layout with the centre of gravity at a place in the hull [m]. The body frame has its
    origin there, so hull, actuators and the centre of buoyancy move the other way; where they move
    aside, no two are mirror images any more."""
    checked = numbers(center, "of the centre of gravity [m]", -2.0, 2.0)
    x, y, z = np.subtract(center_of_gravity(layout), checked).tolist()

    def shifted(point: tuple[float, ...]) -> Vector3:
        return point[0] + x, point[1] + y, point[2] + z

    body = layout.body or Body()
    hull = replace(body.hull or _drawn_hull(layout), center_m=shifted(hull_of(layout).center))
    buoyancy = body.center_of_buoyancy_m
    if buoyancy is not None:
        buoyancy = shifted(buoyancy)
    body = replace(body, hull=hull, center_of_buoyancy_m=buoyancy)
    actuators = [
        replace(actuator, position=shifted(actuator.position)) for actuator in layout.actuators
    ]
    pairs = layout.mirror_pairs if abs(y) <= UNTOUCHED else ()
    return replace(layout, actuators=tuple(actuators), body=body, mirror_pairs=pairs)


def with_power(layout: Layout, watts: float | None) -> Layout:
    """The layout with another budget of all actuators together [W]; None for no limit."""
    return replace(layout, power_w=_checked_budget(watts, "power budget [W]"), buses=())


def with_bus_power(layout: Layout, name: str, watts: float | None) -> Layout:
    """The layout with another budget of a bus [W]; without a limit (None) there is no such bus."""
    budget = _checked_budget(watts, f"power budget of bus {name} [W]")
    buses = []
    for bus in layout.buses:
        if bus.name != name:
            buses.append(bus)
        elif budget is not None:
            buses.append(replace(bus, power_w=budget))
    return replace(layout, buses=tuple(buses))


def _checked_budget(watts: float | None, name: str) -> float | None:
    """A power that actuators may take together [W], within what a page may ask for."""
    if watts is None:
        return None
    return number(watts, name, LEAST_BUDGET, MOST_WATTS)


def with_dynamics(layout: Layout, **values: Any) -> Layout:
    """The layout with other fields of `DYNAMICS` of its body; None forgets one."""
    for key in values:
        one_of(key, "field of the body", DYNAMICS)
    return replace(layout, body=replace(layout.body or Body(), **values))


def modelled(actuator: Actuator, model: str) -> Actuator:
    """The actuator with another kind of model, see `Actuator.with_model`; as it is where its type
    has no such one.

    Raises:
        FinlabError: there is no such model, or it needs a file.
    """
    if not actuator.KIND.models or model == actuator.model_type:
        return actuator
    if model == "table":
        raise FinlabError(
            f"a table for {actuator.name} comes from a file; drop its CSV, or fit measurements"
        )
    models: list[str] = []
    for actuator_type in KINDS.values():
        models.extend(actuator_type.KIND.models)
    one_of(model, "model", models)
    return actuator.with_model(model) if model in actuator.KIND.models else actuator


def partner(layout: Layout, name: str) -> str | None:
    """The actuator that moves along with another one as its mirror image; None where none does."""
    for pair in layout.mirror_pairs:
        if name in pair:
            return pair[1 - pair.index(name)]
    return None


def unlinked(layout: Layout, *names: str) -> Layout:
    """The layout without the mirror pairs of some actuators."""
    pairs = [pair for pair in layout.mirror_pairs if not set(names) & set(pair)]
    return replace(layout, mirror_pairs=tuple(pairs))


def linked(layout: Layout, name: str, image: str) -> Layout:
    """The layout with two actuators as a mirror pair, in place of pairs that they were in."""
    others = unlinked(layout, name, image)
    return replace(others, mirror_pairs=(*others.mirror_pairs, (name, image)))


def with_twin(old_layout: Layout, layout: Layout, name: str) -> Layout:
    """The layout after the twin of an actuator, if any, took its mirrored place.

    Args:
        old_layout: before the edit: axes of the twin that pointed the other way than those of the
            image do so again.
        layout: after the edit.
        name: of the actuator that was edited.
    """
    twin_name = partner(layout, name)
    if twin_name is None:
        return layout
    image = layout.actuator(name).image()
    twin = layout.actuator(twin_name)
    old_image = np.array(old_layout.actuator(name).image().frame)
    # Row by row the cosine between each axis of the old image and of the old twin.
    cosines = np.sum(old_image * old_layout.actuator(twin_name).frame, axis=1)
    frame = np.array(image.frame) * np.where(cosines < 0.0, -1.0, 1.0)[:, None]
    return layout.with_actuator(twin.turned(frame[: len(twin.KIND.axes)], image.position))
