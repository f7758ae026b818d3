"""Thrust of a ship's actuators by DNV-ST-0111 (December 2021), level 1, and what is lost of it.

Angles of thrust are those of the standard ([3.8.2]): 0 forward, counterclockwise, so that 90
degrees push to port. The sets hold the nominal thrust with the losses by direction (flushing and
skegs); those by the weather are factors of the whole set.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from finlab.actuators.azimuth import Azimuth
from finlab.actuators.thruster import Thruster
from finlab.analysis.dnv_loads import Weather, folded
from finlab.analysis.ship_file import ActuatorType, Ship, ShipActuator
from finlab.analysis.split_sets import Piece, SplitSet
from finlab.arrays import Array
from finlab.axes import TURN, is_full_turn
from finlab.errors import LayoutError
from finlab.forces.force_sets import shapes_of
from finlab.forces.power_sides import PowerCurve, Side
from finlab.forces.within_budget import sides_of
from finlab.layout import Layout

LOSSES = ("ventilation", "flushing", "skeg")
"""Losses that can be left out; the constant one cannot."""
CONSTANT_LOSS = 0.9
"""Share of the thrust that is left of all ([3.9.3])."""
THRUST_FACTOR = {"azimuth": 800.0, "pod": 800.0, "shaft_line": 800.0, "cycloidal": 900.0,
                 "tunnel": 900.0}  # fmt: skip
"""Thrust over (diameter x power)^(2/3) (Table 3-1) [N / (m kW)^(2/3)]."""
CONTRA_ROTATING_FACTOR = 950.0
"""The same of contra-rotating propellers."""
DUCTED_FACTOR = 1200.0
"""The same of ducted propellers."""
INLET_FACTOR = {"broken": 1.0, "rounded": 1.07, "other": 0.93}
"""Of a tunnel's inlet (Table 3-2)."""
REVERSE_FACTOR = {
    ("fixed", False): 0.9, ("fixed", True): 0.7, ("controllable", False): 0.65,
    ("controllable", True): 0.5,
}  # fmt: skip
"""Of reversed thrust, by pitch and whether there is a duct (Table 3-3)."""
MECHANICAL_EFFICIENCY = {
    "azimuth": 0.93, "pod": 0.98, "shaft_line": 0.97, "cycloidal": 0.91, "tunnel": 0.93,
}  # fmt: skip
"""Power at the propeller over brake power (Table 3-4)."""
MAGNET_EFFICIENCY = 0.995
"""The same of permanent magnet motors at the rim."""
MAGNET_CYCLOIDAL_EFFICIENCY = 0.97
"""The same of permanent magnet cycloidal actuators."""
THRUST_EXPONENT = 1.5
"""Power grows with this power of the nominal thrust ([3.9.2])."""
VENTILATION = (2.0, 1.5, 15.2, 0.85, 0.38)
"""k_V1 to k_V5 of the loss by ventilation ([3.9.4])."""
FLUSHING_REACH = 15.0
"""Diameters within which a working actuator may not be flushed ([3.11.3])."""
FLUSHING_SLOPE = 0.1
"""Slope of the edge of a race that counts as flushing, besides diameter over distance."""
DEAD_REACH = {False: 8.0, True: 4.0}
"""Diameters within which a dead actuator that is flushed costs thrust, open and ducted
([3.11.4])."""
DEAD_WIDTH = {False: 0.6, True: 0.35}
"""Of the sector in which it does, half the width over the diameter."""
DEAD_LOSS = (0.02, 0.25, 1.2)
"""Coefficients of the loss in the middle of that sector."""
SKEG_REACH = {False: 15.0, True: 8.0}
"""Diameters within which a skeg costs thrust, open and ducted ([3.11.5])."""
SKEG_WIDTH = 0.6
"""Of the race at a skeg, half the width over the diameter."""
CORNER_STEP = math.pi / 180.0
"""Steps of direction of a polygon: within its arc by at most 4e-5 of the radius."""
SAME_DIRECTION = 1e-9
"""Difference of direction that is rounding [rad]."""
VERTICAL = 1e-6
"""How far a direction may be off the vertical or the horizontal [1]."""


