"""A robot as a proof takes it: positions and axes as decimals, and for each actuator the set of its
forces and its power, as `check_proof` reads them.

What a file of a proof says of an actuator is a premise: the proof holds of the robot in the file.
Positions, axes and arcs are those of the layout, rounded to `PLACES` decimals, and force limits are
the layout's own; power is written as chords above the curve of its law or table. A fin's largest
force and its power come from its law, rounded to the safe side by `FIN_MARGIN`: in mean over a
stroke, as everywhere in finlab.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from finlab.actuators.azimuth import Azimuth
from finlab.actuators.fin.fin import Fin
from finlab.actuators.fin.fin_response import fin_table
from finlab.actuators.propeller import usable_force
from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_power import ThrustPower
from finlab.actuators.thruster import Thruster
from finlab.analysis.force_pieces import Piece
from finlab.arrays import Array
from finlab.axes import is_full_turn
from finlab.errors import FinlabError
from finlab.layout import Layout

LINE = [[[1.0, 0.0], [1.0, 0.0]]]
"""The sectors of an actuator of one axis."""
PLACES = 12
"""Decimals of positions [m], axes and directions [1]."""
FIN_MARGIN = 1e-6
"""Share by which a fin's largest force and its power are rounded to the safe side [1]."""
POWER_POINTS = 65
"""Points of a curve of power, on each side."""
EDGE_LENGTH = 1.0 + 1e-6
"""Length of the directions that end an arc [1]: at least 1, whatever rounding does."""
HALF_TURN_TOLERANCE = 1e-9
"""Most by which an arc that counts as half a turn differs from it [rad]."""
INNER_SHARE = 0.3
"""Where a sector's inner point lies between its tip and its rim [1]."""
NO_ROOM = 0.99
"""Least force of a fin over its largest one from which on there is no room between them [1]."""
RIM_STEP = 0.05
"""Steps between points on the rim of a sector that the search takes for a polygon [rad]: inside by
at most 3e-4 of the radius."""
SMALL_LEAST = 1e-6
"""Least force over the largest one up to which the search takes a sector whole [1]."""
RING_PARTS = 8
"""Convex parts of the forces of one that turns all round and cannot stop."""
ROUND_PIECE = 2.0 * math.pi / 3.0
"""Widest sector of all directions [rad]."""
RING_PIECE = math.pi / 8.0
"""Widest arc of a piece of forces that cannot be small [rad]."""
SHIFTS = (0.0, 1.0, -1.0)
"""Where convex parts of an arc lie, from its middle to its ends [1]."""


class NotSettledError(FinlabError):
    """A statement that is neither proved nor refuted; the message says why."""


class Part(NamedTuple):
    """A convex part of an actuator's forces, in coordinates along its axes."""

    piece: Piece
    """The part as the search takes it."""
    inner_point: Array
    """A force (2,) [N] well inside."""
    is_ahead: bool = True
    """Whether all its forces are ahead."""
    line: list[float] | None = None
    """The direction (2,) that its forces lie along, as decimals; None of a part that is wide."""


@dataclass(frozen=True, eq=False)
class ProofActuator:
    """One actuator of a proof."""

    values: dict[str, Any]
    """Its premises, as the file has them."""
    radius: float
    """Largest force that is certain [N]; of a line the farther one of its ends."""
    parts: tuple[Part, ...]
    """Convex parts to choose from, at least one."""
    cover: Piece
    """A convex set that contains these."""
    outer_cover: Piece
    """A convex set that contains all forces that it may have."""
    cuts: tuple[Piece, ...] = ()
    """Convex sets that contain all forces in each of its sectors, ahead and then astern; none where
    `outer_cover` is the set itself."""
    arcs: tuple[tuple[float, float], ...] = ()
    """First and last direction of each of its arcs [rad]; none of a line."""

    @property
    def name(self) -> str:
        """Its name."""
        return str(self.values["name"])

    @property
    def n_axes(self) -> int:
        """1 of a line, 2 of a plane."""
        return len(self.values["axes"])


