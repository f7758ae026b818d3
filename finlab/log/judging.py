"""Judges a log: when axes were lost, at which limits, and which method or policy would have held
them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation import Allocator
from finlab.allocation.binding import at_limits, limit_words
from finlab.allocation.methods import MethodName
from finlab.allocation.policy import CLOSEST, Policy, check_order
from finlab.analysis.optimize import optimize_layout
from finlab.analysis.second_losses import SecondLoss, second_losses
from finlab.arrays import Array
from finlab.axes import AXES, Axis, axes_in
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.log.demand_answers import answers_to
from finlab.log.judgement import Judgement, Spell, Timeline
from finlab.log.read import Log, rest_command
from finlab.log.recorded import Event, Form
from finlab.log.replay import demands_of, n_replays, replay, six
from finlab.physics.objective import judged_power, wrench_scale_of
from finlab.physics.plant import plant_of

CHUNK_ROWS = 8192
"""Samples whose wrenches are computed at once: bounds the memory."""
LOST_SHARE = 0.01
"""Share of the wrench scale from which on a missing wrench counts as an axis lost."""
UNEXPLAINED_SHARE = 0.05
"""Share of the demand that may be missing with no actuator at a limit before a note says it."""
DEAD_SHARE = 0.1
"""Least share of the squared deviation that a dead thruster explains, and most that remains
unexplained."""
MERGED_S = 0.5
"""Longest break within one spell [s]."""
MAX_SPELLS = 200
"""Most spells of a judgement: those that lost most."""
TIMELINE_PIECES = 1000
"""Most pieces of a timeline."""
MISSION_DEMANDS = 8
"""Demands that an improved layout is to meet: the hardest ones."""
SEARCH_ROUNDS = 8
"""Rounds of the search for it."""
METHODS: dict[Form, MethodName] = {
    "px4": "px4",
    "ardusub": "ardusub",
    "ros": "dual",
    "finlab": "dual",
}
"""Program that wrote a log -> the method that stands for its outputs where the log has none."""
REPLAYING = "asking other methods and policies the same"
"""Stage of a judgement, in words."""
SEARCHING = "searching for a better layout"
"""The same of the search."""
STOPPED = "It was stopped before all methods were asked."
"""Note on a judgement that was cancelled."""
IMPROVED = " improved"
"""End of the name of the layout that a search proposes."""
MAX_STEM = 64 - len(IMPROVED)
"""Most characters of the robot's name before that."""
DEFAULT_ORDER = Policy("priority").order
"""Order of the axes of policy `priority` where none is given."""
Flags = NDArray[np.bool_]
"""Truth values, by samples and actuators."""


class Progress(NamedTuple):
    """How far a judgement is."""

    stage: str
    """What is done just now, in words."""
    n_done: int
    """Parts that are done, of the replays and the rounds of the search."""
    n_parts: int
    """Parts that there are, as far as that is known."""
    judgement: Judgement
    """What is known by now: all but the replays and the improved layout that are still to come."""