@dataclass(frozen=True)
class ShipThruster:
    """An actuator of a ship as the standard has it."""

    name: str
    type: ActuatorType
    x: float
    """Forward of the middle of the ship [m]."""
    y: float
    """To port of the centreline [m]."""
    forward: float
    """Nominal thrust [N]."""
    reverse: float
    """Nominal thrust the other way, of those that do not turn [N]."""
    data: ShipActuator
    arc: tuple[float, float] | None
    """Directions in which it may push [rad]; None all round. Of one that does not turn, that of its
    forward thrust, twice."""
    power: tuple[PowerCurve, PowerCurve] | None = None
    """What its forward and its reversed thrust take, as shares of the largest; None where no power
    budget counts."""
    bus: str | None = None
    """Name of the bus whose budget counts; None for no limit."""

    @property
    def turns(self) -> bool:
        """Whether it pushes in more than one line."""
        return self.arc is None or self.arc[0] < self.arc[1]

    @property
    def diameter(self) -> float | None:
        """Of its propeller [m]."""
        return self.data.diameter_m


def ship_thrusters(
    layout: Layout, ship: Ship, bus_of: Mapping[str, str] | None = None
) -> tuple[ShipThruster, ...]:
    """Returns the actuators of a layout as the standard has them.

    Args:
        layout: the actuators.
        ship: the ship.
        bus_of: the bus of each actuator that has one, by names; None where no power budget counts.

    Raises:
        LayoutError: the file of the ship names one that is not there, or the standard has no rule
            for one.
    """
    layout.indices(tuple(ship.actuators), "ship.actuators")
    power: list[tuple[PowerCurve, PowerCurve] | None] = [None] * layout.n
    if bus_of is not None:
        power = [*_powers(layout, ship)]
    found = []
    for actuator, curves in zip(layout.actuators, power, strict=True):
        data = ship.actuators.get(actuator.name, ShipActuator())
        if isinstance(actuator, Azimuth):
            arc, known_type = _azimuth_arc(actuator)
        elif isinstance(actuator, Thruster):
            arc, known_type = _line(actuator)
        else:
            raise LayoutError(
                f"{actuator.name}: DNV-ST-0111 level 1 is computed of thrusters and azimuths, got "
                f"a {type(actuator).__name__.lower()}; the plot without a standard takes all types"
            )
        actuator_type = known_type if data.type is None else data.type
        turns = arc is None or arc[0] < arc[1]
        if turns != (actuator_type in ("azimuth", "pod", "cycloidal")):
            raise LayoutError(
                f"ship.actuators.{actuator.name}.type: got {actuator_type}, but it "
                f"{'turns' if turns else 'does not turn'} in the layout"
            )
        low, high = actuator.force
        forward = max(high, 0.0)
        reverse = max(-low, 0.0)
        if data.power_kw is not None:
            forward = nominal_thrust(actuator.name, actuator_type, data)
            if reverse > 0.0:
                reverse = forward * _reverse_factor(actuator_type, data)
        x, y, _ = actuator.position
        found.append(
            ShipThruster(
                name=actuator.name,
                type=actuator_type,
                x=x - ship.midship_m,
                y=y,
                forward=forward,
                reverse=reverse,
                data=data,
                arc=arc,
                power=curves,
                bus=(bus_of or {}).get(actuator.name),
            )
        )
    return tuple(found)


def _powers(layout: Layout, ship: Ship) -> Iterator[tuple[PowerCurve, PowerCurve]]:
    """What the forward and the reversed thrust of each actuator takes: nominal thrust grows with
    power^(2/3) ([3.9.2]), up to the brake power of the ship's file either way; without one, as the
    model of the layout says."""
    nothing = PowerCurve(0.0)
    for actuator, sides in zip(layout.actuators, sides_of(layout, shapes_of(layout)), strict=True):
        data = ship.actuators.get(actuator.name, ShipActuator())
        if data.power_kw is not None:
            at_most = PowerCurve(1e3 * data.power_kw, THRUST_EXPONENT)
            yield at_most, at_most
            continue
        curves = [side.curve for side in sides[0]]
        is_astern_alone = len(curves) == 1 and getattr(actuator, "force", (0.0, 0.0))[1] <= 0.0
        if is_astern_alone:
            curves.insert(0, nothing)
        forward, reverse, *_ = (*curves, nothing, nothing)
        yield forward, reverse


