"""The formula of jets of docs/theory/interaction.md, one pair after the other: an oracle for the
core."""

import numpy as np

from finlab.arrays import Array
from finlab.interaction.interaction import DENSITY, MIN_JET_SPEED, JetGeometry
from finlab.interaction.jets import Jets


def offset(known: Jets, geometry: JetGeometry, force: Array, inflow: Array) -> Array:
    """The wrench (6,) beside forces (n, 3) of geometry that move at `inflow` (n, 3)."""
    n = len(force)
    wrench = np.zeros(6)
    area = 0.25 * np.pi * geometry.diameter**2
    least = 0.5 * DENSITY * area * MIN_JET_SPEED**2
    thrust = np.sqrt((force**2).sum(axis=1) + least**2)
    ahead = force / thrust[:, None]
    speed = np.sqrt(2.0 * thrust / (DENSITY * area))
    for i in range(n):
        water = np.zeros(3)
        for j in set(range(n)) - {i}:
            way = (geometry.position[i] - geometry.position[j]) / geometry.diameter[j]
            along = -way @ ahead[j]
            beside = way @ way - along**2
            slow = (1.0 + (along / known.length) ** 4) ** -0.25 * 0.5 * (1.0 + np.tanh(along / 0.2))
            narrow = np.exp(-known.spread * beside / (along**2 + known.width**2))
            water -= speed[j] * slow * narrow * ahead[j]
        share = -(water @ ahead[i]) / speed[i]
        lost = share / (known.lag + known.most * np.sqrt(share**2 + 1e-4))
        lost += geometry.advance[i] * (inflow[i] @ ahead[i]) / speed[i]
        center, half = geometry.hull
        if half.all():
            place = (geometry.position[i] - center) / half
            course = -ahead[i] / half
            facing = -(place @ course) / np.linalg.norm(course)
            rim = np.tanh((1.0 - place @ place + facing**2) / 0.3)
            lost += known.hull * 0.25 * (1.0 + rim) * (1.0 + np.tanh(facing / 0.3))
        across = water - (water @ ahead[i]) * ahead[i]
        drag = 0.5 * DENSITY * known.housing * area[i] * np.sqrt(water @ water + 1e-12)
        change = known.side * DENSITY * area[i] * speed[i] * across + drag * water - lost * force[i]
        wrench += np.concatenate([change, np.cross(geometry.position[i], change)])
    return wrench
