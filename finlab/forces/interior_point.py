"""A primal-dual interior-point method for planar forces within discs, sectors, lines and polygons.

    min 1/2 sum_j v_j^2 / c_j   s.t.   v = w - sum_i B_i y_i,   y_i within its set,

for many robots at once. Newton's systems are reduced to the multipliers l = v / c of the wrench, so that an
axis with a tiny c, which must be met, costs no accuracy, and more actuators hardly cost time. Forces count
from the centres of the sets.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array, solve
from finlab.forces.force_sets import THINNEST, ForceSets

ITERATIONS = 40
UNMET = 1e-8
"""Largest violation of any condition at the end, relative to the same."""
CENTRING = (0.05, 0.3)
"""By how much a step aims to lessen that product: after a long step, and after a short one."""
LEAST_GAP, SHORT = 1e-13, 1e-6
"""Such a product, or such a short step, ends it too: rounding allows no more."""
LONG = 0.9
"""Share of Newton's step from which it counts as long."""
STIFF = 1e-10
"""Least stiffness of a fin: steps of those that nothing holds stay bounded."""
RIDGE = 1e-15
"""Relative regularization of the systems."""
KEPT = 0.99
"""Share of the way to the nearest limit that a step goes at most."""
SLACK, WEIGHT = 3.0, 10.0
"""Slack and multiplier of each limit at the outset; the latter for a wanted wrench that is not far away."""
NARROWEST = 1e-6
"""Half of a sector's angle [rad] below which it has no inside: such a fin only pushes ahead."""


class _State(NamedTuple):
    """R problems on their way; forces are shares of each one's largest, components before actuators."""

    full: Array
    """Wrench (R, 2n, m) of the largest forces."""
    sides: Array
    """Outward normals (R, K, 2, n) of the sectors' sides."""
    beyond: Array
    """How far out those sides are (R, K, n); 1 where there is none."""
    wanted: Array  # (R, m), as c and the multiplier
    c: Array
    point: Array  # (R, 2, n)
    multiplier: Array
    slack: Array
    """Of each limit (R, 1 + K, n): the disc, then the sides; as the limits' multipliers, the weights."""
    weight: Array
    length: Array
    """Of the last step (R,)."""


def minimize(sets: ForceSets, wanted: Array, c: Array, gap: float) -> tuple[Array, Array]:
    """Solves R problems in m coordinates: the planar forces (R, n, 2) [N] within the sets, hulls of sectors
    wider than half a turn, whose wrench comes nearest to `wanted` (R, m), squared errors divided by `c` (m,)
    or (R, m), and the multiplier (R, m) of the wrench.

    The search ends at a `gap`: the mean product of a limit's multiplier and slack relative to the wrench's
    error plus one, where the strongest actuator's wrench is one.
    """
    state = _outset(sets, wanted - sets.offset, c)
    busy, least = np.arange(len(wanted)), np.full(len(wanted), np.inf)
    point, multiplier = state.point.copy(), state.multiplier.copy()
    for _ in range(ITERATIONS):
        before = state
        done, off, state = _step(before, gap)
        # At a corner rounding may spoil the last steps.
        better = off < least[busy]
        at = busy[better]
        least[at], point[at], multiplier[at] = off[better], before.point[better], before.multiplier[better]
        if done.all():
            break
        if 2 * done.sum() > len(done):  # the few that are left need not drag all others along
            busy, state = busy[~done], _State(*(field[~done] for field in state))
    # Should a row not be done, its forces are at least such that the fins can give.
    force = _ahead(sets, np.nan_to_num(point).swapaxes(1, 2)[..., None])[..., 0]
    force /= np.maximum(np.sqrt((force * force).sum(-1, keepdims=True)), 1.0)
    force *= sets.radius[..., None]
    if sets.center is not None:
        force += sets.center
    return force, multiplier * _unit(sets)[:, None]


