"""Convex sets of what each actuator can push, in a plane of its own, and how these add up to a wrench.

A fin or an azimuth that may turn a full circle pushes anywhere within a disc whose radius is its largest
thrust. With stops it pushes within a sector of that disc. A sector wider than half a turn is not convex: here
it stands for its convex hull, the disc cut off along the chord between the stops, unless `convex_parts` has
cut it in two. Where a fin pushes harder in some directions than in others, the disc is cut down to its convex
hull, too. A thruster pushes along a line, one way or both. What feels the flow, such as a foil, pushes what
its law gives between its limits: here the convex hull of that, a polygon. Dead bands, and the tiny thrust
that a fin cannot go below, are left out; an azimuth that cannot stop has the polygon around what is left, one
that pushes either way within an arc that around both parts.

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
from finlab.axes import TURN, wrapped
from finlab.layout import Layout
from finlab.layout.effectiveness import own_effectiveness
from finlab.physics.plant import plant_of

LEVER = 0.2
"""Length [m] that makes torques comparable to forces: about the distance of a fin from the centre."""
SCALE = np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
"""What a wrench is divided by, entry by entry."""
HALF_TURN_TOLERANCE = 1e-9
"""By how much half an arc [rad] may exceed a quarter turn and still be convex."""
BOUNDARY, POINTS = 48, 193
"""Sides of the polygon around an uneven fin's forces, 0.2 % too wide; directions in its arc."""
ALONG, SIDES = 193, 24
"""Forces of an actuator along its limits, or its rim, of which a polygon is made; and sides of one for forces
of the flow: they lie inside by at most 1 % of its width."""
THINNEST = 1e-3
"""Share of a set's length below which it has no width, and least distance of a side of a polygon from its
centre, as a share of the radius."""
MAX_CUT = 3
"""Most fins whose wide sectors are cut with both halves kept, which doubles the number of parts each time."""


class ForceSets(NamedTuple):
    """R robots of n actuators each, in m coordinates of a wrench. One with radius 0 is not there."""

    effectiveness: Array
    """Scaled wrench per newton (R, n, 2, m) along both axes of each actuator's plane."""
    radius: Array
    """Largest force (R, n) [N], of polygons from their centre."""
    middle: Array
    """Middle of the arc of force directions (R, n) [rad]."""
    half: Array
    """Half of the arc (R, n) [rad]; pi for a full circle, 0 for a line."""
    boundary: Array | None = None
    """How far the sets reach along M evenly spaced directions (R, n, M), the first at zero, as shares of the
    radius; None where every fin is the same all round."""
    back: Array | None = None
    """Share (R, n) of the radius that a line gives backwards; None where none does."""
    center: Array | None = None
    """Force (R, n, 2) [N] from which an actuator's set is seen; None where all are seen from 0."""
    corners: Array | None = None
    """Corners (R, n, K, 2) [N] of polygons from their centres, counter-clockwise, the last one repeated;
    0 for other actuators; None where there is none. An actuator of one command, such as a foil, has a half
    of 0: it gives only one side of its polygon, and counts as one direction."""

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> ForceSets:
        """Returns some of the robots, in the order asked for, repeated where asked for twice."""
        return ForceSets(*(None if field is None else field[rows] for field in self))  # type: ignore[arg-type]

    def lose(self, rows: Any, places: Any) -> None:
        """Takes actuators out of some robots, in place."""
        for field in (self.radius, self.center, self.corners):
            if field is not None:
                field[rows, places] = 0.0

    def along(self, places: Sequence[int] | NDArray[np.intp]) -> ForceSets:
        """Returns the sets in some of the wrench's coordinates alone."""
        return self._replace(effectiveness=np.ascontiguousarray(self.effectiveness[..., places]))

    @property
    def offset(self) -> Array | float:
        """Scaled wrenches (R, m) of what the sets are seen from."""
        return 0.0 if self.center is None else self.wrench(self.center)

    def repeat(self, times: int) -> ForceSets:
        """Returns each robot several times, side by side."""
        return self.take(np.repeat(np.arange(len(self.radius)), times))

    def tile(self, times: int) -> ForceSets:
        """Returns all robots several times, one round after the other."""
        return self.take(np.tile(np.arange(len(self.radius)), times))

    def pull(self, normal: Array) -> Array:
        """Returns the dot products (R, n, 2) of each one's columns with the direction `normal` (R, m)."""
        rows, n = self.radius.shape
        return (self.effectiveness.reshape(rows, 2 * n, -1) @ normal[..., None]).reshape(rows, n, 2)

    def wrench(self, force: Array) -> Array:
        """Returns the scaled wrenches (R, m) of planar forces (R, n, 2) [N]."""
        rows, n = self.radius.shape
        return (force.reshape(rows, 1, 2 * n) @ self.effectiveness.reshape(rows, 2 * n, -1))[:, 0]

    def farthest(self, normal: Array) -> tuple[Array, Array]:
        """Returns the support function (R,) of all wrenches along `normal` (R, m), and the planar forces (R,
        n, 2) that reach it; where a sector is wider than half a turn, those of its hull."""
        pull = self.pull(normal)
        size = np.sqrt((pull**2).sum(-1))
        angle = wrapped(np.arctan2(pull[..., 1], pull[..., 0]) - self.middle)
        held = np.clip(angle, -self.half, self.half)
        share = np.cos(angle - held)
        thrust = np.where(share > 1e-12, self.radius, 0.0)
        if self.back is not None:
            thrust = np.where(share < -1e-12, -self.back * self.radius, thrust)
        direction = self.middle + held
        reach = thrust * share
        if self.boundary is not None:
            support, inside = _along_boundary(self.boundary, self.middle + angle, direction)
            reach, thrust = np.minimum(reach, self.radius * support), thrust * inside
        reach = reach * size
        force = thrust[..., None] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
        if self.corners is not None:
            along = (self.corners @ pull[..., None])[..., 0]
            best = np.take_along_axis(self.corners, along.argmax(-1)[..., None, None], axis=2)[:, :, 0]
            reach = np.where(self.cornered, along.max(-1), reach)
            force = np.where(self.cornered[..., None], best, force)
        if self.center is not None:
            reach, force = reach + (pull * self.center).sum(-1), force + self.center
        return reach.sum(-1), force

    @property
    def cornered(self) -> NDArray[np.bool_]:
        """Which actuators (R, n) have corners."""
        if self.corners is None:
            return np.zeros(self.radius.shape, bool)
        return np.asarray(self.corners.any((-1, -2)))

    def full_effectiveness(self) -> Array:
        """Returns the scaled wrenches (R, 2n, m) of each one's largest force along both axes of its plane;
        one that pushes along a line has zeros for the other."""
        full = self.effectiveness * self.radius[..., None, None]
        fixed = self.half == 0.0
        if fixed.any():
            only = np.stack([np.cos(self.middle), np.sin(self.middle)], axis=-1)
            both = np.stack([(only[..., None] * full).sum(-2), np.zeros_like(full[..., 0, :])], axis=-2)
            full = np.where(fixed[..., None, None], both, full)
        rows, n = self.radius.shape
        return full.reshape(rows, 2 * n, -1)


