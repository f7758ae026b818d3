"""What one fin can do, compiled: for each direction and size of its force the cheapest command, and its cost.

A fin's law may be any: its force may saturate and fall again, lean off the zero direction, differ from one
direction to the next, or come from a table. Once per fin the law is asked on a grid of commands. For each of
`DIRECTIONS` directions of the planar force, and each of `LEVELS` sizes between the smallest and the largest,
the cheapest pair of amplitude and frequency is found by inverting the force along the frequency for each
amplitude, and then made exact by the law itself. Everything that searches in force space reads these tables
and needs no other word about the fin.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from finlab.actuators.fin.models import file_stamp, make_law
from finlab.actuators.law import FinLaw
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout import FinModelSpec, Limits
from finlab.layout.angles import is_full_turn, wrapped
from finlab.physics.objective import Objective

LEVELS = 49
"""Sizes of force per direction."""
DIRECTIONS = 49
"""Directions of the force, the ends of the arc included; a fin that is the same all round needs but one."""
AMPLITUDES, FREQUENCIES, TURNS = 25, 49, 73
"""Commands at which a law is asked along each axis."""
WEAK = 1e-3
"""Share of the largest force below which a force has no direction of its own."""
FLAT = 1e-5
"""By how much, as a share, a force may fall short of a level and still count as giving it."""
CONVEX = 0.3
"""Least elasticity of the marginal cost that is followed; below it, and where cost is concave, a steeper
quadratic is touched, which never overshoots."""
STIFFEST = 10.0
"""Elasticities above this one count as this one."""
MARGINAL = 1e-3
"""Least marginal cost, as a share of the mean one."""
NOISY = 0.004
"""Share of levels whose cost is below that of the one before, from which on a fin counts as measured."""
WAVES = 4
"""Waves around the circle, or degree along an arc, that the smooth cost of a measured fin has."""
MEASURED = 0.05
"""The same of a measured fin, whose weak forces are hardly known."""
NARROWEST = 1e-6
"""Half of an arc [rad] below which a fin has but one direction."""
POLISHES = 3
"""Newton steps by the law itself."""

AMPLITUDE, FREQUENCY, DEFLECTION, COST, MOBILITY, STIFFNESS, DRIFT, SHAFT = range(8)
"""Columns of a table: amplitude [rad], frequency [Hz], force direction minus zero direction [rad], cost,
logarithm of the mobility T / (dc/dT), elasticity of dc/dT, dc/dtheta over dc/dT [N], force along the
shaft [N]."""


@dataclass(frozen=True, eq=False)
class FinEnvelope:
    """The compiled fin. Directions are evenly spaced over its arc; sizes follow `levels`."""

    middle: float
    """Middle of the arc of force directions [rad]."""
    half: float
    """Half of that arc [rad]; pi for a full circle."""
    smallest: Array
    """Smallest force (K,) [N] by direction: the fin at rest."""
    largest: Array
    """Largest force (K,) [N] by direction."""
    table: Array
    """(K, LEVELS, 8), see the columns above."""


def levels() -> Array:
    """Shares (LEVELS,) of the range of sizes: dense near zero, where both commands grow like fourth roots,
    and near the top, where a force that saturates is flat in its commands."""
    share: Array = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, LEVELS)) ** 4
    return share


def fin_envelope(model: FinModelSpec, limits: Limits, objective: Objective) -> FinEnvelope:
    """Returns the compiled fin, kept from the last time it was asked for.

    Raises:
        DataError: the fin's force table cannot be read, or gives no thrust within the limits.
    """
    return _kept(model, limits, objective, file_stamp(model))


@lru_cache(maxsize=512)
def _kept(
    model: FinModelSpec, limits: Limits, objective: Objective, stamp: tuple[int, int] | None
) -> FinEnvelope:
    """An envelope; a table whose file has changed is read again."""
    fin = compile_fin(make_law(model), limits, objective)
    if model.type == "table" and not fin.largest.any():
        (low, high), (slow, fast) = limits.amplitude, limits.frequency
        raise DataError(
            f"{model.values()['path']}: gives no thrust within the fin's limits, amplitudes {low:.4g} to "
            f"{high:.4g} rad and frequencies {slow:.4g} to {fast:.4g} Hz; widen the limits or leave it out"
        )
    return fin


def compile_fin(law: FinLaw, limits: Limits, objective: Objective) -> FinEnvelope:
    """Returns the envelope of a fin of one law within its limits."""
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    grid = _force_grid(law, lower, upper)
    size = _with_peaks(grid.size)
    largest = size.max(axis=(0, 1))
    smallest = np.minimum(grid.size[0, 0], largest)
    wanted = smallest[:, None] + (largest - smallest)[:, None] * levels()
    found = _frequencies(grid.frequency, size, wanted)
    turn = _turns_at(grid, found)
    amplitude = np.broadcast_to(grid.amplitude[:, None, None], found.shape)
    command = np.stack([amplitude, found, turn], axis=-1)
    cost = objective.fin_cost(law, upper)
    price = np.where(np.isnan(found), np.inf, cost(np.nan_to_num(command)))
    command = _polished(law, _cheapest(command, price), grid, wanted, lower, upper)
    table = _table(law, cost(command), command, grid, wanted, objective.convex)
    return FinEnvelope(grid.middle, grid.half, smallest, largest, table)


class _Grid(NamedTuple):
    """A law asked on a grid of a amplitudes, f frequencies and K directions of the force."""

    amplitude: Array
    """(a,) [rad]."""
    frequency: Array
    """(f,) [Hz]."""
    direction: Array
    """(K,) [rad]; of a fin that is the same all round, one will do."""
    size: Array
    """Size of the planar force (a, f, K) [N]; zero where the stops do not let it point there."""
    turn: Array
    """Zero direction (a, f, K) [rad] that points it there."""
    middle: float
    half: float
    """The arc of force directions, as in the envelope."""
    uniform: bool
    """Whether the fin is the same all round."""


def _axis(low: float, high: float, count: int) -> Array:
    return np.linspace(low, high, count if high > low else 1)


def _force_grid(law: FinLaw, lower: Array, upper: Array) -> _Grid:
    """Ask a law, and say which zero direction points the force where."""
    amplitude = _axis(lower[0], upper[0], AMPLITUDES)
    frequency = _axis(lower[1], upper[1], FREQUENCIES)
    full = bool(is_full_turn(upper[2] - lower[2]))
    ahead = float(np.clip(0.0, lower[2], upper[2]))
    turns = np.array([ahead]) if law.uniform else _axis(lower[2], upper[2], TURNS)
    force = law.force(np.stack(np.meshgrid(amplitude, frequency, turns, indexing="ij"), axis=-1))
    size = np.hypot(force[..., 1], force[..., 2])
    deflection = wrapped(np.arctan2(force[..., 2], force[..., 1]) - turns)
    if len(turns) == 1:
        strongest = float(deflection.flat[size.argmax()])
        half = np.pi if full else 0.5 * float(upper[2] - lower[2])
        middle = 0.5 * float(lower[2] + upper[2]) + strongest
        turn = np.broadcast_to(turns, size.shape)
        return _Grid(amplitude, frequency, turns + strongest, size, turn, middle, half, True)
    # A force that is next to nothing leans as the strongest one does.
    a, f = np.unravel_index(size.max(axis=2).argmax(), size.shape[:2])
    deflection = np.where(size > WEAK * size.max(), deflection, deflection[a, f])
    if full:
        middle, half = 0.5 * float(lower[2] + upper[2]), np.pi
    else:
        # The outermost directions of all forces that are worth anything.
        worth = size > 0.02 * size.max(axis=(0, 1))
        first = float(np.where(worth[..., 0], turns[0] + deflection[..., 0], np.inf).min())
        last = float(np.where(worth[..., -1], turns[-1] + deflection[..., -1], -np.inf).max())
        middle, half = 0.5 * (first + last), float(np.clip(0.5 * (last - first), 0.0, np.pi))
    direction = np.linspace(middle - half, middle + half, DIRECTIONS)
    turn = np.broadcast_to(direction, (*size.shape[:2], DIRECTIONS))
    for _ in range(8):  # the lean changes slowly from one zero direction to the next
        turn = direction - _along_turns(deflection, turns, turn, full)
    size = _along_turns(size, turns, turn, full)
    if not full:
        size = np.where((turn >= lower[2] - 1e-3) & (turn <= upper[2] + 1e-3), size, 0.0)
        turn = np.clip(turn, lower[2], upper[2])
    return _Grid(amplitude, frequency, direction, size, turn, middle, half, False)


def _along_turns(values: Array, turns: Array, at: Array, full: bool) -> Array:
    """Values (a, f, d) on evenly spaced zero directions (d,), linearly in between at others (a, f, K)."""
    last = len(turns) - 1
    place = (at - turns[0]) * last / (turns[-1] - turns[0])
    place = np.clip(np.mod(place, last) if full else place, 0.0, last)
    low = np.minimum(place.astype(np.intp), last - 1)
    part = place - low
    a, f = np.ogrid[: values.shape[0], : values.shape[1]]
    found: Array = values[a[..., None], f[..., None], low] * (1.0 - part)
    found += values[a[..., None], f[..., None], low + 1] * part
    return found


def _with_peaks(size: Array) -> Array:
    """Sizes (a, f, K); of one that falls again the largest is that of its very peak, between grid points."""
    n = size.shape[1]
    if n < 3:
        return size
    peak = size.argmax(axis=1)
    inner = (peak > 0) & (peak < n - 1)
    peak = np.clip(peak, 1, n - 2)
    a, k = np.ogrid[: size.shape[0], : size.shape[2]]
    _, top = _vertex(size[a, peak - 1, k], size[a, peak, k], size[a, peak + 1, k])
    size = size.copy()
    size[a, peak, k] = np.where(inner, top, size[a, peak, k])
    return size


def _vertex(before: Array, at: Array, after: Array) -> tuple[Array, Array]:
    """Where the parabola through three evenly spaced values turns, in steps from the middle one, and its
    value there; the middle one where it has no such place."""
    with np.errstate(all="ignore"):
        offset = 0.5 * (before - after) / (before - 2.0 * at + after)
    offset = np.where(np.isfinite(offset), np.clip(offset, -0.5, 0.5), 0.0)
    return offset, _parabola(before, at, after, offset)


def _parabola(before: Array, at: Array, after: Array, offset: Array) -> Array:
    with np.errstate(invalid="ignore"):
        value = at + offset * (0.5 * (after - before) + 0.5 * offset * (before - 2.0 * at + after))
    return np.where(offset == 0.0, at, value)


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


def _turns_at(grid: _Grid, frequency: Array) -> Array:
    """Zero directions (a, K, LEVELS) at frequencies (a, K, LEVELS) between those of the grid."""
    if grid.uniform:
        return np.full(frequency.shape, grid.turn.flat[0])
    low, n = grid.frequency[0], len(grid.frequency)
    place = np.nan_to_num(frequency - low) / max(grid.frequency[-1] - low, 1e-12) * (n - 1)
    place = np.clip(place, 0.0, n - 1)
    first = np.minimum(place.astype(np.intp), max(n - 2, 0))
    a, k = np.ogrid[: frequency.shape[0], : frequency.shape[1]]
    a, k, part = a[..., None], k[..., None], place - first
    found: Array = (
        grid.turn[a, first, k] * (1.0 - part) + grid.turn[a, np.minimum(first + 1, n - 1), k] * part
    )
    return found


def _cheapest(command: Array, price: Array) -> Array:
    """Of commands (a, K, LEVELS, 3) the cheapest (K, LEVELS, 3), between the grid's amplitudes, too."""
    best = price.argmin(axis=0)
    k, level = np.ogrid[: best.shape[0], : best.shape[1]]
    before, after = np.maximum(best - 1, 0), np.minimum(best + 1, len(price) - 1)
    offset, _ = _vertex(price[before, k, level], price[best, k, level], price[after, k, level])
    inner = (before < best) & (best < after) & np.isfinite(price[before, k, level] + price[after, k, level])
    offset = np.where(inner, offset, 0.0)[..., None]
    found = _parabola(command[before, k, level], command[best, k, level], command[after, k, level], offset)
    return np.nan_to_num(found)


