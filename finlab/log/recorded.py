"""The record of a log in units of its own, as the readers of PX4, ArduSub and ROS make it.

`read` gives it the units of a robot.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange import Exchange
from finlab.layout import Layout

Form = Literal["px4", "ardusub", "ros", "finlab"]
"""The program that wrote a log; of ROS and of finlab itself wrenches are in newtons."""
FLU = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
"""Turns a wrench of x forward, y right, z down into x forward, y left, z up."""

TRUNCATED = "It ends in the middle of a message: it was cut there, or the power went."
"""The note on a log without its end."""


@dataclass(frozen=True)
class Event:
    """An event of the robot's health."""

    time: float
    """On the log's clock [s]."""
    words: str
    actuator: int | None = None
    """Index of the actuator that it is about; None for the robot."""


@dataclass(frozen=True)
class Series:
    """Samples of one kind; each holds until the next."""

    time: Array
    """Rising, on the log's clock (N,) [s]."""
    values: Array
    """(N, K)."""
    max_jump_back: float = 0.0
    """Largest step of the clock backwards, before the samples were sorted [s]."""

    @classmethod
    def of(cls, time: Array, values: Array) -> "Series":
        """Sorts samples by time (N,) [s]; of those at one time the last stays."""
        order = np.argsort(time, kind="stable")
        chosen = order[np.append(np.diff(time[order]) > 0.0, True)] if len(order) else order
        max_jump_back = -float(np.diff(time).min(initial=0.0))
        return cls(
            np.asarray(time[chosen], np.float64),
            np.asarray(values[chosen], np.float64),
            max_jump_back,
        )

    def at(self, time: Array) -> Array:
        """Values (M, K) that hold at times (M,) [s]; NaN before the first, and where there is
        none."""
        if not len(self.time):
            return np.full((len(time), self.values.shape[1]), np.nan)
        index = np.searchsorted(self.time, time, side="right") - 1
        return np.where(index[:, None] >= 0, self.values[np.maximum(index, 0)], np.nan)


@dataclass
class LogRecord:
    """The content of a log in units of its own."""

    form: Form
    demand: Series
    """Wrenches (N, 6), x forward, y left, z up; setpoints without unit of an autopilot, of ROS [N,
    N m]."""
    outputs: Series | None = None
    """Shares (M, n) of full output, NaN where a motor is stopped; or what ROS sent."""
    of_shares: bool = True
    """Whether outputs are shares."""
    unmet: Series | None = None
    """The part of a demand that the autopilot logged as unallocated (M, 6), in its unit."""
    armed: Series | None = None
    """Whether motors were armed (K, 1), 1 or 0; None where the log does not say it."""
    in_water: Series | None = None
    """Whether the robot was in the water, or in flight (K, 1), 1 or 0; None likewise."""
    unlogged: Series | None = None
    """Along which axes the log lacks the demand of a time (N, 6), 1 or 0: what outputs gave counts
    as asked there. None where it lacks none, or lacks an axis throughout."""
    turns: Series | None = None
    """Speeds of the motors (M, n) by their ESCs, in any unit; NaN where none says it."""
    layout: Layout | None = None
    """The robot by the log's own parameters."""
    events: list[Event] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    """Sentences on how it was read."""
    asks: list[str] = field(default_factory=list)
    """Sentences on what it lacks, each with the option that gives it."""
    taken: list[str] = field(default_factory=list)
    """Notes on what was assumed of the robot; they count where the layout is the log's."""
    lacking: list[str] = field(default_factory=list)
    """Sentences on what the log lacks of the robot; they count likewise."""

    def describe(
        self, read: Callable[[str, str, Exchange], Layout], parameters: dict[str, Any], name: str
    ) -> Layout | None:
        """Finds the robot in the autopilot's parameters, and returns its layout; None where there
        is none.

        Args:
            read: the reader of the parameters: takes their text, a name and an exchange.
            parameters: the parameters by name.
            name: the name of the layout.
        """
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


def changes(
    time: Array, bits: NDArray[np.bool_], rising_words: str, falling_words: str
) -> list[Event]:
    """Returns an event for each change of a flag.

    Args:
        time: times of the samples (N,) [s].
        bits: flags (N, n) of n actuators.
        rising_words: words of an event where a flag rises; the first sample counts as a change.
        falling_words: words where it falls.
    """
    previous = np.vstack([np.zeros_like(bits[:1]), bits[:-1]])
    events = []
    for row, i in np.argwhere(bits != previous).tolist():
        words = rising_words if bits[row, i] else falling_words
        events.append(Event(float(time[row]), words, i))
    return events


def silenced(module: Any) -> Any:
    """Returns a library's module, which from now on prints nothing about faults of a file."""
    vars(module)["print"] = lambda *_, **__: None
    return module
