"""Where fins should turn now so that none has to turn fast soon.

The force of a fin that works cannot pass near zero without a fast turn. The change from the previous
command's wrench to the target is taken to go on, which predicts the next ticks: of a few dozen trajectories
(stay, drift with the working fins, change to another allocation soon or after fins at rest have turned, step
aside in the null space) the cheapest one is taken on which no fin turns too fast. Only its first tick is
carried out.

All of them are trajectories of planar forces that give the predicted targets exactly; they are evaluated
together, as arrays (M, H, n), in about a millisecond.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.search.prepared import Prepared
from finlab.arrays import Array
from finlab.forces.fin_envelope import AMPLITUDE, COST, FREQUENCY, LEAN
from finlab.forces.force_space import PlanarProblem
from finlab.layout.angles import wrapped


@dataclass(frozen=True)
class HorizonSettings:
    """How far the next ticks are predicted, and what counts on the way."""

    ticks: int = 17
    """Ticks of the horizon, the present one included: half a circle at `free_turn` takes a fin at rest 9, and
    the longest change 8 more."""
    free_turn: float = 0.35
    """Turn per tick [rad] that costs nothing: what a pole of 3.5 rad/s follows in 0.1 s."""
    max_turn: float = 0.5
    """Turn per tick [rad] that is avoided at any price."""
    turn_cost: float = 0.07
    """What a turn of one radian beyond `free_turn` is worth, as a share of a fin's largest cost."""
    last_tick_weight: int = 10
    """Ticks for which the cost of the last tick counts on: what a change of allocation pays in the long
    run."""
    overload_cost: float = 1.0
    """What a force counts that is twice what a fin can give, as a share of its largest cost."""
    working_share: float = 2e-4
    """Share of its largest thrust from which it matters where a fin points."""
    stay_gain: float = 0.01
    """Share of its cost that another trajectory must save before the robot leaves the present one."""
    sudden_change: float = 0.5
    """Normalized change of the target in one tick from which nothing is predicted: this is no smooth path."""
    changes: tuple[tuple[int, int], ...] = ((0, 1), (0, 3), (0, 8), (4, 3), (4, 8), (9, 4))
    """Changes to another allocation: ticks to wait, while fins at rest turn, and ticks to change."""
    detours: tuple[tuple[int, int], ...] = ((0, 2), (0, 6), (4, 6))
    """The same for steps within the null space."""
    detour_sizes: tuple[float, ...] = (-0.3, -0.12, -0.05, 0.05, 0.12, 0.3)
    """Sizes of those steps, as shares of a fin's largest thrust."""
    random_detours: int = 12
    """Steps in random directions of the null space."""


HORIZON = HorizonSettings()
"""What the pipeline uses."""


class Plan(NamedTuple):
    """The first tick of the chosen trajectory."""

    command: Array
    """(n, 3), a little off the target: to be refined."""
    ready: Array
    """Zero directions (n,) [rad] that the fins need next."""


def plan_ahead(
    prepared: Prepared,
    previous: Array,
    target: Array,
    near: Array,
    far: Array,
    settings: HorizonSettings = HORIZON,
) -> Plan | None:
    """The first tick of the cheapest trajectory, or None where going straight on is as good.

    Args:
        prepared: the layout.
        previous: command (n, 3) of the previous tick.
        target: normalized wrench (6,).
        near: command (n, 3) that answers the target with small turns: going straight on.
        far: other commands (P, n, 3) that answer it, whatever the turns.
        settings: the horizon, and what counts on the way.
    """
    planar = prepared.planar
    n = len(previous)
    before = _planar_force(prepared, previous)
    change = target - before.T.reshape(2 * n) @ planar.columns
    if not np.linalg.norm(change) <= settings.sudden_change:
        return None
    now, others = _planar_force(prepared, near), _planar_force(prepared, far)
    tick = np.arange(settings.ticks)[:, None, None]
    slow, working = _drifts(planar, now, change)
    kept = before + (tick + 1) * working
    straight = np.stack([now + tick * slow, now + tick * working])
    forces = np.concatenate(
        [
            straight,
            np.stack([before + (tick + 1) * slow, kept]),
            _changes(kept, others[:, None] + tick * slow, settings.changes),
        ]
    )
    found = evaluate(prepared, previous, forces, settings)
    if found.too_fast[int(np.argmin(found.cost))] > 0.0:
        # Detours are many: they are tried only where all else turns too fast.
        goals = _detours(planar, now, working, settings)[:, None] + tick * slow
        more = evaluate(prepared, previous, _changes(kept, goals, settings.detours), settings)
        found = Trajectories._make(map(np.concatenate, zip(found, more, strict=True)))
    best = choose(found.cost, len(straight), settings)
    if best < len(straight):
        return None
    size, direction, works = found.size[best], found.direction[best], found.works[best]
    first = works.argmax(0)
    row = planar.fins.lookup(planar.fins.rim(direction[:1]), size[:1])[0]
    ahead = direction[first, np.arange(n)] - row[:, LEAN]
    ready = np.where(works.any(0), ahead, previous[:, 2])
    return Plan(np.stack([row[:, AMPLITUDE], row[:, FREQUENCY], ready], axis=-1), ready)


def choose(cost: Array, n_straight: int, settings: HorizonSettings = HORIZON) -> int:
    """The cheapest of M trajectories (M,); the first ones go straight on and are left only for a gain."""
    weighed = cost.copy()
    weighed[:n_straight] *= 1.0 - settings.stay_gain
    return int(np.argmin(weighed))


