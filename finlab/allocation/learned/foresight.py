"""Where fins should turn now so that none has to turn fast soon.

The force of a fin that works cannot pass near zero without a fast turn. Which way the target is going is
known from the previous command, so the next ticks can be foreseen: from a few dozen ways to go on (stay,
drift with the working fins, change to another allocation soon or after fins at rest have turned, step aside
in the null space) the cheapest one is taken on which no fin turns too fast. Only its first tick is carried
out.

All ways are trajectories of planar forces that give the foreseen targets exactly; they are weighed together,
as arrays (M, H, n), in about a millisecond.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.prepared import Prepared
from finlab.forces.force_space import PlanarProblem

Array = NDArray[Any]

AHEAD = 17
"""Ticks that are foreseen, the present one included."""
CALM = 0.35
"""Turn per tick [rad] that costs nothing: what a pole of 3.5 rad/s follows in 0.1 s."""
FAST = 0.5
"""Turn per tick [rad] that is avoided at any price."""
TURN_COST = 0.2
"""Energy that a turn of one radian beyond `CALM` is worth."""
LASTING = 10
"""Ticks for which the last foreseen energy counts on: what a change of allocation pays in the long run."""
OVERLOAD_COST = 3.0
"""Energy that a thrust counts that is twice what a fin can give, beside its own."""
WORKS = 2e-4
"""Share of its largest thrust from which it matters where a fin points."""
STAY_GAIN = 0.01
"""Share of its energy that another way must save before the robot leaves the present one."""
SUDDEN = 0.5
"""Normalized change of the target in one tick from which nothing is foreseen: this is no smooth path."""
CHANGES = ((0, 1), (0, 3), (0, 8), (4, 3), (4, 8), (9, 4))
"""Changes to another allocation: ticks to wait, while fins at rest turn, and ticks to change."""
ASIDES = ((0, 2), (0, 6), (4, 6))
"""The same for steps aside."""
STEPS_ASIDE = (-0.3, -0.12, -0.05, 0.05, 0.12, 0.3)
"""Sizes of steps aside, as shares of a fin's largest thrust."""
N_RANDOM = 12
"""Steps aside in random directions."""


class Plan(NamedTuple):
    """The first tick of the way to go."""

    command: Array
    """(n, 3), a little off the target: to be refined."""
    ready: Array
    """Zero directions (n,) [rad] that the fins need next."""


def foresee(prepared: Prepared, previous: Array, target: Array, near: Array, far: Array) -> Plan | None:
    """The way to go, or None where the obvious one is as good.

    Args:
        prepared: the layout.
        previous: command (n, 3) of the previous tick.
        target: normalized wrench (6,).
        near: command (n, 3) that answers the target with small turns: the obvious way.
        far: other commands (P, n, 3) that answer it, whatever the turns.
    """
    planar = prepared.planar
    n = len(previous)
    before = _planar_force(prepared, previous)
    change = target - before.reshape(2 * n) @ planar.columns.reshape(2 * n, 6)
    if not np.linalg.norm(change) <= SUDDEN:
        return None
    now, others = _planar_force(prepared, near), _planar_force(prepared, far)
    ahead = np.arange(AHEAD)[:, None, None]
    slow, busy = _drifts(planar, now, change)
    kept = before + (ahead + 1) * busy
    obvious = np.stack([now + ahead * slow, now + ahead * busy])
    ways = np.concatenate(
        [
            obvious,
            np.stack([before + (ahead + 1) * slow, kept]),
            _changes(kept, others[:, None] + ahead * slow, CHANGES),
        ]
    )
    weighed = _weigh(prepared, previous, ways)
    if weighed.fast[int(np.argmin(weighed.cost))] > 0.0:
        # Steps aside are many: they are tried only where all else turns too fast.
        more = _changes(kept, _aside(planar, now, busy)[:, None] + ahead * slow, ASIDES)
        weighed = Weighed(*map(np.concatenate, zip(weighed, _weigh(prepared, previous, more), strict=True)))
    weighed.cost[: len(obvious)] *= 1.0 - STAY_GAIN
    best = int(np.argmin(weighed.cost))
    if best < len(obvious):
        return None
    thrust, direction, works = weighed.thrust[best], weighed.direction[best], weighed.works[best]
    first = works.argmax(0)
    ready = np.where(works.any(0), direction[first, np.arange(n)], previous[:, 2])
    command = planar.curves.lookup(np.minimum(thrust[0], planar.curves.maximum))
    command[:, 2] = ready
    return Plan(command, ready)


class Weighed(NamedTuple):
    """M trajectories and what they cost."""

    cost: Array
    """(M,), an energy."""
    fast: Array
    """By how much fins turn too fast (M,) [rad], what comes late counting less."""
    thrust: Array
    """(M, H, n) [N]."""
    direction: Array
    """(M, H, n) [rad]."""
    works: NDArray[np.bool_]
    """Whether a fin has to point where it does (M, H, n)."""


