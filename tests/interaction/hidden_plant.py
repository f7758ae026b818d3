"""A plant of another family than the formula of jets, written apart from the library; loops, no
arrays.

Jets are cones with a flat core and swirl, losses multiply, hulls are pushed off along their
normals, housings drag.
"""

import math

import numpy as np

from finlab.layout import Layout
from finlab.physics import Plant

WATER_DENSITY = 1025.0
"""Density of sea water [kg/m3]."""


def _jet(force: np.ndarray, diameter: float) -> tuple[float, np.ndarray, float]:
    """Thrust [N], direction (3,) and speed [m/s] of the jet of a force (3,) [N]."""
    thrust = float(np.linalg.norm(force))
    if thrust < 1e-9 or diameter <= 0.0:
        return 0.0, np.zeros(3), 0.0
    return (
        thrust,
        -force / thrust,
        math.sqrt(2.0 * thrust / (WATER_DENSITY * math.pi * diameter**2 / 4.0)),
    )


def _velocity(way: np.ndarray, course: np.ndarray, speed: float, diameter: float) -> np.ndarray:
    """Velocity at a way from a jet's disc: a cone that widens by 0.11, with a cosine rim, and
    swirl."""
    along = float(way @ course)
    if along <= 0.0:
        return np.zeros(3)
    aside = way - along * course
    radius = float(np.linalg.norm(aside))
    wide = 0.5 * diameter + 0.11 * along
    core = 0.5 * diameter / wide
    share = radius / (1.7 * wide)
    if share >= 1.0:
        return np.zeros(3)
    profile = 0.5 * (1.0 + math.cos(math.pi * share)) * (1.0 - math.exp(-2.0 * along / diameter))
    axial = 1.15 * speed * core * profile
    around = np.cross(course, aside / max(radius, 1e-9)) * math.sin(math.pi * share)
    return axial * course + 0.18 * axial * around


def wrenches(layout: Layout, command: np.ndarray) -> np.ndarray:
    """Wrenches (K, 6) [N, N m] of commands (K, n, 3)."""
    plant = Plant(layout)
    return np.array([_wrench(layout, plant, row) for row in np.asarray(command)])


def _wrench(layout: Layout, plant: Plant, command: np.ndarray) -> np.ndarray:
    """Wrench (6,) of a command (n, 3), jets included."""
    own = plant.force(command[None])[0]
    wrench = np.einsum("na,naw->w", own, plant.effectiveness)
    forces = np.einsum("na,nab->nb", own, layout.frames)
    diameters = [part.jet for part in layout.actuators]
    jets = [_jet(force, d) for force, d in zip(forces, diameters, strict=True)]
    hull = layout.body.hull if layout.body else None
    for i, (thrust, course, speed) in enumerate(jets):
        place = layout.position[i]
        area = math.pi * diameters[i] ** 2 / 4.0
        kept = 1.0
        push = np.zeros(3)
        water = np.zeros(3)
        for j, (_, other, fast) in enumerate(jets):
            if j == i or fast == 0.0:
                continue
            met = _velocity(place - layout.position[j], other, fast, diameters[j])
            water += met
            if speed > 0.0:
                ratio = float(met @ course) / speed
                kept *= max(0.0, 1.0 - 0.85 * ratio / (1.0 + 0.55 * abs(ratio)))
        if speed > 0.0:
            push += forces[i] * (kept - 1.0)
            across = water - float(water @ course) * course
            push += 0.22 * WATER_DENSITY * area * speed * across
        push += 0.5 * WATER_DENSITY * 0.12 * area * float(np.linalg.norm(water)) * water
        if hull is not None and hull.size_m is not None and thrust > 0.0:
            push += _on_hull(place, course, thrust, 0.5 * np.array(hull.size_m))
        wrench[:3] += push
        wrench[3:] += np.cross(place, push)
    return wrench


def _on_hull(place: np.ndarray, course: np.ndarray, thrust: float, half: np.ndarray) -> np.ndarray:
    """A jet that comes within a rim of the hull pushes it along the jet and a little off along its
    normal."""
    z = place / half
    q = course / half
    towards = -float(z @ q) / float(np.linalg.norm(q))
    if towards <= 0.0:
        return np.zeros(3)
    miss = math.sqrt(max(float(z @ z) - towards**2, 0.0))
    share = 1.0 / (1.0 + math.exp((miss - 1.05) / 0.12))
    normal = place / half**2
    normal /= np.linalg.norm(normal)
    return thrust * share * (0.5 * course - 0.12 * normal)
