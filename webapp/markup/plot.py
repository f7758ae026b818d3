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
from webapp.markup.words import html, without_powers
from webapp.theme import Rgb, css

WIDTH = 388
"""Width of a plot [px]."""
RIGHT = 8
"""Margin at the right of a plot [px]."""
TOP = 24
"""Margin above a plot, with room for what its colours mean [px]."""
BOTTOM = 34
"""Margin below a plot, with room for the ticks and the word of the axis [px]."""
MOST_TICKS = 6
"""Ticks of an axis at most: their labels are not to touch."""
LEAST_TICKS = 2
"""Ticks of an axis at least, from which its scale can be read."""
NARROW_WIDTH = 250
"""Width of a plot that stands beside others [px]."""
NARROW_HEIGHT = 128
"""Height of a plot that stands beside others [px]."""
NARROW_LEFT = 46
"""Where the axis that goes up stands in such a plot [px]."""
EXACT = 1e-6
"""Error below which all answers are drawn as equally exact."""
Point = tuple[float, float]
"""Across and down [px]."""


class Axis(NamedTuple):
    """One axis of a plot."""

    word: str
    """What it shows, with its unit."""
    low: float
    high: float
    ticks: tuple[tuple[float, str], ...]
    """Values and labels."""

    def fraction(self, value: Any) -> Any:
        """How far along it a value lies, or each of an array, 0 to 1."""
        return (value - self.low) / (self.high - self.low)


def cost_axis(word: str, values: Array, max_ticks: int = MOST_TICKS) -> Axis:
    """An axis that shows all of some values, with a margin and round ticks.

    Args:
        word: what it shows, with its unit.
        values: array (N,) in that unit.
        max_ticks: ticks at most.
    """
    lowest = float(values.min())
    highest = float(values.max())
    margin = max(0.08 * (highest - lowest), 0.02 * highest, 1e-6)
    low = lowest - margin
    high = highest + margin
    # The smallest of 1, 2, 5 and 10 times a power of ten with so few ticks; a step less where that
    # leaves a single one, which would not say how large anything is.
    decade = 10.0 ** math.floor(math.log10((high - low) / max_ticks))
    multiples = range(0)
    step = 10.0 * decade
    for factor in (10.0, 5.0, 2.0, 1.0):
        is_fine_enough = (high - low) / (factor * decade) > max_ticks
        if is_fine_enough and len(multiples) >= LEAST_TICKS:
            break
        step = factor * decade
        multiples = range(math.ceil(low / step), math.floor(high / step) + 1)
    ticks = []
    for k in multiples:
        ticks.append((k * step, without_powers(f"{k * step + 0.0:.4g}").replace("-", "−")))
    return Axis(word, low, high, tuple(ticks))


