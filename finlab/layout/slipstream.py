"""Rudders that stand straight behind a propeller: with it they are one actuator, as the slipstream
is the flow that they meet.

A layout file may list a thruster and a rudder. Where the rudder lies in the slipstream of one
thruster alone, the file is read as one `PropellerRudder` in their place, under the name of the
thruster. What the file does not say is taken so:

- the diameter D of the propeller is that of the thruster, or estimated from its force;
- of the foil's area, chord times D lies in the slipstream, and at most so much that the foil does
  not push aside with more than the thrust: more momentum there is not; the rest meets the flow;
- as a rudder alone it stays where the propeller has a dead band or a reaction torque.

The joined actuator keeps the rudder's name in `rudder_name`, so that a question about the rudder is
answered by a sentence. A rudder with `alone: true` stays an actuator of its own.
"""

import math
from collections.abc import Sequence

import numpy as np

from finlab.actuators.actuator import Actuator
from finlab.actuators.propeller_rudder import PropellerRudder
from finlab.actuators.rudder import Rudder
from finlab.actuators.thruster import Thruster

REACH = 5.0
"""Diameters of the propeller behind it up to which its slipstream is taken to hold together."""
PARALLEL = math.cos(math.radians(5.0))
"""Least cosine of the angle between the thruster's axis and the rudder's chord at rest."""
MOMENTUM = 0.999
"""Largest force aside over the thrust, a little below that which `PropellerRudder` refuses."""


def joined(actuators: Sequence[Actuator]) -> tuple[Actuator, ...]:
    """Returns actuators with each propeller and the rudder in its slipstream as one.

    Args:
        actuators: n of a layout.

    Returns:
        The same where no rudder lies in a slipstream. A joined pair stands in the place of its
        thruster.
    """
    pairs = _pairs(actuators)
    rudders = {rudder for _, rudder in pairs}
    thruster_of = dict(pairs)
    result: list[Actuator] = []
    for index, actuator in enumerate(actuators):
        if index in rudders:
            continue
        if index in thruster_of:
            rudder = actuators[thruster_of[index]]
            assert isinstance(actuator, Thruster) and isinstance(rudder, Rudder)
            result.append(_joined_pair(actuator, rudder))
            continue
        result.append(actuator)
    return tuple(result)


def _pairs(actuators: Sequence[Actuator]) -> list[tuple[int, int]]:
    """Indices of thrusters, each with that of the rudder in its slipstream: of those of which
    neither is in two pairs."""
    found = []
    for i, thruster in enumerate(actuators):
        for k, rudder in enumerate(actuators):
            if (
                isinstance(thruster, Thruster)
                and isinstance(rudder, Rudder)
                and _is_behind(thruster, rudder)
            ):
                found.append((i, k))
    names = [actuator.name for actuator in actuators]
    found = [(i, k) for i, k in found if names.count(names[k]) == 1]  # others are refused later
    thrusters = [i for i, _ in found]
    rudders = [k for _, k in found]
    return [(i, k) for i, k in found if thrusters.count(i) == 1 and rudders.count(k) == 1]


def _is_behind(thruster: Thruster, rudder: Rudder) -> bool:
    """Whether a rudder lies in the slipstream of a thruster, and both can be one actuator."""
    if rudder.alone:
        return False
    is_simple = thruster.dead_band == 0.0 and thruster.torque_per_newton == 0.0
    pushes_ahead = thruster.force[1] > 0.0
    if not (is_simple and pushes_ahead):
        return False
    zero = np.array(rudder.zero)
    if float(np.dot(thruster.axis, zero)) < PARALLEL:
        return False
    ahead = np.array(thruster.position) - np.array(rudder.position)
    along = float(ahead @ zero)
    aside = float(np.linalg.norm(ahead - along * zero))
    diameter = thruster.jet
    return 0.0 < along <= REACH * diameter and aside <= 0.5 * diameter


def _joined_pair(thruster: Thruster, rudder: Rudder) -> PropellerRudder:
    """A propeller and the rudder in its slipstream as one actuator."""
    diameter = thruster.jet
    disc = 0.25 * math.pi * diameter**2
    span = math.sqrt(0.5 * rudder.aspect_ratio * rudder.area)  # A = 2 span^2 / area
    chord = rudder.area / span
    most_by_momentum = MOMENTUM * disc / (rudder.slope * rudder.stall)
    area = min(chord * diameter, most_by_momentum)
    return PropellerRudder(
        name=thruster.name,
        position=rudder.position,
        shaft=rudder.shaft,
        zero=rudder.zero,
        force=thruster.force,
        model=thruster.model,
        diameter=diameter,
        area=rudder.area,
        aspect_ratio=rudder.aspect_ratio,
        deflection=rudder.deflection,
        slipstream=min(1.0, area / rudder.area),
        lift_slope=rudder.lift_slope,
        drag=rudder.drag,
        stall=rudder.stall,
        density=rudder.density,
        turn_rate=rudder.rate,
        time_constant=thruster.time_constant,
        rate=thruster.rate,
        uncertainty=thruster.uncertainty,
        rudder_name=rudder.name,
    )