def _azimuth_arc(azimuth: Azimuth) -> tuple[tuple[float, float] | None, ActuatorType]:
    """Directions [rad] in which a turning thruster may push, None all round, and its type."""
    up = azimuth.turn_axis[2]
    if abs(abs(up) - 1.0) > VERTICAL:
        raise LayoutError(
            f"{azimuth.name}.turn_axis: DNV-ST-0111 level 1 has azimuths that turn about the "
            f"vertical, got {list(azimuth.turn_axis)}"
        )
    if azimuth.barred:
        raise LayoutError(
            f"{azimuth.name}.arc_deg: expected one arc for the formulas of DNV-ST-0111, got several"
        )
    low, high = azimuth.turn_range
    if is_full_turn(high - low):
        return None, "azimuth"
    zero = math.atan2(azimuth.zero[1], azimuth.zero[0])
    return ((zero + low, zero + high) if up > 0.0 else (zero - high, zero - low)), "azimuth"


def _line(thruster: Thruster) -> tuple[tuple[float, float], ActuatorType]:
    """Direction [rad] of a thruster that does not turn, twice, and its type."""
    x, y, z = thruster.axis
    if abs(z) > VERTICAL:
        raise LayoutError(
            f"{thruster.name}.axis: DNV-ST-0111 level 1 has horizontal thrusters, got "
            f"{list(thruster.axis)}"
        )
    angle = math.atan2(y, x)
    return (angle, angle), "tunnel" if abs(y) > abs(x) else "shaft_line"


def nominal_thrust(name: str, actuator_type: ActuatorType, data: ShipActuator) -> float:
    """Returns the nominal thrust [N] of a diameter and a brake power ([3.9.2]).

    Args:
        name: the actuator's, for a sentence.
        actuator_type: which rows of the tables count.
        data: with both; the power in kW.

    Raises:
        LayoutError: there is no diameter, or the tables have no row for it.
    """
    if data.diameter_m is None or data.power_kw is None:
        raise LayoutError(
            f"ship.actuators.{name}: expected diameter_m with power_kw, got one alone"
        )
    factor = THRUST_FACTOR[actuator_type]
    efficiency = MECHANICAL_EFFICIENCY[actuator_type]
    if actuator_type in ("azimuth", "pod", "shaft_line"):
        if data.ducted and data.contra_rotating:
            raise LayoutError(
                f"ship.actuators.{name}: DNV-ST-0111, Table 3-1 has no thrust of ducted "
                "contra-rotating propellers; leave out power_kw to take the layout's force_n"
            )
        if data.ducted:
            factor = DUCTED_FACTOR
        elif data.contra_rotating:
            factor = CONTRA_ROTATING_FACTOR
    if data.permanent_magnet:
        is_cycloidal = actuator_type == "cycloidal"
        efficiency = MAGNET_CYCLOIDAL_EFFICIENCY if is_cycloidal else MAGNET_EFFICIENCY
    if actuator_type == "tunnel":
        factor *= INLET_FACTOR[data.inlet]
    power = efficiency * data.power_kw
    return float(factor * (data.diameter_m * power) ** (2.0 / 3.0))


def _reverse_factor(actuator_type: ActuatorType, data: ShipActuator) -> float:
    """Reversed thrust over forward thrust."""
    if actuator_type in ("tunnel", "cycloidal"):
        return 1.0
    return REVERSE_FACTOR[data.pitch, data.ducted]


