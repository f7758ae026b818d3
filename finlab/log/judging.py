"""Judges a log: what its robot could not, what it gave instead, and which policy would have held
it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from finlab.allocation import Allocator
from finlab.allocation.binding import at_limits, limit_words
from finlab.allocation.policy import CLOSEST, Policy, check_order
from finlab.analysis.optimize import optimize_layout
from finlab.arrays import Array
from finlab.axes import AXES, Axis, axes_in
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.log.answers import answers_to
from finlab.log.judgement import Judgement, Spell, Timeline
from finlab.log.read import Log, robot_rest
from finlab.log.recorded import Event
from finlab.log.replay import demands_of, replay, six
from finlab.physics.objective import judged_power, yardstick
from finlab.physics.plant import plant_of

CHUNK = 8192
LOST = 0.01
"""Share of the yardstick from which on a missing wrench counts as an axis lost."""
OFF = 0.05
"""Share of what was asked for that may be missing with no actuator at a limit before it is said."""
DEAD = 0.1
"""Least share of the square of what was away that a dead thruster explains, and most that none
does."""
MERGED_S = 0.5
"""Losses that are no further apart are one spell."""
MOST_SPELLS, BINS = 200, 1000
"""Most spells that are told, and pieces of a timeline."""
HARDEST, ROUNDS = 8, 8
"""Demands that an improved layout is to meet, and rounds of the search for it."""
USUAL = Policy("priority").order
Flags = NDArray[np.bool_]


def judge(log: Log, *, priority: Sequence[Sequence[Axis]] = (), improve: bool = True) -> Judgement:
    """Returns what the log's robot could not, and replays its demands by other methods and
    policies, with each actuator lost, and on an improved layout.

    Args:
        log: of `read_log`.
        priority: groups of axes for policy `priority`, most important first; the axis that lost
            most comes first when empty.
        improve: whether to search for a better layout.

    Raises:
        CommandError: `priority` names no axes.
        DataError: a table of forces cannot be read.
    """
    account = Account(log)
    scale = account.scale
    span = log.span
    impulse = account.impulse
    notes = [*log.notes]
    asked = span @ np.abs(account.demand)
    axis = AXES[int(np.argmax(impulse / scale))] if account.lost.any() else None
    if ((span @ np.abs(account.away) - impulse) / scale).max() > OFF * (asked / scale).max():
        notes.append(
            "With no actuator at a limit the outputs gave another wrench than was asked for: "
            "forces of the "
            "robot, or what a setpoint stands for (--scale), differ from those of the log."
        )
    policies = [CLOSEST, Policy("direction"), _priority(priority, axis)]
    replays = [*replay(log.robot, log.demand, span, policies)]
    improved = _improved(log, scale, notes) if improve else None
    if improved is not None:
        replays += replay(improved, log.demand, span, policies, improved=True)
    spells = account.spells()
    worst = sorted(spells, key=lambda spell: -float((spell.missing / scale).sum()))[:MOST_SPELLS]
    return Judgement(
        source=log.source,
        robot=log.robot,
        scale=scale,
        seconds=float(span.sum()),
        asked=six(asked, scale),
        missing=six(impulse, scale),
        lost_s=six(span @ account.lost, np.zeros(6)),
        saturated_s=float(span @ account.lost.any(axis=1)),
        watts=account.watts,
        axis=axis,
        stopped=account.names(account.dead | account.gone[-1]),
        spells=tuple(sorted(worst, key=lambda spell: spell.start)),
        n_spells=len(spells),
        replays=tuple(replays),
        improved=improved,
        timeline=account.timeline(),
        events=tuple((event.time, _words(log, event)) for event in log.events),
        notes=tuple(notes),
        asks=log.asks,
    )


class Account:
    """What was asked for in a log of N samples, given and missing; n actuators."""

    def __init__(self, log: Log) -> None:
        self.log = log
        self.scale = yardstick(log.robot)
        self.demand = np.nan_to_num(log.demand)
        """(N, 6) [N, N m]."""
        self.watts: float | None = None
        """Mean power of the outputs [W]; None without outputs."""
        self.full = self.ended = np.zeros((len(log), log.robot.n), bool)
        """Which actuators were at full thrust, and which at the end of their arc (N, n)."""
        self.delivered = self._delivered()
        """Wrench of the outputs (N, 6)."""
        self.away = np.where(np.isfinite(log.demand), self.demand - self.delivered, 0.0)
        """Demand less that (N, 6)."""
        self.at = self.full | self.ended
        self.dead = self._dead()
        """Actuators (n,) at rest all along, to whom most of what was away is due."""
        command = np.zeros((1, log.robot.n, 3)) if log.command is None else log.command
        self.gone = np.isnan(command).any(axis=-1) & ~self.dead
        """Which others were stopped, or stood still (N, n)."""
        self.missing = np.where((self._bound() | self.dead.any())[:, None], self.away, 0.0)
        """The same where a limit is why (N, 6)."""
        self.lost = np.abs(self.missing) > LOST * self.scale
        """Which axes were lost (N, 6)."""
        self.impulse = log.span @ np.abs(self.missing)
        """(6,) [N s, N m s]."""

    def _delivered(self) -> Array:
        log = self.log
        if (command := log.command) is None:
            if log.unmet is not None:
                return self.demand - log.unmet
            method = "dual" if log.form == "ros" else log.form
            command = answers_to(Allocator(log.robot, method), log.demand).command
        self.full, self.ended = at_limits(log.robot, command)
        plant = plant_of(log.robot)
        delivered = np.empty((len(log), 6))
        energy = 0.0
        for k in range(0, len(log), CHUNK):
            rows = slice(k, k + CHUNK)
            delivered[rows] = plant.wrench(command[rows])
            energy += float(log.span[rows] @ judged_power(plant, command[rows]))
        if log.command is not None:
            self.watts = energy / float(log.span.sum())
        return delivered

    def _bound(self) -> Flags:
        """Samples (N,) at which a limit kept the robot from giving more: an actuator's, that of a
        thruster which does not reverse or was stopped, or, in a log without outputs, where the
        autopilot says so."""
        log = self.log
        bound = self.at.any(axis=1)
        if log.command is not None:
            one_way = (log.robot.lower[:, 0] == 0.0) | (log.robot.upper[:, 0] == 0.0)
            rests = (log.command[..., 0] == 0.0) & one_way
            bound |= (rests | np.isnan(log.command).any(axis=-1)).any(axis=1)
        elif log.unmet is not None:
            bound |= log.unmet.any(axis=1)
        return np.asarray(bound)

    def _dead(self) -> Flags:
        """Actuators (n,) of one number, such as thrusters, that were at rest in all of the log, and
        whose forces are most of what was away while no actuator was at a limit."""
        log = self.log
        robot = self.log.robot
        none = np.zeros(robot.n, bool)
        if log.command is None:
            return none
        rest = (np.nan_to_num(log.command) == robot_rest(robot)).all(axis=(0, 2))
        rest &= (robot.lower[:, 1:] == robot.upper[:, 1:]).all(axis=1)
        off = (self.away / self.scale)[~self.at.any(axis=1)]
        if not rest.any() or np.abs(off).max(initial=0.0) < LOST:
            return none
        counts = rest[:, None] & np.isfinite(log.demand).any(axis=0)
        columns = np.where(counts, plant_of(robot).effectiveness[:, 0] / self.scale, 0.0)
        force = off @ np.linalg.pinv(columns)
        size = np.square(off).sum()
        share = np.square(force).sum(axis=0) * np.square(columns).sum(axis=1) / size
        explained = np.square(off - force @ columns).sum() < DEAD * size
        return np.asarray(rest & (share > DEAD) & explained)

    def names(self, flags: Flags) -> tuple[str, ...]:
        """Names of the actuators with a flag (n,)."""
        return tuple(name for name, one in zip(self.log.robot.names, flags, strict=True) if one)

    def spells(self) -> list[Spell]:
        """Times between which axes were lost, without longer breaks."""
        time = self.log.time
        span = self.log.span
        places = np.flatnonzero(self.lost.any(axis=1))
        apart = time[places[1:]] - (time + span)[places[:-1]] > MERGED_S
        parts = np.split(places, np.flatnonzero(apart) + 1) if len(places) else []
        return [self._spell(slice(int(part[0]), int(part[-1]) + 1)) for part in parts]

    def _spell(self, rows: slice) -> Spell:
        log = self.log
        lost = self.lost[rows]
        span = log.span[rows]
        some = np.asarray(lost.any(axis=1))
        flags = (np.any(each[rows][some], axis=0) for each in (self.full, self.ended))
        return Spell(
            start=float(log.time[rows.start]),
            end=float(log.time[rows.stop - 1] + span[-1]),
            axes=axes_in(np.any(lost, axis=0)),
            missing=six(span @ np.abs(self.missing[rows]), self.scale),
            asked=six(span @ self.demand[rows] / span.sum(), self.scale),
            gave=six(span @ self.delivered[rows] / span.sum(), self.scale),
            limits=(
                *(f"{name} at rest all along" for name in self.names(self.dead)),
                *(f"{name} stopped" for name in self.names(np.any(self.gone[rows], axis=0))),
                *limit_words(log.robot, *flags),
            ),
        )

    def timeline(self) -> Timeline:
        """Means over pieces of the log."""
        span = self.log.span
        n = len(self.log)
        starts = np.unique(np.linspace(0, n, BINS, endpoint=False).astype(np.intp))
        columns = (self.demand, self.delivered, self.missing, self.at)
        sums = [np.add.reduceat(span[:, None] * each, starts) for each in columns]
        return Timeline(
            self.log.time[starts], *(each / np.add.reduceat(span, starts)[:, None] for each in sums)
        )


def _priority(groups: Sequence[Sequence[Axis]], axis: Axis | None) -> Policy:
    """Policy `priority`: the groups named, or the axis that lost most and then the usual ones."""
    if groups:
        check_order(groups, "priority")
        return Policy("priority", order=tuple(tuple(group) for group in groups))
    rest = (tuple(each for each in group if each != axis) for group in USUAL)
    return Policy(
        "priority", order=(*(((axis,),) if axis else ()), *(group for group in rest if group))
    )


def _improved(log: Log, scale: Array, notes: list[str]) -> Layout | None:
    """The layout that a search proposes for the demands that miss most, or else are largest."""
    demands = demands_of(log.demand, log.span, scale, 10 * HARDEST)
    answer = answers_to(Allocator(log.robot), demands.wrench)
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


def _words(log: Log, event: Event) -> str:
    place = event.actuator
    return (
        event.words
        if place is None or place >= log.robot.n
        else f"{log.robot.names[place]} {event.words}"
    )
