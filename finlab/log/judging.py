"""Judges a log: what its robot could not, what it gave instead, and which policy would have held it."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.allocation import Allocator
from finlab.allocation.policy import CLOSEST, Policy, at_limits, limit_words
from finlab.analysis.optimize import optimize_layout
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.log.judgement import Judgement, Spell, Timeline
from finlab.log.read import Log, robot_rest
from finlab.log.replay import Replay, demands_of, replay, six
from finlab.physics.objective import judged_power, yardstick
from finlab.physics.plant import plant_of

CHUNK = 8192
LOST = 0.01
"""Share of the yardstick from which on a missing wrench counts as an axis lost."""
OFF = 0.05
"""Share of what was asked for that may be missing with no actuator at a limit before it is said."""
HELD = 0.02
"""Share of what was missing along an axis that a replay which holds it may miss."""
DEAD = 0.1
"""Least share of the square of what was away that a dead thruster explains, and most that none does."""
MERGED_S = 0.5
"""Losses that are no further apart are one spell."""
MOST_SPELLS, BINS = 200, 1000
"""Most spells that are told, and pieces of a timeline."""
HARDEST, ROUNDS = 8, 8
"""Demands that an improved layout is to meet, and rounds of the search for it."""
USUAL = Policy("priority").order
Flags = NDArray[np.bool_]


def judge(log: Log, *, priority: Sequence[Sequence[str]] = (), improve: bool = True) -> Judgement:
    """Returns what the log's robot could not, and replays its demands by other methods and policies, with
    each actuator lost, and on an improved layout.

    Args:
        log: of `read_log`.
        priority: groups of axes for policy `priority`, most important first; the axis that lost most comes
            first when empty.
        improve: whether to search for a better layout.

    Raises:
        CommandError: `priority` names no axes.
        DataError: a table of forces cannot be read.
    """
    scale, span, notes = yardstick(log.robot), log.span, [*log.notes]
    delivered, full, ended, watts = _given(log)
    demand, counts = np.nan_to_num(log.demand), np.isfinite(log.demand)
    away = np.where(counts, demand - delivered, 0.0)
    at = full | ended
    dead = _dead(log, away / scale, at)
    stopped = tuple(name for name, one in zip(log.robot.names, dead, strict=True) if one)
    missing = np.where((_bound(log, at) | dead.any())[:, None], away, 0.0)
    lost = np.abs(missing) > LOST * scale
    impulse = span @ np.abs(missing)
    axis = AXES[int(np.argmax(impulse / scale))] if lost.any() else None
    asked = span @ np.abs(demand)
    if ((span @ np.abs(away) - impulse) / scale).max() > OFF * (asked / scale).max():
        notes.append(
            "With no actuator at a limit the outputs gave another wrench than was asked for: forces of the "
            "robot, or what a setpoint stands for (--scale), differ from those of the log."
        )
    policies = [CLOSEST, Policy("direction"), _priority(priority, axis)]
    replays = [*replay(log.robot, log.demand, span, policies)]
    improved = _improved(log, scale, notes) if improve else None
    if improved is not None:
        replays += replay(improved, log.demand, span, policies, improved=True)
    spells = [*_spells(log, missing, lost)]
    worst = sorted(spells, key=lambda rows: -float((span[rows] @ np.abs(missing[rows]) / scale).sum()))
    return Judgement(
        source=log.source,
        robot=log.robot,
        scale=scale,
        seconds=float(span.sum()),
        asked=six(asked, scale),
        missing=six(impulse, scale),
        lost_s=six(span @ lost, np.zeros(6)),
        saturated_s=float(span @ lost.any(axis=1)),
        watts=watts,
        axis=axis,
        stopped=stopped,
        spells=tuple(
            _spell(log, scale, rows, delivered, missing, lost, full, ended, stopped)
            for rows in sorted(worst[:MOST_SPELLS], key=lambda rows: rows.start)
        ),
        n_spells=len(spells),
        replays=tuple(replays),
        held_by=None if axis is None else _held(replays, AXES.index(axis), impulse, scale, stopped),
        improved=improved,
        timeline=_timeline(log, delivered, missing, at),
        events=tuple((event.time, _words(log, event.actuator, event.words)) for event in log.events),
        notes=tuple(notes),
        asks=log.asks,
    )


def _given(log: Log) -> tuple[Array, Flags, Flags, float | None]:
    """Wrenches (N, 6) that the outputs gave, which actuators were at full thrust and which at the end of
    their arc (N, n), and the mean power [W]."""
    robot, n = log.robot, len(log)
    if log.command is None and log.unmet is not None:
        none = np.zeros((n, robot.n), bool)
        return np.nan_to_num(log.demand) - log.unmet, none, none, None
    if (command := log.command) is None:
        method = "dual" if log.form == "ros" else log.form
        command = Allocator(robot, method).allocate_batch(log.demand).command
    plant, delivered, watts = plant_of(robot), np.empty((n, 6)), 0.0
    for k in range(0, n, CHUNK):
        rows = slice(k, k + CHUNK)
        delivered[rows] = plant.wrench(command[rows])
        watts += float(log.span[rows] @ judged_power(plant, command[rows]))
    mean = None if log.command is None else watts / float(log.span.sum())
    return delivered, *at_limits(robot, command), mean


def _bound(log: Log, at: Flags) -> Flags:
    """Samples (N,) at which a limit kept the robot from giving more: an actuator's, that of a thruster which
    does not reverse or was stopped, or, in a log without outputs, where the autopilot says so."""
    if log.command is None and log.unmet is not None:
        return np.asarray(log.unmet.any(axis=1))
    if log.command is None:
        return np.asarray(at.any(axis=1))
    ends = (log.robot.lower[:, 0] == 0.0) | (log.robot.upper[:, 0] == 0.0)
    rests = (log.command[..., 0] == 0.0) & ends
    stopped = np.isnan(log.command).any(axis=-1)
    return np.asarray((at | rests | stopped).any(axis=1))


def _priority(groups: Sequence[Sequence[str]], axis: str | None) -> Policy:
    """Policy `priority`: the groups named, or the axis that lost most and then the usual ones."""
    if groups:
        return Policy("priority", order=tuple(map(tuple, groups)))
    rest = (tuple(each for each in group if each != axis) for group in USUAL)
    return Policy("priority", order=(*(((axis,),) if axis else ()), *(group for group in rest if group)))


def _dead(log: Log, away: Array, at: Flags) -> Flags:
    """Actuators (n,) of one number, such as thrusters, that were at rest in all of the log, and whose forces
    are most of what was away (N, 6), in shares of the yardstick, while no actuator was at a limit."""
    none = np.zeros(log.robot.n, bool)
    if log.command is None:
        return none
    rest = (np.nan_to_num(log.command) == robot_rest(log.robot)).all(axis=(0, 2))
    rest &= (log.robot.lower[:, 1:] == log.robot.upper[:, 1:]).all(axis=1)
    off = away[~at.any(axis=1)]
    if not rest.any() or np.abs(off).max(initial=0.0) < LOST:
        return none
    counts = rest[:, None] & np.isfinite(log.demand).any(axis=0)
    columns = np.where(counts, plant_of(log.robot).effectiveness[:, 0] / yardstick(log.robot), 0.0)
    force, size = off @ np.linalg.pinv(columns), np.square(off).sum()
    share = np.square(force).sum(axis=0) * np.square(columns).sum(axis=1) / size
    explained = np.square(off - force @ columns).sum() < DEAD * size
    return np.asarray(rest & (share > DEAD) & explained)


def _held(
    replays: list[Replay], i: int, impulse: Array, scale: Array, stopped: tuple[str, ...]
) -> Replay | None:
    """The best replay that holds axis i, first on the robot as it is, without the one that was stopped."""
    lost = stopped[0] if len(stopped) == 1 else None
    for robot in ("as it is", "improved"):
        held = [
            each
            for each in replays
            if each.robot == robot and each.lost == lost and each.missing[i] <= HELD * impulse[i]
        ]
        if held:
            return min(held, key=lambda each: (round(sum(each.missing / scale), 3), each.watts))
    return None


def _improved(log: Log, scale: Array, notes: list[str]) -> Layout | None:
    """The layout that a search proposes for the demands that miss most, or else are largest."""
    demands = demands_of(log.demand, log.span, scale, 10 * HARDEST)
    answer = Allocator(log.robot).allocate_batch(demands.wrench)
    size = np.linalg.norm(np.nan_to_num(demands.wrench) / scale, axis=1)
    order = np.lexsort((-size * demands.span, -np.round(answer.err_norm, 3) * demands.span))
    mission = np.nan_to_num(demands.wrench[order[:HARDEST]])
    try:
        found = optimize_layout(
            log.robot, log.robot.names, goal="mission_power", mission=mission, rounds=ROUNDS
        )
    except FinlabError as error:
        notes.append(f"No better layout was searched for: {error}.")
        return None
    if not found.improved:
        notes.append("The search found no layout that meets the hardest demands better.")
    return found.layout if found.improved else None


def _spells(log: Log, missing: Array, lost: Flags) -> Iterator[slice]:
    """Samples between which axes were lost, without longer breaks."""
    places = np.flatnonzero(lost.any(axis=1))
    if not len(places):
        return
    ends = log.time + log.span
    apart = log.time[places[1:]] - ends[places[:-1]] > MERGED_S
    for part in np.split(places, np.flatnonzero(apart) + 1):
        yield slice(int(part[0]), int(part[-1]) + 1)


def _spell(
    log: Log,
    scale: Array,
    rows: slice,
    delivered: Array,
    missing: Array,
    lost: Flags,
    full: Flags,
    ended: Flags,
    stopped: tuple[str, ...],
) -> Spell:
    span, some = log.span[rows], np.asarray(lost[rows].any(axis=1))
    return Spell(
        start=float(log.time[rows.start]),
        end=float(log.time[rows.stop - 1] + log.span[rows.stop - 1]),
        axes=tuple(axis for axis, one in zip(AXES, np.any(lost[rows], axis=0), strict=True) if one),
        missing=six(span @ np.abs(missing[rows]), scale),
        asked=six(span @ np.nan_to_num(log.demand[rows]) / span.sum(), scale),
        gave=six(span @ delivered[rows] / span.sum(), scale),
        limits=(
            *(f"{name} at rest all along" for name in stopped),
            *limit_words(log.robot, *(np.any(flags[rows][some], axis=0) for flags in (full, ended))),
        ),
    )


def _timeline(log: Log, delivered: Array, missing: Array, at: Flags) -> Timeline:
    """Means over pieces of the log."""
    starts = np.unique(np.linspace(0, len(log), BINS, endpoint=False).astype(np.intp))
    held = np.add.reduceat(log.span, starts)[:, None]
    columns = (np.nan_to_num(log.demand), delivered, missing, at.astype(np.float64))
    means = [np.add.reduceat(log.span[:, None] * each, starts) / held for each in columns]
    return Timeline(log.time[starts], *means)


def _words(log: Log, actuator: int | None, words: str) -> str:
    return words if actuator is None or actuator >= log.robot.n else f"{log.robot.names[actuator]} {words}"
