"""Plots as SVG: axes with round ticks, curves, and what their colours mean.

viser has a chart of its own, `gui.add_uplot`, which zooms and needs no code here. It serves none of
these plots:

- Curves over time, of swims and logs, stand beside each other, up to six in one row of a low
  drawer, and those of a log have a line at the chosen moment. A chart of viser is a widget with a
  row of its own, and draws no such line.
- The plot of modes has rings, numbers and trails that can be pressed, and samples that travel from
  one step to the next; those of an actuator's model are thumbnails in its card. A chart of viser
  draws series over one axis, and is no markup.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from finlab.arrays import Array
from webapp.markup.words import html
from webapp.theme import Rgb, css

WIDTH = 388
"""Width of a plot [px]."""
RIGHT, TOP, BOTTOM = 8, 24, 34
"""Margins of a plot [px]."""
MOST_TICKS = 6
EXACT = 1e-6
"""Error below which all answers are drawn as equally exact."""
Point = tuple[float, float]
"""Across and down [px]."""


class Axis(NamedTuple):
    """One axis of a plot."""

    word: str
    low: float
    high: float
    ticks: tuple[tuple[float, str], ...]

    def share(self, value: Any) -> Any:
        """How far along it a value lies, or each of an array, 0 to 1."""
        return (value - self.low) / (self.high - self.low)


def cost_axis(word: str, values: Array, most: int = MOST_TICKS) -> Axis:
    """An axis that shows all of some values (N,), in the unit that `word` names, with round ticks,
    `most` at most."""
    low = float(values.min())
    high = float(values.max())
    margin = max(0.08 * (high - low), 0.02 * high, 1e-6)
    low = low - margin
    high = high + margin
    decade = 10.0 ** math.floor(math.log10((high - low) / most))
    step = next(s * decade for s in (1.0, 2.0, 5.0, 10.0) if (high - low) / (s * decade) <= most)
    places = range(math.ceil(low / step), math.floor(high / step) + 1)
    return Axis(
        word,
        low,
        high,
        tuple((k * step, f"{k * step + 0.0:.4g}".replace("-", "−")) for k in places),
    )


def error_axis(logs: Array) -> Axis:
    """The same for logarithms (N,) of errors, to base ten, in powers of ten."""
    low = math.floor(logs.min())
    high = max(math.ceil(logs.max()), low + 1)
    ticks = []
    for power in range(low, high + 1, max(1, round((high - low) / 5))):
        below = "≤" if 10.0**power <= EXACT else ""
        raised = str(power).replace("-", "−")
        label = Markup(f"{below}10<tspan dy='-4' font-size='8'>{raised}</tspan>")
        ticks.append((float(power), label))
    margin = 0.06 * (high - low)
    return Axis("error", low - margin, high + margin, tuple(ticks))


class Plot(NamedTuple):
    """A plot between two axes."""

    across: Axis
    up: Axis
    height: int
    """[px]."""
    left: int = 44
    """Where the axis that goes up stands [px]."""
    width: int = WIDTH
    """[px]."""

    @property
    def floor(self) -> float:
        """Where the axis across stands [px]."""
        return self.height - BOTTOM

    def place(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Where a pair of values stands, or each of two arrays [px]."""
        right = self.left + self.across.share(x) * (self.width - self.left - RIGHT)
        return right, self.floor - self.up.share(y) * (self.floor - TOP)

    def points(self, x: Array, y: Array) -> str:
        """Some places, x and y (N,) in the units of the axes, as lines take them [px]."""
        places = zip(*self.place(x, y), strict=True)
        return " ".join([f"{right:.1f},{down:.1f}" for right, down in places])

    def curve(self, x: Array, y: Array, color: Rgb) -> str:
        """A line through some places, x and y (N,) in the units of the axes."""
        line = "<polyline points='{}' fill='none' stroke='{}' stroke-width='2'/>"
        return html(line, self.points(x, y), css(color))

    def key(self, right: int, color: Rgb, words: str) -> str:
        """What a colour means, above the plot, so far [px] from the axis that goes up."""
        sign = (
            "<rect x='{}' y='7' width='14' height='5' rx='2' fill='{}'/><text x='{}' "
            "y='14'>{}</text>"
        )
        return html(sign, self.left + right, css(color), self.left + right + 19, words)

    def grid(self, upright: bool) -> str:
        """Lines and labels; upright lines or none."""
        floor = self.floor
        left = self.left
        end = self.width - RIGHT
        across = np.array([value for value, _ in self.across.ticks])
        up = np.array([value for value, _ in self.up.ticks])
        right = self.place(across, 0.0)[0]
        down = self.place(0.0, up)[1]
        parts = []
        # Labels of ticks are rounded numbers, or markup of ours: they need no escaping.
        for at, (_, label) in zip(down.tolist(), self.up.ticks, strict=True):
            parts.append(f"<path d='M{left} {at:.1f}H{end}' class='grid'/>")
            parts.append(f"<text x='{left - 5}' y='{at + 4:.1f}' text-anchor='end'>{label}</text>")
        for at, (_, label) in zip(right.tolist(), self.across.ticks, strict=True):
            if upright:
                parts.append(f"<path d='M{at:.1f} {TOP}V{floor}' class='grid'/>")
            parts.append(f"<text x='{at:.1f}' y='{floor + 14}' text-anchor='middle'>{label}</text>")
        middle = (left + self.width) / 2
        word = "<text x='{:.1f}' y='{}' text-anchor='middle'>{}</text>"
        turned = (
            f"<text transform='translate(10 {(TOP + floor) / 2}) rotate(-90)' text-anchor='middle'>"
        )
        words = html(
            word + turned + "{}</text>", middle, self.height - 5, self.across.word, self.up.word
        )
        return Markup("".join(parts)) + words

    def drawn(self, parts: Iterable[str], upright: bool = False) -> str:
        """The whole plot, `parts` over its grid."""
        frame = "<svg class='plot' viewBox='0 0 {} {}'>{}{}</svg>"
        return html(frame, self.width, self.height, self.grid(upright), parts)


