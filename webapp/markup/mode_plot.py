"""The modes of an answer as numbered dots that can be picked: effort against error."""

import math

import numpy as np
from markupsafe import Markup

from finlab.arrays import Array
from webapp.markup.html import html
from webapp.markup.plot import EXACT, RIGHT, TOP, WIDTH, Plot, Point, cost_axis, error_axis
from webapp.presses import press
from webapp.tasks.mode_names import Modes
from webapp.theme import DEAD, Rgb, css, mode_color

LEFT = 54
"""Where the axis that goes up stands [px]."""
FAR = 2.0
"""Samples that cost more than so many times the dearest mode are counted, not drawn: modes keep apart."""
LEGEND = (("refined", 5.0, 6), ("on the robot", 0.0, 72), ("sampled", 2.6, 176))
"""Word, radius and place of what is drawn; radius 0 is the ring."""
DOT = 4.5
"""Radius of the dot of a mode [px]."""
LABEL = (13.0, 12.0)
"""Width and height of the number of a mode [px]."""
FAR_PX = 14.0
"""Distance of a number from its dot above which a line joins them [px]."""


def mode_plot(modes: Modes, shown: int, height: int) -> str:
    """Effort, which the network's proposals keep least, against the error.

    Samples are small dots, modes numbered ones, which can be clicked.

    Args:
        modes: an answer's modes, which give the samples their colours.
        shown: mode on the robot.
        height: of the plot [px].
    """
    samples = modes.samples
    if not modes.shown or samples is None:
        return ""
    error = np.array([mode.err_norm for mode, _ in modes.shown])
    effort = np.array([mode.effort for mode, _ in modes.shown])
    refined = np.stack([effort, _logarithm(error)], axis=1)
    raw = np.stack([samples.effort, _logarithm(samples.err_norm)], axis=1)
    near = raw[:, 0] <= FAR * effort.max()
    points = np.concatenate([refined, raw[near]])
    if not np.isfinite(points).all():
        return ""
    plot = Plot(cost_axis("effort", points[:, 0]), error_axis(points[:, 1]), height, LEFT)
    dots = [plot.place(*point) if close else None for point, close in zip(raw, near, strict=True)]
    parts = [_legend(), _sample_dots(dots, modes)]
    parts += _mode_dots([plot.place(*point) for point in refined], plot.floor, shown)
    return html("<div class='fl'>{}</div>", plot.drawn(parts, upright=True))


def _mode_dots(places: list[Point], floor: float, shown: int) -> list[str]:
    """A dot where each mode lies, with its number beside it; the best one on top."""
    # What is between a dot and its number can be clicked, too.
    dot = (
        "<g class='pick' {}><path {} stroke='transparent' stroke-width='12'/>{}"
        "<circle cx='{:.1f}' cy='{:.1f}' r='{}' class='mode' fill='{}'/>"
        "<text x='{:.1f}' y='{:.1f}' class='digit' text-anchor='middle'>{}</text></g>"
    )
    parts = []
    labels = _labels(places, floor)
    for k, ((x, y), (u, v)) in reversed(list(enumerate(zip(places, labels, strict=True)))):
        color, pressed = css(mode_color(k)), press("mode", str(k))
        way = html("d='M{:.1f} {:.1f}L{:.1f} {:.1f}'", x, y, u, v)
        line = html("<path {} stroke='{}'/>", way, color) if math.dist((x, y), (u, v)) > FAR_PX else ""
        parts.append(html(dot, pressed, way, line, x, y, DOT, color, u, v + 3.8, k + 1))
        if k == shown:
            parts.append(_ring(x, y, DOT + 3.0))
    return parts


def sample_colors(modes: Modes, count: int) -> list[Rgb]:
    """The colour of each of `count` samples: that of the mode which its component led to, grey for none."""
    kinds = [-1] * count if modes.of_samples is None else modes.of_samples.tolist()
    return [DEAD if kind < 0 else mode_color(kind) for kind in kinds]


def _logarithm(error: Array) -> Array:
    return np.asarray(np.log10(np.maximum(error, EXACT)))


def _sample_dots(places: list[Point | None], modes: Modes) -> str:
    """Raw samples, and how many have no place in the plot."""
    dots = [
        html("<circle cx='{:.1f}' cy='{:.1f}' r='3' fill='{}'/>", place[0], place[1], css(color, 0.6))
        for place, color in zip(places, sample_colors(modes, len(places)), strict=True)
        if place is not None
    ]
    beyond = len(places) - len(dots)
    told = (
        html("<text x='{}' y='14' text-anchor='end'>{} dearer →</text>", WIDTH - RIGHT, beyond)
        if beyond
        else ""
    )
    return html("<g class='samples'>{}</g>{}", dots, told)


def _ring(x: float, y: float, radius: float) -> str:
    return html("<circle class='ring' cx='{:.1f}' cy='{:.1f}' r='{:g}'/>", x, y, radius)


def _labels(places: list[Point], floor: float) -> list[Point]:
    """Where the numbers of dots stand: beside them, clear of all dots and of each other, above `floor`."""
    labels: list[Point] = []
    width, height = LABEL
    for x, y in places:
        rooms = (
            (x + radius * math.cos(turn), y - radius * math.sin(turn))
            for radius in range(12, WIDTH, 4)
            for turn in np.linspace(0.5 * math.pi, 2.5 * math.pi, 12, endpoint=False)
        )
        free = (
            (u, v)
            for u, v in rooms
            if LEFT + width / 2 <= u <= WIDTH - RIGHT - width / 2
            and TOP <= v <= floor - height / 2
            and not any(abs(u - a) < width and abs(v - b) < height for a, b in labels)
            and not any(abs(u - a) < width / 2 + DOT and abs(v - b) < height / 2 + DOT for a, b in places)
        )
        labels.append(next(free, (x, y)))
    return labels


def _legend() -> str:
    parts = []
    for word, radius, place in LEGEND:
        dot = html("<circle cx='{}' cy='10' r='{}' fill='currentColor' opacity='.55'/>", LEFT + place, radius)
        parts.append(dot if radius else _ring(LEFT + place, 10, 5.5))
        parts.append(html("<text x='{}' y='14'>{}</text>", LEFT + place + 9, word))
    return Markup().join(parts)
