"""Capability plots as SVG: a curve by heading for the robot as it is, one for each single loss, the
worst of all losses as an area, and what each can hold at least."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from finlab.analysis.capability import Capability
from finlab.analysis.capability_text import shown_values
from finlab.arrays import Array
from webapp.markup.words import html
from webapp.theme import DEAD, DELIVERED, MISSING, Rgb, css, fin_color

WIDTH = 512
HEIGHT = 238
"""Size of the picture [px]."""
CENTER = (122.0, 119.0)
"""Middle of the polar plot [px]."""
RADIUS = 94.0
"""Radius of its largest ring [px]."""
MOST_RINGS = 4
"""Rings at most."""
HEADINGS = range(0, 360, 30)
"""Headings with a line and a label [deg]."""
LABEL_RADIUS = RADIUS + 12.0
"""How far from the middle the labels of headings stand [px]."""
KEY_LEFT = 244
"""Where the list of cases begins [px]."""
LEAST_RIGHT = 462
FROM_RIGHT = 508
"""Right ends of its two columns of numbers [px]."""
KEY_TOP = 32
ROW = 18
"""Where its first row stands, and the distance of rows [px]."""
MOST_ROWS = 11
"""Rows of the list; a robot with more losses has them in its files."""
DOT = 2.8
"""Radius of a dot [px]."""
MOST_LETTERS = 15
"""Letters of a name in the list; of a longer one the first are shown."""
BOW_UP = "M0 -15C5 -9 6 -4 6 2V11Q6 14 3 14H-3Q-6 14 -6 11V2C-6 -4 -5 -9 0 -15Z"
"""Outline of a ship from above, its bow up, about the middle of the plot [px]."""
OUTLINED = "paint-order='stroke' stroke='#fff' stroke-width='3' stroke-linejoin='round'"
"""Attributes of a text that is read above curves."""
FILE_STYLE = (
    "<style>text {{ font-family: sans-serif; font-size: 13px; }} .grid {{ stroke: #ccd3d8; "
    "fill: none; }} .dim {{ fill: #6a747c; }}</style>"
)
"""Style of a picture that stands alone; on the page the style sheet has it."""


class Curve(NamedTuple):
    """A closed curve by heading, and its row in the list."""

    name: str
    values: Array
    """Values (H,) in the unit that is shown."""
    color: Rgb
    width: float
    """Of its line [px]."""
    is_area: bool = False
    """Whether it is filled."""
    is_marked: NDArray[np.bool_] | None = None
    """Headings (H,) at which power is the limit, that have a dot; None for no dots."""


def polar_plot(capability: Capability, names: Sequence[str]) -> str:
    """Returns the picture of a plot, for the page.

    Args:
        capability: the plot.
        names: of all actuators of the robot, in order: a loss has the colour of its actuator.
    """
    frame = "<svg class='plot polar' viewBox='0 0 {} {}' role='img' aria-label='{}'>{}</svg>"
    label = f"Capability plot of {capability.layout}"
    return html(frame, WIDTH, HEIGHT, label, _layers(capability, names))


def polar_file(capability: Capability, names: Sequence[str]) -> str:
    """Returns the same picture as an SVG file; arguments as for `polar_plot`."""
    frame = (
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {} {}' width='{}' height='{}'>{}"
        "<rect width='100%' height='100%' fill='#fff'/>{}</svg>\n"
    )
    style = html(FILE_STYLE)
    return html(frame, WIDTH, HEIGHT, 2 * WIDTH, 2 * HEIGHT, style, _layers(capability, names))


def curves_of(capability: Capability, names: Sequence[str]) -> list[Curve]:
    """Returns the curves from the lowest to the uppermost: the worst single loss, each loss, and
    the robot as it is; arguments as for `polar_plot`."""
    scale = shown_values(capability).scale
    values = scale * capability.values
    limited: NDArray[np.bool_] | None = None
    limited_after: NDArray[np.bool_] | None = None
    if capability.buses:
        limited = np.asarray(capability.binding_buses[0].any(axis=-1))
        limited_after = np.asarray(capability.worst_binding_buses.any(axis=-1))
    curves = []
    if len(capability.cases) > 1:
        worst = scale * capability.worst
        curves.append(Curve("worst single loss", worst, MISSING, 2.4, True, limited_after))
    for case, row in zip(capability.cases[1:], values[1:], strict=True):
        is_one = len(case.lost) == 1 and case.lost[0] in names
        color = fin_color(list(names).index(case.lost[0])) if is_one else DEAD
        curves.append(Curve(f"without {case.name}", row, color, 1.6))
    curves.append(Curve("all actuators", values[0], DELIVERED, 2.6, is_marked=limited))
    return curves


def _layers(capability: Capability, names: Sequence[str]) -> list[str]:
    """Grid, curves and list of a plot."""
    curves = curves_of(capability, names)
    rings = _rings(max(float(curve.values.max(initial=0.0)) for curve in curves))
    order = np.argsort(np.asarray(capability.headings) % 360.0)
    angle = np.deg2rad(np.asarray(capability.headings)[order])
    layers = [_grid(rings)]
    for curve in curves:
        layers.append(_outline(curve, angle, curve.values[order] / rings[-1]))
    for curve in curves:
        if curve.is_marked is not None:
            marked = order[curve.is_marked[order]]
            turn = np.deg2rad(np.asarray(capability.headings)[marked])
            layers.append(_dots(curve, turn, curve.values[marked] / rings[-1]))
    layers.append(_ring_values(rings, shown_values(capability).unit))
    layers.append(_list(capability, curves))
    return layers


def _rings(largest: float) -> list[float]:
    """Round values of the rings, the last of which is not below the largest value."""
    if not (math.isfinite(largest) and largest > 0.0):
        return [1.0]
    decade = 10.0 ** math.floor(math.log10(largest / MOST_RINGS))
    step = decade
    for factor in (1.0, 2.0, 5.0, 10.0):
        step = factor * decade
        if math.ceil(largest / step - 1e-9) <= MOST_RINGS:
            break
    count = max(math.ceil(largest / step - 1e-9), 1)
    return [step * k for k in range(1, count + 1)]


def _grid(rings: Sequence[float]) -> str:
    """Rings, headings, and a ship whose bow is up."""
    x, y = CENTER
    markup = []
    for value in rings:
        radius = RADIUS * value / rings[-1]
        markup.append(html("<circle cx='{}' cy='{}' r='{:.1f}' class='grid'/>", x, y, radius))
    for heading in HEADINGS:
        across, down = _place(math.radians(heading), 1.0)
        markup.append(html("<path d='M{} {}L{:.1f} {:.1f}' class='grid'/>", x, y, across, down))
        across, down = _place(math.radians(heading), LABEL_RADIUS / RADIUS)
        label = "<text class='dim' x='{:.1f}' y='{:.1f}' text-anchor='middle'>{}°</text>"
        markup.append(html(label, across, down + 4.5, heading))
    markup.append(
        html("<path d='{}' transform='translate({} {})' class='dim ship'/>", BOW_UP, x, y)
    )
    return html("{}", markup)


def _ring_values(rings: Sequence[float], unit: str) -> str:
    """The values of the rings, above the curves."""
    markup = []
    for value in rings:
        across, down = _place(math.radians(45.0), value / rings[-1])
        words = f"{value:g} {unit}".rstrip() if value == rings[-1] else f"{value:g}"
        label = "<text class='dim ring' x='{:.1f}' y='{:.1f}' {}>{}</text>"
        markup.append(html(label, across + 2.0, down + 1.0, Markup(OUTLINED), words))
    return html("{}", markup)


def _place(angle: float, share: float) -> tuple[float, float]:
    """Where a share of the largest ring at an angle from the top, clockwise [rad], is drawn
    [px]."""
    x, y = CENTER
    return x + RADIUS * share * math.sin(angle), y - RADIUS * share * math.cos(angle)


def _outline(curve: Curve, angle: Array, share: Array) -> str:
    """A closed curve at angles (H,) [rad], at shares (H,) of the largest ring."""
    points = []
    for heading, value in zip(angle.tolist(), share.tolist(), strict=True):
        across, down = _place(heading, value)
        points.append(f"{across:.1f},{down:.1f}")
    fill = css(curve.color, 0.16) if curve.is_area else "none"
    shape = "<polygon points='{}' fill='{}' stroke='{}' stroke-width='{}' stroke-linejoin='round'/>"
    return html(shape, " ".join(points), fill, css(curve.color), curve.width)


def _dots(curve: Curve, angle: Array, share: Array) -> str:
    """Dots on a curve at angles (K,) [rad], at shares (K,) of the largest ring."""
    dots = []
    for heading, value in zip(angle.tolist(), share.tolist(), strict=True):
        across, down = _place(heading, value)
        dot = "<circle class='dot' cx='{:.1f}' cy='{:.1f}' r='{}' fill='{}'/>"
        dots.append(html(dot, across, down, DOT, css(curve.color)))
    return Markup().join(dots)


def _list(capability: Capability, curves: Sequence[Curve]) -> str:
    """What each curve is, the least that it holds, and from where; the robot as it is first."""
    shown = shown_values(capability)
    head = (
        "<text class='dim' x='{}' y='{}' text-anchor='end'>{}</text>"
        "<text class='dim' x='{}' y='{}' text-anchor='end'>from</text>"
    )
    unit = f" [{shown.unit}]" if shown.unit else ""
    y = KEY_TOP - ROW
    markup = [html(head, LEAST_RIGHT, y, f"least{unit}", FROM_RIGHT, y)]
    # As it is, the worst loss, and each loss.
    ordered = [curves[-1], *curves[:-1]]
    n_rows = MOST_ROWS - 1 if capability.buses else MOST_ROWS
    for k, curve in enumerate(ordered[:n_rows]):
        y = KEY_TOP + ROW * k
        weakest = int(curve.values.argmin())
        row = (
            "<rect x='{}' y='{}' width='16' height='5' rx='2' fill='{}'/>"
            "<text x='{}' y='{}'>{}<title>{}</title></text>"
            "<text x='{}' y='{}' text-anchor='end'>{}</text>"
            "<text x='{}' y='{}' text-anchor='end'>{:g}°</text>"
        )
        markup.append(
            html(
                row,
                KEY_LEFT,
                y - 7,
                css(curve.color),
                KEY_LEFT + 22,
                y,
                _short(curve.name),
                curve.name,
                LEAST_RIGHT,
                y,
                shown.digits(float(curve.values[weakest])),
                FROM_RIGHT,
                y,
                capability.headings[weakest],
            )
        )
    n_more = len(ordered) - n_rows
    if capability.buses:
        dot = (
            "<circle cx='{}' cy='{}' r='{}' fill='{}'/>"
            "<text class='dim' x='{}' y='{}'>limited by power</text>"
        )
        y = KEY_TOP + ROW * min(len(ordered), n_rows)
        markup.append(html(dot, KEY_LEFT + 8, y - 4.5, DOT, css(DELIVERED), KEY_LEFT + 22, y))
    if n_more > 0:
        y = KEY_TOP + ROW * MOST_ROWS
        more = "<text class='dim' x='{}' y='{}'>and {} more losses</text>"
        markup.append(html(more, KEY_LEFT + 22, y, n_more))
    return Markup().join(markup)


def _short(name: str) -> str:
    """A name that fits its column."""
    limit = MOST_LETTERS + len("without ")
    return name if len(name) <= limit else f"{name[: limit - 1]}…"