def _polished(law: FinLaw, command: Array, grid: _Grid, wanted: Array, lower: Array, upper: Array) -> Array:
    """Commands (K, LEVELS, 3) whose frequency and zero direction give the wanted sizes (K, LEVELS) by the law
    itself; where a step does not help, as at a peak, the command stays."""
    low, high = lower.copy(), upper.copy()
    if is_full_turn(upper[2] - lower[2]):
        low[2], high[2] = -np.inf, np.inf
    # A fin of one frequency has its amplitude to give the size.
    free = [1, 2] if upper[1] > lower[1] else [0, 2]
    longest = np.array([0.1 * (upper[free[0]] - lower[free[0]]), 0.1])
    point = np.stack([np.cos(grid.direction), np.sin(grid.direction)], axis=-1)
    goal = wanted[..., None] * point[:, None]
    best = np.clip(command, low, high)
    error = np.full(wanted.shape, np.inf)
    trial = best
    for _ in range(POLISHES + 1):
        force, jacobian = law.force_and_jacobian(trial)
        missing = goal - force[..., 1:]
        off = np.hypot(missing[..., 0], missing[..., 1])
        better = off < error
        best, error = np.where(better[..., None], trial, best), np.where(better, off, error)
        jacobian = jacobian[..., free, 1:]
        if grid.uniform:
            jacobian = jacobian * np.array([[1.0], [0.0]])
        gram = jacobian @ jacobian.swapaxes(-1, -2)
        ridge = 1e-8 * np.trace(gram, axis1=-2, axis2=-1)[..., None, None] + 1e-30
        step = np.linalg.solve(gram + ridge * np.eye(2), jacobian @ missing[..., None])[..., 0]
        trial = trial.copy()
        trial[..., free] += np.clip(step, -longest, longest)
        trial = np.clip(trial, low, high)
    return best