def thrust_left(
    thruster: ShipThruster, ship: Ship, weather: Weather, heading: Array, ventilation: bool
) -> Array:
    """Returns what the weather leaves of an actuator's thrust (H,): beta_misc beta_vent ([3.9.5]).

    Args:
        thruster: the actuator.
        ship: its ship.
        weather: conditions of a DP capability number.
        heading: where the weather comes from (H,) [rad], clockwise.
        ventilation: whether ventilation counts; it does not without a height and a diameter.
    """
    height = thruster.data.height_m
    diameter = thruster.diameter
    if not ventilation or height is None or diameter is None:
        return np.full(heading.shape, CONSTANT_LOSS)
    k1, k2, k3, k4, k5 = VENTILATION
    load_factor = math.sqrt(thruster.forward / diameter**3) / k3
    # Waves move a ship most abeam, and least at its stern.
    share_of_half_turn = folded(heading) / np.pi
    b = 1.0 + k5 * np.minimum(share_of_half_turn, 1.0 - share_of_half_turn)
    c = 1.0 + 0.4 * min(thruster.x, 0.0) / ship.length_pp_m
    period_ratio = 0.64 * math.sqrt(ship.length_pp_m) / weather.zero_crossing_period
    motion = k4 * b * c * weather.wave_height * min(period_ratio, 1.0)
    sigma = 0.25 * (motion + max(load_factor - 1.0, 0.0))
    submergence = ship.draft_m - height
    argument = k1 * 2.0 * submergence / diameter - k2 * sigma
    normal_distribution = [0.5 * (1.0 + math.erf(a / math.sqrt(2.0))) for a in argument]
    return CONSTANT_LOSS * np.array(normal_distribution)


@dataclass(frozen=True)
class Notch:
    """Thrust that is lost in a sector: linear between its corners."""

    angle: Array
    """Directions (K,) [rad], rising over less than a turn; no loss at the first and last."""
    left: Array
    """Share of the thrust (K,) that is left there [1]."""
    straight: bool
    """Whether the ends of the thrust lie on straight lines between the corners; else the share is
    linear in the angle."""

    def share(self, angle: Array) -> Array:
        """Returns the share that is left in directions [rad]."""
        turned = self.angle[0] + (angle - self.angle[0]) % TURN
        if not self.straight:
            return np.asarray(np.interp(turned, self.angle, self.left, right=1.0))
        share = np.ones(np.shape(angle))
        for k in range(len(self.angle) - 1):
            begin, end = self.angle[k : k + 2]
            size_begin, size_end = self.left[k : k + 2]
            # The radius at an angle of the line through two points in polar coordinates.
            across = size_begin * size_end * math.sin(end - begin)
            from_begin = size_begin * np.sin(turned - begin)
            to_end = size_end * np.sin(end - turned)
            inside = (turned >= begin) & (turned <= end)
            along = np.where(inside, from_begin + to_end, 1.0)
            share = np.where(inside, across / along, share)
        return share


def skeg_notch(thruster: ShipThruster, skeg: tuple[float, float]) -> Notch | None:
    """Returns what a skeg costs an actuator ([3.11.5], Tables 3-7 and 3-8).

    Args:
        thruster: the actuator.
        skeg: x and y of its aftmost point [m].

    Returns:
        The loss, or None: it is a tunnel, below the keel, without a diameter, too far, or in line.
    """
    diameter = thruster.diameter
    if diameter is None or thruster.type == "tunnel":
        return None
    if thruster.data.height_m is not None and thruster.data.height_m <= 0.0:
        return None
    ahead = skeg[0] - thruster.x
    # On the starboard side everything is the mirror image of the port side.
    side = thruster.y - skeg[1]
    if side == 0.0:
        return None
    distance = math.hypot(ahead, side) if ahead > 0.0 else abs(side)
    if distance >= SKEG_REACH[thruster.data.ducted] * diameter:
        return None
    half_width = math.atan(SKEG_WIDTH * diameter / distance)
    flush = 0.5 * math.pi + math.atan(ahead / abs(side))
    worst = min(max(flush + half_width, 0.5 * math.pi), math.pi)
    begin = max(flush - half_width, 0.0)
    end = min(worst + 4.0 * half_width, math.pi)
    angle = np.array([begin, worst, end])
    left = np.array([1.0, 2.0 * worst / math.pi - 1.0, 1.0])
    if end - worst < SAME_DIRECTION:
        # The worst direction is straight aft, where nothing is lost.
        angle, left = angle[:2], left[:2]
    if side < 0.0:
        angle, left = -angle[::-1], left[::-1]
    return Notch(angle, left, straight=False)


