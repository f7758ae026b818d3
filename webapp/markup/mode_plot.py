"""The modes of an answer as numbered rings that can be picked, and what led to them: effort against error."""

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
"""Samples that cost more than the answer, and so many times the dearest other mode, are counted, not drawn:
modes keep apart."""
LEGEND = (("sample", 0), ("refined", 76), ("on the robot", 154))
"""Words and places of what is drawn."""
DOT, RING = 3.0, 5.5
"""Radii of samples and of modes [px]."""
APART = 3.0
"""How much wider each further ring is that lies about another one [px]."""
LABEL = (13.0, 12.0)
"""Width and height of the number of a mode [px]."""
FAR_PX = 16.0
"""Distance of a number from its ring above which a line joins them [px]."""
TRAIL = (0, 1, 2, 3, 4, 6, 8, 12, 20)
"""Steps at which the way of a sample is drawn, beside the last one."""


def mode_plot(modes: Modes, shown: int, step: int | None, height: int) -> str:
    """Effort, which the network's proposals keep least, against the error.

    Samples are small dots, with thin lines to where they end; modes are numbered rings, which can be clicked.

    Args:
        modes: an answer's modes, which give the samples their colours.
        shown: mode on the robot.
        step: how many steps of refinement the samples have had; None for all.
        height: of the plot [px].
    """
    if not modes.shown or not modes.ways:
        return ""
    error = np.array([named.mode.err_norm for named in modes.shown])
    effort = np.array([named.mode.effort for named in modes.shown])
    refined = np.stack([effort, _logarithm(error)], axis=1)
    raw = np.array([[way.effort, _logarithm(way.err_norm)] for way in modes.ways]).swapaxes(1, 2)
    far = max(float(effort.max()), FAR * float(effort[len(effort) > 1 :].max()))
    near = raw[0, :, 0] <= far
    drawn = raw[:, near].clip(max=(far, np.inf))
    points = np.concatenate([refined, drawn.reshape(-1, 2)])
    if not np.isfinite(points).all():
        return ""
    plot = Plot(cost_axis("effort", points[:, 0]), error_axis(points[:, 1]), height, LEFT)
    ends = [end for end, kept in zip(modes.ends or [-1] * len(near), near.tolist(), strict=True) if kept]
    places = np.stack(plot.place(drawn[..., 0], drawn[..., 1]), axis=-1)
    parts = [_legend(), _trails(places, ends), _sample_dots(places[0], ends, step is not None)]
    if step is not None:
        parts.append(_moving_dots(places[max(step - 1, 0)], places[step], ends))
    if beyond := int((~near).sum()):
        parts.append(html("<text x='{}' y='14' text-anchor='end'>{} dearer →</text>", WIDTH - RIGHT, beyond))
    rings = [(float(x), float(y)) for x, y in zip(*plot.place(*refined.T), strict=True)]
    parts += _rings(rings, plot.floor, shown)
    return html("<div class='fl'>{}</div>", plot.drawn(parts, upright=True))


def _rings(places: list[Point], floor: float, shown: int) -> list[str]:
    """A ring where each mode lies, filled where it is on the robot, with its number beside it; the best one
    on top."""
    # What is between a ring and its number can be clicked, too.
    ring = (
        "<g class='pick' {}><path {} stroke='transparent' stroke-width='12'/>{}"
        "<circle cx='{:.1f}' cy='{:.1f}' r='{:g}' class='mode' stroke='{}' fill='{}'/>"
        "<text x='{:.1f}' y='{:.1f}' class='digit' text-anchor='middle'>{}</text></g>"
    )
    parts = []
    labels = _labels(places, floor)
    for k, ((x, y), (u, v)) in reversed(list(enumerate(zip(places, labels, strict=True)))):
        color, pressed = css(mode_color(k)), press("mode", str(k))
        way = html("d='M{:.1f} {:.1f}L{:.1f} {:.1f}'", x, y, u, v)
        line = html("<path {} stroke='{}'/>", way, color) if math.dist((x, y), (u, v)) > FAR_PX else ""
        fill = color if k == shown else "transparent"
        radius = RING + APART * sum(math.dist((x, y), place) < RING for place in places[:k])
        parts.append(html(ring, pressed, way, line, x, y, radius, color, fill, u, v + 3.8, k + 1))
    return parts


def _logarithm(error: Array) -> Array:
    return np.asarray(np.log10(np.maximum(error, EXACT)))


def _color(end: int, alpha: float) -> str:
    """Of a sample that ends at a mode, grey for none."""
    return css(DEAD if end < 0 else mode_color(end), alpha)


def _sample_dots(places: Array, ends: list[int], faint: bool) -> str:
    """Samples (K, 2) [px] as they were proposed."""
    dots = [
        f"<circle cx='{x:.1f}' cy='{y:.1f}' r='{DOT:g}' fill='{_color(end, 0.25 if faint else 0.7)}'/>"
        for (x, y), end in zip(places.tolist(), ends, strict=True)
    ]
    return Markup(f"<g class='samples'>{''.join(dots)}</g>")


def _moving_dots(before: Array, now: Array, ends: list[int]) -> str:
    """Samples (K, 2) [px] as they have been refined so far; a style lets them come from where they were."""
    dots = [
        f"<circle cx='{x:.1f}' cy='{y:.1f}' r='{DOT:g}' fill='{_color(end, 1.0)}' "
        f"style='--x:{u - x:.1f}px;--y:{v - y:.1f}px'/>"
        for (u, v), (x, y), end in zip(before.tolist(), now.tolist(), ends, strict=True)
    ]
    return Markup(f"<g class='moving'>{''.join(dots)}</g>")


def _trails(places: Array, ends: list[int]) -> str:
    """The ways of samples (steps, K, 2) [px]."""
    if len(places) == 1:
        return Markup()
    kept = places[[*(k for k in TRAIL if k < len(places) - 1), -1]].swapaxes(0, 1).round(1).tolist()
    lines = [
        f"<path d='M{'L'.join(f'{x:g} {y:g}' for x, y in way)}' stroke='{_color(end, 0.3)}'/>"
        for way, end in zip(kept, ends, strict=True)
    ]
    return Markup(f"<g class='trails'>{''.join(lines)}</g>")


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
            (dots, (width / 2 + RING, height / 2 + RING)),
            (np.array(labels or [(1e9, 1e9)]), LABEL),
        ):
            free &= ~(np.abs(rooms[:, None] - others) < gap).all(axis=2).any(axis=1)
        u, v = rooms[free][0] if free.any() else place
        labels.append((float(u), float(v)))
    return labels


def _legend() -> str:
    sign = "<circle cx='{}' cy='10' r='{}' stroke='currentColor' stroke-width='2' fill='{}'/>"
    looks = ((DOT - 1.0, "currentColor"), (RING - 1.0, "none"), (RING - 1.0, "currentColor"))
    parts = []
    for (word, place), look in zip(LEGEND, looks, strict=True):
        parts.append(html(sign, LEFT + place + 4, *look))
        parts.append(html("<text x='{}' y='14'>{}</text>", LEFT + place + 14, word))
    return Markup().join(parts)