def _table(law: FinLaw, cost: Array, command: Array, grid: _Grid, wanted: Array, convex: bool) -> Array:
    """The table of an envelope, from its commands (K, LEVELS, 3), their cost and size (K, LEVELS)."""
    found = cost
    noisy = convex and len(cost) > 1 and (np.diff(cost, axis=1) < -1e-9 * np.ptp(cost)).mean() > NOISY
    if noisy:
        cost, wanted = _smooth(cost, wanted, grid)
    marginal, stiffness = np.ones_like(cost), np.ones_like(cost)
    for k, size in enumerate(wanted):
        span = size[-1] - size[0]
        if span <= 1e-12:
            continue
        size = size + np.arange(len(size)) * 1e-15 * size[-1]
        share = MEASURED if noisy else MARGINAL
        least = share * max(float(cost[k].max() - cost[k].min()), 1e-12) / span
        marginal[k] = np.maximum(np.gradient(cost[k], size), least)
        if noisy:  # noise that is left must not look like falling cost
            marginal[k] = np.maximum.accumulate(marginal[k])
        height = np.log(np.maximum(size, 1e-9 * size[-1])) + np.arange(len(size)) * 1e-9
        stiffness[k] = np.gradient(np.log(marginal[k]), height)
    stiffness = np.where(stiffness > CONVEX, np.minimum(stiffness, STIFFEST), 1.0)
    # The cost at a given size, not at a given level, by the direction.
    by_direction = _around(cost, grid) - marginal * _around(wanted, grid)
    mobility = np.maximum(wanted, 1e-5 * wanted[:, -1:] + 1e-300) / marginal
    effectiveness = (
        command[..., 0],
        command[..., 1],
        wrapped(grid.direction[:, None] - command[..., 2]),
        found,
        np.log(mobility),
        stiffness,
        by_direction / marginal,
        law.force(command)[..., 0],
    )
    return np.stack(effectiveness, axis=-1)