def judge(
    log: Log,
    *,
    priority: Sequence[Sequence[Axis]] = (),
    improve: bool = True,
    report: Callable[[Progress], object] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Judgement:
    """Returns the judgement of a log: which axes its robot lost, and what would have held them.

    The demands are replayed by other methods and policies, with each actuator lost, and on an
    improved layout.

    Args:
        log: the log, of `read_log`.
        priority: groups of axes for policy `priority`, most important first; the axis that lost
            most comes first when empty.
        improve: whether to search for a better layout.
        report: called before the first replay, and after each part of the work.
        cancelled: called between the parts; when it returns True, the judgement ends with what is
            known by then, and says so.

    Raises:
        CommandError: `priority` names no axes.
        DataError: a table of forces cannot be read.
    """
    account = Account(log)
    judgement = account.judgement()
    policies = [CLOSEST, Policy("direction"), _priority(priority, account.axis)]
    rounds = SEARCH_ROUNDS if improve else 0
    n_parts = n_replays(log.robot, policies) + rounds
    n_parts += n_replays(log.robot, policies, improved=True) if improve else 0
    n_done = 0

    def tell(stage: str, parts: int = 0) -> bool:
        """Whether to go on; so many more parts are done."""
        nonlocal n_done
        n_done += parts
        if report is not None:
            report(Progress(stage, min(n_done, n_parts), n_parts, judgement))
        return cancelled is None or not cancelled()

    goes_on = tell(REPLAYING)
    if goes_on:
        for answered in replay(log.robot, log.demand, log.span, policies):
            judgement = replace(judgement, replays=(*judgement.replays, answered))
            goes_on = tell(REPLAYING, 1)
            if not goes_on:
                break
    if goes_on:
        pairs = _second_losses(log.robot, judgement.stopped)
        judgement = replace(judgement, second_losses=pairs)
    if goes_on and improve:
        notes = [*judgement.notes]
        improved = _improved(log, account.scale, notes, lambda: tell(SEARCHING, 1))
        judgement = replace(judgement, notes=tuple(notes), improved=improved)
        goes_on = tell(SEARCHING)
        if goes_on and improved is not None:
            for answered in replay(improved, log.demand, log.span, policies, improved=True):
                judgement = replace(judgement, replays=(*judgement.replays, answered))
                goes_on = tell(REPLAYING, 1)
                if not goes_on:
                    break
    if not goes_on:
        judgement = replace(judgement, notes=(*judgement.notes, STOPPED))
    return judgement


class Account:
    """Demanded, delivered and missing wrenches of a log of N samples; n actuators."""

    def __init__(self, log: Log) -> None:
        """Takes the log, and computes all fields."""
        self.log = log
        self.scale = wrench_scale_of(log.robot)
        self.demand = np.nan_to_num(log.demand)
        """(N, 6) [N, N m]."""
        self.watts: float | None = None
        """Mean power of the outputs [W]; None without outputs."""
        self.is_full = self.is_at_arc_end = np.zeros((len(log), log.robot.n), bool)
        """Which actuators were at full thrust, and which at the end of their arc (N, n)."""
        self.delivered = self._delivered()
        """Wrench of the outputs (N, 6)."""
        self.deviation = np.where(np.isfinite(log.demand), self.demand - self.delivered, 0.0)
        """Demand less that (N, 6)."""
        self.is_limited = self.is_full | self.is_at_arc_end
        self.dead = self._dead()
        """Actuators (n,) at rest all along, to whom most of what was away is due."""
        command = np.zeros((1, log.robot.n, 3)) if log.command is None else log.command
        self.gone = np.isnan(command).any(axis=-1) & ~self.dead
        """Which others were stopped, or stood still (N, n)."""
        self.missing = np.where((self._bound() | self.dead.any())[:, None], self.deviation, 0.0)
        """The same where a limit is why (N, 6)."""
        self.lost = np.abs(self.missing) > LOST_SHARE * self.scale
        """Which axes were lost (N, 6)."""
        self.impulse = log.span @ np.abs(self.missing)
        """(6,) [N s, N m s]."""

    def _delivered(self) -> Array:
        """Wrenches (N, 6) of the outputs by the laws; without outputs by what the autopilot logged
        as unallocated, or else by what its method gives. Sets flags and power on the way."""
        log = self.log
        command = log.command
        if command is None:
            if log.unmet is not None:
                return self.demand - log.unmet
            command = answers_to(Allocator(log.robot, METHODS[log.form]), log.demand).command
        self.is_full, self.is_at_arc_end = at_limits(log.robot, command)
        plant = plant_of(log.robot)
        delivered = np.empty((len(log), 6))
        energy = 0.0
        for k in range(0, len(log), CHUNK_ROWS):
            rows = slice(k, k + CHUNK_ROWS)
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
        bound = self.is_limited.any(axis=1)
        if log.command is not None:
            one_way = (log.robot.lower[:, 0] == 0.0) | (log.robot.upper[:, 0] == 0.0)
            is_resting = (log.command[..., 0] == 0.0) & one_way
            bound |= (is_resting | np.isnan(log.command).any(axis=-1)).any(axis=1)
        elif log.unmet is not None:
            bound |= log.unmet.any(axis=1)
        return np.asarray(bound)

    def _dead(self) -> Flags:
        """Dead actuators (n,): of one number, such as thrusters, at rest in all of the log, and
        with forces that explain most of the deviation while no actuator was at a limit.

        The forces are the least-squares solution of D = F C for the deviations D (M, 6) and the
        columns C (n, 6) of the actuators at rest, both over the wrench scale.
        """
        log = self.log
        robot = self.log.robot
        none = np.zeros(robot.n, bool)
        if log.command is None:
            return none
        is_resting = (np.nan_to_num(log.command) == rest_command(robot)).all(axis=(0, 2))
        is_resting &= (robot.lower[:, 1:] == robot.upper[:, 1:]).all(axis=1)
        deviation = (self.deviation / self.scale)[~self.is_limited.any(axis=1)]
        if not is_resting.any() or np.abs(deviation).max(initial=0.0) < LOST_SHARE:
            return none
        counted = is_resting[:, None] & np.isfinite(log.demand).any(axis=0)
        columns = np.where(counted, plant_of(robot).effectiveness[:, 0] / self.scale, 0.0)
        force = deviation @ np.linalg.pinv(columns)
        size = np.square(deviation).sum()
        share = np.square(force).sum(axis=0) * np.square(columns).sum(axis=1) / size
        explained = np.square(deviation - force @ columns).sum() < DEAD_SHARE * size
        return np.asarray(is_resting & (share > DEAD_SHARE) & explained)

    @property
    def axis(self) -> Axis | None:
        """The axis that lost most, as a share of the wrench scale; None where none was lost."""
        return AXES[int(np.argmax(self.impulse / self.scale))] if self.lost.any() else None

    def judgement(self) -> Judgement:
        """What can be said without another question: the judgement without replays, pairs of losses
        and an improved layout."""
        log = self.log
        scale = self.scale
        span = log.span
        impulse = self.impulse
        demanded = span @ np.abs(self.demand)
        notes = [*log.notes]
        unexplained = ((span @ np.abs(self.deviation) - impulse) / scale).max()
        if unexplained > UNEXPLAINED_SHARE * (demanded / scale).max():
            notes.append(
                "With no actuator at a limit the outputs gave another wrench than was asked for: "
                "forces of the robot, or what a setpoint stands for (--scale), differ from those "
                "of the log."
            )
        spells = self.spells()
        by_loss = sorted(spells, key=lambda spell: -float((spell.missing / scale).sum()))
        worst = by_loss[:MAX_SPELLS]
        return Judgement(
            source=log.source,
            robot=log.robot,
            scale=scale,
            seconds=float(span.sum()),
            asked=six(demanded, scale),
            missing=six(impulse, scale),
            lost_s=six(span @ self.lost, np.zeros(6)),
            saturated_s=float(span @ self.lost.any(axis=1)),
            watts=self.watts,
            axis=self.axis,
            stopped=self.names(self.dead | self.gone[-1]),
            spells=tuple(sorted(worst, key=lambda spell: spell.start)),
            n_spells=len(spells),
            replays=(),
            second_losses=(),
            improved=None,
            timeline=self.timeline(),
            events=tuple((event.time, _event_words(log, event)) for event in log.events),
            notes=tuple(notes),
            asks=log.asks,
        )

    def names(self, flags: Flags) -> tuple[str, ...]:
        """Names of the actuators with a flag (n,)."""
        return tuple(name for name, flag in zip(self.log.robot.names, flags, strict=True) if flag)

    def spells(self) -> list[Spell]:
        """Stretches of time over which axes were lost; breaks up to MERGED_S belong to them."""
        start = self.log.time
        end = start + self.log.span
        samples = np.flatnonzero(self.lost.any(axis=1))
        if not len(samples):
            return []
        is_break = start[samples[1:]] - end[samples[:-1]] > MERGED_S
        stretches = np.split(samples, np.flatnonzero(is_break) + 1)
        return [self._spell(slice(int(rows[0]), int(rows[-1]) + 1)) for rows in stretches]

    def _spell(self, rows: slice) -> Spell:
        """The spell of a range of samples."""
        log = self.log
        lost = self.lost[rows]
        span = log.span[rows]
        is_losing = np.asarray(lost.any(axis=1))
        was_full = np.any(self.is_full[rows][is_losing], axis=0)
        was_at_arc_end = np.any(self.is_at_arc_end[rows][is_losing], axis=0)
        limits = [f"{name} at rest all along" for name in self.names(self.dead)]
        limits += [f"{name} stopped" for name in self.names(np.any(self.gone[rows], axis=0))]
        limits += limit_words(log.robot, was_full, was_at_arc_end)
        return Spell(
            start=float(log.time[rows.start]),
            end=float(log.time[rows.stop - 1] + span[-1]),
            axes=axes_in(np.any(lost, axis=0)),
            missing=six(span @ np.abs(self.missing[rows]), self.scale),
            asked=six(span @ self.demand[rows] / span.sum(), self.scale),
            gave=six(span @ self.delivered[rows] / span.sum(), self.scale),
            limits=tuple(limits),
        )

    def timeline(self) -> Timeline:
        """Means over pieces of the log."""
        span = self.log.span
        n = len(self.log)
        starts = np.unique(np.linspace(0, n, TIMELINE_PIECES, endpoint=False).astype(np.intp))
        piece_span = np.add.reduceat(span, starts)[:, None]

        def means(values: Array | Flags) -> Array:
            return np.asarray(np.add.reduceat(span[:, None] * values, starts) / piece_span)

        return Timeline(
            time=self.log.time[starts],
            demand=means(self.demand),
            given=means(self.delivered),
            missing=means(self.missing),
            limits=means(self.is_limited),
        )


def _priority(groups: Sequence[Sequence[Axis]], axis: Axis | None) -> Policy:
    """Policy `priority` with given groups, or with the axis that lost most before the default
    ones."""
    if groups:
        check_order(groups, "priority")
        return Policy("priority", order=tuple(tuple(group) for group in groups))
    order: list[tuple[Axis, ...]] = [] if axis is None else [(axis,)]
    for group in DEFAULT_ORDER:
        remaining = tuple(name for name in group if name != axis)
        if remaining:
            order.append(remaining)
    return Policy("priority", order=tuple(order))


def _improved(
    log: Log, scale: Array, notes: list[str], goes_on: Callable[[], bool]
) -> Layout | None:
    """The layout that a search proposes for the demands that miss most, or else are largest.

    Args:
        log: the log.
        scale: the robot's wrench scale (6,) [N, N m].
        notes: gets a sentence where there is none.
        goes_on: called after each round; the search ends when it returns False.
    """
    demands = demands_of(log.demand, log.span, scale, 10 * MISSION_DEMANDS)
    answer = answers_to(Allocator(log.robot), demands.wrench)
    size = np.linalg.norm(np.nan_to_num(demands.wrench) / scale, axis=1)
    order = np.lexsort((-size * demands.span, -np.round(answer.err_norm, 3) * demands.span))
    mission = np.nan_to_num(demands.wrench[order[:MISSION_DEMANDS]])
    is_stopped = False

    def after_round(_: object) -> None:
        nonlocal is_stopped
        is_stopped = not goes_on()

    try:
        search = optimize_layout(
            log.robot,
            log.robot.names,
            goal="mission_power",
            mission=mission,
            rounds=SEARCH_ROUNDS,
            progress=after_round,
            cancelled=lambda: is_stopped,
        )
    except FinlabError as error:
        notes.append(f"No better layout was searched for: {error}.")
        return None
    if not search.improved:
        notes.append("The search found no layout that meets the hardest demands better.")
        return None
    return replace(search.layout, name=f"{log.robot.name[:MAX_STEM]}{IMPROVED}")


def _second_losses(robot: Layout, stopped: Sequence[str]) -> tuple[SecondLoss, ...]:
    """Fatal pairs of losses; where one actuator was stopped, those with it."""
    pairs = second_losses(robot)
    if len(stopped) != 1:
        return pairs
    return tuple(pair for pair in pairs if stopped[0] in (pair.first, pair.second))


def _event_words(log: Log, event: Event) -> str:
    """An event in words, after the name of its actuator."""
    index = event.actuator
    if index is None or index >= log.robot.n:
        return event.words
    return f"{log.robot.names[index]} {event.words}"