def dead_notch(thruster: ShipThruster, dead: ShipThruster) -> Notch | None:
    """Returns what an actuator loses by flushing a dead one ([3.11.4], Figure 3-6), or None."""
    diameter = thruster.diameter
    if diameter is None or dead.type == "tunnel":
        return None
    from_dead = (thruster.x - dead.x, thruster.y - dead.y)
    distance = math.hypot(*from_dead)
    ducted = thruster.data.ducted
    if distance == 0.0 or distance >= DEAD_REACH[ducted] * diameter:
        return None
    half_width = math.atan(DEAD_WIDTH[ducted] * diameter / distance)
    ratio = distance / diameter
    a, b, c = DEAD_LOSS
    left = 1.0 - 1.0 / (a * ratio**2 + b * ratio + c)
    center = math.atan2(from_dead[1], from_dead[0])
    angle = center + half_width * np.array([-1.0, 0.0, 1.0])
    return Notch(angle, np.array([1.0, left, 1.0]), straight=True)


def flushing_zones(
    thruster: ShipThruster, working: Sequence[ShipThruster]
) -> list[tuple[float, float]]:
    """Returns the sectors [rad] in which an actuator would flush another one that works, which is
    forbidden ([3.11.3]).

    The race goes against the thrust: a sector is about the direction from the other one.
    """
    zones = []
    diameter = thruster.diameter
    for other in working:
        if diameter is None or other is thruster or other.type == "tunnel":
            continue
        from_other = (thruster.x - other.x, thruster.y - other.y)
        distance = math.hypot(*from_other)
        if distance == 0.0 or distance >= FLUSHING_REACH * diameter:
            continue
        half_width = math.atan(FLUSHING_SLOPE + diameter / distance)
        center = math.atan2(from_other[1], from_other[0])
        zones.append((center - half_width, center + half_width))
    return zones


def ship_sets(
    thrusters: Sequence[ShipThruster],
    ship: Ship,
    lost: Collection[str] = (),
    losses: Collection[str] = LOSSES,
) -> tuple[SplitSet, ...]:
    """Returns the feasible nominal thrust of those actuators that work, about the layout's origin.

    Args:
        thrusters: all of the ship.
        ship: its particulars.
        lost: names of those that do not work.
        losses: which of `LOSSES` count.
    """
    working = [each for each in thrusters if each.name not in lost]
    dead = [each for each in thrusters if each.name in lost]
    sets = []
    for thruster in working:
        zones: list[tuple[float, float]] = []
        notches: list[Notch | None] = []
        if "flushing" in losses:
            zones = flushing_zones(thruster, working)
            notches += [dead_notch(thruster, each) for each in dead]
        if "skeg" in losses:
            notches += [skeg_notch(thruster, skeg) for skeg in ship.skegs_m]
        known = [notch for notch in notches if notch is not None]
        effectiveness = np.zeros((2, 6))
        effectiveness[0, [0, 5]] = 1.0, -thruster.y
        effectiveness[1, [1, 5]] = 1.0, thruster.x
        if thruster.turns:
            cover, parts = _turning_set(thruster, zones, known)
        else:
            cover, parts = _line_set(thruster, zones, known), ()
        if thruster.power is not None:
            cover = _with_power(cover, thruster)
            parts = tuple(_with_power(part, thruster) for part in parts)
        sets.append(SplitSet(thruster.name, effectiveness, cover, parts, thruster.bus))
    return tuple(sets)


