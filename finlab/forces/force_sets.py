"""Convex sets of what each actuator can push, in a plane of its own, and how these add up to a
wrench.

A fin or an azimuth that may turn a full circle pushes anywhere within a disc whose radius is its
largest thrust. With stops it pushes within a sector of that disc. A sector wider than half a turn
is not convex: here it stands for its convex hull, the disc cut off along the chord between the
stops, unless `convex_parts` has cut it in two. All else is a polygon: the line of a thruster, the
convex hull of what a fin pushes that pushes harder in some directions than in others, and that of
what the flow gives, such as the lift and drag of a foil between its limits. Dead bands, and the
tiny thrust that a fin cannot go below, are left out; an azimuth that cannot stop has the polygon
around what is left, one that pushes either way within an arc that around both parts.

Wrenches are scaled: torques are divided by `LEVER`, so that all six entries are in newton.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.actuators.fin.fin_response import FinGroup
from finlab.actuators.kinds import groups_of, laws_of
from finlab.actuators.response import Plane, Response
from finlab.arrays import Array
from finlab.axes import TURN
from finlab.core.ray_reach import block_of_planes, ray_reach
from finlab.layout import Layout
from finlab.layout.effectiveness import own_effectiveness
from finlab.physics.plant import plant_of

LEVER = 0.2
"""Length [m] that makes torques comparable to forces: about the distance of a fin from the
centre."""
SCALE = np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
"""What a wrench is divided by, entry by entry."""
HALF_TURN_TOLERANCE = 1e-9
"""By how much half an arc [rad] may exceed a quarter turn and still be convex."""
ALONG = 193
"""Forces of an actuator along its limits, or its rim, of which a polygon is made."""
UNEVEN, BOUNDARY, SIDES = 193, 48, 24
"""Sides of the polygon of an uneven fin, of an azimuth and of forces of the flow: they lie inside
by at most
0.01 %, 0.2 % and 1 % of its width."""
THINNEST = 1e-3
"""Share of a set's length below which it has no width."""
MAX_CUT = 3
"""Most fins whose wide sectors are cut with both halves kept, which doubles the number of parts
each time."""