def error_axis(logs: Array) -> Axis:
    """An axis that shows logarithms (N,) of errors to base ten, with ticks at powers of ten."""
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
        right = self.left + self.across.fraction(x) * (self.width - self.left - RIGHT)
        return right, self.floor - self.up.fraction(y) * (self.floor - TOP)

    def points(self, x: Array, y: Array) -> str:
        """Some points, x and y (N,) in the units of the axes, as lines take them [px]."""
        points = zip(*self.place(x, y), strict=True)
        return " ".join([f"{right:.1f},{down:.1f}" for right, down in points])

    def curve(self, x: Array, y: Array, color: Rgb) -> str:
        """A line through some points, x and y (N,) in the units of the axes."""
        line = "<polyline points='{}' fill='none' stroke='{}' stroke-width='2'/>"
        return html(line, self.points(x, y), css(color))

    def key(self, right: int, color: Rgb, words: str) -> str:
        """What a colour means, above the plot, so far [px] from the axis that goes up."""
        sign = (
            "<rect x='{}' y='7' width='14' height='5' rx='2' fill='{}'/>"
            "<text x='{}' y='14'>{}</text>"
        )
        return html(sign, self.left + right, css(color), self.left + right + 19, words)

    def grid(self, upright: bool) -> str:
        """Lines and labels of both axes; `upright` says whether there are upright lines as well."""
        floor = self.floor
        left = self.left
        right = self.width - RIGHT
        columns = self.place(np.array([value for value, _ in self.across.ticks]), 0.0)[0].tolist()
        levels = self.place(0.0, np.array([value for value, _ in self.up.ticks]))[1].tolist()
        markup = []
        # Labels of ticks are rounded numbers, or markup of ours: they need no escaping.
        for y, (_, label) in zip(levels, self.up.ticks, strict=True):
            markup.append(f"<path d='M{left} {y:.1f}H{right}' class='grid'/>")
            markup.append(f"<text x='{left - 5}' y='{y + 4:.1f}' text-anchor='end'>{label}</text>")
        for x, (_, label) in zip(columns, self.across.ticks, strict=True):
            if upright:
                markup.append(f"<path d='M{x:.1f} {TOP}V{floor}' class='grid'/>")
            markup.append(f"<text x='{x:.1f}' y='{floor + 14}' text-anchor='middle'>{label}</text>")
        words = html(
            "<text x='{:.1f}' y='{}' text-anchor='middle'>{}</text>"
            "<text transform='translate(10 {}) rotate(-90)' text-anchor='middle'>{}</text>",
            (left + self.width) / 2,
            self.height - 5,
            self.across.word,
            (TOP + floor) / 2,
            self.up.word,
        )
        return Markup("".join(markup)) + words

    def svg(self, layers: Iterable[str], upright: bool = False) -> str:
        """The whole plot: markup in `layers` over its grid, see `grid`."""
        frame = "<svg class='plot' viewBox='0 0 {} {}'>{}{}</svg>"
        return html(frame, self.width, self.height, self.grid(upright), layers)


def positive_axis(word: str, values: Array, max_ticks: int = MOST_TICKS) -> Axis:
    """An axis from 0, or the least of some values, that shows all of them; see `cost_axis`.

    Args:
        word: what it shows, with its unit.
        values: array (N,) in that unit.
        max_ticks: ticks at most.
    """
    low = min(0.0, float(values.min()))
    return cost_axis(word, np.append(values, low), max_ticks)._replace(low=low)


def exact_axis(word: str, values: Array) -> Axis:
    """An axis from the first of some values (N,) to the last, in the unit that `word` names."""
    low = float(values[0])
    high = float(values[-1])
    if high <= low:  # limits that leave a single value
        half_width = 0.5 * max(abs(low), 1.0)
        low -= half_width
        high += half_width
    axis = cost_axis(word, values)._replace(low=low, high=high)
    ticks = [tick for tick in axis.ticks if axis.low <= tick[0] <= axis.high]
    return axis._replace(ticks=tuple(ticks))


def over_time(
    across: Axis,
    seconds: Array,
    up: Axis,
    curves: Sequence[Array],
    colors: Sequence[Rgb],
    words: Sequence[str] = (),
    moment: float | None = None,
) -> str:
    """Curves over the same times.

    Args:
        across: the axis of time [s].
        seconds: times (T,) [s].
        up: the axis of the values.
        curves: values (T,) of each curve, in the unit of `up`.
        colors: of the curves.
        words: what the first colours mean.
        moment: time at which an upright line stands [s], if any.
    """
    plot = Plot(across, up._replace(word=""), NARROW_HEIGHT, NARROW_LEFT, NARROW_WIDTH)
    layers = [html("<text x='2' y='14'>{}</text>", up.word)]
    for curve, color in zip(curves, colors, strict=False):
        layers.append(plot.curve(seconds, curve, color))
    for k, (word, color) in enumerate(zip(words, colors, strict=False)):
        layers.append(plot.key(34 + 68 * k, color, word))
    if moment is not None:
        x = plot.place(moment, 0.0)[0]
        line = "<path d='M{:.1f} {}V{}' stroke='currentColor'/>"
        layers.append(html(line, x, TOP, plot.floor))
    return plot.svg(layers)
