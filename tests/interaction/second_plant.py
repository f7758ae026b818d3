"""A second plant of another family, of which the shipped prior has no sample.

The terms of the hull, and that hulls of random plants turn jets, were chosen after errors on it.

Jets fall off as Schlichting's round jet does, add up by their momentum, turn each other aside, and
take in water from all around their discs; thrust falls by a quadratic of the advance ratio; the
hull pushes back where a jet of finite width meets it. Written apart from the library: loops, no
arrays.
"""

import math

import numpy as np

from finlab.layout import Layout
from finlab.physics import Plant

WATER_DENSITY = 1010.0
"""Density [kg/m3]."""
SLOWEST = 0.05
"""Speed [m/s] of a jet that counts."""


def wrenches(layout: Layout, command: np.ndarray, flow: np.ndarray | None = None) -> np.ndarray:
    """Wrenches (K, 6) [N, N m] of commands (K, n, 3), in flows (K, 6) [m/s, rad/s] or at rest."""
    plant = Plant(layout)
    rows = np.asarray(command)
    flows = np.zeros((len(rows), 6)) if flow is None else np.asarray(flow)
    return np.array([_wrench(layout, plant, u, v) for u, v in zip(rows, flows, strict=True)])


def _induced(
    way: np.ndarray, course: np.ndarray, speed: float, diameter: float, drift: np.ndarray
) -> np.ndarray:
    """Velocity (3,) [m/s] at a way (3,) [m] from a disc whose jet is carried by a drift (3,)
    [m/s]."""
    along = float(way @ course)
    velocity = np.zeros(3)
    if along > 0.0:
        # The middle of the jet, after it has been carried along.
        carried = drift - float(drift @ course) * course
        slower = speed * min(1.0, 5.0 * diameter / max(along, 1e-9)) + SLOWEST
        middle = along * course + carried * along / slower
        aside = way - middle
        aside = aside - float(aside @ course) * course
        radius = float(np.linalg.norm(aside))
        # Schlichting: u = u_m / (1 + eta^2)^2, eta = r / (0.15 x); a potential core before.
        wide = 0.38 * diameter + 0.125 * along
        axis_speed = speed * min(1.0, 5.4 / (along / diameter + 1.2))
        axial = axis_speed / (1.0 + (radius / wide) ** 2) ** 2
        axial *= 1.0 - math.exp(-3.0 * along / diameter)
        velocity = velocity + axial * course
    # Water that is taken in from all around: a sink with the flow through the disc.
    distance = math.sqrt(float(way @ way) + (0.5 * diameter) ** 2)
    through = 0.5 * speed * math.pi * diameter**2 / 4.0
    return velocity - 0.8 * through / (4.0 * math.pi * distance**3) * way


def _wrench(layout: Layout, plant: Plant, command: np.ndarray, flow: np.ndarray) -> np.ndarray:
    """Wrench (6,) of a command (n, 3) in a flow (6,)."""
    own = plant.force(command[None])[0]
    wrench = np.einsum("na,naw->w", own, plant.effectiveness)
    forces = np.einsum("na,nab->nb", own, layout.frames)
    n = len(forces)
    thrust = np.linalg.norm(forces, axis=1)
    diameters = [part.jet for part in layout.actuators]
    course = [-forces[i] / max(thrust[i], 1e-9) for i in range(n)]
    speed = np.zeros(n)
    for i in range(n):
        if diameters[i] > 0.0 and thrust[i] > 1e-9:
            area = math.pi * diameters[i] ** 2 / 4.0
            speed[i] = math.sqrt(2.0 * thrust[i] / (WATER_DENSITY * area))
    ambient = [-(flow[:3] + np.cross(flow[3:], layout.position[i])) for i in range(n)]
    # First all jets run straight; then each is carried by what the others bring to its outlet.
    drift = [np.array(v) for v in ambient]
    for _ in range(2):
        met = np.zeros((n, 3))
        for i in range(n):
            momentum = np.zeros(3)
            for j in range(n):
                if j == i or speed[j] == 0.0:
                    continue
                way = layout.position[i] - layout.position[j]
                u = _induced(way, course[j], speed[j], diameters[j], drift[j])
                momentum += float(np.linalg.norm(u)) * u
            size = float(np.linalg.norm(momentum))
            met[i] = momentum / math.sqrt(size) if size > 0.0 else momentum
        drift = [ambient[i] + 0.35 * met[i] for i in range(n)]
    hull = layout.body.hull if layout.body else None
    for i in range(n):
        push = np.zeros(3)
        area = math.pi * diameters[i] ** 2 / 4.0
        if speed[i] > SLOWEST:
            advance = float((met[i] + ambient[i] * _has_propeller(layout, i)) @ course[i])
            ratio = advance / speed[i]
            kept = 1.0 - 0.95 * ratio + 0.22 * ratio * abs(ratio)
            push += forces[i] * (min(max(kept, 0.1), 1.8) - 1.0)
            across = met[i] - float(met[i] @ course[i]) * course[i]
            push += 0.35 * WATER_DENSITY * area * speed[i] * across
        push += 0.5 * WATER_DENSITY * 0.09 * area * float(np.linalg.norm(met[i])) * met[i]
        if hull is not None and hull.size_m is not None and thrust[i] > 0.0:
            half = 0.5 * np.array(hull.size_m)
            push += _on_hull(layout.position[i], course[i], thrust[i], diameters[i], half)
        wrench[:3] += push
        wrench[3:] += np.cross(layout.position[i], push)
    return wrench


def _has_propeller(layout: Layout, i: int) -> float:
    """1 where speed through the water takes thrust."""
    return 0.0 if layout.actuators[i].type == "fin" else 1.0


def _on_hull(
    place: np.ndarray, course: np.ndarray, thrust: float, diameter: float, half: np.ndarray
) -> np.ndarray:
    """Force (3,) [N] of the hull: the part of a jet's cross section that meets it, turned along
    its surface where it only grazes it."""
    z = place / half
    q = course / half
    length = float(np.linalg.norm(q))
    towards = -float(z @ q) / length
    miss = math.sqrt(max(float(z @ z) - towards**2, 0.0))
    wide = 0.15 + 0.5 * diameter / float(half.mean())
    covered = 0.5 * (1.0 - math.tanh((miss - 1.0) / wide))
    covered *= 0.5 * (1.0 + math.tanh(towards / 0.2))
    hit = z + q / length * (towards - math.sqrt(max(1.0 - miss**2, 0.0)))
    normal = hit / half
    normal /= max(float(np.linalg.norm(normal)), 1e-9)
    normal_part = float(course @ normal) * normal
    tangential = course - normal_part
    return thrust * covered * (0.85 * normal_part + 0.25 * tangential)