def proof_actuators(layout: Layout, with_power: bool) -> tuple[ProofActuator, ...]:
    """Returns the premises of a robot at rest in the water.

    Args:
        layout: the robot.
        with_power: whether the statement has a power budget.

    Returns:
        Its actuators in the order of the layout, without rudders, which give no force at rest.

    Raises:
        NotSettledError: no premises are known that are certain, with the reason.
    """
    if layout.interaction is not None:
        raise NotSettledError(
            "the layout has an interaction, with which wrenches do not add up; leave it out"
        )
    actuators = []
    for actuator, frame in zip(layout.actuators, layout.frames, strict=True):
        if isinstance(actuator, Rudder):
            continue
        axes = frame[list(actuator.KIND.push_rows)]
        try:
            if isinstance(actuator, Thruster):
                made = _thruster(actuator, axes, with_power)
            elif isinstance(actuator, Azimuth):
                made = _azimuth(actuator, axes, with_power)
            elif isinstance(actuator, Fin):
                made = _fin(actuator, axes)
            else:
                raise NotSettledError(f"nothing certain is known of a {actuator.type}")
        except NotSettledError as error:
            raise NotSettledError(f"{actuator.name}: {error}") from None
        if not with_power:
            made.values["power"] = None
        actuators.append(made)
    return tuple(actuators)


def decimals(values: Any) -> Any:
    """Returns numbers rounded to `PLACES` decimals, as plain values."""
    return (np.round(np.asarray(values, np.float64), PLACES) + 0.0).tolist()  # + 0.0: no "-0.0"


def _premises(
    actuator: Any,
    axes: Array,
    force: tuple[float, float],
    outer_force: tuple[float, float],
    power: Any,
) -> dict[str, Any]:
    """What a file says of an actuator with these axes (1, 3) or (2, 3)."""
    return {
        "name": actuator.name,
        "type": actuator.type,
        "position_m": decimals(actuator.position),
        "axes": decimals(axes),
        "torque_per_newton_m": decimals(getattr(actuator, "torque_per_newton", 0.0)),
        "force_n": list(map(float, force)),
        "outer_force_n": list(map(float, outer_force)),
        "sectors": LINE,
        "mean": False,
        "power": power,
    }


def _thruster(thruster: Thruster, axes: Array, with_power: bool) -> ProofActuator:
    least, most = usable_force(thruster)
    if with_power and thruster.dead_band:
        raise NotSettledError("has a dead band, within which its power is not convex")
    if not least <= 0.0 <= most:
        raise NotSettledError(f"hangs at {most:g} N")
    power = _propeller_power(thruster, least, most)
    radius = max(-least, most)
    values = _premises(thruster, axes, (least, most), (least, most), power)
    values["mean"] = thruster.dead_band > 0.0
    piece = Piece(radius, corners=np.array([[least, 0.0], [most, 0.0]]))
    part = Part(piece, np.array([0.25 * (least + most), 0.0]))
    return ProofActuator(values, radius, (part,), piece, piece)


def _azimuth(azimuth: Azimuth, axes: Array, with_power: bool) -> ProofActuator:
    least, most = usable_force(azimuth)
    if 0.0 < least < azimuth.dead_band:
        least = 0.0  # a command within the dead band gives no force
    if with_power and azimuth.dead_band:
        raise NotSettledError("has a dead band, within which its power is not convex")
    if most <= 0.0:
        raise NotSettledError("pushes astern alone; turn its zero direction round")
    power = _propeller_power(azimuth, least, most)
    values = _premises(azimuth, axes, (least, most), (least, most), power)
    values["mean"] = azimuth.dead_band > 0.0 and least <= 0.0
    arcs = []
    for low, high in azimuth.arcs:
        half_angle = math.pi if is_full_turn(high - low) else 0.5 * (high - low)
        arcs.append(_Arc(0.5 * (low + high), half_angle))
    return _plane(values, arcs)