def _with_power(piece: Piece, thruster: ShipThruster) -> Piece:
    """A set of an actuator with what its forces take: where losses leave less of the thrust, the
    power is still that of all."""
    assert thruster.power is not None
    forward, reverse = thruster.power
    if piece.radius <= 0.0:
        return piece
    if thruster.turns:
        side = Side(forward, piece.radius, piece.center, piece.half_angle, piece.corners)
        return piece._replace(sides=(side,))
    assert piece.corners is not None
    sides = []
    for corner, curve in zip(piece.corners, (forward, reverse), strict=True):
        size = float(np.linalg.norm(corner))
        if size > 0.0:
            sides.append(Side(curve, size, corners=corner[None]))
    return piece._replace(sides=tuple(sides))


def _share_left(notches: Sequence[Notch], angle: Array) -> Array:
    """What all losses by direction leave in directions [rad]: of several skegs, or dead actuators,
    the worst counts; both kinds multiply ([3.11.6])."""
    share = np.ones(np.shape(angle))
    for straight in (False, True):
        of_kind = [notch.share(angle) for notch in notches if notch.straight is straight]
        if of_kind:
            share = share * np.min(of_kind, axis=0)
    return share


def _line_set(
    thruster: ShipThruster, zones: Sequence[tuple[float, float]], notches: Sequence[Notch]
) -> Piece:
    """Forces of an actuator that does not turn."""
    assert thruster.arc is not None
    forward_angle = thruster.arc[0]
    ends = []
    for angle, size in ((forward_angle, thruster.forward),
                        (forward_angle + math.pi, thruster.reverse)):  # fmt: skip
        is_forbidden = any(
            SAME_DIRECTION < (angle - begin) % TURN < end - begin - SAME_DIRECTION
            for begin, end in zones
        )
        left = 0.0 if is_forbidden else float(_share_left(notches, np.array(angle)))
        ends.append([left * size * math.cos(angle), left * size * math.sin(angle)])
    corners = np.array(ends)
    radius = float(np.linalg.norm(corners, axis=-1).max())
    return Piece(radius, corners=corners)


def _turning_set(
    thruster: ShipThruster, zones: Sequence[tuple[float, float]], notches: Sequence[Notch]
) -> tuple[Piece, tuple[Piece, ...]]:
    """A cover of the forces of an azimuth, and the convex parts of these; no parts where the cover
    is all of them."""
    arcs = _allowed_arcs(thruster.arc, zones)
    if not arcs:
        return Piece(0.0), ()
    stretches = []
    for arc in arcs:
        stretches += _convex_stretches(arc, notches, thruster.forward)
    if len(stretches) == 1 and not notches and arcs[0][1] - arcs[0][0] >= TURN:
        return Piece(thruster.forward), ()
    pieces = [_piece(stretch, notches, thruster.forward) for stretch in stretches]
    if len(pieces) == 1 and len(arcs) == 1:
        return pieces[0], ()
    return _cover(arcs, pieces, thruster.forward, bool(notches)), tuple(pieces)


def _allowed_arcs(
    arc: tuple[float, float] | None, zones: Sequence[tuple[float, float]]
) -> list[tuple[float, float]]:
    """The arcs [rad] that forbidden zones leave of an arc, None of all directions."""
    begin, end = (0.0, TURN) if arc is None else arc
    if arc is None and zones:
        # Begin all round at the end of a zone, where no arc is cut in two.
        begin = zones[0][1]
        end = begin + TURN
    taken = []
    for low, high in zones:
        first = begin + (low - begin) % TURN
        for turn in (0.0, -TURN):
            taken.append((first + turn, first + turn + high - low))
    arcs = []
    position = begin
    for low, high in sorted(taken):
        if low > position + SAME_DIRECTION:
            arcs.append((position, min(low, end)))
        position = max(position, high)
        if position >= end:
            break
    if position < end - SAME_DIRECTION:
        arcs.append((position, end))
    return [(low, high) for low, high in arcs if high > low + SAME_DIRECTION]


