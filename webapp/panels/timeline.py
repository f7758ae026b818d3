"""What happens while a robot swims: plots over time."""

import math
import time
from collections.abc import Sequence

import numpy as np

from finlab.arrays import Array
from finlab.layout.layout import MAX_ACTUATORS
from webapp.handles import add_html, put
from webapp.markup.html import html
from webapp.markup.plot import Axis, Plot, cost_axis, exact_axis, positive
from webapp.page import Page
from webapp.tasks.moment import DEPTH_ERROR, ERROR, FORCES, POWER, SURGE, TIME, Moment
from webapp.tasks.swimmer import Swimmer
from webapp.theme import ASKED, DELIVERED, Rgb, fin_color

FIN_LINES = tuple(fin_color(i) for i in range(MAX_ACTUATORS))
EVERY_S = 0.2
"""Least time between two drawings [s]."""
SMALL = 0.01
"""What a vertical axis shows at least, in its unit."""
WIDTH, HEIGHT, LEFT = 250, 128, 40
"""Of a plot, and where its vertical axis stands [px]."""
TICKS = 3
MOST = 2000
"""About how many forces are drawn; a longer record, or one of more actuators, is thinned out."""
FIRST_S = 8.0
"""Least end of the axes of time [s]; it doubles as time goes on."""
SMOOTH_S = 1.0
"""Time over which plotted power is averaged."""
UNSWUM = (
    "Once a swim is started, its distance from the path, power, wrench, forces and what is found broken "
    "are plotted here over time."
)


def add_timeline(page: Page) -> None:
    """What is said before a swim, and six plots over time."""
    content = add_html(page.gui, "")
    drawn = 0.0

    def draw(swimmer: Swimmer | None, moment: Moment | None, paused: bool) -> None:
        """No more often than an eye can follow."""
        nonlocal drawn
        now = time.monotonic()
        if swimmer is None:
            put(content, content=html("<div class='fl fl-timeline fl-unswum dim'>{}</div>", UNSWUM))
        elif moment is None or not len(moment.record):
            return
        elif paused or moment.done or now - drawn >= EVERY_S:
            drawn = now
            plots = timeline(moment.record, len(swimmer.fins), swimmer.duration_s)
            put(content, content=html("<div class='fl fl-timeline'>{}</div>", plots))

    page.board.act(draw)


def timeline(record: Array, n: int, duration_s: float) -> list[str]:
    """Errors, power, surge asked and delivered, forces, and the monitor's doubts, as plots.

    Args:
        record: rows (N, 9 + 2 n) of a swim, as `tasks/moment.py` describes them.
        n: number of actuators.
        duration_s: of the whole swim [s].
    """
    rows = np.nan_to_num(record[:: 1 + len(record) * n // MOST])
    seconds, power = rows[:, TIME], rows[:, POWER]
    if len(rows) > 1:
        ones = np.ones(max(1, min(len(rows), round(SMOOTH_S / float(seconds[1] - seconds[0])))))
        power = np.convolve(power, ones, "same") / np.convolve(np.ones(len(rows)), ones, "same")
    last = float(seconds[-1])
    end = max(last, min(duration_s, 2.0 ** math.ceil(math.log2(max(last, FIRST_S)))))
    across = exact_axis("time [s]", np.array([0.0, end]))

    def plot(up: Axis, lines: Sequence[Array], colors: Sequence[Rgb], words: Sequence[str] = ()) -> str:
        drawing = Plot(across, up._replace(word=""), HEIGHT, LEFT, WIDTH)
        parts = [html("<text x='2' y='14'>{}</text>", up.word)]
        parts += [drawing.curve(seconds, line, color) for line, color in zip(lines, colors, strict=False)]
        parts += [
            drawing.key(34 + 68 * k, color, word)
            for k, (word, color) in enumerate(zip(words, colors, strict=False))
        ]
        return drawing.drawn(parts)

    def sizes(word: str, lines: Sequence[Array], colors: Sequence[Rgb] = (DELIVERED,)) -> str:
        return plot(positive(word, np.append(SMALL, lines), TICKS), lines, colors)

    surge = list(rows[:, SURGE : SURGE + 2].T)
    ends = cost_axis("surge [N]", np.append((-SMALL, SMALL), surge), TICKS)
    return [
        sizes("off the path [m]", [rows[:, ERROR]]),
        sizes("off in depth [m]", [rows[:, DEPTH_ERROR]]),
        sizes("power [W]", [power]),
        plot(ends, surge, (ASKED, DELIVERED), ("asked", "delivered")),
        sizes("forces [N]", list(rows[:, FORCES : FORCES + n].T), FIN_LINES),
        sizes("broken [%]", list(100.0 * rows[:, FORCES + n :].T), FIN_LINES),
    ]