def _outset(sets: ForceSets, wanted: Array, c: Array) -> _State:
    rows, n = sets.radius.shape
    m = sets.effectiveness.shape[-1]
    unit = _unit(sets)
    full = _ahead(sets, sets.effectiveness * (sets.radius / unit[:, None])[..., None, None])
    sides, beyond = _sides(sets)
    limits = 1 + sides.shape[1]
    wanted, c = wanted / unit[:, None], np.broadcast_to(np.asarray(c, np.float64), (rows, m))
    pulled = 1.0 + (np.abs(wanted) / np.maximum(c, 1.0)).max(-1)
    full = full.swapaxes(1, 2).reshape(rows, 2 * n, m)
    point, multiplier = np.zeros((rows, 2, n)), np.zeros((rows, m))
    slack = np.full((rows, limits, n), SLACK)
    weight = np.tile(WEIGHT * pulled[:, None, None], (1, limits, n))
    return _State(full, sides, beyond, wanted, c, point, multiplier, slack, weight, np.ones(rows))


def _unit(sets: ForceSets) -> Array:
    """Wrench (R,) of each robot's strongest fin, by which all are divided."""
    size: Array = (np.sqrt((sets.effectiveness**2).sum((-1, -2))) * sets.radius).max(-1)
    return np.where(size > 0.0, size, 1.0)


def _ahead(sets: ForceSets, vectors: Array) -> Array:
    """Vectors (R, n, 2, k) in the actuators' planes, of lines only their parts ahead."""
    fixed = (sets.half < NARROWEST) & ~sets.cornered
    if not fixed.any():
        return vectors
    ahead = np.stack([np.cos(sets.middle), np.sin(sets.middle)], axis=-1)[..., None]
    return np.where(fixed[..., None, None], ahead * (ahead * vectors).sum(-2, keepdims=True), vectors)


def _sides(sets: ForceSets) -> tuple[Array, Array]:
    """Normals (R, K, 2, n) that point out of each sector, and how far out its sides are (R, K, n). A sector
    has two sides through the origin, the hull of one wider than half a turn the chord between its stops, and
    uneven fins and polygons those of their polygon."""
    normals, beyond = _stops(sets)
    if sets.corners is not None:
        radius = np.where(sets.radius > 0.0, sets.radius, 1.0)[..., None, None]
        at = (sets.corners / radius).swapaxes(1, 2)  # (R, K, n, 2)
        edge = np.roll(at, -1, axis=1) - at
        length = np.sqrt((edge * edge).sum(-1))
        none = length < NARROWEST
        out = np.stack([edge[..., 1], -edge[..., 0]], axis=-1) / np.where(none, np.inf, length)[..., None]
        normals = np.concatenate([normals, out.swapaxes(2, 3)], axis=1)
        beyond = np.concatenate([beyond, np.where(none, 1.0, (out * at).sum(-1))], axis=1)
    if sets.boundary is None:
        return normals, beyond
    rows, n, count = sets.boundary.shape
    angle = 2.0 * np.pi / count * np.arange(count)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)[:, :, None]
    around = np.broadcast_to(around, (rows, count, 2, n))
    out = np.concatenate([beyond, np.maximum(sets.boundary.swapaxes(1, 2), THINNEST)], axis=1)
    return np.concatenate([normals, around], axis=1), out


def _stops(sets: ForceSets) -> tuple[Array, Array]:
    """The sides at the fins' stops, see `_sides`."""
    circle = (sets.half >= np.pi) | sets.cornered
    rows, n = sets.half.shape
    if circle.all():
        return np.zeros((rows, 0, 2, n)), np.zeros((rows, 0, n))
    wide = sets.half > np.pi / 2
    half = np.where(sets.half < NARROWEST, np.pi / 2, sets.half)
    ends = np.stack([sets.middle + half - np.pi / 2, sets.middle - half + np.pi / 2], axis=1)
    ends = np.where(wide[:, None], sets.middle[:, None], ends)
    none = np.stack([circle, circle | wide], axis=1)
    normals = -np.stack([np.cos(ends), np.sin(ends)], axis=2)
    beyond = np.where(wide[:, None], -np.cos(half)[:, None], 0.0)
    if sets.back is not None:
        beyond += sets.back[:, None]
    return np.where(none[:, :, None], 0.0, normals), np.where(none, 1.0, beyond)