def _weigh(prepared: Prepared, previous: Array, force: Array) -> Weighed:
    """Turns and energy of trajectories of planar forces (M, H, n, 2) [N]."""
    planar = prepared.planar
    top = planar.curves.maximum
    x, y = force[..., 0], force[..., 1]
    thrust, direction = np.sqrt(x * x + y * y), np.arctan2(y, x)
    works = thrust > np.maximum(WORKS * top, 1.5 * planar.curves.minimum)
    sooner = 1.0 - np.arange(AHEAD) / AHEAD  # what comes late may be avoided yet
    fast, turned = (turn.sum(-1) @ sooner for turn in _turns(prepared, previous[:, 2], direction, works))
    # The energy of a thrust grows about like its square root; what a fin cannot give counts dearly, but a
    # drift that leaves its limits is no reason to leave the obvious way at any price.
    share = thrust / top
    energy = planar.curves.table[:, -1, 2] * np.sqrt(share) + OVERLOAD_COST * np.maximum(share - 1.0, 0.0)
    energy += planar.direction_cost * (direction * works) ** 2
    spent = energy.sum(-1)
    mean = (spent.sum(1) + LASTING * spent[:, -1]) / (AHEAD + LASTING)
    return Weighed(mean + TURN_COST * turned + 1e3 * fast, fast, thrust, direction, works)


def _planar_force(prepared: Prepared, command: Array) -> Array:
    """Planar forces (..., n, 2) [N] of commands by the surrogate."""
    force: Array = prepared.commands.fin.force(prepared.commands.clamp(command))[..., 1:]
    return force


def _drifts(planar: PlanarProblem, force: Array, change: Array) -> Array:
    """Changes of force per tick (2, n, 2) that change the wrench: of all fins, of those that work."""
    n = len(force)
    top = planar.curves.maximum
    columns = planar.columns.reshape(2 * n, 6)
    working = np.maximum(np.linalg.norm(force, axis=-1), 1e-4 * top) ** 1.5
    weighted = np.repeat(np.stack([top, working]), 2, axis=1)[..., None] * columns
    gram = columns.T @ weighted
    diagonal = gram.reshape(2, 36)[:, ::7]
    diagonal += 1e-9 * diagonal.sum(1, keepdims=True) + 1e-12
    multiplier = np.linalg.solve(gram, np.broadcast_to(change[:, None], (2, 6, 1)))
    drifts: Array = (weighted @ multiplier).reshape(2, n, 2)
    return drifts


def _changes(start: Array, goal: Array, shapes: tuple[tuple[int, int], ...]) -> Array:
    """From a trajectory (H, n, 2) to each of G others (G, H, n, 2), in each of S shapes: (S G, H, n, 2)."""
    tick = np.arange(1.0, AHEAD + 1.0)
    share = np.array([np.clip((tick - wait) / ramp, 0.0, 1.0) for wait, ramp in shapes])
    mixed = start + share[:, None, :, None, None] * (goal - start)
    return mixed.reshape(-1, *start.shape)


def _aside(planar: PlanarProblem, force: Array, drift: Array) -> Array:
    """Forces (G, n, 2) of the same wrench: one fin after the other steps off its way, and random ones."""
    n = len(force)
    _, size, right = np.linalg.svd(planar.columns.reshape(2 * n, 6).T)
    null = right[int((size > 1e-6 * size[0]).sum()) :]
    if len(null) == 0:
        return np.empty((0, n, 2))
    own = null.T.reshape(n, 2, len(null))
    across = np.stack([-drift[:, 1], drift[:, 0]], axis=-1)
    across /= np.linalg.norm(across, axis=-1, keepdims=True) + 1e-12
    # The least change of all forces that moves fin i by `across`.
    gram = own @ own.swapaxes(1, 2) + 1e-3 * np.eye(2)
    steps = (own.swapaxes(1, 2) @ np.linalg.solve(gram, across[..., None]))[..., 0]
    drawn = np.random.default_rng(0).standard_normal((N_RANDOM, len(null)))
    drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    drawn *= np.resize(STEPS_ASIDE[3:], N_RANDOM)[:, None]
    steps = np.concatenate([np.kron(np.array(STEPS_ASIDE)[:, None], steps), drawn])
    aside: Array = force + (planar.curves.maximum.mean() * (steps @ null)).reshape(-1, n, 2)
    return aside


def _turns(
    prepared: Prepared, before: Array, direction: Array, works: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """By how much [rad] fins turn beyond `FAST` and beyond `CALM`, (M, H, n).

    Only fins that work have to point anywhere; what a fin turns at rest is spread over its rest.
    """
    middle, half = prepared.planar.middle, prepared.planar.half
    wraps = prepared.commands.wraps
    offset = _wrapped(direction - middle)
    stopped = np.where(wraps | ~works, 0.0, np.maximum(np.abs(offset) - half, 0.0))
    tick = np.arange(1, AHEAD + 1)[:, None]
    last = np.maximum.accumulate(np.where(works, tick, 0), axis=1)
    last = np.concatenate([np.zeros_like(last[:, :1]), last[:, :-1]], axis=1)
    start = np.broadcast_to(_wrapped(before - middle), offset[:, :1].shape)
    turn = offset - np.take_along_axis(np.concatenate([start, offset], axis=1), last, axis=1)
    turn = np.where(works, np.abs(np.where(wraps, _wrapped(turn), turn)), 0.0)
    spread = tick - last
    return np.maximum(turn - FAST * spread, 0.0) + stopped, np.maximum(turn - CALM * spread, 0.0)


def _wrapped(angle: Array) -> Array:
    """The same angles within half a turn either way [rad]."""
    wrapped: Array = angle - 2 * np.pi * np.rint(angle / (2 * np.pi))
    return wrapped
