"""The modes of an answer as numbered rings that can be picked, and what led to them: effort against
error.

The drawer of candidates (`panels/modes_tab.py`) shows the plot, for robots of fins. A network's
proposals travel from step to step of their refinement; each ends at one of the modes.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from finlab.arrays import Array
from webapp.handles import press
from webapp.markup.plot import EXACT, RIGHT, WIDTH, Plot, Point, cost_axis, error_axis
from webapp.markup.words import html
from webapp.tasks.solver import Modes
from webapp.theme import DEAD, MODE_COLORS, css

AXIS_LEFT = 54
"""Where the axis that goes up stands [px]."""
DEAREST = 2.0
"""Samples that cost more than the answer, and so many times the dearest other mode, are counted,
not drawn: modes keep apart."""
LEGEND = (("sample", 0), ("refined", 76), ("on the robot", 154))
"""Words, and how far each stands from the axis that goes up [px]."""
DOT_RADIUS = 3.0
"""Radius of a sample [px]."""
RING_RADIUS = 5.5
"""Radius of a mode's ring [px]."""
RING_GAP = 2.0
"""How much wider each further ring is that lies about another one [px]."""
LABEL_SIZE = (13.0, 14.0)
"""Width and height of the number of a mode [px]."""
LABEL_LIFT = 15.0
"""How far a number stands above the middle of its ring [px]."""
BASELINE = 3.8
"""How far the foot of a number lies below its middle [px]."""
TRAIL_STEPS = (0, 1, 2, 3, 4, 6, 8, 12, 20)
"""Steps of the refinement at which the path of a sample has a corner, beside the last one: early
steps are the longest."""


class Samples(NamedTuple):
    """The K proposals that are drawn, at each of the S steps of their refinement."""

    values: Array
    """Effort and logarithm of the error (S, K, 2)."""
    ends: list[int]
    """For each of them the mode at which it ends; -1 for none that is listed."""
    hidden: int
    """Proposals that are too dear to be drawn."""


def mode_plot(modes: Modes, shown_mode: int, step: int | None, height: int) -> str:
    """Effort, which the network's proposals keep least, against the error: samples are small dots
    with lines to where they end, modes are rings.

    Args:
        modes: the modes, and the proposals that led to them.
        shown_mode: index of the mode that is on the robot; its ring is filled, unless the robot
            shows a step on the way to it.
        step: after how many steps of refinement the samples are drawn; None for all steps.
        height: of the plot [px].

    Returns:
        Markup; nothing where there is no refinement, or a figure that is no number.
    """
    if not modes.visible or not modes.refinement:
        return ""
    effort = np.array([named.mode.effort for named in modes.visible])
    error = np.array([named.mode.err_norm for named in modes.visible])
    refined = np.stack([effort, _logarithm(error)], axis=1)
    samples = _samples(modes, effort)
    points = np.concatenate([refined, samples.values.reshape(-1, 2)])
    if not np.isfinite(points).all():
        return ""
    plot = Plot(cost_axis("effort", points[:, 0]), error_axis(points[:, 1]), height, AXIS_LEFT)
    pixels = np.stack(plot.place(samples.values[..., 0], samples.values[..., 1]), axis=-1)
    layers = [
        _legend(),
        _trails(pixels, samples.ends),
        _dots("samples", pixels[0], samples.ends, 0.7 if step is None else 0.25),
    ]
    if step is not None:
        previous = pixels[max(step - 1, 0)]
        layers.append(_dots("moving", pixels[step], samples.ends, 1.0, previous))
    if samples.hidden:
        note = "<text x='{}' y='14' text-anchor='end'>{} dearer →</text>"
        layers.append(html(note, WIDTH - RIGHT, samples.hidden))
    rings = [(float(x), float(y)) for x, y in zip(*plot.place(*refined.T), strict=True)]
    layers += _rings(rings, shown_mode if step is None else None)
    return html("<div class='fl'>{}</div>", plot.svg(layers, upright=True))


def _samples(modes: Modes, effort: Array) -> Samples:
    """The proposals whose effort is not far beyond that (M,) of the modes."""
    values = np.array([[step.effort, step.err_norm] for step in modes.refinement])
    values = values.swapaxes(1, 2)
    values[..., 1] = _logarithm(values[..., 1])
    others = effort[1:] if len(effort) > 1 else effort
    limit = max(float(effort.max()), DEAREST * float(others.max()))
    is_drawn: NDArray[np.bool_] = values[0, :, 0] <= limit
    ends = np.array(modes.ends or [-1] * len(is_drawn), dtype=int)
    assert ends.shape == is_drawn.shape, (ends.shape, is_drawn.shape)
    return Samples(
        values[:, is_drawn].clip(max=(limit, np.inf)),
        ends[is_drawn].tolist(),
        int((~is_drawn).sum()),
    )