def _fin(fin: Fin, axes: Array) -> ProofActuator:
    table = fin_table(fin)
    law = table.box.law
    if law.measured:
        raise NotSettledError(
            "its forces are a table of measurements, which also has forces along the shaft"
        )
    gauge = table.directions.gauge
    weakest_share = 1.0 if gauge is None else float(gauge.min()) * (1.0 - _gauge_step(gauge))
    strongest_share = 1.0 if gauge is None else float(gauge.max()) * (1.0 + _gauge_step(gauge))
    if weakest_share <= 0.0:
        raise NotSettledError("has directions without force")
    force = np.array([table.table.force[0], table.table.largest])
    least = float(force[0] * strongest_share) * (1.0 + FIN_MARGIN)
    most = float(force[1] * weakest_share) * (1.0 - FIN_MARGIN)
    outer_least = float(force[0] * weakest_share) * (1.0 - FIN_MARGIN)
    outer = float(force[1] * strongest_share) * (1.0 + FIN_MARGIN)
    if least >= NO_ROOM * most:
        raise NotSettledError("can push hardly less than it can at most")

    # Chords of the least power over the force, of the weakest direction; of the strongest one it is
    # less, by `error_w` at most.
    size = outer / weakest_share * np.linspace(0.0, 1.0, POWER_POINTS) ** 2
    between = np.linspace(0.0, size[-1] * weakest_share, 16 * POWER_POINTS)
    in_reach = np.minimum(size, table.table.largest)
    watts = table.table.cost(in_reach)
    slope = table.table.price_max
    watts = watts + slope * (size - in_reach)
    chord = np.interp(between, size * weakest_share, watts)
    true = table.table.cost(np.minimum(between / strongest_share, table.table.largest))
    margin = FIN_MARGIN * float(watts[-1])
    power = {
        "points": _points(size * weakest_share, watts + margin),
        "error_w": float(1.01 * np.max(chord - true)) + 3.0 * margin,
    }
    arc = _Arc(table.directions.sector_center, table.directions.sector_half_angle)
    if not arc.is_narrow:
        least = outer_least = 0.0  # small forces are means over time
    values = _premises(fin, axes, (least, most), (outer_least, outer), power)
    values["mean"] = True
    return _plane(values, [arc])


def _gauge_step(gauge: Array) -> float:
    """How much a gauge (K,) may differ between two of its directions, as a share of it: the largest
    difference of neighbours."""
    return float(np.abs(np.diff(gauge, append=gauge[:1])).max() / gauge.min())


def _propeller_power(propeller: Any, least: float, most: float) -> dict[str, Any]:
    """Chords of its power, over forces from the least to the largest, negative ones astern."""
    side = np.linspace(0.0, 1.0, POWER_POINTS) ** 2
    largest = most if least < most else 1.0  # a curve of one that gives no force has two ends, too
    force = largest * side if largest > 0.0 else np.zeros(1)
    if least < 0.0:
        force = np.append(least * side[:0:-1], force)
    between = np.interp(
        np.linspace(0.0, len(force) - 1.0, 32 * len(force)), np.arange(len(force)), force
    )
    curve = ThrustPower([propeller.model])
    watts = _convex(force, curve.watts(force[:, None])[:, 0])
    error = np.interp(between, force, watts) - curve.watts(between[:, None])[:, 0]
    margin = FIN_MARGIN * float(watts.max())
    return {
        "points": _points(force, watts + margin),
        "error_w": float(1.01 * error.max()) + 3.0 * margin,
    }


def _convex(x: Array, y: Array) -> Array:
    """Values (K,) at points around 0, raised where needed so that slopes rise and the value at 0 is
    the least."""
    zero = int(np.searchsorted(x, 0.0))
    raised = y.copy()
    for side in (slice(zero, None), slice(zero, None, -1)):
        steps = np.abs(np.diff(x[side]))
        slopes = np.maximum.accumulate(np.maximum(np.diff(y[side]) / steps, 0.0))
        raised[side] = y[zero] + np.append(0.0, np.cumsum(slopes * steps))
    return raised


def _points(x: Array, y: Array) -> list[list[float]]:
    """Points that are convex when they are read as decimals."""
    curved = _convex(x, y)
    # A parabola far below the margin keeps slopes apart that rounding would bring out of order.
    span = x[-1] - x[0]
    curved = curved + 1e-9 * (curved.max() + 1e-12) * (x / span) ** 2
    points: list[list[float]] = np.stack([x, curved], axis=-1).tolist()
    return points


class _Arc(NamedTuple):
    """Directions of forces."""

    center: float
    """Its middle [rad]."""
    half_angle: float
    """Half of it [rad]; pi of all directions."""

    @property
    def is_round(self) -> bool:
        """Whether it has all directions."""
        return self.half_angle >= math.pi

    @property
    def is_narrow(self) -> bool:
        """Whether it is less than half a turn."""
        return self.half_angle < 0.5 * math.pi - HALF_TURN_TOLERANCE

    @property
    def edges(self) -> list[list[float]]:
        """Its ends as a file has them."""
        return _edges(self.center, self.half_angle)

    def pieces(self, width: float) -> list[_Arc]:
        """The arc in equal pieces that are no wider [rad]."""
        count = max(1, math.ceil(2.0 * self.half_angle / width - HALF_TURN_TOLERANCE))
        half_angle = self.half_angle / count
        first = self.center - self.half_angle + half_angle
        return [_Arc(first + 2.0 * half_angle * k, half_angle) for k in range(count)]