def _step(state: _State, tolerance: float) -> tuple[NDArray[np.bool_], Array, _State]:
    """Which rows are done, how far off each is (R,), and all others one Newton step on."""
    full, sides, beyond, wanted, c, point, multiplier, slack, weight, length = state
    rows, _, n = point.shape
    missing = wanted - _wrench(full, point)
    disc = 0.5 * ((point * point).sum(1, keepdims=True) - 1.0)
    flat = (sides * point[:, None]).sum(2) - beyond
    astray = np.concatenate([disc, flat], axis=1) + slack
    size = 1.0 + np.sqrt((missing * missing / c).sum(-1))
    gap = (weight * slack).mean((1, 2))
    unmet = np.abs(missing - c * multiplier).max(-1) + np.abs(astray).max((1, 2))
    gap, unmet = gap / size, unmet / size
    done = ((gap <= tolerance) & (unmet <= UNMET)) | (gap <= LEAST_GAP) | (length < SHORT)
    off = gap + unmet
    if done.all():
        return done, off, state
    slope = np.concatenate([point[:, None], sides], axis=1)  # of the limits (R, 1 + K, 2, n)
    ratio = weight / slack
    aim = (np.where(length > LONG, *CENTRING) * gap * size)[:, None, None] / slack + ratio * astray
    xx, xy, yy = _softness(slope, ratio, weight[:, 0] + STIFF)
    pull = (full @ multiplier[..., None]).reshape(point.shape) - (aim[:, :, None] * slope).sum(1)
    blocks = full.reshape(rows, 2, n, -1)
    x, y = blocks[:, 0], blocks[:, 1]
    a, b, d = xx[..., None], xy[..., None], yy[..., None]
    spread = np.concatenate([a * x + b * y, b * x + d * y], axis=1)
    gram = full.swapaxes(1, 2) @ spread
    diagonal = gram.reshape(rows, -1)[:, :: gram.shape[-1] + 1]
    diagonal += c + RIDGE * diagonal.sum(1, keepdims=True)
    right = missing - c * multiplier - _wrench(spread, pull)
    turn = solve(gram, right[..., None])[..., 0]
    pull += (full @ turn[..., None]).reshape(point.shape)
    step = np.stack([xx * pull[:, 0] + xy * pull[:, 1], xy * pull[:, 0] + yy * pull[:, 1]], axis=1)
    along = (slope * step[:, None]).sum(2)
    growth = aim - weight + ratio * along
    length = np.minimum(_way_to_zero(slack, -astray - along), _way_to_zero(weight, growth))
    length = np.where(done, 0.0, np.minimum(KEPT * length, 1.0))
    far, multiplier = length[:, None, None], multiplier + length[:, None] * turn
    point, slack, weight = point + far * step, slack - far * (astray + along), weight + far * growth
    return done, off, _State(full, sides, beyond, wanted, c, point, multiplier, slack, weight, length)


def _wrench(full: Array, point: Array) -> Array:
    return np.asarray((point.reshape(len(point), 1, -1) @ full)[:, 0])


def _way_to_zero(weight: Array, growth: Array) -> Array:
    """The longest step (R,) that keeps the limits' multipliers positive."""
    ways = np.where(growth < 0.0, weight / np.maximum(-growth, 1e-100), np.inf)
    return np.asarray(ways.min((1, 2)))


def _softness(slope: Array, ratio: Array, stiff: Array) -> tuple[Array, Array, Array]:
    """Entries xx, xy, yy (R, n) of the inverses of stiff I + sum_k ratio_k slope_k slope_k^T."""
    pushed = slope * np.sqrt(ratio)[:, :, None]
    x, y = pushed[:, :, 0], pushed[:, :, 1]
    a, b, d = stiff + (x * x).sum(1), (x * y).sum(1), stiff + (y * y).sum(1)
    # The determinant as a sum of squares, which rounding cannot bring to zero where two sides are close.
    determinant = stiff * (a + d - stiff)
    if x.shape[1] > 3:  # more pairs than neighbours; sides of a polygon are never close
        determinant = np.maximum(a * d - b * b, determinant)
    elif x.shape[1] > 1:
        cross = x * np.roll(y, 1, axis=1) - y * np.roll(x, 1, axis=1)
        determinant += (cross * cross).sum(1)
    return d / determinant, -b / determinant, a / determinant
