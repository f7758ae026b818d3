"""The plant that judges models of interaction: none of them, and no choice in them, was made by it.

Its family is neither that of the formula nor one of those that priors are learned from. Jets with
the profile of a free shear flow (Goertler's squared hyperbolic secant) that decay by a power of the
distance which no other plant has, add up in the root of squares along a common way, and take thrust
by the square of what is met. The hull is a sphere of the same volume, which takes of a jet the
share of it that it hides. Of a robot that moves, jets stay behind with the water that they are in,
propellers lose thrust by a curve that levels off, and the water taken in pushes aside.
"""

import numpy as np

from finlab.arrays import Array
from finlab.interaction.interaction import jets_of, lever_of
from finlab.layout import Layout
from finlab.layout.effectiveness import body_force
from finlab.layout.jet_geometry import jet_geometry_of
from finlab.physics import Plant

DECAY = 0.8
"""Power of the distance by which jets decay."""
CORE = 3.0
"""Length of their core, in diameters."""
GROWTH = 0.12
"""Growth of their half width by distance."""
TAKEN = 0.7
"""Share of thrust that is lost where a jet as fast as the own one is met."""
SIDE = 0.25
"""Share of the momentum taken in from the side."""
PUSH = 0.5
"""Share of the thrust by which a jet pushes the hull."""
STAYS = 0.8
"""How far jets stay behind a robot that moves, over how far it moves until they arrive."""
ADVANCE = 0.85
"""Loss of thrust by a small speed, over that of the open-water line of the layout."""
LEVEL = 1.5
"""Speed over that of the jet at which this loss levels off."""
CROSS = 0.3
"""Share of the momentum taken in from the side of a robot that moves."""


def wrenches(layout: Layout, command: Array, flow: Array | None = None) -> Array:
    """Returns wrenches; a `WrenchOracle`.

    Args:
        layout: the robot.
        command: (K, n, 3).
        flow: velocities (K, 6) of the body through the water [m/s, rad/s]; None at rest.

    Returns:
        (K, 6) [N, N m], body frame.
    """
    plant = Plant(layout)
    own = plant.force(command)
    force = body_force(own, layout.frames)
    geometry = jet_geometry_of(layout)
    diameter = geometry.diameter
    jets = jets_of(force, diameter)
    velocity = np.zeros_like(force) if flow is None else plant.point_velocity(flow)
    change = np.zeros_like(force)
    for j in range(len(diameter)):
        has_jet = np.arange(len(diameter)) != j
        met = np.zeros(force[:, j].shape)
        for i in np.flatnonzero(has_jet & (diameter > 0.0)):
            way = (geometry.position[j] - geometry.position[i]) / diameter[i]
            along = -(way * jets.ahead[:, i]).sum(axis=-1)
            time = np.maximum(along, 0.0) / jets.speed[:, i]
            way = way + STAYS * time[:, None] * velocity[:, i]
            along = -(way * jets.ahead[:, i]).sum(axis=-1)
            radial = way + along[:, None] * jets.ahead[:, i]
            radius = np.sqrt((radial**2).sum(axis=-1))
            width = 0.5 + GROWTH * np.maximum(along, 0.0)
            decay = (1.0 + np.maximum(along, 0.0) / CORE) ** -DECAY
            onset = 0.5 * (1.0 + np.tanh(3.0 * along))
            speed = jets.speed[:, i] * decay * onset / np.cosh(radius / width) ** 2
            met += np.abs(speed)[:, None] ** 2 * -jets.ahead[:, i]
        size = np.sqrt(np.sqrt((met**2).sum(axis=-1)) + 1e-12)
        water = met / size[:, None]
        ahead = jets.ahead[:, j]
        against = -(water * ahead).sum(axis=-1)
        ratio = against / jets.speed[:, j]
        lost = TAKEN * ratio * np.abs(ratio) / (1.0 + np.abs(ratio)) + 0.3 * np.tanh(ratio)
        across = water + against[:, None] * ahead
        mass_flow = 1000.0 * np.pi / 4.0 * diameter[j] ** 2 * jets.speed[:, j]
        speed_ratio = (velocity[:, j] * ahead).sum(axis=-1) / jets.speed[:, j]
        levelled = speed_ratio / np.sqrt(1.0 + (speed_ratio / LEVEL) ** 2)
        lost += ADVANCE * geometry.advance[j] * levelled
        drift = (velocity[:, j] * ahead).sum(axis=-1)[:, None] * ahead - velocity[:, j]
        change[:, j] += mass_flow[:, None] * (SIDE * across + CROSS * drift)
        change[:, j] -= lost[:, None] * force[:, j]
        change[:, j] += _by_hull(geometry.hull, geometry.position[j], ahead, force[:, j])
    return np.asarray(
        plant.wrench_of(own) + np.einsum("kib,ibw->kw", change, lever_of(geometry.position))
    )


def _by_hull(hull: Array, position: Array, ahead: Array, force: Array) -> Array:
    """Force (K, 3) with which a jet pushes the hull."""
    center, half = hull
    if not half.all():
        return np.zeros_like(force)
    radius = half.prod() ** (1.0 / 3.0)
    to_center = center - position
    along = -(ahead * to_center).sum(axis=-1)
    off = np.sqrt(np.maximum((to_center**2).sum() - along**2, 0.0))
    hidden = 0.5 * (1.0 - np.tanh(4.0 * (off / radius - 1.0)))
    facing = 0.5 * (1.0 + np.tanh(4.0 * along / radius))
    return np.asarray(-PUSH * (hidden * facing)[:, None] * force)
