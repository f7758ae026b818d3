"""What one fin can do, compiled: for each direction and size of its force the least effort, and the command.

A fin's law may be any: its force may saturate and fall again, lean off the zero direction, differ from one
direction to the next, or come from a table. The law is asked on a grid of commands; for each direction and
each of `LEVELS` sizes between the smallest and the largest force, the pair of amplitude and frequency with
the least effort is found by inverting the force along the frequency for each amplitude. What the zero
direction adds to the effort is left out here: it does not depend on the size.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from finlab.actuators.fin.models import file_stamp, make_law
from finlab.actuators.law import FinLaw
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout import FinModelSpec, Limits
from finlab.layout.angles import TURN, is_full_turn, wrapped
from finlab.physics.effort import EffortWeights, effort_of_shares, effort_scale

LEVELS = 49
"""Sizes of force per direction."""
DIRECTIONS = 49
"""Directions of the force, the ends of the arc included; a fin that is the same all round needs but one."""
AMPLITUDES, FREQUENCIES = 25, 49
"""Commands at which a law is asked."""
FLAT = 1e-5
"""By how much, as a share, a force may fall short of a size and still count as giving it."""
CONVEX = 0.3
"""Least elasticity of the marginal effort that is followed; below it, and where effort is concave, a steeper
quadratic is touched, which never overshoots."""
STIFFEST = 10.0
"""Elasticities above this one count as this one."""
MARGINAL = 1e-3
"""Least marginal effort, as a share of the mean one."""

AMPLITUDE, FREQUENCY, DEFLECTION, EFFORT, MOBILITY, STIFFNESS, DRIFT = range(7)
"""Columns of a table: amplitude [rad], frequency [Hz], force direction minus zero direction [rad], effort,
logarithm of the mobility T / (dc/dT), elasticity of dc/dT, dc/dtheta over dc/dT [N]."""


class EffortFin(NamedTuple):
    """The compiled fin; its K directions are evenly spaced over its arc."""

    middle: float
    """Middle of the arc of force directions [rad]."""
    half: float
    """Half of that arc [rad]; pi for a full circle."""
    smallest: Array
    """Smallest force (K,) [N] by direction: the fin at rest."""
    largest: Array
    """Largest force (K,) [N] by direction."""
    table: Array
    """(K, LEVELS, 7), see the columns above."""


def levels() -> Array:
    """Shares (LEVELS,) of the range of sizes: dense near zero, where both commands grow like fourth roots,
    and near the top, where a force that saturates is flat in its commands."""
    share: Array = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, LEVELS)) ** 4
    return share


def effort_fin(model: FinModelSpec, limits: Limits, weights: EffortWeights) -> EffortFin:
    """Returns the compiled fin, kept from the last time it was asked for.

    Raises:
        DataError: the fin's force table cannot be read, or gives no thrust within the limits.
    """
    return _kept(model, limits, weights, file_stamp(model))


@lru_cache(maxsize=512)
def _kept(
    model: FinModelSpec, limits: Limits, weights: EffortWeights, stamp: tuple[int, int] | None
) -> EffortFin:
    """A compiled fin; a table whose file has changed is read again."""
    fin = compile_fin(make_law(model), limits, weights)
    if model.type == "table" and not fin.largest.any():
        (low, high), (slow, fast) = limits.amplitude, limits.frequency
        raise DataError(
            f"{model.values()['path']}: gives no thrust within the fin's limits, amplitudes {low:.4g} to "
            f"{high:.4g} rad and frequencies {slow:.4g} to {fast:.4g} Hz; widen the limits or leave it out"
        )
    return fin


def compile_fin(law: FinLaw, limits: Limits, weights: EffortWeights) -> EffortFin:
    """Returns a fin of one law within its limits, compiled."""
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    amplitude = _axis(lower[0], upper[0], AMPLITUDES)
    frequency = _axis(lower[1], upper[1], FREQUENCIES)
    direction, turn, half = _directions(law, lower, upper, amplitude, frequency)
    size, _ = _asked(law, amplitude, frequency, turn)
    largest = size.max(axis=(0, 1))
    smallest = np.minimum(size[0, 0], largest)
    wanted = smallest[:, None] + (largest - smallest)[:, None] * levels()
    found = _frequencies(frequency, size, wanted)
    scale = effort_scale(upper)
    shares = (amplitude / scale[0])[:, None, None], found / scale[1]
    price = np.where(np.isnan(found), np.inf, effort_of_shares(*shares, 0.0, weights))
    command = np.stack(np.broadcast_arrays(amplitude[:, None, None], found), axis=-1)
    command = np.clip(_cheapest(command, price), lower[:2], upper[:2])
    effort = effort_of_shares(command[..., 0] / scale[0], command[..., 1] / scale[1], 0.0, weights)
    table = np.stack(
        [
            command[..., 0],
            command[..., 1],
            np.broadcast_to(wrapped(direction - turn)[:, None], wanted.shape),
            effort,
            *_slopes(effort, wanted, direction, half),
        ],
        axis=-1,
    )
    return EffortFin(0.5 * float(direction[0] + direction[-1]), half, smallest, largest, table)


def _axis(low: float, high: float, count: int) -> Array:
    return np.linspace(low, high, count if high > low else 1)


def _asked(law: FinLaw, amplitude: Array, frequency: Array, turn: Array) -> tuple[Array, Array]:
    """Sizes (a, f, K) [N] and directions [rad] of a law's force on a grid of commands."""
    force = law.force(np.stack(np.meshgrid(amplitude, frequency, turn, indexing="ij"), axis=-1))
    return np.hypot(force[..., 1], force[..., 2]), np.arctan2(force[..., 2], force[..., 1])


