"""The modes of an answer as numbered rings that can be picked, and what led to them: effort against
error."""

import math
from functools import cache

import numpy as np
from markupsafe import Markup

from finlab.arrays import Array
from webapp.handles import press
from webapp.markup.plot import EXACT, RIGHT, WIDTH, Plot, Point, cost_axis, error_axis
from webapp.markup.words import html
from webapp.tasks.solver import Modes
from webapp.theme import DEAD, MODE_COLORS, css

LEFT = 54
"""Where the axis that goes up stands [px]."""
FAR = 2.0
"""Samples that cost more than the answer, and so many times the dearest other mode, are counted,
not drawn: modes keep apart."""
LEGEND = (("sample", 0), ("refined", 76), ("on the robot", 154))
"""Words and places of what is drawn."""
DOT, RING = 3.0, 5.5
"""Radii of samples and of modes [px]."""
APART = 2.0
"""How much wider each further ring is that lies about another one [px]."""
LABEL = (13.0, 14.0)
"""Width and height of the number of a mode [px]."""
LIFT = 15.0
"""Of a number above the middle of its ring [px]."""
TRAIL = (0, 1, 2, 3, 4, 6, 8, 12, 20)
"""Steps at which the way of a sample is drawn, beside the last one."""


def mode_plot(modes: Modes, shown_mode: int, step: int | None, height: int) -> str:
    """Effort, which the network's proposals keep least, against the error: samples, after so many
    steps of refinement (None: all), are small dots with lines to where they end, modes are rings;
    `height` in px."""
    if not modes.visible or not modes.refinement:
        return ""
    error = np.array([named.mode.err_norm for named in modes.visible])
    effort = np.array([named.mode.effort for named in modes.visible])
    refined = np.stack([effort, _logarithm(error)], axis=1)
    raw = np.array([[way.effort, way.err_norm] for way in modes.refinement]).swapaxes(1, 2)
    raw[..., 1] = _logarithm(raw[..., 1])
    far = max(float(effort.max()), FAR * float(effort[len(effort) > 1 :].max()))
    near = raw[0, :, 0] <= far
    drawn = raw[:, near].clip(max=(far, np.inf))
    points = np.concatenate([refined, drawn.reshape(-1, 2)])
    if not np.isfinite(points).all():
        return ""
    plot = Plot(cost_axis("effort", points[:, 0]), error_axis(points[:, 1]), height, LEFT)
    ends = [
        end for end, kept in zip(modes.ends or [-1] * len(near), near.tolist(), strict=True) if kept
    ]
    places = np.stack(plot.place(drawn[..., 0], drawn[..., 1]), axis=-1)
    parts = [
        _legend(),
        _trails(places, ends),
        _dots("samples", places[0], ends, 0.7 if step is None else 0.25),
    ]
    if step is not None:
        parts.append(_dots("moving", places[step], ends, 1.0, places[max(step - 1, 0)]))
    if beyond := int((~near).sum()):
        parts.append(
            html("<text x='{}' y='14' text-anchor='end'>{} dearer →</text>", WIDTH - RIGHT, beyond)
        )
    rings = [(float(x), float(y)) for x, y in zip(*plot.place(*refined.T), strict=True)]
    parts += _rings(rings, shown_mode)
    return html("<div class='fl'>{}</div>", plot.drawn(parts, upright=True))


def _rings(places: list[Point], shown_mode: int) -> list[str]:
    """A ring where each mode lies, filled where it is on the robot, with its number above it."""
    ring = (
        "<g class='pick' {}><circle cx='{:.1f}' cy='{:.1f}' r='{:g}' class='mode' stroke='{}' "
        "fill='{}'/>"
        "<text x='{:.1f}' y='{:.1f}' class='digit' text-anchor='middle'>{}</text></g>"
    )
    parts = []
    labels = _labels(places)
    for k, ((x, y), (u, v)) in reversed(list(enumerate(zip(places, labels, strict=True)))):
        color = css(MODE_COLORS[k])
        fill = color if k == shown_mode else "transparent"
        under = [place for place in places[:k] if math.dist((x, y), place) < RING]
        radius = RING + APART * len(under)
        parts.append(
            html(ring, press("mode", str(k)), x, y, radius, color, fill, u, v + 3.8, k + 1)
        )
    return parts


def _logarithm(error: Array) -> Array:
    return np.asarray(np.log10(np.maximum(error, EXACT)))


@cache
def _color(end: int, alpha: float) -> str:
    return css(DEAD if end < 0 else MODE_COLORS[end], alpha)


def _dots(kind: str, now: Array, ends: list[int], alpha: float, before: Array | None = None) -> str:
    """Samples (K, 2) [px]; a style lets them come from where they were before."""
    way = [""] * len(ends)
    if before is not None:
        way = [f" style='--x:{x:.1f}px;--y:{y:.1f}px'" for x, y in (before - now).tolist()]
    dots = [
        f"<circle cx='{x:.1f}' cy='{y:.1f}' r='{DOT:g}' fill='{_color(end, alpha)}'{style}/>"
        for (x, y), end, style in zip(now.tolist(), ends, way, strict=True)
    ]
    return Markup(f"<g class='{kind}'>{''.join(dots)}</g>")


def _trails(places: Array, ends: list[int]) -> str:
    if len(places) == 1:
        return Markup()
    steps = [k for k in TRAIL if k < len(places) - 1]
    kept = places[[*steps, -1]].swapaxes(0, 1).round()
    way = "L".join(["%g %g"] * kept.shape[1])
    lines = [
        f"<path d='M{way % tuple(row)}' stroke='{_color(end, 0.3)}'/>"
        for row, end in zip(kept.reshape(-1, 2 * kept.shape[1]).tolist(), ends, strict=True)
    ]
    return Markup(f"<g class='trails'>{''.join(lines)}</g>")


def _labels(places: list[Point]) -> list[Point]:
    """Where the numbers of rings stand: above them, and above each other's."""
    labels: list[Point] = []
    width, height = LABEL
    for x, y in places:
        level = y - LIFT
        while [1 for u, v in labels if abs(x - u) < width and abs(level - v) < height]:
            level -= 0.5 * height
        labels.append((x, level))
    return labels


@cache
def _legend() -> str:
    """Signs and words of what is drawn, above the plot."""
    sign = "<circle cx='{}' cy='10' r='{}' stroke='currentColor' stroke-width='2' fill='{}'/>"
    looks = ((DOT - 1.0, "currentColor"), (RING - 1.0, "none"), (RING - 1.0, "currentColor"))
    parts = []
    for (word, place), look in zip(LEGEND, looks, strict=True):
        parts.append(html(sign, LEFT + place + 4, *look))
        parts.append(html("<text x='{}' y='14'>{}</text>", LEFT + place + 14, word))
    return Markup().join(parts)