class ForceSets(NamedTuple):
    """R robots of n actuators each, in m coordinates of a wrench. One with radius 0 is not
    there."""

    effectiveness: Array
    """Scaled wrench per newton (R, n, 2, m) along both axes of each actuator's plane."""
    radius: Array
    """Largest force (R, n) [N], of polygons that do not hold 0 from their middle."""
    middle: Array
    """Middle of the arc of force directions (R, n) [rad]."""
    half: Array
    """Half of the arc (R, n) [rad]; pi for a full circle, 0 for a line, and for an actuator of one
    command, such as a foil, whatever its polygon."""
    place: Array
    """Where in the block the polygon (R, n) is; 0 for a sector."""
    block: Array
    """Polygons, of all robots, for the core."""

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> ForceSets:
        """Returns some of the robots, in the order asked for, repeated where asked for twice."""
        names = self._fields[:-1]
        return self._replace(**{name: getattr(self, name)[rows] for name in names})

    def lose(self, rows: Any, places: Any) -> None:
        """Takes actuators out of some robots, in place."""
        self.effectiveness[rows, places] = self.radius[rows, places] = 0.0

    def along(self, places: Sequence[int] | NDArray[np.intp]) -> ForceSets:
        """Returns the sets in some of the wrench's coordinates alone."""
        return self._replace(effectiveness=np.ascontiguousarray(self.effectiveness[..., places]))

    def repeat(self, times: int) -> ForceSets:
        """Returns each robot several times, side by side."""
        return self.take(np.repeat(np.arange(len(self.radius)), times))

    def tile(self, times: int) -> ForceSets:
        """Returns all robots several times, one round after the other."""
        return self.take(np.tile(np.arange(len(self.radius)), times))

    def pull(self, normal: Array) -> Array:
        """Returns the dot products (R, n, 2) of each one's columns with the direction `normal` (R,
        m)."""
        rows, n = self.radius.shape
        return (self.effectiveness.reshape(rows, 2 * n, -1) @ normal[..., None]).reshape(rows, n, 2)

    def wrench(self, force: Array) -> Array:
        """Returns the scaled wrenches (R, m) of planar forces (R, n, 2) [N]."""
        rows, n = self.radius.shape
        return (force.reshape(rows, 1, 2 * n) @ self.effectiveness.reshape(rows, 2 * n, -1))[:, 0]

    @property
    def unit(self) -> Array:
        """Scaled wrench (R,) [N] of each robot's strongest actuator."""
        size: Array = (np.sqrt((self.effectiveness**2).sum((-1, -2))) * self.radius).max(-1)
        return np.where(size > 0.0, size, 1.0)

    def reach(self, origin: Array, ray: Array, close: float) -> tuple[Array, Array, Array]:
        """Returns how far (R,) rays (R, m) from points (R, m) go within all wrenches, minus
        infinity where they meet none: never less than that, and the planar forces (R, n, 2) found
        are off the end by at most twice `close`, in the strongest actuator's wrench; and the normal
        (R, m) of the plane that proves it."""
        rows, n, _, m = self.effectiveness.shape
        own = np.zeros((rows, n, 16))
        unit = self.unit
        ends = np.zeros((2, rows, 6))
        own[..., :4] = np.stack([self.place, self.radius, self.middle, self.half], axis=-1)
        own[..., 4:].reshape(rows, n, 2, 6)[..., :m] = (
            self.effectiveness / unit[:, None, None, None]
        )
        ends[..., :m] = origin / unit[:, None], ray
        size, normal, force = ray_reach(self.block, own, ends[0], ends[1], close)
        return size * unit, normal[:, :m], np.where(self.radius[..., None] > 0.0, force, 0.0)

    def farthest(self, normal: Array) -> tuple[Array, Array]:
        """Returns the support function (R,) of all wrenches along `normal` (R, m), and the planar
        forces (R, n, 2) that reach it; where a sector is wider than half a turn, those of its
        hull."""
        size, _, force = self.reach(np.zeros_like(normal), normal, np.inf)
        return size * (normal * normal).sum(-1), force

    def full_effectiveness(self) -> Array:
        """Returns the scaled wrenches (R, 2n, m) of each one's largest force along both axes of its
        plane; one that pushes along a line has zeros for the other."""
        full = self.effectiveness * self.radius[..., None, None]
        fixed = self.half == 0.0
        if fixed.any():
            only = np.stack([np.cos(self.middle), np.sin(self.middle)], axis=-1)
            both = np.stack(
                [(only[..., None] * full).sum(-2), np.zeros_like(full[..., 0, :])], axis=-2
            )
            full = np.where(fixed[..., None, None], both, full)
        rows, n = self.radius.shape
        return full.reshape(rows, 2 * n, -1)


class Shape(NamedTuple):
    """What one actuator can push, in a plane spanned by two directions; fields as in
    `ForceSets`."""

    directions: Array
    """Both axes of the plane (2, 3), by the actuator's own axes."""
    radius: float
    middle: float
    half: float
    polygons: tuple[Array, ...] = ()
    """Corners (K, 2) [N] of a polygon and, where its arc is wide, of those of the upper and the
    lower half of it; none for a sector."""

    @property
    def axes(self) -> int:
        """In how many directions it pushes."""
        return (2 if self.half > 0.0 else 1) if self.radius > 0.0 else 0

    @property
    def one_way(self) -> bool:
        """Whether it cannot push against the middle of its arc."""
        ahead = np.array([math.cos(self.middle), math.sin(self.middle)])
        back = min((float((corners @ ahead).min()) for corners in self.polygons), default=0.0)
        return self.half <= 0.5 * math.pi and back >= -THINNEST * self.radius