class Shape(NamedTuple):
    """What one actuator can push, in a plane spanned by two directions; fields as in `ForceSets`."""

    directions: Array
    """Both axes of the plane (2, 3), by the actuator's own axes."""
    radius: float
    middle: float
    half: float
    boundary: Array | None = None
    back: float | None = None
    center: Array | None = None
    corners: Array | None = None


def force_sets(layout: Layout, failed: Collection[str] = (), flow: ArrayLike | None = None) -> ForceSets:
    """Returns what the actuators of one robot can push along the axes that it commands; nothing counts along
    the others. Those in `failed` push nothing, and the body moves through the water with `flow` (6,) [m/s,
    rad/s], body frame, None at rest. A `LayoutError` at an unknown name."""
    lost = layout.indices(tuple(failed))
    sets = assembled([shapes_of(layout, flow)], own_effectiveness(layout)[None] * layout.commanded)
    sets.lose(0, list(lost))
    return sets


def assembled(shapes: Sequence[Sequence[Shape]], effectiveness: Array) -> ForceSets:
    """Returns R robots with shapes (R, n) and wrenches (R, n, 3, 6) of 1 N along their own axes."""
    every = [shape for robot in shapes for shape in robot]
    most = max((len(shape.corners) for shape in every if shape.corners is not None), default=0)

    def gathered(name: str, rest: Any = None) -> Any:
        values = [getattr(shape, name) for shape in every]
        if all(value is None for value in values):
            return None
        if name == "corners":
            last = np.arange(most)
            values = [None if own is None else own[np.minimum(last, len(own) - 1)] for own in values]
        result = np.array([rest if value is None else value for value in values], np.float64)
        return result.reshape(len(shapes), -1, *result.shape[1:])

    return ForceSets(
        np.ascontiguousarray(gathered("directions") @ effectiveness / SCALE),
        gathered("radius"),
        gathered("middle"),
        gathered("half"),
        gathered("boundary", np.ones(BOUNDARY)),
        gathered("back", 0.0),
        gathered("center", (0.0, 0.0)),
        gathered("corners", np.zeros((most, 2))),
    )


def shapes_of(layout: Layout, flow: ArrayLike | None = None) -> list[Shape]:
    """Returns what each actuator can push; arguments as for `force_sets`."""
    shapes: dict[str, Shape] = {}
    for places, law in laws_of(layout.actuators):
        if law.feels_flow:
            met = plant_of(layout).inflow(None if flow is None else np.asarray(flow, np.float64))
            lower, upper = layout.lower[places], layout.upper[places]
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
    if not isinstance(response, Plane):
        directions = np.stack([response.effectiveness[:3], np.zeros(3)])
        low, high = response.ends
        if low > 0.0 or high < 0.0:
            center = np.array([0.5 * (low + high), 0.0])
            return Shape(directions, 0.5 * (high - low), 0.0, 0.0, back=1.0, center=center)
        far, near = max(high, -low), min(high, -low)
        back = near / far if near > 0.0 else None
        return Shape(directions, far, 0.0 if high >= -low else math.pi, 0.0, back=back)
    directions, (least, largest) = response.effectiveness[:, :3], response.ends
    boundary = None
    if response.gauge is not None:
        largest, boundary = largest * float(response.gauge.max()), _boundary(response, response.gauge)
    middle, half = response.middle, response.half
    turn = half * np.linspace(-1.0, 1.0, ALONG)
    if least < 0.0 and half < np.pi:
        angle, size = middle + np.append(turn, turn), np.repeat((largest, least), ALONG)
    elif is_fin or least <= THINNEST * largest or half > 0.5 * np.pi:
        return Shape(directions, max(largest, -least), middle, half, boundary)
    else:
        angle = middle + np.append(turn, (-half, half))
        size = np.append(np.full(ALONG, largest), (least, least))
    return _polygon(
        directions, size[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1), np.pi, BOUNDARY
    )