def _directions(
    law: FinLaw, lower: Array, upper: Array, amplitude: Array, frequency: Array
) -> tuple[Array, Array, float]:
    """Evenly spaced directions (K,) of the force [rad], the zero directions (K,) [rad] at which the strongest
    force points there, and half of the arc [rad]."""
    middle, half = 0.5 * float(lower[2] + upper[2]), 0.5 * float(upper[2] - lower[2])
    full = bool(is_full_turn(2.0 * half))
    if law.uniform:
        turn = np.array([np.clip(0.0, lower[2], upper[2])])
    else:
        turn = np.linspace(lower[2], upper[2], DIRECTIONS)
    size, points = _asked(law, amplitude, frequency, turn)
    strongest = size.reshape(-1, len(turn)).argmax(axis=0)
    deflection = wrapped(points.reshape(-1, len(turn))[strongest, np.arange(len(turn))] - turn)
    if law.uniform:
        return middle + deflection, middle + 0.0 * turn, np.pi if full else half
    there = np.maximum.accumulate(turn + deflection)
    if full:
        direction = np.linspace(middle - np.pi, middle + np.pi, DIRECTIONS)
        around = np.concatenate([there[:-1] - TURN, there[:-1], there[:-1] + TURN])
        turns = np.concatenate([turn[:-1] - TURN, turn[:-1], turn[:-1] + TURN])
        return direction, np.interp(direction, around, turns), np.pi
    direction = np.linspace(there[0], there[-1], DIRECTIONS)
    half = min(0.5 * float(there[-1] - there[0]), np.pi)
    return direction, np.interp(direction, there, turn), half


def _frequencies(frequency: Array, size: Array, wanted: Array) -> Array:
    """The least frequency (a, K, LEVELS) [Hz] at which each amplitude gives a size (K, LEVELS), NaN where it
    never does. Between grid points the square root of the size is nearly a straight line."""
    a, n, k = size.shape
    rising = np.sqrt(np.maximum.accumulate(size, axis=1))
    rising += np.arange(n)[:, None] * 1e-13 * np.maximum(rising[:, -1:], 1e-12)  # where it stays, the first
    level = np.sqrt(wanted)
    found = np.empty((a, k, wanted.shape[1]))
    for i in range(a):
        for j in range(k):
            found[i, j] = np.interp(level[j], rising[i, :, j], frequency)
    found[level[None] > rising[:, -1, :, None] * (1.0 + FLAT) + 1e-15] = np.nan
    return found


def _cheapest(command: Array, price: Array) -> Array:
    """Of commands (a, K, LEVELS, 2) the cheapest (K, LEVELS, 2): between the grid's amplitudes, on the
    parabola through three of them."""
    best = price.argmin(axis=0)
    k, level = np.ogrid[: best.shape[0], : best.shape[1]]
    around = np.clip(best + np.array([-1, 0, 1])[:, None, None], 0, len(price) - 1)
    before, at, after = price[around, k, level]
    with np.errstate(all="ignore"):
        offset = 0.5 * (before - after) / (before - 2.0 * at + after)
    inner = (around[0] < best) & (best < around[2]) & np.isfinite(offset)
    offset = np.where(inner, np.clip(offset, -0.5, 0.5), 0.0)[..., None]
    low, here, high = np.nan_to_num(command[around, k, level])
    return np.asarray(here + offset * (0.5 * (high - low) + 0.5 * offset * (low - 2.0 * here + high)))


def _slopes(effort: Array, wanted: Array, direction: Array, half: float) -> tuple[Array, Array, Array]:
    """The columns that follow from the slopes of the effort (K, LEVELS) by size and by direction."""
    marginal, stiffness = np.ones_like(effort), np.ones_like(effort)
    for k, size in enumerate(wanted):
        span = size[-1] - size[0]
        if span <= 1e-12:
            continue
        least = MARGINAL * max(float(np.ptp(effort[k])), 1e-12) / span
        marginal[k] = np.maximum(np.gradient(effort[k], size + np.arange(LEVELS) * 1e-15 * size[-1]), least)
        height = np.log(np.maximum(size, 1e-9 * size[-1])) + np.arange(LEVELS) * 1e-9
        stiffness[k] = np.gradient(np.log(marginal[k]), height)
    stiffness = np.where(stiffness > CONVEX, np.minimum(stiffness, STIFFEST), 1.0)
    mobility = np.maximum(wanted, 1e-5 * wanted[:, -1:] + 1e-300) / marginal
    # The effort at a given size, not at a given level, by the direction.
    by_direction = _around(effort, direction, half) - marginal * _around(wanted, direction, half)
    return np.log(mobility), stiffness, by_direction / marginal


def _around(values: Array, direction: Array, half: float) -> Array:
    """Derivatives of values (K, LEVELS) by the direction."""
    if len(direction) == 1 or half < 1e-6:
        return np.zeros_like(values)
    if half < np.pi:
        return np.asarray(np.gradient(values, direction, axis=0))
    turn = values[:-1]
    slope = (np.roll(turn, -1, axis=0) - np.roll(turn, 1, axis=0)) / (2.0 * (direction[1] - direction[0]))
    return np.concatenate([slope, slope[:1]])