def force_sets(
    layout: Layout, lost: Collection[str] = (), flow: ArrayLike | None = None
) -> ForceSets:
    """Returns what the actuators of one robot can push along the axes that it commands; nothing
    counts along the others. Those in `lost` push nothing, and the body moves through the water with
    `flow` (6,) [m/s, rad/s], body frame, None at rest. A `LayoutError` at an unknown name."""
    gone = layout.indices(tuple(lost), "lost")
    sets = assembled([shapes_of(layout, flow)], own_effectiveness(layout)[None] * layout.commanded)
    sets.lose(0, list(gone))
    return sets


def assembled(shapes: Sequence[Sequence[Shape]], effectiveness: Array) -> ForceSets:
    """Returns R robots with shapes (R, n) and wrenches (R, n, 3, 6) of 1 N along their own axes."""
    numbers = [block_of_planes(len(shapes[0]))]
    fields = []
    end = len(numbers[0])
    for shape in (shape for robot in shapes for shape in robot):
        fields.append((shape.radius, shape.middle, shape.half, end if shape.polygons else 0))
        for corners in shape.polygons:
            numbers += [np.array([len(corners)]), corners.ravel()]
            end += 1 + corners.size
    directions = np.array([[shape.directions for shape in robot] for robot in shapes])
    columns = np.moveaxis(np.array(fields, np.float64).reshape(len(shapes), -1, 4), -1, 0)
    radius, middle, half, place = np.ascontiguousarray(columns)
    return ForceSets(
        np.ascontiguousarray(directions @ effectiveness / SCALE),
        *(radius, middle, half, place),
        np.concatenate(numbers),
    )


def shapes_of(layout: Layout, flow: ArrayLike | None = None) -> list[Shape]:
    """Returns what each actuator can push; arguments as for `force_sets`."""
    shapes: dict[str, Shape] = {}
    for places, law in laws_of(layout.actuators):
        if law.feels_flow:
            met = plant_of(layout).inflow(None if flow is None else np.asarray(flow, np.float64))
            lower = layout.lower[places]
            upper = layout.upper[places]
            command = lower + np.linspace(0.0, 1.0, ALONG)[:, None, None] * (upper - lower)
            force = law.force(command, None if met is None else met[places])[..., 1:]
            for k, place in enumerate(places):
                shapes[layout.names[place]] = _polygon(np.eye(3)[1:], force[:, k], 0.0, SIDES)
    others = tuple(part for part in layout.actuators if part.name not in shapes)
    if others:
        rest = layout.without(shapes) if shapes else layout
        own = np.broadcast_to(np.eye(3, 6), (rest.n, 3, 6))
        for places, group in groups_of(rest.actuators, own):
            for place, response in zip(places, group.responses, strict=True):
                shapes[rest.names[place]] = _shape(response, isinstance(group, FinGroup))
    return [shapes[name] for name in layout.names]


def _shape(response: Response, is_fin: bool) -> Shape:
    """What an actuator with an answer to prices, by its own axes, can push."""
    least, largest = response.ends
    if not isinstance(response, Plane):
        directions = np.stack([response.effectiveness[:3], np.zeros(3)])
        radius = max(largest, -least) if least <= 0.0 <= largest else 0.5 * (largest - least)
        return Shape(directions, radius, 0.0, 0.0, (np.array([[least, 0.0], [largest, 0.0]]),))
    directions = response.effectiveness[:, :3]
    middle = response.sector_center
    half = response.sector_half_angle
    turn = half * np.linspace(-1.0, 1.0, ALONG)
    if response.gauge is not None or half == 0.0:
        gauge = np.ones(1) if response.gauge is None else response.gauge
        around = TURN / len(gauge) * np.arange(len(gauge) + 1)
        arcs = (-1.0, 1.0), (0.0, 1.0), (-1.0, 0.0)
        rims = [
            middle + half * np.linspace(*arc, ALONG) for arc in arcs[: 3 if _is_wide(half) else 1]
        ]
        sizes = [
            largest * np.interp(rim % TURN, around, np.append(gauge, gauge[0])) for rim in rims
        ]
        ends = [
            np.append(_points(*rim), [[0.0, 0.0]], axis=0) for rim in zip(rims, sizes, strict=True)
        ]
        hulls = [_polygon(directions, points, half, UNEVEN) for points in ends]
        return hulls[0]._replace(
            radius=largest * float(gauge.max()),
            middle=middle,
            polygons=tuple(hull.polygons[0] for hull in hulls),
        )
    if least < 0.0 and half < np.pi:
        points = _points(middle + np.append(turn, turn), np.repeat((largest, least), ALONG))
    elif is_fin or least <= THINNEST * largest or half > 0.5 * np.pi:
        return Shape(directions, max(largest, -least), middle, half)
    else:
        angle = middle + np.append(turn, (-half, half))
        points = _points(angle, np.append(np.full(ALONG, largest), (least, least)))
    return _polygon(directions, points, np.pi, BOUNDARY)


