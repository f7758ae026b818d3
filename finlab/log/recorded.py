"""What a reader finds in a log, before the robot's newtons are known."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange import Exchange
from finlab.layout import Layout

Form = Literal["px4", "ardusub", "ros"]
FLU = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""Turns a wrench of x forward, y right, z down into x forward, y left, z up."""

CUT = "It ends in the middle of a message: it was cut there, or the power went."
"""What is said of a log without its end."""


@dataclass(frozen=True)
class Event:
    """Something that the log says of the robot's health."""

    time: float
    """On the log's clock [s]."""
    words: str
    actuator: int | None = None
    """Place of the actuator that it is about, from 0."""


@dataclass(frozen=True)
class Series:
    """Samples of one kind; each holds until the next."""

    time: Array
    """Rising, on the log's clock (N,) [s]."""
    values: Array
    """(N, K)."""
    back: float = 0.0
    """How far the clock jumped back, at most, before the samples were sorted [s]."""

    @classmethod
    def of(cls, time: Array, values: Array) -> "Series":
        """Sorts samples by time (N,) [s]; of those at one time the last stays."""
        order = np.argsort(time, kind="stable")
        kept = order[np.append(np.diff(time[order]) > 0.0, True)] if len(order) else order
        back = -float(np.diff(time).min(initial=0.0))
        return cls(np.asarray(time[kept], np.float64), np.asarray(values[kept], np.float64), back)

    def at(self, time: Array) -> Array:
        """Values (M, K) that hold at times (M,) [s]; NaN before the first."""
        place = np.searchsorted(self.time, time, side="right") - 1
        return np.where(place[:, None] >= 0, self.values[np.maximum(place, 0)], np.nan)


@dataclass
class Recorded:
    """What a log holds, in its own units."""

    form: Form
    demand: Series
    """Wrenches (N, 6), x forward, y left, z up; setpoints without unit of an autopilot, of ROS [N,
    N m]."""
    outputs: Series | None = None
    """Shares (M, n) of full output, NaN where a motor is stopped; or what ROS sent."""
    of_shares: bool = True
    """Whether outputs are shares."""
    unmet: Series | None = None
    """What the autopilot says that it left of a demand (M, 6), in its unit."""
    turns: Series | None = None
    """How fast motors turned (M, n), by their ESCs, in any unit; NaN where none says it."""
    layout: Layout | None = None
    """The robot by the log's own parameters."""
    events: list[Event] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """Sentences on how it was read."""
    asks: list[str] = field(default_factory=list)
    """Sentences on what it lacks, each with the option that gives it."""
    taken: list[str] = field(default_factory=list)
    """Notes of what was taken for the robot, where its layout is the log's."""
    lacking: list[str] = field(default_factory=list)
    """What the log lacks of the robot, as `asks` are."""

    def describe(
        self, read: Callable[[str, str, Exchange], Layout], parameters: dict[str, Any], name: str
    ) -> Layout | None:
        """The robot that a reader of the autopilot's parameters finds in them; None where it finds
        none."""
        exchange = Exchange()
        lines = "\n".join(f"{key} {value}" for key, value in parameters.items())
        try:
            self.layout = read(lines, name[:64] or self.form, exchange)
        except LayoutError as error:
            self.lacking.append(
                f"Its parameters hold no robot ({error}); name it by --robot LAYOUT."
            )
            return None
        self.taken += exchange.notes
        return self.layout


def changes(time: Array, bits: NDArray[np.bool_], words: str, again: str) -> list[Event]:
    """Events where flags (N, n) of n actuators change; the second words where one falls."""
    before = np.vstack([np.zeros_like(bits[:1]), bits[:-1]])
    return [
        Event(float(time[row]), words if bits[row, i] else again, int(i))
        for row, i in zip(*np.nonzero(bits != before), strict=True)
    ]


def silent(module: Any) -> Any:
    """A library's module, which from now on prints nothing of what is wrong with a file."""
    vars(module)["print"] = lambda *_, **__: None
    return module