class Trajectories(NamedTuple):
    """M trajectories over H ticks and what they cost."""

    cost: Array
    """(M,), in units of the objective."""
    too_fast: Array
    """By how much fins turn too fast (M,) [rad], what comes late counting less."""
    size: Array
    """Sizes of the forces (M, H, n) [N]."""
    direction: Array
    """Their directions (M, H, n) [rad]."""
    works: NDArray[np.bool_]
    """Whether a fin has to point where it does (M, H, n)."""


def evaluate(
    prepared: Prepared, previous: Array, force: Array, settings: HorizonSettings = HORIZON
) -> Trajectories:
    """Turns and cost of trajectories of planar forces (M, H, n, 2) [N]."""
    fins, ticks = prepared.planar.fins, settings.ticks
    top = fins.maximum
    x, y = force[..., 0], force[..., 1]
    size, direction = np.sqrt(x * x + y * y), np.arctan2(y, x)
    works = size > np.maximum(settings.working_share * top, 1.5 * fins.minimum)
    sooner = 1.0 - np.arange(ticks) / ticks  # what comes late may be avoided yet
    before = previous[:, 2] + fins.lean(previous[:, 2])
    beyond = turns_beyond(prepared, before, direction, works, settings)
    too_fast, turned = (turn.sum(-1) @ sooner for turn in beyond)
    # Effort grows about like the square root of force, power like its square root cubed; what a fin cannot
    # give counts dearly, but a drift that leaves its limits is no reason to avoid going straight on at any
    # price.
    share = size / top
    full = fins.table[:, COST].reshape(len(top), -1).max(1)
    spent = full * (share**1.5 if prepared.planar.turning_is_free else np.sqrt(share))
    spent += settings.overload_cost * full * np.maximum(share - 1.0, 0.0)
    spent += prepared.planar.direction_cost * (direction * works) ** 2
    spent = spent.sum(-1)
    lasting = settings.last_tick_weight
    mean = (spent.sum(1) + lasting * spent[:, -1]) / (ticks + lasting)
    cost = mean + full.mean() * (settings.turn_cost * turned + 1e3 * too_fast)
    return Trajectories(cost, too_fast, size, direction, works)


def _planar_force(prepared: Prepared, command: Array) -> Array:
    """Planar forces (..., n, 2) [N] of commands."""
    return prepared.plant.force(prepared.commands.feasible(command))[..., 1:]


def _columns(planar: PlanarProblem) -> Array:
    """Normalized wrench per newton (2n, 6), fin by fin."""
    return np.stack(np.split(planar.columns, 2), axis=1).reshape(-1, 6)


def _drifts(planar: PlanarProblem, force: Array, change: Array) -> Array:
    """Changes of force per tick (2, n, 2) that change the wrench: of all fins, of those that work."""
    n = len(force)
    top, columns = planar.fins.maximum, _columns(planar)
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
    tick = np.arange(1.0, len(start) + 1.0)
    share = np.array([np.clip((tick - wait) / ramp, 0.0, 1.0) for wait, ramp in shapes])
    mixed: Array = start + share[:, None, :, None, None] * (goal - start)
    return mixed.reshape(-1, *start.shape)


def _detours(planar: PlanarProblem, force: Array, drift: Array, settings: HorizonSettings) -> Array:
    """Forces (G, n, 2) of the same wrench: one fin after the other leaves its path, and random ones."""
    n = len(force)
    _, size, right = np.linalg.svd(_columns(planar).T)
    null = right[int((size > 1e-6 * size[0]).sum()) :]
    if len(null) == 0:
        return np.empty((0, n, 2))
    own = null.T.reshape(n, 2, len(null))
    across = np.stack([-drift[:, 1], drift[:, 0]], axis=-1)
    across /= np.linalg.norm(across, axis=-1, keepdims=True) + 1e-12
    # The least change of all forces that moves fin i by `across`.
    gram = own @ own.swapaxes(1, 2) + 1e-3 * np.eye(2)
    steps = (own.swapaxes(1, 2) @ np.linalg.solve(gram, across[..., None]))[..., 0]
    drawn = np.random.default_rng(0).standard_normal((settings.random_detours, len(null)))
    drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    sizes = np.array(settings.detour_sizes)
    drawn *= np.resize(sizes[sizes > 0.0], len(drawn))[:, None]
    steps = np.concatenate([np.kron(sizes[:, None], steps), drawn])
    forces: Array = force + (planar.fins.maximum.mean() * (steps @ null)).reshape(-1, n, 2)
    return forces


def turns_beyond(
    prepared: Prepared,
    before: Array,
    direction: Array,
    works: NDArray[np.bool_],
    settings: HorizonSettings = HORIZON,
) -> tuple[Array, Array]:
    """By how much [rad] fins turn beyond `max_turn` and beyond `free_turn`, (M, H, n).

    Only fins that work have to point anywhere; what a fin turns at rest is spread over its rest.
    """
    middle, half = prepared.planar.fins.middle, prepared.planar.fins.half
    wraps = prepared.commands.full_turn
    offset = wrapped(direction - middle)
    stopped = np.where(wraps | ~works, 0.0, np.maximum(np.abs(offset) - half, 0.0))
    tick = np.arange(1, direction.shape[1] + 1)[:, None]
    last = np.maximum.accumulate(np.where(works, tick, 0), axis=1)
    last = np.concatenate([np.zeros_like(last[:, :1]), last[:, :-1]], axis=1)
    start = np.broadcast_to(wrapped(before - middle), offset[:, :1].shape)
    turn = offset - np.take_along_axis(np.concatenate([start, offset], axis=1), last, axis=1)
    turn = np.where(works, np.abs(np.where(wraps, wrapped(turn), turn)), 0.0)
    spread = tick - last
    beyond_max = np.maximum(turn - settings.max_turn * spread, 0.0) + stopped
    return beyond_max, np.maximum(turn - settings.free_turn * spread, 0.0)