def _points(angle: Array, size: Array) -> Array:
    """Forces (S, 2) [N] of angles (S,) [rad] and sizes (S,) [N]."""
    return np.asarray(size[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def _polygon(directions: Array, points: Array, half: float, sides: int) -> Shape:
    """A polygon that fills the convex hull of forces (S, 2) [N]; two of them where it has no
    width."""
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle)[2]
    along = (points - middle) @ axes.T
    low = along.min(axis=0)
    high = along.max(axis=0)
    length, width = high - low
    angle = math.atan2(axes[0, 1], axes[0, 0])
    if width <= THINNEST * length or length == 0.0:
        ends = np.array([low, high])
        ends[:, 1] = ends[:, 1].mean()
        return Shape(directions, 0.5 * length, angle, 0.0, (middle + ends @ axes,))
    # Corners are the farthest points in directions around a set as wide as it is long.
    turn = TURN / sides * np.arange(sides)
    best = (along / (length, width) @ np.stack([np.cos(turn), np.sin(turn)])).argmax(axis=0)
    corners = points[best[best != np.roll(best, 1)]]
    radius = float(np.linalg.norm(corners - corners.mean(axis=0), axis=-1).max())
    return Shape(directions, radius, angle, half, (corners,))


def _is_wide(half: Any) -> Any:
    """Whether an arc of half an angle [rad] is wider than half a turn and no full circle."""
    return (half > np.pi / 2 + HALF_TURN_TOLERANCE) & (half < np.pi)


def wide_arcs(sets: ForceSets) -> NDArray[np.intp]:
    """Returns the places of working actuators whose arcs are wider than half a turn and no full
    circle."""
    return np.flatnonzero(_is_wide(sets.half[0]) & (sets.radius > 0.0).any(axis=0))


def convex_parts(sets: ForceSets) -> ForceSets:
    """Returns convex sets of R robots with the same arcs, P of each, one round of robots after the
    other. Wide sectors are cut along their middle, of the first `MAX_CUT` both halves are kept, in
    all combinations; further ones stay what they are, with their hulls."""
    cut = wide_arcs(sets)[:MAX_CUT]
    signs = np.zeros((2 ** len(cut), 1, sets.radius.shape[1]))
    signs[:, 0, cut] = list(product((-0.5, 0.5), repeat=len(cut)))
    signs = np.repeat(signs, len(sets.radius), axis=1)
    signs = signs.reshape(-1, signs.shape[-1])
    parts = sets.tile(2 ** len(cut))
    for behind in (signs != 0.0, signs < 0.0):  # the upper and the lower half follow the whole arc
        at = parts.place[behind & (parts.place > 0.0)]
        parts.place[behind & (parts.place > 0.0)] += 1.0 + 2.0 * sets.block[at.astype(np.intp)]
    return parts._replace(
        middle=parts.middle + signs * parts.half, half=np.where(signs == 0.0, 1.0, 0.5) * parts.half
    )
