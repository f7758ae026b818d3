"""Target wrenches to start from, and how much of each axis a layout can give."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from finlab.layout import Fin, FinModelSpec, Layout, Limits, planar_effectiveness
from finlab.physics import Plant

PRESETS: dict[str, tuple[float, float, float, float, float, float]] = {
    "Cruise": (2.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "Turn": (1.2, 0.0, 0.0, 0.0, 0.0, 0.25),
    "Dive": (0.8, 0.0, -1.5, 0.0, 0.0, 0.0),
    "Sway": (0.0, 0.8, 0.0, 0.0, 0.0, 0.0),
    "Zero": (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
}
"""Wrenches by name [N, N m]."""

FIRST = PRESETS["Turn"]
"""What a new session asks for: gently forward, turning left."""


def axis_reach(layout: Layout, failed: tuple[str, ...] = ()) -> NDArray[np.float64]:
    """Largest size of each wrench component (6,) [N, N m] that the working fins give if nothing else matters.

    Each fin pushes with its full thrust in the best direction for that axis; the other axes are free, and
    limits of the zero direction are not looked at, so this is an upper bound.
    """
    healthy = layout.without(failed) if failed else layout
    position = np.array([fin.position for fin in healthy.fins])
    angle = np.array([fin.mounting_angle for fin in healthy.fins])
    gain = np.linalg.norm(planar_effectiveness(position, angle), axis=-1)  # (n, 6), N or N m per N
    return (gain * full_thrust(healthy)[:, None]).sum(axis=0)


def full_thrust(layout: Layout) -> NDArray[np.float64]:
    """Mean thrust (n,) of each fin at its largest amplitude and frequency [N]."""
    return np.array([_full_thrust(fin.limits, fin.model) for fin in layout.fins])


@lru_cache(maxsize=256)
def _full_thrust(limits: Limits, model: FinModelSpec) -> float:
    """Full thrust of one fin [N]; where it sits does not matter, so a drag asks for the same one again."""
    alone = Layout("alone", (Fin("fin", (0.0, 0.0, 0.0), 0.0, limits, model),))
    command = [[*limits.upper[:2], sum(limits.zero_direction) / 2]]
    return float(np.linalg.norm(Plant(alone).fin_forces(command)))


def slider_end(reach: float) -> float:
    """Where a slider ends: a quarter beyond the reach, to two digits; 1 where there is no reach at all."""
    return float(f"{1.25 * reach:.1e}") if reach > 1e-6 else 1.0


def nice_limit(value: float) -> float:
    """The next of 1, 2, 5, 10, ... above 1.2 times `value`: a scale's end."""
    if value < 1e-6:
        return 1.0
    exponent = math.floor(math.log10(1.2 * value))
    for factor in (1.0, 2.0, 5.0, 10.0):
        if factor * 10.0**exponent >= 1.2 * value:
            return factor * 10.0**exponent
    return 10.0 ** (exponent + 1)