def _plane(values: dict[str, Any], arcs: Sequence[_Arc]) -> ProofActuator:
    """An actuator whose force lies in a plane, with its parts."""
    least, most = values["force_n"]
    outer_least, outer_most = values["outer_force_n"]
    is_round = arcs[0].is_round
    parts = []
    for arc in arcs:
        parts += _parts(arc, max(least, 0.0), most, values["mean"])
        if least < 0.0 and not is_round:
            parts += _reversing_parts(arc, least, most)
    cover = _cover([part.piece for part in parts])

    # Sectors are narrow where an actuator cannot stop: what their hulls have beyond them is little.
    sectors = []
    ahead = []
    astern = []
    is_ring = outer_least > 0.0 and not values["mean"]
    for arc in arcs:
        width = RING_PIECE if is_ring else (ROUND_PIECE if is_round else math.pi)
        chain = [arc] if arc.is_narrow and not is_ring else arc.pieces(width)
        edges = [arc.edges[0], *(piece.edges[0] for piece in chain[1:])]
        edges.append(edges[0] if is_round else arc.edges[1])
        for piece, *ends in zip(chain, edges, edges[1:], strict=False):
            sectors.append(ends)
            ahead.append(_outer_piece(piece, max(outer_least, 0.0), outer_most))
            if outer_least < 0.0:
                astern.append(_mirrored(_outer_piece(piece, 0.0, -outer_least)))
    values["sectors"] = sectors
    cuts = ahead + astern
    outer_cover = _cover(cuts)
    if len(cuts) == 1 or (is_round and not is_ring):
        cuts = []
        outer_cover = _outer_piece(arcs[0], outer_least, outer_most)
    spans = [(arc.center - arc.half_angle, arc.center + arc.half_angle) for arc in arcs]
    return ProofActuator(values, most, tuple(parts), cover, outer_cover, tuple(cuts), tuple(spans))


def _parts(arc: _Arc, least: float, most: float, has_means: bool) -> list[Part]:
    """Convex parts of the forces within an arc; of one that cannot stop beyond a line ahead, or
    all means of these."""
    quarter = 0.5 * math.pi
    room = max(arc.half_angle - quarter, 0.0)
    if least == 0.0 or has_means:
        if arc.is_round:
            return [Part(Piece(most), np.zeros(2))]
        if room <= HALF_TURN_TOLERANCE:
            return [_sector(arc, least, most)]
        shifted = [_Arc(arc.center + shift * (room - 1e-9), quarter) for shift in SHIFTS]
        return [_sector(each, 0.0, most) for each in shifted]
    parts = []
    if arc.is_round:
        for k in range(RING_PARTS):
            ahead = 2.0 * math.pi * k / RING_PARTS
            parts.append(_beyond(_Arc(ahead, quarter), ahead, least, most))
        return parts
    for shift in SHIFTS if arc.half_angle > 0.0 else (0.0,):
        if room <= HALF_TURN_TOLERANCE:
            parts.append(_beyond(arc, arc.center + shift * arc.half_angle, least, most))
        else:
            center = arc.center + shift * (room - 1e-9)
            parts.append(_beyond(_Arc(center, quarter), center, least, most))
    return parts


def _reversing_parts(arc: _Arc, least: float, most: float) -> list[Part]:
    """Further convex parts of one that also pushes against its directions: those forces, lines
    across 0, and of a wide arc all forces up to some size."""
    parts = []
    for ahead in _parts(arc, 0.0, -least, has_means=False):
        parts.append(Part(_mirrored(ahead.piece), -ahead.inner_point, is_ahead=False))
    if not arc.is_narrow:
        parts.append(Part(Piece(min(most, -least)), np.zeros(2), is_ahead=False))
        return parts
    for shift in SHIFTS:
        direction = decimals(_direction(arc.center + shift * (1.0 - 1e-9) * arc.half_angle))
        unit = np.array(direction) / np.linalg.norm(direction)
        piece = Piece(max(most, -least), corners=np.outer([least, most], unit))
        inner_point = 0.25 * (least + most) * unit
        parts.append(Part(piece, inner_point, is_ahead=False, line=direction))
    return parts


