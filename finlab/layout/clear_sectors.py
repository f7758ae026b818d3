"""Sectors of the world that no azimuth may blow into: a diver, a hydrophone, a quay beside a ship.

They stay where they are while the ship turns, so that the arcs of its azimuths are others at each
heading. `kept_clear` returns the layout at one heading: a layout like any other, for all that takes
one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from finlab.actuators.actuator import Actuator
from finlab.actuators.azimuth import Azimuth
from finlab.axes import SAME_DIRECTION, TURN, VERTICAL, arcs_outside, is_full_turn
from finlab.errors import LayoutError
from finlab.layout.layout import Layout

Sector = tuple[float, float]
"""Directions from the first to the second one, counterclockwise [rad]."""


def kept_clear(
    layout: Layout, sectors: Sequence[Sector], yaw: float = 0.0, names: Sequence[str] = ()
) -> Layout:
    """Returns a layout whose azimuths blow into no sector of the world at a heading.

    Args:
        layout: the robot, upright.
        sectors: begin and end of each sector [rad], counterclockwise from the x axis of the world:
            directions in which no race may go. A race goes against the thrust.
        yaw: heading of the robot [rad], counterclockwise: the direction of its x axis in the world.
        names: azimuths that keep clear; none for all that turn about the vertical.

    Returns:
        The layout with other arcs; all else, such as the order of actuators, stays.

    Raises:
        LayoutError: a sector has no width or a turn, an actuator of `names` is no azimuth that
            turns about the vertical, one pushes astern, too, or the sectors leave one no direction.
    """
    if not math.isfinite(yaw):
        raise LayoutError(f"expected an angle [rad], got {yaw}", "yaw")
    for number, (begin, end) in enumerate(sectors):
        if not SAME_DIRECTION < end - begin < TURN:
            raise LayoutError(
                "expected its begin and, above it by less than a turn, its end [rad], got "
                f"{begin:g} and {end:g}",
                f"sectors[{number}]",
            )
    layout.indices(tuple(names), "names")
    actuators: list[Actuator] = []
    for actuator in layout.actuators:
        is_meant = actuator.name in names if names else _is_upright(actuator)
        if is_meant and sectors:
            actuators.append(_with_arcs(actuator, sectors, yaw))
        else:
            actuators.append(actuator)
    return layout.with_actuators(tuple(actuators))


def _is_upright(actuator: Actuator) -> bool:
    """Whether an actuator is an azimuth that turns about the vertical."""
    return isinstance(actuator, Azimuth) and abs(abs(actuator.turn_axis[2]) - 1.0) <= VERTICAL


def _with_arcs(actuator: Actuator, sectors: Sequence[Sector], yaw: float) -> Azimuth:
    """An azimuth with the directions that sectors leave it."""
    name = actuator.name
    if not isinstance(actuator, Azimuth) or not _is_upright(actuator):
        raise LayoutError(f"{name} is no azimuth that turns about the vertical", "names")
    if actuator.force[0] < 0.0:
        raise LayoutError(
            f"{name}: pushes astern, too, so that its race goes both ways; expected force_n from 0 "
            "on, or names of the others"
        )
    up = actuator.turn_axis[2]
    zero = math.atan2(actuator.zero[1], actuator.zero[0])
    zones = []
    for sector in sectors:
        # Thrust against the race, by the angle about the turn axis from `zero`.
        angles = sorted(up * (end + math.pi - yaw - zero) for end in sector)
        zones.append((angles[0], angles[1]))
    own = actuator.arcs
    if len(own) == 1 and is_full_turn(own[0][1] - own[0][0]):
        # All round from the end of a zone, below 0 so that no angle exceeds a turn.
        begin = zones[0][1] % TURN - TURN
        own = ((begin, begin + TURN),)
    arcs: list[Sector] = []
    for arc in own:
        arcs += arcs_outside(arc, zones)
    if not arcs:
        raise LayoutError(
            f"{name}: the sectors leave it no direction at this heading; take it as lost there"
        )
    return replace(actuator, arc=tuple(arcs) if len(arcs) > 1 else arcs[0])
