"""The modes of an answer: cost against error, every mode a dot that can be picked, and a table."""

from collections.abc import Callable
from html import escape

import numpy as np

from finlab.allocation.allocation import Allocation
from webapp.markup.picking import pick, send
from webapp.markup.words import objective_of, small, source_words, three_digits
from webapp.tasks.mode_names import Modes
from webapp.theme import DEAD, Rgb, css, mode_color

WIDTH = 388
"""Width of the plot [px]."""
LEFT, RIGHT, TOP, BOTTOM = 54, 8, 24, 34
"""Margins of the plot [px]."""
MOST_TICKS = 6
"""Ticks of the cost at most."""
LEGEND = (("refined", 5.0, 6), ("on the robot", 0.0, 72), ("sampled", 2.6, 162))
"""Word, radius and place of what is drawn; radius 0 is the ring. The last one is for methods that sample."""
DOT = 9
"""Radius of the dot of a mode with its rim [px]."""
SAMPLES = "fl-sample"
"""Channel that hears which sample is clicked."""

Scale = Callable[[float], float]


def mode_plot(
    answer: Allocation,
    modes: Modes,
    shown: int | None,
    sample: int | None,
    height: int,
    picker: str,
) -> str:
    """What the method keeps least against error: raw samples as small dots, modes as numbered ones; all can
    be clicked.

    Args:
        answer: what the dots are of.
        modes: its modes, which give the samples their colours.
        shown: mode on the robot, None while it is another command.
        sample: sample on the robot.
        height: of the plot [px].
        picker: class of the marker before the buttons that choose a mode, and of the channel for samples.
    """
    samples = answer.samples
    if not modes.shown:
        return ""
    power = objective_of(answer) == "power"
    refined = np.array([mode.power if power else mode.energy for mode, _ in modes.shown])
    raw = np.empty(0) if samples is None else samples.power if power else samples.energy
    cost, error = np.append(refined, raw), np.array([mode.err_norm for mode, _ in modes.shown])
    if samples is not None:
        error = np.append(error, samples.err_norm)
    if not np.isfinite(cost).all() or not np.isfinite(error).all():
        return ""
    low, high = float(cost.min()), float(cost.max())
    margin = max(0.06 * (high - low), 0.02 * high, 1e-6)
    low, high = low - margin, high + margin
    bottom = float(np.floor(np.log10(max(error.min(), 1e-10))))
    top = max(float(np.ceil(np.log10(max(error.max(), 1e-10)))), bottom + 1)

    def x(value: float) -> float:
        return LEFT + (value - low) / (high - low) * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        share = (np.log10(max(value, 10.0**bottom)) - bottom) / (top - bottom)
        return float(height - BOTTOM - (0.06 + 0.88 * share) * (height - BOTTOM - TOP))

    parts = [_legend(samples is not None), _axes(x, y, (low, high), (int(bottom), int(top)), height)]
    parts.append(_axis_words("power [W]" if power else "effort", height))
    if samples is not None:
        pick_sample = send(f"{picker}-{SAMPLES}", "event.target.dataset.k + ',' + Date.now()")
        colors = sample_colors(modes, len(raw))
        dots = [
            f"<circle data-k='{k}' cx='{x(c):.1f}' cy='{y(r):.1f}' r='3' fill='{css(color, 0.6)}'/>"
            for k, (c, r, color) in enumerate(zip(raw, samples.err_norm, colors, strict=True))
        ]
        click = f"if (event.target.dataset.k) {{ {pick_sample} }}"
        parts.append(f'<g class="pick samples" onclick="{click}">{"".join(dots)}</g>')
        if sample is not None and sample < len(dots):
            parts.append(_ring(x(float(raw[sample])), y(float(samples.err_norm[sample])), 6.5))
    places = _apart([(x(c), y(r)) for c, r in zip(refined.tolist(), error.tolist(), strict=False)])
    for k, (cx, cy) in reversed(list(enumerate(places))):  # the best one on top
        parts.append(
            f"<g class='pick' {pick(picker, k)}>"
            f"<circle cx='{cx:.1f}' cy='{cy:.1f}' r='8.5' fill='{css(mode_color(k))}'/>"
            f"<text x='{cx:.1f}' y='{cy + 3.8:.1f}' class='digit'>{k + 1}</text></g>"
        )
        if k == shown:
            parts.append(_ring(cx, cy, 11))
    return f"<div class='fl'><svg class='plot' viewBox='0 0 {WIDTH} {height}'>{''.join(parts)}</svg></div>"


def sample_colors(modes: Modes, count: int) -> list[Rgb]:
    """The colour of each of `count` samples: that of the mode which its component led to, grey for none."""
    kinds = [-1] * count if modes.of_samples is None else modes.of_samples.tolist()
    return [DEAD if kind < 0 else mode_color(kind) for kind in kinds]