def _polygon(directions: Array, points: Array, half: float, sides: int) -> Shape:
    """A polygon that fills the convex hull of forces (S, 2) [N]; a line or a point where it has no width."""
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle)[2]
    along = (points - middle) @ axes.T
    low, high = along.min(axis=0), along.max(axis=0)
    length, width = high - low
    angle = math.atan2(axes[0, 1], axes[0, 0])
    if width <= THINNEST * length or length == 0.0:
        center = middle + (0.5 * (low + high)) @ axes
        if not center.any() and not length:
            return Shape(directions, 0.0, 0.0, 0.0)
        return Shape(directions, 0.5 * length, angle, 0.0, back=1.0, center=center)
    # Corners are the farthest points in directions around a set as wide as it is long.
    turn = TURN / sides * np.arange(sides)
    best = (along / (length, width) @ np.stack([np.cos(turn), np.sin(turn)])).argmax(axis=0)
    corners = points[best[best != np.roll(best, 1)]]
    corners = corners if np.linalg.det(axes) > 0.0 else corners[::-1]
    center = corners.mean(axis=0)
    radius = float(np.linalg.norm(corners - center, axis=-1).max())
    return Shape(directions, radius, angle, half, center=center, corners=corners - center)


def _boundary(plane: Plane, gauge: Array) -> Array:
    """How far the hull of what an uneven fin can push reaches (BOUNDARY,), as shares of its largest force."""
    angle = plane.middle + plane.half * np.linspace(-1.0, 1.0, POINTS)
    gauge = np.append(gauge, gauge[0])
    reach = np.interp(angle % TURN, TURN / (len(gauge) - 1) * np.arange(len(gauge)), gauge)
    sides = TURN / BOUNDARY * np.arange(BOUNDARY)
    ahead = (reach[:, None] * np.cos(angle[:, None] - sides)).max(axis=0)
    return np.asarray(np.maximum(ahead, 0.0) / gauge.max())


def _along_boundary(boundary: Array, pull: Array, direction: Array) -> tuple[Array, Array]:
    """How far (R, n) sets with rims (R, n, M) reach along the directions `pull` (R, n) [rad], and how far out
    along `direction` (R, n) they end, both as shares of the radius."""
    count = boundary.shape[-1]
    gap = 2.0 * np.pi / count
    place = np.mod(pull, 2.0 * np.pi) / gap
    before = np.minimum(place.astype(np.intp), count - 1)
    here = np.take_along_axis(boundary, before[..., None], axis=-1)[..., 0]
    after = np.take_along_axis(boundary, (before[..., None] + 1) % count, axis=-1)[..., 0]
    # The corner between two sides of the polygon.
    part = (place - before) * gap
    support = (here * np.sin(gap - part) + after * np.sin(part)) / np.sin(gap)
    deflection = np.cos(direction[..., None] - np.arange(count) * gap)
    ends = np.where(deflection > 0.1, boundary / np.where(deflection > 0.1, deflection, 1.0), np.inf)
    return support, np.minimum(ends.min(-1), 1.0)


def wide_arcs(sets: ForceSets) -> NDArray[np.intp]:
    """Returns the places of working actuators whose arcs are wider than half a turn and no full circle."""
    alive = (sets.radius > 0.0).any(axis=0)
    half = sets.half[0]
    return np.flatnonzero((half > np.pi / 2 + HALF_TURN_TOLERANCE) & (half < np.pi) & alive)


def convex_parts(sets: ForceSets) -> ForceSets:
    """Returns convex sets of R robots with the same arcs, P of each, one round of robots after the other.
    Wide sectors are cut along their middle, of the first `MAX_CUT` both halves are kept, in all combinations;
    further ones stay what they are, with their hulls."""
    cut = wide_arcs(sets)[:MAX_CUT]
    signs = np.zeros((2 ** len(cut), 1, sets.radius.shape[1]))
    signs[:, 0, cut] = list(product((-0.5, 0.5), repeat=len(cut)))
    signs = np.repeat(signs, len(sets.radius), axis=1)
    signs = signs.reshape(-1, signs.shape[-1])
    parts = sets.tile(2 ** len(cut))
    return parts._replace(
        middle=parts.middle + signs * parts.half, half=np.where(signs == 0.0, 1.0, 0.5) * parts.half
    )
