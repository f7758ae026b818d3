"""Convex sets of the feasible forces of each actuator, in a plane of its own, and the sum of these
sets as wrenches. `finlab.forces.reach`, the attainable sets and the analyses use them.

A fin or an azimuth without limits of direction has a disc, whose radius is its largest thrust. With
stops it has a sector of that disc. A sector wider than half a turn is not convex: it is replaced by
its convex hull, the disc cut off along the chord between the stops, unless `convex_parts` has cut
it in two. An azimuth with several arcs has the convex hull of their sectors, a polygon, unless
`convex_parts` has taken one of them. All other sets are polygons: the line of a thruster; the
convex hull of the forces of a fin that are larger in some directions than in others; the convex
hull of forces by the flow, such as lift and drag of a foil between its limits. Dead bands, and the
tiny thrust that a fin cannot go below, are neglected. An azimuth that cannot stop has the convex
hull of its ring sector; one with thrust of both signs within an arc has the convex hull of both
sectors.

Wrenches are scaled: torques are divided by `LEVER`, so that all six entries are in newton.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finlab.actuators.fin.fin_response import FinGroup
from finlab.actuators.kinds import groups_of, laws_of
from finlab.actuators.response import Plane, Response
from finlab.arrays import Array
from finlab.axes import TURN
from finlab.core.ray_reach import block_of_planes, ray_reach, ray_reach_within
from finlab.forces.power_sides import PowerSets
from finlab.layout import Actuator, Layout
from finlab.layout.effectiveness import own_effectiveness
from finlab.physics.plant import plant_of

LEVER = 0.2
"""Length [m] that makes torques comparable to forces: about the distance of a fin from the
centre."""
SCALE = np.array([1.0, 1.0, 1.0, LEVER, LEVER, LEVER])
"""Divisors (6,) of a wrench [1, m]."""
HALF_TURN_TOLERANCE = 1e-9
"""Most by which half an arc may exceed a quarter turn and still count as convex [rad]."""
N_SAMPLES = 193
"""Forces of an actuator along its limits, or its rim, whose convex hull is taken."""
SIDES_OF_GAUGE = 193
"""Sides of the polygon of a fin whose largest force differs by direction: it lies inside the hull
by at most 0.01 % of the width."""
SIDES_OF_AZIMUTH = 48
"""Sides of the polygon of an azimuth: inside by at most 0.2 % of the width."""
LEAST_RANGE = 1e-12
"""Least range of a force by which is divided [N]."""
SIDES_OF_FLOW = 24
"""Sides of the polygon of forces by the flow: inside by at most 1 % of the width."""
MIN_ASPECT = 1e-3
"""Width over length below which a set counts as a line [1]."""
MAX_PARTS = 12
"""Most convex parts of a robot: every actuator whose set is cut has a factor of two or more in
it."""


class ForceSets(NamedTuple):
    """Feasible forces of R robots of n actuators each, in m coordinates of a wrench. An actuator
    with radius 0 gives no force."""

    effectiveness: Array
    """Scaled wrench per newton (R, n, 2, m) along both axes of each actuator's plane."""
    radius: Array
    """Largest force (R, n) [N]; of polygons that do not contain 0, from their centre."""
    sector_center: Array
    """Middle of the arc of force directions (R, n) [rad]."""
    sector_half_angle: Array
    """Half of the arc (R, n) [rad]; pi for a full circle, 0 for a line, and for any polygon of an
    actuator of one command, such as a foil."""
    n_parts: NDArray[np.intp]
    """How many convex parts each set has (R, n); 1 of a convex one."""
    polygon_offset: Array
    """Offset of the polygon in the block (R, n); 0 for a sector."""
    block: Array
    """Polygons of all robots, as the core reads them."""
    sides: Array | None = None
    """The first of the sides of each set, and how many it has (R, n, 2); None without a power
    budget."""
    powers: PowerSets | None = None
    """Sides of all sets, what they cost, and the power budgets of all robots; None without any."""

    def take(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> ForceSets:
        """Returns the robots of some rows, by a mask (R,) or by indices, which may repeat."""
        of_rows = [name for name in self._fields if name not in ("block", "powers")]
        taken = {name: getattr(self, name)[rows] for name in of_rows if name != "sides"}
        return self._replace(**taken, sides=None if self.sides is None else self.sides[rows])

    def lose(self, rows: Any, actuators: Any) -> None:
        """Sets the forces of actuators of some robots to zero, in place.

        Args:
            rows: indices of robots.
            actuators: indices of actuators, broadcast with `rows`.
        """
        self.effectiveness[rows, actuators] = 0.0
        self.radius[rows, actuators] = 0.0

    def along(self, coordinates: Sequence[int] | NDArray[np.intp]) -> ForceSets:
        """Returns the sets in some of the wrench's coordinates, by their indices."""
        effectiveness = np.ascontiguousarray(self.effectiveness[..., coordinates])
        return self._replace(effectiveness=effectiveness)

    def repeat(self, times: int) -> ForceSets:
        """Returns each robot several times, side by side."""
        return self.take(np.repeat(np.arange(len(self.radius)), times))

    def tile(self, times: int) -> ForceSets:
        """Returns all robots several times, one round after the other."""
        return self.take(np.tile(np.arange(len(self.radius)), times))

    def pull(self, normal: Array) -> Array:
        """Returns the dot products (R, n, 2) of the columns of each actuator's effectiveness with
        the direction `normal` (R, m)."""
        rows, n = self.radius.shape
        columns = self.effectiveness.reshape(rows, 2 * n, -1)
        return (columns @ normal[..., None]).reshape(rows, n, 2)

    def wrench(self, force: Array) -> Array:
        """Returns the scaled wrenches (R, m) [N] of planar forces (R, n, 2) [N]."""
        rows, n = self.radius.shape
        columns = self.effectiveness.reshape(rows, 2 * n, -1)
        return (force.reshape(rows, 1, 2 * n) @ columns)[:, 0]

    @property
    def unit(self) -> Array:
        """Scaled wrench (R,) [N] of each robot's strongest actuator."""
        gain = np.sqrt((self.effectiveness**2).sum((-1, -2)))
        size: Array = (gain * self.radius).max(-1)
        return np.where(size > 0.0, size, 1.0)

    def reach(self, origin: Array, ray: Array, tolerance: float) -> tuple[Array, Array, Array]:
        """Returns the distances to which rays stay within the attainable wrenches.

        Args:
            origin: points (R, m) where the rays begin, scaled wrenches [N].
            ray: directions (R, m) [1].
            tolerance: gap at which the search ends, over the strongest actuator's wrench [1];
                infinity for one step.

        Returns:
            Upper bounds of the distances (R,) over the length of the ray, minus infinity of a ray
            that misses all wrenches; normals (R, m) of the planes that prove them; and planar
            forces (R, n, 2) [N] whose wrench is off the end by at most twice the tolerance.
        """
        if self.powers is not None:
            size, normal, force, _ = self.reach_within(origin, ray, tolerance)
            return size, normal, force
        rows, n, _, m = self.effectiveness.shape
        unit = self.unit
        records = np.zeros((rows, n, 16))
        records[..., 0] = self.polygon_offset
        records[..., 1] = self.radius
        records[..., 2] = self.sector_center
        records[..., 3] = self.sector_half_angle
        core_origin, core_ray = self._write_wrenches(records, origin, ray)
        size, normal, force = ray_reach(self.block, records, core_origin, core_ray, tolerance)
        is_working = self.radius[..., None] > 0.0
        return size * unit, normal[:, :m], np.where(is_working, force, 0.0)

    def reach_within(
        self, origin: Array, ray: Array, tolerance: float
    ) -> tuple[Array, Array, Array, Array]:
        """Returns the distances to which rays stay within what is attainable within the power
        budgets.

        Args:
            origin: as for `reach`.
            ray: as for `reach`.
            tolerance: as for `reach`.

        Returns:
            What `reach` returns, and the multipliers (R, b) of the budgets at the planes [N/W].
            Minus infinity where actuators that cannot rest take more than a budget.
        """
        assert self.powers is not None and self.sides is not None
        rows, n, _, m = self.effectiveness.shape
        records = np.zeros((rows, n, 16))
        records[..., 0:2] = self.sides
        records[..., 2] = self.powers.bus
        records[..., 3] = self.radius > 0.0
        core_origin, core_ray = self._write_wrenches(records, origin, ray)
        plain_block = block_of_planes(n)
        size, normal, force, multiplier = ray_reach_within(
            plain_block, self.powers.within, records, core_origin, core_ray, tolerance
        )
        unit = self.unit
        is_over = self.powers.over_budget(self.sides, self.radius > 0.0).any(axis=-1)
        size = np.where(is_over, -np.inf, size * unit)
        is_working = self.radius[..., None] > 0.0
        force = np.where(is_working, force, 0.0)
        return size, normal[:, :m], force, multiplier * unit[:, None]

    def _write_wrenches(self, records: Array, origin: Array, ray: Array) -> tuple[Array, Array]:
        """Writes the effectiveness into records (R, n, 16) of the core, over the strongest
        actuator's wrench, and returns origins and rays (R, 6) as the core has them."""
        rows, n, _, m = self.effectiveness.shape
        unit = self.unit
        columns = records[..., 4:].reshape(rows, n, 2, 6)  # a view
        columns[..., :m] = self.effectiveness / unit[:, None, None, None]
        # The core has six coordinates; those beyond m are zero.
        core_origin = np.zeros((rows, 6))
        core_origin[:, :m] = origin / unit[:, None]
        core_ray = np.zeros((rows, 6))
        core_ray[:, :m] = ray
        return core_origin, core_ray

    def farthest(self, normal: Array) -> tuple[Array, Array]:
        """Returns the support function of the attainable wrenches.

        Args:
            normal: directions (R, m).

        Returns:
            Its values (R,) [N], and planar forces (R, n, 2) [N] that attain them; of a sector wider
            than half a turn those of its hull.
        """
        size, _, force = self.reach(np.zeros_like(normal), normal, np.inf)
        return size * (normal * normal).sum(-1), force

    def full_effectiveness(self) -> Array:
        """Returns the scaled wrenches (R, 2n, m) [N] of each actuator's largest force along both
        axes of its plane; one whose force is along a line has zeros for the second."""
        full = self.effectiveness * self.radius[..., None, None]
        is_line = self.sector_half_angle == 0.0
        if is_line.any():
            direction = np.stack([np.cos(self.sector_center), np.sin(self.sector_center)], axis=-1)
            along_line = (direction[..., None] * full).sum(-2)
            across_line = np.zeros_like(full[..., 0, :])
            of_lines = np.stack([along_line, across_line], axis=-2)
            full = np.where(is_line[..., None, None], of_lines, full)
        rows, n = self.radius.shape
        return full.reshape(rows, 2 * n, -1)


class Shape(NamedTuple):
    """Feasible forces of one actuator, in a plane spanned by two directions; fields as in
    `ForceSets`."""

    directions: Array
    """Both axes of the plane (2, 3), by the actuator's own axes."""
    radius: float
    """Largest force [N]."""
    sector_center: float
    """Middle of the arc of force directions [rad]."""
    sector_half_angle: float
    """Half of the arc [rad]."""
    polygons: tuple[Array, ...] = ()
    """Corners (K, 2) [N] of a polygon and, where the set is not convex, of those of its convex
    parts; none for a sector."""

    @property
    def n_parts(self) -> int:
        """How many convex parts the set has; 1 of a convex one."""
        if self.polygons:
            return max(len(self.polygons) - 1, 1)
        return 2 if is_wide(self.sector_half_angle) else 1

    @property
    def axes(self) -> int:
        """Dimension of the set: 0 without force, 1 of a line, else 2."""
        if self.radius <= 0.0:
            return 0
        return 2 if self.sector_half_angle > 0.0 else 1

    @property
    def one_way(self) -> bool:
        """Whether it has no force against the middle of its arc."""
        ahead = np.array([math.cos(self.sector_center), math.sin(self.sector_center)])
        least_ahead = 0.0
        if self.polygons:
            least_ahead = min(float((corners @ ahead).min()) for corners in self.polygons)
        is_convex = self.sector_half_angle <= 0.5 * math.pi
        return is_convex and least_ahead >= -MIN_ASPECT * self.radius


def force_sets(
    layout: Layout, lost: Collection[str] = (), flow: ArrayLike | None = None
) -> ForceSets:
    """Returns the feasible forces of one robot, with their wrenches along the axes that it
    commands; along the others these are zero.

    Args:
        layout: the robot.
        lost: names of actuators that give no force.
        flow: velocity of the body relative to the water (6,), body frame [m/s, rad/s]; None at
            rest.

    Raises:
        LayoutError: there is no actuator of a name.
    """
    lost_indices = layout.indices(tuple(lost), "lost")
    effectiveness = own_effectiveness(layout)[None] * layout.commanded
    sets = assembled([shapes_of(layout, flow)], effectiveness)
    sets.lose(0, list(lost_indices))
    return sets


def assembled(shapes: Sequence[Sequence[Shape]], effectiveness: Array) -> ForceSets:
    """Returns the sets of R robots.

    Args:
        shapes: feasible forces of each robot's n actuators (R, n).
        effectiveness: wrenches (R, n, 3, 6) of 1 N along their own axes [1, m], body frame.
    """
    robots = len(shapes)
    n = len(shapes[0])
    directions = np.empty((robots, n, 2, 3))
    radius = np.empty((robots, n))
    sector_center = np.empty((robots, n))
    sector_half_angle = np.empty((robots, n))
    n_parts = np.ones((robots, n), np.intp)
    polygon_offset = np.zeros((robots, n))
    tables = [block_of_planes(n)]
    end_of_block = len(tables[0])
    for row, robot in enumerate(shapes):
        for i, shape in enumerate(robot):
            directions[row, i] = shape.directions
            radius[row, i] = shape.radius
            sector_center[row, i] = shape.sector_center
            sector_half_angle[row, i] = shape.sector_half_angle
            n_parts[row, i] = shape.n_parts
            if shape.polygons:
                polygon_offset[row, i] = end_of_block
            for corners in shape.polygons:
                # A polygon in the block: the number of its corners, then their coordinates.
                tables.append(np.array([len(corners)]))
                tables.append(corners.ravel())
                end_of_block += 1 + corners.size
    return ForceSets(
        effectiveness=np.ascontiguousarray(directions @ effectiveness / SCALE),
        radius=radius,
        sector_center=sector_center,
        sector_half_angle=sector_half_angle,
        n_parts=n_parts,
        polygon_offset=polygon_offset,
        block=np.concatenate(tables),
    )


def shapes_of(layout: Layout, flow: ArrayLike | None = None) -> list[Shape]:
    """Returns the feasible forces of each actuator (n), in the order of the layout.

    Args:
        layout: the robot.
        flow: velocity of the body relative to the water (6,), body frame [m/s, rad/s]; None at
            rest.
    """
    shapes = _flow_shapes(layout, flow)
    if len(shapes) < layout.n:
        others = layout.without(shapes) if shapes else layout
        # Unit wrenches: the responses then have their directions by own axes.
        own_axes = np.broadcast_to(np.eye(3, 6), (others.n, 3, 6))
        for indices, group in groups_of(others.actuators, own_axes):
            is_fin = isinstance(group, FinGroup)
            for i, response in zip(indices, group.responses, strict=True):
                shapes[others.names[i]] = _shape(response, is_fin)
    return [shapes[name] for name in layout.names]


def _flow_shapes(layout: Layout, flow: ArrayLike | None) -> dict[str, Shape]:
    """Feasible forces, by name, of the actuators whose force is that of the flow."""
    body_flow = None if flow is None else np.asarray(flow, np.float64)
    shapes: dict[str, Shape] = {}
    for indices, law in laws_of(layout.actuators):
        if not law.feels_flow:
            continue
        inflow = plant_of(layout).inflow(body_flow)
        share = _shares_of_limits(layout.actuators[indices[0]])
        lower = layout.lower[indices]
        upper = layout.upper[indices]
        command = lower + share[:, None] * (upper - lower)
        force = law.force(command, None if inflow is None else inflow[indices])[..., 1:]
        for k, i in enumerate(indices):
            plane = np.eye(3)[1:]
            is_line = len(layout.actuators[i].KIND.push_rows) == 1
            half_angle = 0.0 if is_line else np.pi
            shapes[layout.names[i]] = _polygon(plane, force[:, k], half_angle, SIDES_OF_FLOW)
    return shapes


def _shares_of_limits(actuator: Actuator) -> Array:
    """Shares (S, 3) of the range of a command at which forces by the flow are asked: along an angle
    `N_SAMPLES`, at each of them both ends of a force and rest between."""
    angle = np.linspace(0.0, 1.0, N_SAMPLES)
    number = actuator.KIND.force_number
    if number is None:
        return np.repeat(angle[:, None], 3, axis=1)
    low = actuator.lower[number]
    high = actuator.upper[number]
    at_rest = np.clip(-low / max(high - low, LEAST_RANGE), 0.0, 1.0)
    share = np.zeros((3, N_SAMPLES, 3))
    share[..., 0] = angle
    share[..., number] = np.array([0.0, at_rest, 1.0])[:, None]
    return share.reshape(-1, 3)


def _shape(response: Response, is_fin: bool) -> Shape:
    """Feasible forces of an actuator, by its response to prices along its own axes."""
    force_min, force_max = response.ends
    if not isinstance(response, Plane):
        return _segment(response.effectiveness[:3], force_min, force_max)
    directions = response.effectiveness[:, :3]
    center = response.sector_center
    half_angle = response.sector_half_angle
    if response.gauge is not None or half_angle == 0.0:
        gauge = np.ones(1) if response.gauge is None else response.gauge
        return _gauge_shape(directions, center, half_angle, force_max, gauge)
    if response.barred:
        return _zoned_shape(response, directions)
    turn = half_angle * np.linspace(-1.0, 1.0, N_SAMPLES)
    if force_min < 0.0 and half_angle < np.pi:
        # Two opposite sectors.
        angle = center + np.append(turn, turn)
        size = np.repeat((force_max, force_min), N_SAMPLES)
    elif is_fin or force_min <= MIN_ASPECT * force_max or half_angle > 0.5 * np.pi:
        return Shape(directions, max(force_max, -force_min), center, half_angle)
    else:
        # A ring sector: its outer arc, and both ends of the inner one.
        angle = center + np.append(turn, (-half_angle, half_angle))
        size = np.append(np.full(N_SAMPLES, force_max), (force_min, force_min))
    return _polygon(directions, _polar(angle, size), np.pi, SIDES_OF_AZIMUTH)


def _segment(axis: Array, force_min: float, force_max: float) -> Shape:
    """Forces along one axis (3,) between two limits [N]."""
    directions = np.stack([axis, np.zeros(3)])
    contains_zero = force_min <= 0.0 <= force_max
    radius = max(force_max, -force_min) if contains_zero else 0.5 * (force_max - force_min)
    ends = np.array([[force_min, 0.0], [force_max, 0.0]])
    return Shape(directions, radius, 0.0, 0.0, (ends,))


def _gauge_shape(
    directions: Array, center: float, half_angle: float, force_max: float, gauge: Array
) -> Shape:
    """Forces within an arc [rad] whose largest size depends on the direction: `force_max` [N] times
    the gauge (K,) [1], evenly spaced around the circle."""
    gauge_angle = TURN / len(gauge) * np.arange(len(gauge) + 1)
    closed_gauge = np.append(gauge, gauge[0])
    arcs = [(-1.0, 1.0)]
    if is_wide(half_angle):
        arcs += [(0.0, 1.0), (-1.0, 0.0)]  # its upper and its lower half, see `convex_parts`
    hulls = []
    for begin, end in arcs:
        angle = center + half_angle * np.linspace(begin, end, N_SAMPLES)
        size = force_max * np.interp(angle % TURN, gauge_angle, closed_gauge)
        points = np.append(_polar(angle, size), [[0.0, 0.0]], axis=0)
        hulls.append(_polygon(directions, points, half_angle, SIDES_OF_GAUGE))
    return hulls[0]._replace(
        radius=force_max * float(gauge.max()),
        sector_center=center,
        polygons=tuple(hull.polygons[0] for hull in hulls),
    )


def _zoned_shape(response: Plane, directions: Array) -> Shape:
    """Forces of an azimuth that pushes ahead, within several arcs: the convex hull of them all, and
    each arc as a part, of one wider than half a turn its halves."""
    force_min, force_max = response.ends
    sectors = [_ring_sector(low, high, force_min, force_max) for low, high in zones_of(response)]
    half_angle = response.sector_half_angle
    polygons = []
    for points in (np.concatenate(sectors), *sectors):
        shape = _polygon(directions, points, half_angle, SIDES_OF_GAUGE)
        polygons.append(shape.polygons[0])
    return Shape(directions, force_max, response.sector_center, half_angle, tuple(polygons))


def zones_of(response: Plane) -> list[tuple[float, float]]:
    """Returns the arcs [rad] that barred zones leave an azimuth, those wider than half a turn as
    their halves."""
    ends = [response.sector_center - response.sector_half_angle]
    for begin, end in response.barred:
        ends += [begin, end]
    ends.append(response.sector_center + response.sector_half_angle)
    zones = []
    for low, high in zip(ends[::2], ends[1::2], strict=True):
        n_pieces = 2 if is_wide(0.5 * (high - low)) else 1
        cuts = np.linspace(low, high, n_pieces + 1).tolist()
        zones += list(pairwise(cuts))
    return zones


def _ring_sector(low: float, high: float, force_min: float, force_max: float) -> Array:
    """Forces (S, 2) [N] whose convex hull is that of all between two angles [rad] and sizes [N]:
    the outer arc, and the ends of the inner one, or none where that is small."""
    outer = _polar(np.linspace(low, high, N_SAMPLES), np.full(N_SAMPLES, force_max))
    inner_size = force_min if force_min > MIN_ASPECT * force_max else 0.0
    return np.concatenate([outer, _polar(np.array([low, high]), np.full(2, inner_size))])


def _polar(angle: Array, size: Array) -> Array:
    """Forces (S, 2) [N] of angles (S,) [rad] and sizes (S,) [N]."""
    return np.asarray(size[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def _polygon(directions: Array, points: Array, half_angle: float, sides: int) -> Shape:
    """A polygon inside the convex hull of forces (S, 2) [N], with their extreme points as its
    corners; a line where the hull has no width."""
    center = points.mean(axis=0)
    axes = np.linalg.svd(points - center)[2]
    principal = (points - center) @ axes.T  # coordinates along the principal axes
    low = principal.min(axis=0)
    high = principal.max(axis=0)
    length, width = high - low
    angle = math.atan2(axes[0, 1], axes[0, 0])
    if width <= MIN_ASPECT * length or length == 0.0:
        ends = np.array([low, high])
        ends[:, 1] = ends[:, 1].mean()
        return Shape(directions, 0.5 * length, angle, 0.0, (center + ends @ axes,))
    # Corners are the extreme points in directions around the set scaled to be as wide as long.
    turn = TURN / sides * np.arange(sides)
    normals = np.stack([np.cos(turn), np.sin(turn)])
    extreme = (principal / (length, width) @ normals).argmax(axis=0)
    is_new = extreme != np.roll(extreme, 1)
    corners = points[extreme[is_new]]
    radius = float(np.linalg.norm(corners - corners.mean(axis=0), axis=-1).max())
    return Shape(directions, radius, angle, half_angle, (corners,))


def is_wide(half_angle: Any) -> Any:
    """Returns whether arcs of half angles [rad] are wider than half a turn and no full circle."""
    return (half_angle > np.pi / 2 + HALF_TURN_TOLERANCE) & (half_angle < np.pi)


def not_convex(sets: ForceSets) -> NDArray[np.intp]:
    """Returns the indices of working actuators whose sets are not convex: with an arc wider than
    half a turn that is no full circle, or with several arcs."""
    is_working = (sets.radius > 0.0).any(axis=0)
    return np.flatnonzero((sets.n_parts[0] > 1) & is_working)


def cut_actuators(sets: ForceSets) -> NDArray[np.intp]:
    """Returns the indices of those whose sets `convex_parts` cuts: as many of the first ones as
    give no more than `MAX_PARTS`."""
    split = not_convex(sets)
    total = np.cumprod(sets.n_parts[0, split])
    return split[total <= MAX_PARTS]


def convex_parts(sets: ForceSets) -> ForceSets:
    """Returns P convex parts of each of R robots with the same arcs, robots fastest (P * R rows).

    Of the sets that are cut (`cut_actuators`) all parts are used, in all combinations: of a wide
    sector its halves along its middle. Further ones are not cut and have their hulls.
    """
    cut = cut_actuators(sets)
    choices = np.array(list(product(*(range(k) for k in sets.n_parts[0, cut]))), np.intp)
    robots, n = sets.radius.shape
    # Which part of each actuator is used, from 1; 0 for all of it.
    chosen = np.zeros((len(choices), n), np.intp)
    chosen[:, cut] = choices.reshape(len(choices), len(cut)) + 1
    part = np.repeat(chosen, robots, axis=0)
    parts = sets.tile(len(choices))
    # In the block, the polygon of a set is followed by those of its parts.
    has_polygon = parts.polygon_offset > 0.0
    for k in range(1, part.max(initial=0) + 1):
        skipped = (part >= k) & has_polygon
        corners = sets.block[parts.polygon_offset[skipped].astype(np.intp)]
        parts.polygon_offset[skipped] += 1.0 + 2.0 * corners
    # Shift of the sector's centre over its half angle: 0 where it is not cut.
    shift = np.select([part == 1, part == 2], [0.5, -0.5], 0.0)
    half_angle_share = np.where(part == 0, 1.0, 0.5)
    parts = parts._replace(
        sector_center=parts.sector_center + shift * parts.sector_half_angle,
        sector_half_angle=half_angle_share * parts.sector_half_angle,
        n_parts=np.where(part == 0, parts.n_parts, 1),
    )
    if sets.powers is None:
        return parts
    return parts._replace(sides=sets.powers.sides_of_parts(part))