def _rings(centers: list[Point], shown_mode: int | None) -> list[str]:
    """A ring where each mode lies, filled where it is on the robot, with its number above it; the
    first modes are drawn last, over the others."""
    ring = (
        "<g class='pick' {}>"
        "<circle cx='{:.1f}' cy='{:.1f}' r='{:g}' class='mode' stroke='{}' fill='{}'/>"
        "<text x='{:.1f}' y='{:.1f}' class='digit' text-anchor='middle'>{}</text></g>"
    )
    labels = _labels(centers)
    markup = []
    for k in reversed(range(len(centers))):
        center = centers[k]
        x, y = center
        label_x, label_y = labels[k]
        color = css(MODE_COLORS[k])
        fill = color if k == shown_mode else "transparent"
        inner = [other for other in centers[:k] if math.dist(center, other) < RING_RADIUS]
        radius = RING_RADIUS + RING_GAP * len(inner)
        target = press("mode", str(k))
        foot = label_y + BASELINE
        markup.append(html(ring, target, x, y, radius, color, fill, label_x, foot, k + 1))
    return markup


def _logarithm(error: Array) -> Array:
    """Logarithm of errors to base ten; all that count as exact have the same."""
    return np.asarray(np.log10(np.maximum(error, EXACT)))


@cache
def _color(mode: int, alpha: float) -> str:
    """Colour of the samples that end at a mode; -1 for none that is listed."""
    return css(DEAD if mode < 0 else MODE_COLORS[mode], alpha)


def _dots(
    group: str, centers: Array, ends: list[int], alpha: float, previous: Array | None = None
) -> str:
    """Samples as dots.

    Args:
        group: style class of all of them.
        centers: where they are (K, 2) [px].
        ends: the mode at which each ends, which gives its colour.
        alpha: opacity.
        previous: where they were before (K, 2) [px]: a style lets them come from there.
    """
    styles = [""] * len(ends)
    if previous is not None:
        shifts = (previous - centers).tolist()
        styles = [f" style='--x:{x:.1f}px;--y:{y:.1f}px'" for x, y in shifts]
    dots = [
        f"<circle cx='{x:.1f}' cy='{y:.1f}' r='{DOT_RADIUS:g}' "
        f"fill='{_color(mode, alpha)}'{style}/>"
        for (x, y), mode, style in zip(centers.tolist(), ends, styles, strict=True)
    ]
    return Markup(f"<g class='{group}'>{''.join(dots)}</g>")


def _trails(pixels: Array, ends: list[int]) -> str:
    """The paths of samples (S, K, 2) [px] through their refinement, to the mode at which each
    ends."""
    if len(pixels) == 1:
        return Markup()
    steps = [k for k in TRAIL_STEPS if k < len(pixels) - 1]
    corners = pixels[[*steps, -1]].swapaxes(0, 1).round()
    path = "L".join(["%g %g"] * corners.shape[1])
    coordinates = corners.reshape(-1, 2 * corners.shape[1]).tolist()
    lines = [
        f"<path d='M{path % tuple(numbers)}' stroke='{_color(mode, 0.3)}'/>"
        for numbers, mode in zip(coordinates, ends, strict=True)
    ]
    return Markup(f"<g class='trails'>{''.join(lines)}</g>")


def _labels(centers: list[Point]) -> list[Point]:
    """Where the numbers of rings stand: above them, and above each other's [px]."""
    labels: list[Point] = []
    for x, y in centers:
        level = y - LABEL_LIFT
        while _overlaps(x, level, labels):
            level -= 0.5 * LABEL_SIZE[1]
        labels.append((x, level))
    return labels


def _overlaps(x: float, y: float, labels: list[Point]) -> bool:
    """Whether a number at a point [px] would lie on one of others."""
    width, height = LABEL_SIZE
    for other_x, other_y in labels:
        if abs(x - other_x) < width and abs(y - other_y) < height:
            return True
    return False


@cache
def _legend() -> str:
    """Signs and words of what is drawn, above the plot."""
    sign = "<circle cx='{}' cy='10' r='{}' stroke='currentColor' stroke-width='2' fill='{}'/>"
    signs = (
        (DOT_RADIUS - 1.0, "currentColor"),
        (RING_RADIUS - 1.0, "none"),
        (RING_RADIUS - 1.0, "currentColor"),
    )
    markup = []
    for (word, offset), (radius, fill) in zip(LEGEND, signs, strict=True):
        markup.append(html(sign, AXIS_LEFT + offset + 4, radius, fill))
        markup.append(html("<text x='{}' y='14'>{}</text>", AXIS_LEFT + offset + 14, word))
    return Markup().join(markup)
