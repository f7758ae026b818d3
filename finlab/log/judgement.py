"""The judgement of a log, as plain data."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec import to_builtins

from finlab.analysis.second_losses import SecondLoss
from finlab.arrays import Array
from finlab.axes import AXES, MOTIONS, UNITS
from finlab.display import three_digits
from finlab.layout import Layout
from finlab.layout.save import layout_to_dict
from finlab.log.replay import Replay

DEMANDED_SHARE = 1e-3
"""Share of the largest impulse above which that of an axis counts as demanded."""
HELD_SHARE = 0.02
"""Share of what was missing along an axis that a replay which holds it may miss."""


@dataclass(frozen=True)
class Spell:
    """A stretch of time over which axes were lost."""

    start: float
    """On the log's clock [s]."""
    end: float
    axes: tuple[str, ...]
    """Axes that were lost, of Fx to Tz."""
    missing: tuple[float, ...]
    """Impulse that was missing along each axis (6,) [N s, N m s]."""
    asked: tuple[float, ...]
    """Mean wrench that was asked for (6,) [N, N m]; 0 along axes that do not count."""
    gave: tuple[float, ...]
    """Mean wrench that the outputs gave instead (6,)."""
    limits: tuple[str, ...]
    """Actuators that were at their limits in it, in words."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """Means over K pieces of the log."""

    time: Array
    """Begin of each piece (K,) [s]."""
    demand: Array
    """(K, 6) [N, N m]; 0 along axes that do not count."""
    given: Array
    """(K, 6)."""
    missing: Array
    """(K, 6), counted where some actuator was at a limit."""
    limits: Array
    """Share of the time that each actuator was at a limit (K, n)."""


@dataclass(frozen=True, eq=False)
class Judgement:
    """The wrenches that a robot lacked, and the method that would have delivered them.

    An impulse is the integral over time of a size.
    """

    source: str
    """Name of the file."""
    robot: Layout
    """By whose laws it was judged."""
    scale: Array
    """The robot's wrench scale (6,) [N, N m]."""
    seconds: float
    """Time that was judged [s]."""
    asked: tuple[float, ...]
    """Impulse that was asked for along each axis (6,) [N s, N m s]."""
    missing: tuple[float, ...]
    """Impulse that was missing along each axis while an actuator was at a limit (6,)."""
    lost_s: tuple[float, ...]
    """Time over which each axis was lost (6,) [s]."""
    saturated_s: float
    """Time over which any was lost [s]."""
    watts: float | None
    """Mean power of the outputs by the actuators' own models [W]; None where the log has no
    outputs."""
    axis: str | None
    """Axis that lost most, as a share of the wrench scale; None where none was lost."""
    stopped: tuple[str, ...]
    """Actuators that were at rest all along while what they would have given was missing, and those
    that the autopilot had stopped at last, or that had ceased to turn by then."""
    spells: tuple[Spell, ...]
    """Those that lost most, by time."""
    n_spells: int
    """How many there were."""
    replays: tuple[Replay, ...]
    second_losses: tuple[SecondLoss, ...]
    """Pairs of losses that take an axis away which either alone leaves; where one actuator was
    stopped, those with it."""
    improved: Layout | None
    """Layout on which the hardest demands cost least, with a name of its own; None where none was
    found, or asked for."""
    timeline: Timeline
    events: tuple[tuple[float, str], ...]
    """What the log says of the robot's health: time [s] and words."""
    notes: tuple[str, ...]
    asks: tuple[str, ...]
    """Sentences on what the log lacks, each with the option that gives it."""

    @property
    def without(self) -> str | None:
        """The one actuator that was stopped, which replays that could have held an axis do
        without."""
        return self.stopped[0] if len(self.stopped) == 1 else None

    @property
    def demanded_axes(self) -> tuple[int, ...]:
        """Indices of the axes that were asked for in earnest."""
        least = DEMANDED_SHARE * max(self.asked)
        return tuple(k for k in range(len(AXES)) if self.asked[k] > least)

    @property
    def held_by(self) -> Replay | None:
        """Replay on the robot as it is, or else on the improved one, that holds the axis, with
        least missing, then least power; None where none does, or nothing was lost."""
        if self.axis is None:
            return None
        i = AXES.index(self.axis)
        holding = [
            replay
            for replay in self.replays
            if replay.lost == self.without and replay.missing[i] <= HELD_SHARE * self.missing[i]
        ]

        def rank(replay: Replay) -> tuple[bool, float, float]:
            missing = round(sum(replay.missing / self.scale), 3)
            return replay.robot != "as it is", missing, replay.watts

        return min(holding, key=rank, default=None)

    @property
    def sentence(self) -> str:
        """The judgement in one sentence: what was lost, and what would have held it."""
        if self.axis is None or not self.replays:
            return self.loss
        return f"{self.loss.removesuffix('.')}; {self._remedy(AXES.index(self.axis))}."

    @property
    def loss(self) -> str:
        """What was lost, in one sentence."""
        seconds = three_digits(self.seconds)
        if self.axis is None:
            return f"No axis was lost in {seconds} s: no actuator at a limit cut a demand."
        i = AXES.index(self.axis)
        lost_seconds = three_digits(self.lost_s[i])
        plural = "s" if self.n_spells > 1 else ""
        longest = max(self.spells, key=lambda spell: spell.end - spell.start)
        worst = max(self.spells, key=lambda spell: spell.missing[i])
        why = f", with {', '.join(worst.limits[:4])}" if worst.limits else ""
        return (
            f"{MOTIONS[i].capitalize()} ({self.axis}) was lost for {lost_seconds} s of {seconds} "
            f"s, in {self.n_spells} spell{plural}, the longest from {longest.start:.1f} to "
            f"{longest.end:.1f} s: {amount(self.missing, i)} of {amount(self.asked, i)} were "
            f"missing{why}."
        )

    def _remedy(self, i: int) -> str:
        """A clause on the replay that would have held axis i, and what it costs on other axes; or
        on the one that comes nearest."""
        best = self.held_by
        if best is None:
            best = min(self.replays, key=lambda r: (r.lost != self.without, r.missing[i]))
            where = ", on the improved layout," if best.robot == "improved" else ""
            if best.lost is not None:
                where = f" without {best.lost}"
            misses = f"comes nearest and misses {amount(best.missing, i)}"
            return f"no policy would have held it; {best.name}{where} {misses}"
        where = ""
        if best.lost is not None:
            where = f" without {best.lost}"
        elif best.robot == "improved":
            where = " on the improved layout, and nothing on this one"
        excess = np.subtract(best.missing, self.missing)
        threshold = HELD_SHARE * self.missing[i] * self.scale / self.scale[i]
        costs = []
        for k in np.flatnonzero(excess > threshold).tolist():
            costs.append(f"{amount(excess, k)} of {MOTIONS[k]}")
        clause = f", for {' and '.join(costs)}" if costs else ""
        return f"{best.name} would have held it{where}{clause}"

    def to_dict(self) -> dict[str, Any]:
        """Returns all of it as numbers, strings, lists and None, for JSON."""
        better = self.improved and layout_to_dict(self.improved)
        parts = {"robot": layout_to_dict(self.robot), "improved": better, "held_by": self.held_by}
        plain = to_builtins(vars(self) | parts, enc_hook=lambda array: np.round(array, 6).tolist())
        return {"sentence": self.sentence, "axes": [*AXES], "names": [*self.robot.names], **plain}


def amount(impulse: Sequence[float] | Array, axis: int) -> str:
    """Returns the component of an impulse (6,) along an axis, with its unit."""
    return f"{three_digits(impulse[axis])} {UNITS[axis]} s"
