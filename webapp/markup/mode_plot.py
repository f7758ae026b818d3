"""The modes of an answer as numbered dots that can be picked: effort against error."""

import math

import numpy as np
from markupsafe import Markup

from finlab.arrays import Array
from webapp.markup.html import html
from webapp.markup.plot import EXACT, RIGHT, TOP, WIDTH, Plot, Point, cost_axis, error_axis
from webapp.presses import press
from webapp.tasks.mode_names import Modes
from webapp.theme import DEAD, css, mode_color

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
    kinds = np.full(len(raw), -1) if modes.of_samples is None else modes.of_samples
    parts = [_legend(), _sample_dots(*plot.place(*raw[near].T), kinds[near].tolist(), len(raw))]
    parts += _mode_dots(
        [(float(x), float(y)) for x, y in zip(*plot.place(*refined.T), strict=True)], plot.floor, shown
    )
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


def _logarithm(error: Array) -> Array:
    return np.asarray(np.log10(np.maximum(error, EXACT)))


def _sample_dots(x: Array, y: Array, kinds: list[int], count: int) -> str:
    """Raw samples in the colours of the modes which their components led to, grey for none, and how many of
    them all have no place in the plot."""
    fills = [
        css(DEAD if kind < 0 else mode_color(kind), 0.6) for kind in range(-1, max(kinds, default=-1) + 1)
    ]
    dots = [
        f"<circle cx='{u:.1f}' cy='{v:.1f}' r='3' fill='{fills[kind + 1]}'/>"
        for u, v, kind in zip(x.tolist(), y.tolist(), kinds, strict=True)
    ]
    beyond = count - len(dots)
    told = f"<text x='{WIDTH - RIGHT}' y='14' text-anchor='end'>{beyond} dearer →</text>" if beyond else ""
    return Markup(f"<g class='samples'>{''.join(dots)}</g>{told}")


def _ring(x: float, y: float, radius: float) -> str:
    return html("<circle class='ring' cx='{:.1f}' cy='{:.1f}' r='{:g}'/>", x, y, radius)


def _labels(places: list[Point], floor: float) -> list[Point]:
    """Where the numbers of dots stand: beside them, clear of all dots and of each other, above `floor`."""
    labels: list[Point] = []
    (width, height), dots = LABEL, np.array(places)
    turn = np.linspace(0.5 * math.pi, 2.5 * math.pi, 12, endpoint=False)
    ring = (
        np.arange(12, WIDTH, 4)[:, None, None] * np.stack([np.cos(turn), -np.sin(turn)], axis=-1)
    ).reshape(-1, 2)
    for place in dots:
        rooms = place + ring
        free = (
            np.abs(rooms - [(LEFT + WIDTH - RIGHT) / 2, 0]) <= [(WIDTH - RIGHT - LEFT - width) / 2, np.inf]
        ).all(axis=1)
        free &= (rooms[:, 1] >= TOP) & (rooms[:, 1] <= floor - height / 2)
        for others, gap in (
            (dots, (width / 2 + DOT, height / 2 + DOT)),
            (np.array(labels or [(1e9, 1e9)]), LABEL),
        ):
            free &= ~(np.abs(rooms[:, None] - others) < gap).all(axis=2).any(axis=1)
        u, v = rooms[free][0] if free.any() else place
        labels.append((float(u), float(v)))
    return labels


def _legend() -> str:
    parts = []
    for word, radius, place in LEGEND:
        dot = html("<circle cx='{}' cy='10' r='{}' fill='currentColor' opacity='.55'/>", LEFT + place, radius)
        parts.append(dot if radius else _ring(LEFT + place, 10, 5.5))
        parts.append(html("<text x='{}' y='14'>{}</text>", LEFT + place + 9, word))
    return Markup().join(parts)