def _mirrored(piece: Piece) -> Piece:
    """The forces against those of a piece."""
    corners = None if piece.corners is None else -piece.corners
    return piece._replace(center=piece.center + math.pi, corners=corners)


def _sector(arc: _Arc, least: float, most: float) -> Part:
    """All means of forces from the least to the most within an arc of at most half a turn."""
    direction = np.array([math.cos(arc.center), math.sin(arc.center)])
    chord = least * math.cos(arc.half_angle)
    if arc.half_angle == 0.0:
        return _beyond(arc, arc.center, least, most)
    inner_point = INNER_SHARE * most * direction
    piece = Piece(most, arc.center, arc.half_angle)
    if chord > SMALL_LEAST * most:
        inner_point = 0.5 * (chord + most) * direction
        rim = _rim(arc.center - arc.half_angle, arc.center + arc.half_angle)
        # An edge is a little longer than 1, so that the chord between edges is farther out.
        inner = least * EDGE_LENGTH * rim[[-1, 0]]
        piece = Piece(most, corners=np.concatenate([most * rim, inner]))
    return Part(piece, inner_point)


def _beyond(arc: _Arc, ahead: float, least: float, most: float) -> Part:
    """Forces within an arc of at most half a turn that push with at least the least force along a
    direction [rad]."""
    # Up to the ends of the arc, or up to the rim where that is nearer.
    to_rim = math.acos(min(least / most, 1.0)) if most > 0.0 else 0.0
    low = max(arc.center - arc.half_angle, ahead - to_rim)
    high = min(arc.center + arc.half_angle, ahead + to_rim)
    rim = most * _rim(low, high)
    along_line = least / np.maximum(np.cos(np.array([high, low]) - ahead), 1e-12)
    inner = np.minimum(along_line / most, 1.0)[:, None] * rim[[-1, 0]] if most > 0.0 else rim[:2]
    corners = np.concatenate([rim, inner])
    if arc.half_angle == 0.0:
        corners = corners[[0, -1]]
    return Part(Piece(most, corners=corners), corners.mean(axis=0))


def _outer_piece(arc: _Arc, least: float, most: float) -> Piece:
    """A convex set of all forces within an arc, of one that is wider than half a turn its hull."""
    reverse = max(-least, 0.0)
    radius = max(most, reverse)
    if arc.is_round or (reverse == 0.0 and least <= SMALL_LEAST * most and arc.half_angle > 0.0):
        return Piece(radius, arc.center, arc.half_angle)
    rim = _rim(arc.center - arc.half_angle, arc.center + arc.half_angle)
    return Piece(radius, corners=_convex_hull(np.concatenate([most * rim, least * rim])))


def _cover(pieces: Sequence[Piece]) -> Piece:
    """A convex set that contains pieces."""
    if len(pieces) == 1:
        return pieces[0]
    radius = max(piece.radius for piece in pieces)
    points = []
    for piece in pieces:
        if piece.corners is not None:
            points.append(piece.corners)
            continue
        rim = _rim(piece.center - piece.half_angle, piece.center + piece.half_angle)
        points.append(piece.radius * rim)
        points.append(np.zeros((1, 2)))
    return Piece(radius, corners=_convex_hull(np.concatenate(points)))


def _rim(low: float, high: float) -> Array:
    """Directions (P, 2) from one angle to another [rad]."""
    n_steps = max(1, math.ceil((high - low) / RIM_STEP))
    angle = np.linspace(low, high, n_steps + 1)
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _convex_hull(points: Array) -> Array:
    """The corners (K, 2) of the convex hull of points (P, 2), counter-clockwise; of points along a
    line both ends."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        direction = points[np.linalg.norm(points, axis=1).argmax()]
        along = points @ direction
        return np.asarray(points[[along.argmin(), along.argmax()]])


def _edges(center: float, half_angle: float) -> list[list[float]]:
    """The directions that end an arc, exactly opposite ones of half a turn."""
    first = _direction(center - half_angle)
    if abs(half_angle - 0.5 * math.pi) <= HALF_TURN_TOLERANCE:
        return [first, [0.0 - first[0], 0.0 - first[1]]]
    return [first, _direction(center + half_angle)]


def _direction(angle: float) -> list[float]:
    """A direction as decimals, not shorter than 1."""
    exact = EDGE_LENGTH * np.array([math.cos(angle), math.sin(angle)])
    rounded: list[float] = decimals(exact)
    return rounded
