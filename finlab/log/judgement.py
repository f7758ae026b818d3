"""The judgement of a log, as plain data."""

from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from finlab.analysis.authority import AXES as MOTIONS
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.evaluation.document import three
from finlab.layout import Layout
from finlab.layout.file import layout_to_dict
from finlab.log.replay import Replay


@dataclass(frozen=True)
class Spell:
    """A time over which axes were lost."""

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
    """The log in pieces, as means over each."""

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
    """What a robot could not, and what would have held it; an impulse is the integral over time of a size."""

    source: str
    """Name of the file."""
    robot: Layout
    """By whose laws it was judged."""
    scale: Array
    """The robot's yardstick (6,) [N, N m]."""
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
    """Mean power of the outputs by the actuators' own models [W]; None where the log has no outputs."""
    axis: str | None
    """Axis that lost most, as a share of the yardstick; None where none was lost."""
    stopped: tuple[str, ...]
    """Actuators that were at rest all along while what they would have given was missing."""
    spells: tuple[Spell, ...]
    """Those that lost most, by time."""
    n_spells: int
    """How many there were."""
    replays: tuple[Replay, ...]
    held_by: Replay | None
    """Replay on the robot as it is (without the one actuator that was stopped), or else on the improved one,
    that holds the axis, with least missing, then least power; None where none does, or nothing was lost."""
    improved: Layout | None
    """Layout on which the hardest demands cost least; None where none was found, or asked for."""
    timeline: Timeline
    events: tuple[tuple[float, str], ...]
    """What the log says of the robot's health: time [s] and words."""
    notes: tuple[str, ...]
    asks: tuple[str, ...]
    """Sentences on what the log lacks, each with the option that gives it."""

    @property
    def sentence(self) -> str:
        """The answer."""
        if self.axis is None:
            return f"No axis was lost in {three(self.seconds)} s: no actuator at a limit cut a demand."
        i = AXES.index(self.axis)
        longest = max(self.spells, key=lambda spell: spell.end - spell.start)
        worst = max(self.spells, key=lambda spell: spell.missing[i])
        why = f", with {', '.join(worst.limits[:4])}" if worst.limits else ""
        begin = (
            f"{MOTIONS[i].capitalize()} ({self.axis}) was lost for {three(self.lost_s[i])} s of "
            f"{three(self.seconds)} s, in {self.n_spells} spell{'s' * (self.n_spells > 1)}, the longest from "
            f"{longest.start:.1f} to {longest.end:.1f} s: {amount(self.missing[i], i)} of "
            f"{amount(self.asked[i], i)} were missing{why}"
        )
        return f"{begin}; {self._remedy(i)}."

    @property
    def without(self) -> str | None:
        """The one actuator that was stopped, which replays that could have held an axis do without."""
        return self.stopped[0] if len(self.stopped) == 1 else None

    def _remedy(self, i: int) -> str:
        if (held := self.held_by) is None:
            least = min(self.replays, key=lambda each: (each.lost != self.without, each.missing[i]))
            where = "" if least.robot == "as it is" else ", on the improved layout,"
            where = where if least.lost is None else f" without {least.lost}"
            misses = amount(least.missing[i], i)
            return f"no policy would have held it; {least.name}{where} comes nearest and misses {misses}"
        where = "" if held.robot == "as it is" else " on the improved layout, and nothing on this one"
        where = where if held.lost is None else f" without {held.lost}"
        more = np.subtract(held.missing, self.missing)
        least = 0.02 * self.missing[i] * self.scale / self.scale[i]
        price = [f"{amount(more[k], int(k))} of {MOTIONS[k]}" for k in np.flatnonzero(more > least)]
        return f"{held.name} would have held it{where}" + (f", for {' and '.join(price)}" if price else "")

    def to_dict(self) -> dict[str, Any]:
        """Returns all of it as numbers, strings, lists and None, for JSON."""
        plain = {field.name: _plain(getattr(self, field.name)) for field in fields(self)}
        return {"sentence": self.sentence, "axes": [*AXES], "names": [*self.robot.names], **plain}


def amount(value: float, axis: int) -> str:
    """An impulse along an axis in words."""
    return f"{three(value)} N{' m' * int(axis > 2)} s"


def _plain(value: Any) -> Any:
    if isinstance(value, Layout):
        return layout_to_dict(value)
    if isinstance(value, np.ndarray):
        return np.round(value, 6).tolist()
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    if isinstance(value, Replay):
        return asdict(value) | {"name": value.name}
    if isinstance(value, Spell | Timeline):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    return value