def _smooth(cost: Array, wanted: Array, grid: _Grid) -> tuple[Array, Array]:
    """Cost and size (K, LEVELS) as the search shall see them: those of a measured fin rise and fall with the
    noise, from which no slope follows, so they are taken for polynomials of the level and few waves of
    the direction. The commands stay what they are."""
    across = np.linspace(-1.0, 1.0, len(cost))
    if grid.half < np.pi:
        waves = np.polynomial.legendre.legvander(across, WAVES)
    else:
        turns = np.pi * across[:, None] * np.arange(1, WAVES + 1)
        waves = np.hstack([np.ones((len(cost), 1)), np.cos(turns), np.sin(turns)])
    level = np.linspace(0.0, 1.0, LEVELS)[:, None]
    # Near rest force is like the fourth power of the level, and cost grows no more slowly.
    powers = level ** np.r_[0, 4:9]
    around, along = (basis @ np.linalg.pinv(basis) for basis in (waves, powers))
    ends = np.maximum(around @ wanted[:, [0, -1]], [0.0, WEAK * float(wanted.max())])
    ends[:, 0] = np.minimum(ends[:, 0], ends[:, 1])
    return around @ cost @ along.T, ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * levels()


def _around(values: Array, grid: _Grid) -> Array:
    """Derivatives of values (K, LEVELS) by the direction."""
    if len(grid.direction) == 1 or grid.half < NARROWEST:
        return np.zeros_like(values)
    if grid.half < np.pi:
        jacobian: Array = np.gradient(values, grid.direction, axis=0)
        return jacobian
    turn = values[:-1]
    jacobian = (np.roll(turn, -1, axis=0) - np.roll(turn, 1, axis=0)) / (
        2.0 * (grid.direction[1] - grid.direction[0])
    )
    return np.concatenate([jacobian, jacobian[:1]])