def _ring(x: float, y: float, radius: float) -> str:
    return f"<circle class='ring' cx='{x:.1f}' cy='{y:.1f}' r='{radius:g}'/>"


def _apart(places: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Dots moved sideways, no further than need be and within the plot, so that each can be clicked."""
    apart: list[tuple[float, float]] = []
    for x, y in places:
        rooms = [x + side * step for step in range(0, WIDTH, 2) for side in (1, -1)]
        free = (
            room
            for room in rooms
            if LEFT + DOT <= room <= WIDTH - RIGHT - DOT
            and not any(abs(room - u) < 2 * DOT and abs(y - v) < 2 * DOT for u, v in apart)
        )
        apart.append((next(free, x), y))
    return apart


def _legend(sampled: bool) -> str:
    parts = []
    for word, radius, place in LEGEND if sampled else LEGEND[:-1]:
        dot = f"<circle cx='{LEFT + place}' cy='10' r='{radius}' fill='currentColor' opacity='.55'/>"
        parts.append(dot if radius else _ring(LEFT + place, 10, 5.5))
        parts.append(f"<text x='{LEFT + place + 9}' y='14'>{word}</text>")
    return "".join(parts)


def _axes(x: Scale, y: Scale, costs: tuple[float, float], powers: tuple[int, int], height: int) -> str:
    """The grid, with the cost below and powers of ten of the error at the left."""
    floor = height - BOTTOM
    parts = []
    bottom, top = powers
    for power in range(bottom, top + 1, max(1, round((top - bottom) / 5))):
        at, digits = y(10.0**power), str(power).replace("-", "−")
        parts.append(f"<path d='M{LEFT} {at:.1f}H{WIDTH - RIGHT}' class='grid'/>")
        label = f"10<tspan dy='-4' font-size='8'>{digits}</tspan>"
        parts.append(f"<text x='{LEFT - 5}' y='{at + 4:.1f}' text-anchor='end'>{label}</text>")
    low, high = costs
    decade = 10.0 ** np.floor(np.log10((high - low) / MOST_TICKS))
    step = next(s * decade for s in (1.0, 2.0, 5.0, 10.0) if (high - low) / (s * decade) <= MOST_TICKS)
    for k in range(int(np.ceil(low / step)), int(high / step) + 1):
        at = x(k * step)
        parts.append(f"<path d='M{at:.1f} {TOP}V{floor}' class='grid'/>")
        parts.append(f"<text x='{at:.1f}' y='{floor + 14}' text-anchor='middle'>{k * step:.3g}</text>")
    return "".join(parts)


def _axis_words(cost: str, height: int) -> str:
    turned = f"translate(10 {(TOP + height - BOTTOM) / 2}) rotate(-90)"
    return (
        f"<text x='{(LEFT + WIDTH) / 2}' y='{height - 5}' text-anchor='middle'>{cost}</text>"
        f"<text transform='{turned}' text-anchor='middle'>error [σ]</text>"
    )


def mode_table(modes: Modes, searching: bool, shown: int | None, picker: str) -> str:
    """Name and origin, error, power, effort and use of the limits of each mode.

    Args:
        modes: an answer's modes.
        searching: whether more may be found.
        shown: which mode moves the fins, None while another command does.
        picker: class of the marker before the buttons that a click on a row presses.
    """
    if not modes.shown:
        return "<div class='fl dim'>This method gives one answer and no candidates.</div>"
    rows = []
    for k, (mode, name) in enumerate(modes.shown):
        kind = "chosen" if k == shown else ""
        origin = f"<div class='dim'>{escape(source_words(mode.sources))}</div>"
        origin = f"<div class='dim'>{escape(source_words(mode.sources))}</div>"
        rows.append(
            f"<tr class='{kind} pick' {pick(picker, k)}><td>{_swatch(k)}</td>"
            f"<td class='words'>{escape(name)}{origin}</td>"
            f"<td>{small(mode.err_norm)}</td><td>{three_digits(mode.power)}</td>"
            f"<td>{three_digits(mode.energy)}</td><td>{100 * mode.saturation:.0f} %</td></tr>"
        )
    header = (
        "<tr><th>#</th><th class='words'>mode</th><th>error [σ]</th><th>power&nbsp;[W]</th><th>effort</th>"
        "<th title='largest share of a range of amplitude or frequency that is used'>used</th></tr>"
    )
    left = modes.count - len(modes.shown)
    told = "looking for more …" if searching else f"{left} more are known; they come after these."
    more = f"<div class='said dim'>{told}</div>" if searching or left > 0 else ""
    return f"<div class='fl'><table class='modes'>{header}{''.join(rows)}</table>{more}</div>"


def _swatch(k: int) -> str:
    return f"<span class='swatch mode' style='background:{css(mode_color(k))}'>{k + 1}</span>"
