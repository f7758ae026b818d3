"""Target wrenches to start from, and how much of each axis a layout can give."""

from functools import lru_cache

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics import plant_of
from webapp.session.state import Flow

PRESETS: dict[str, tuple[float, float, float, float, float, float]] = {
    "Cruise": (2.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "Turn": (1.2, 0.0, 0.0, 0.0, 0.0, 0.25),
    "Dive": (0.8, 0.0, -1.5, 0.0, 0.0, 0.0),
    "Sway": (0.0, 0.8, 0.0, 0.0, 0.0, 0.0),
    "Zero": (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
}
"""Wrenches by name [N, N m]."""

FIRST_TARGET = PRESETS["Turn"]
"""What a new session asks for: gently forward, turning left."""


STEPS = (5, 5, 73)
"""Values of each of its three numbers that an actuator is tried with: a fin's directions lie 5 deg
apart."""


@lru_cache(maxsize=64)
def axis_reach(layout: Layout, lost: tuple[str, ...] = (), flow: Flow | None = None) -> Array:
    """Largest size of each wrench component (6,) [N, N m] that the working actuators give with the
    others free, in a flow (6,) [m/s, rad/s]."""
    works = np.array([name not in lost for name in layout.names])
    reach: Array = _extents(layout, flow)[1][:, works].sum(axis=1).max(axis=0)
    reach.setflags(write=False)
    return reach


@lru_cache(maxsize=64)
def full_thrust(layout: Layout, flow: Flow | None = None) -> Array:
    """Largest force (n,) of each actuator [N]."""
    return _extents(layout, flow)[0]


@lru_cache(maxsize=64)
def _extents(layout: Layout, flow: Flow | None) -> tuple[Array, Array]:
    """Largest force (n,) of each actuator, and what it gives at most along each axis either way (2,
    n, 6)."""
    plant = plant_of(layout)
    force = plant.force(plant.grid(STEPS), flow=None if flow is None else np.array(flow))
    wrench = np.einsum("kni,niw->knw", force, plant.effectiveness)
    largest_force = np.linalg.norm(force, axis=-1).max(axis=0)
    extents = np.stack([wrench.max(axis=0), -wrench.min(axis=0)])
    return largest_force, np.maximum(extents, 0.0)


def slider_end(reach: float) -> float:
    """Where a slider ends: a quarter beyond the reach, to two digits; 1 where there is no reach at
    all."""
    return float(f"{1.25 * reach:.1e}") if reach > 1e-6 else 1.0