def positive(word: str, values: Array, most: int = MOST_TICKS) -> Axis:
    """An axis from 0, or the least of some values (N,), that shows all of them."""
    least = min(0.0, float(values.min()))
    return cost_axis(word, np.append(values, least), most)._replace(low=least)


def exact_axis(word: str, values: Array) -> Axis:
    """An axis from the first of some values (N,) to the last."""
    axis = cost_axis(word, values)._replace(low=float(values[0]), high=float(values[-1]))
    return axis._replace(
        ticks=tuple(tick for tick in axis.ticks if axis.low <= tick[0] <= axis.high)
    )


NARROW, LOW, INDENT = 250, 128, 46
"""Of a plot that stands beside others, and where its vertical axis stands [px]."""


def over_time(
    across: Axis,
    seconds: Array,
    up: Axis,
    lines: Sequence[Array],
    colors: Sequence[Rgb],
    words: Sequence[str] = (),
    moment: float | None = None,
) -> str:
    """Curves (T,), in the unit of `up`, over the same times (T,) [s], of as many colours, the first
    of which have words; with an upright line at a moment [s]."""
    drawing = Plot(across, up._replace(word=""), LOW, INDENT, NARROW)
    parts = [html("<text x='2' y='14'>{}</text>", up.word)]
    parts += [
        drawing.curve(seconds, line, color) for line, color in zip(lines, colors, strict=False)
    ]
    parts += [
        drawing.key(34 + 68 * k, color, word)
        for k, (word, color) in enumerate(zip(words, colors, strict=False))
    ]
    if moment is not None:
        at = drawing.place(moment, 0.0)[0]
        parts.append(
            html("<path d='M{:.1f} {}V{}' stroke='currentColor'/>", at, TOP, drawing.floor)
        )
    return drawing.drawn(parts)