def _corner_angles(arc: tuple[float, float], notches: Sequence[Notch]) -> Array:
    """Directions [rad] of the corners of a polygon within an arc: steps, and where losses bend."""
    begin, end = arc
    n_steps = max(1, math.ceil((end - begin) / CORNER_STEP - SAME_DIRECTION))
    angles = [np.linspace(begin, end, n_steps + 1)]
    for notch in notches:
        bends = begin + (notch.angle - begin) % TURN
        angles.append(bends[bends < end])
    merged = np.unique(np.concatenate(angles))
    is_new = np.append(True, np.diff(merged) > SAME_DIRECTION)
    return np.asarray(merged[is_new])


def _corners(arc: tuple[float, float], notches: Sequence[Notch], radius: float) -> Array:
    """Ends (K, 2) [N] of the largest forces in these directions."""
    angle = _corner_angles(arc, notches)
    size = radius * _share_left(notches, angle)
    return np.asarray(size[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def _convex_stretches(
    arc: tuple[float, float], notches: Sequence[Notch], radius: float
) -> list[tuple[float, float]]:
    """Arcs [rad] of at most half a turn, on which the forces are convex, that make up an arc; a
    disc is one."""
    begin, end = arc
    is_round = end - begin >= TURN - SAME_DIRECTION
    angle = _corner_angles(arc, notches)
    points = _corners(arc, notches, radius)
    edge = np.diff(points, axis=0)
    bend = edge[:-1, 0] * edge[1:, 1] - edge[:-1, 1] * edge[1:, 0]
    least_bend = -SAME_DIRECTION * radius**2
    reflex = angle[1:-1][bend < least_bend].tolist()
    cuts = [begin, *reflex, end]
    if is_round:
        bend_at_seam = edge[-1, 0] * edge[0, 1] - edge[-1, 1] * edge[0, 0]
        if bend_at_seam < least_bend:
            reflex = [begin, *reflex]
        if not reflex:
            return [(begin, end)]
        # No cut where the circle was opened, unless it is reflex there.
        cuts = [*reflex, reflex[0] + TURN]
    stretches = []
    for low, high in zip(cuts, cuts[1:], strict=False):
        n_parts = max(1, math.ceil((high - low) / math.pi - SAME_DIRECTION))
        ends = np.linspace(low, high, n_parts + 1).tolist()
        stretches += list(zip(ends, ends[1:], strict=False))
    return stretches


def _piece(arc: tuple[float, float], notches: Sequence[Notch], radius: float) -> Piece:
    """Forces in an arc of at most half a turn."""
    begin, end = arc
    angle = _corner_angles(arc, notches)
    if (_share_left(notches, angle) >= 1.0).all():
        return Piece(radius, 0.5 * (begin + end), 0.5 * (end - begin))
    points = _corners(arc, notches, radius)
    if end - begin < TURN - SAME_DIRECTION:
        points = np.append(points, [[0.0, 0.0]], axis=0)
    return Piece(radius, corners=points)


def _cover(
    arcs: Sequence[tuple[float, float]], pieces: Sequence[Piece], radius: float, has_notches: bool
) -> Piece:
    """A convex set that contains all pieces."""
    if not has_notches:
        # The arc beyond the widest gap between the allowed ones, or its hull.
        begins = [low for low, _ in arcs]
        ends = [high for _, high in arcs]
        gaps = [low - high for low, high in zip([*begins[1:], begins[0] + TURN], ends, strict=True)]
        widest = int(np.argmax(gaps))
        half_angle = 0.5 * (TURN - gaps[widest])
        begin = [*begins[1:], begins[0]][widest]
        return Piece(radius, begin + half_angle, min(half_angle, math.pi))
    from scipy.spatial import ConvexHull

    points = [np.zeros((1, 2))]
    for piece in pieces:
        if piece.corners is None:
            n_steps = max(2, math.ceil(2.0 * piece.half_angle / CORNER_STEP))
            angle = piece.center + piece.half_angle * np.linspace(-1.0, 1.0, n_steps + 1)
            # Outside of the arc: the polygon of its tangents.
            size = radius / math.cos(piece.half_angle / n_steps)
            points.append(size * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
        else:
            points.append(piece.corners)
    every = np.concatenate(points)
    corners = every[ConvexHull(every).vertices]
    return Piece(float(np.linalg.norm(corners, axis=-1).max()), corners=corners)
