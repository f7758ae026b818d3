"""What the tests of forces share: robots, and an independent way to find largest wrenches."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog

from finlab.assets import shipped_layouts
from finlab.forces.force_sets import ForceSets
from finlab.layout import Fin, Layout, Limits, load_layout

Array = NDArray[np.float64]

THRUST = 4.0 * 1000.0 * 0.15 * 0.02 * 0.1**2 * (2.0 * np.pi * 2.1) ** 2 * np.sin(0.6) ** 2
"""Largest thrust [N] of the default fin, from the contract's law."""


@pytest.fixture(scope="session")
def shipped() -> Callable[[str], Layout]:
    """A shipped robot by its name."""
    return lambda name: load_layout(shipped_layouts()[name])


@pytest.fixture(scope="session")
def wide() -> Layout:
    """Four fins, two of which have arcs wider than half a turn."""
    arcs = [(-2.2, 2.2), (-np.pi, np.pi), (0.5, 4.9), (-np.pi, np.pi)]
    places = [(0.25, -0.15, 0.02), (0.25, 0.15, 0.0), (-0.25, 0.15, 0.0), (-0.25, -0.15, -0.02)]
    angles = np.radians([-60.0, 60.0, 120.0, -120.0])
    return Layout(
        "wide",
        tuple(
            Fin(f"fin_{i}", place, float(angle), Limits(zero_direction=arc))
            for i, (place, angle, arc) in enumerate(zip(places, angles, arcs, strict=True))
        ),
    )


def largest_by_polygons(sets: ForceSets, direction: Array, corners: int, outer: bool) -> float:
    """Largest scaled wrench exactly along a unit direction (6,), each disc a polygon inside or
    around it.

    A linear programme that shares nothing with the solver under test. Sectors up to half a turn,
    one robot.
    """
    n = sets.radius.shape[1]
    angles = 2 * np.pi * np.arange(corners) / corners
    rows = []
    limits = []
    for i in range(n):
        reach = sets.radius[0, i] * (1.0 if outer else np.cos(np.pi / corners))
        normals = [(angle, reach) for angle in angles]
        if sets.sector_half_angle[0, i] <= np.pi / 2:
            stop = sets.sector_half_angle[0, i] + np.pi / 2
            normals += [
                (sets.sector_center[0, i] + stop, 0.0),
                (sets.sector_center[0, i] - stop, 0.0),
            ]
        for angle, limit in normals:
            row = np.zeros(2 * n + 1)
            row[2 * i : 2 * i + 2] = np.cos(angle), np.sin(angle)
            rows.append(row)
            limits.append(limit)
    wrench = np.hstack([sets.effectiveness[0].reshape(2 * n, 6).T, -direction[:, None]])
    cost = np.zeros(2 * n + 1)
    cost[-1] = -1.0
    found = linprog(cost, np.array(rows), limits, wrench, np.zeros(6), bounds=(None, None))
    return float(-found.fun)
