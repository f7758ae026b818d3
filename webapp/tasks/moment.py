"""One moment of a robot that swims, as the page shows it, and the record up to then."""

from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.sim.log import Tick

POINTS = 300
"""Most points of a plotted line; a longer record is thinned out."""
NOW = 10
"""Periods of which the present power is the mean: it jumps with every beat."""

TIME, ERROR, DEPTH_ERROR, POWER = range(4)
"""Columns of a record: time [s], distance from where it should be [m], that of the depth [m], driving power
of all fins with motor losses [W]."""
SURGE, PLACE, FORCES = 4, 6, 9
"""First columns of the asked and delivered surge (2) [N], the position (3) [m], and of the force of each fin
(n) [N]; then comes the probability of each fin being broken (n)."""


class Figures(NamedTuple):
    """What a swim has come to so far."""

    track_m: float
    """Root mean square distance from where it should have been [m]."""
    depth_m: float
    """The same of the depth [m]."""
    mean_w: float
    """Mean driving power of all fins with motor losses [W]."""
    now_w: float
    """The same over the last second [W]."""
    energy_wh: float
    """Energy of that so far [Wh]."""


class Moment(NamedTuple):
    """What the page shows of a robot."""

    time: float
    pose: Array
    """Position (3,) and quaternion w, x, y, z (7,)."""
    motion: Array
    """What the fins do (n, 3): amplitude [rad], frequency [Hz], direction [rad]."""
    angle: Array
    """Angle of each blade (n,) [rad]."""
    force: Array
    """Force of each fin (n, 3) in the body frame [N]."""
    asked: Array
    """Wrench (6,) that the controller asked for [N, N m]."""
    delivered: Array
    """Wrench (6,) that the fins gave."""
    reference: Array
    """Where the robot should be (3,) [m]."""
    flow: Array
    """Velocity of the water where it is (3,), in the world [m/s]."""
    lost: tuple[str, ...]
    failed: tuple[str, ...]
    """Those that the allocator takes for lost."""
    found: tuple[tuple[str, float], ...]
    """Unannounced losses that the monitor has detected, each with the time that it took [s]."""
    doubted: tuple[str, ...]
    """Those that the monitor takes for broken in some way, more likely than not."""
    controllable: bool
    capsized: float | None
    """When it first lay on its side or stood on its end [s]; None where it never did."""
    done: bool
    figures: Figures | None
    """What the swim has come to; None before the first step."""
    record: Array
    """Rows of ticks (N, 9 + 2 n), thinned out; `TIME` to `FORCES` say where what is."""


def row_of(tick: Tick) -> Array:
    """The row of a tick in a record."""
    off = tick.position - tick.reference
    power = float(tick.driving_power.sum())
    surge = tick.asked[0], tick.delivered[0]
    head = (tick.time, float(np.linalg.norm(off)), abs(float(off[2])), power, *surge)
    force = np.linalg.norm(tick.force, axis=1)
    return np.concatenate([head, tick.position, force, tick.fault_probability])


def figures_of(rows: Array, period_s: float) -> Figures | None:
    """What a whole record (N, ...) with a row per period [s] comes to; None where it has no rows."""
    if not len(rows):
        return None
    power, duration = rows[:, POWER], len(rows) * period_s
    return Figures(
        track_m=float(np.sqrt(np.mean(rows[:, ERROR] ** 2))),
        depth_m=float(np.sqrt(np.mean(rows[:, DEPTH_ERROR] ** 2))),
        mean_w=float(power.mean()),
        now_w=float(power[-NOW:].mean()),
        energy_wh=float(power.mean()) * duration / 3600.0,
    )
