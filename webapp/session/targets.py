"""Target wrenches to start from, and how much of each axis a layout can give."""

import math
from functools import lru_cache

import numpy as np

from finlab.analysis.authority import reach_alone
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


@lru_cache(maxsize=64)
def lone_reach(layout: Layout, lost: tuple[str, ...] = (), flow: Flow | None = None) -> Array:
    """How far a robot goes along each axis (6,) [N, N m] with the other five at zero, the farther
    of both ways; where it pushes an axis only along with others, as far as `axis_reach` has it.
    A power budget counts, but where the flow drives actuators.

    Args:
        layout: the robot, with the limits that damage has left.
        lost: names of its lost actuators.
        flow: velocity (6,) relative to the water [m/s, rad/s]; None at rest.
    """
    with_others = axis_reach(layout, lost, flow)
    if len(lost) == layout.n:
        return with_others
    alone = reach_alone(layout, lost, flow).max(axis=0)
    reach: Array = np.where(alone > 0.0, alone, with_others)
    reach.setflags(write=False)
    return reach


NO_REACH = 1e-6
"""Reach below which nothing pushes along an axis [N, N m]."""
MARGIN = 1.25
"""How far a slider goes, in reaches of the robot: what is out of reach can be asked as well."""
NUDGES = 100.0
"""Nudges by the arrow keys from zero to the end of what is within reach."""
LEAST_STEP = 1e-4
"""Least step of a slider [N, N m]: it shows no further digit."""


def slider_end(reach: float) -> float:
    """Where a slider ends: a quarter beyond the reach, to two digits; 1 where there is no reach at
    all."""
    return float(f"{MARGIN * reach:.1e}") if reach > NO_REACH else 1.0


def widened_end(end: float, value: float) -> float:
    """Where a slider ends that has to show a value beyond its end: the value, rounded up to two
    digits, so that zero stays a whole number of steps away."""
    size = abs(value)
    if size <= end:
        return end
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    n_units = math.ceil(round(size / unit, 6))
    return float(f"{n_units * unit:.6g}")


def nudge(reach: float) -> float:
    """Step of a slider by an arrow key: about a hundredth of the reach, as 1, 2 or 5 of a decimal
    place [N, N m]."""
    size = (reach if reach > NO_REACH else 1.0) / NUDGES
    unit = 10.0 ** math.floor(math.log10(size))
    steps = [unit, 2.0 * unit, 5.0 * unit, 10.0 * unit]
    nearest = min(steps, key=lambda step: abs(math.log(step / size)))
    return float(f"{max(nearest, LEAST_STEP):.6g}")
