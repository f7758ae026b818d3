"""The plot of an answer's modes: energy against error, every mode a dot that can be picked."""

from collections.abc import Callable

import numpy as np

from finlab.allocation.allocation import Allocation
from webapp.markup.picking import pick
from webapp.modes import Mode
from webapp.theme import DELIVERED, SKY, VERMILLION, css

WIDTH = 388
"""Width of the plot [px]."""
LEFT, RIGHT, TOP, BOTTOM = 54, 8, 24, 34
"""Margins of the plot [px]."""
STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 1e9)
"""Distances that ticks of the energy may have."""
LEGEND = (("sampled", SKY, 2.4, 6), ("refined", DELIVERED, 5.0, 74), ("on the robot", VERMILLION, 5.0, 140))
"""Word, colour, radius and place of what is drawn."""

Scale = Callable[[float], float]


def mode_plot(answer: Allocation, modes: tuple[Mode, ...], shown: int, height: int, picker: str) -> str:
    """Energy against error: raw samples as small dots, modes as numbered ones to click on."""
    samples, refined = answer.samples, answer.candidates
    if refined is None or not modes:
        return ""
    index = [mode.index for mode in modes]
    groups = [refined] if samples is None else [refined, samples]
    energy = np.concatenate([group.energy for group in groups])
    error = np.concatenate([group.err_norm for group in groups])
    if not np.isfinite(energy).all() or not np.isfinite(error).all():
        return ""
    low, high = float(energy.min()), float(energy.max())
    margin = max(0.06 * (high - low), 0.05)
    low, high = low - margin, high + margin
    bottom = float(np.floor(np.log10(max(error.min(), 1e-10))))
    top = max(float(np.ceil(np.log10(max(error.max(), 1e-10)))), bottom + 1)

    def x(value: float) -> float:
        return LEFT + (value - low) / (high - low) * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        share = (np.log10(max(value, 10.0**bottom)) - bottom) / (top - bottom)
        return float(height - BOTTOM - (0.06 + 0.88 * share) * (height - BOTTOM - TOP))

    parts = [_axes(x, y, (low, high), (int(bottom), int(top)), height)]
    if samples is not None:
        parts += [
            f"<circle cx='{x(e):.1f}' cy='{y(r):.1f}' r='2.4' fill='{css(SKY, 0.75)}'/>"
            for e, r in zip(samples.energy, samples.err_norm, strict=True)
        ]
    places = _apart([(x(float(refined.energy[i])), y(float(refined.err_norm[i]))) for i in index])
    for k, (cx, cy) in reversed(list(enumerate(places))):  # the best one on top
        color = css(VERMILLION if k == shown else DELIVERED)
        parts.append(
            f"<g class='pick' {pick(picker, k)}><circle cx='{cx:.1f}' cy='{cy:.1f}' r='8.5' fill='{color}'/>"
            f"<text x='{cx:.1f}' y='{cy + 3.8:.1f}' class='digit'>{k + 1}</text></g>"
        )
    return f"<div class='fl'><svg class='plot' viewBox='0 0 {WIDTH} {height}'>{''.join(parts)}</svg></div>"


def _apart(places: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Dots moved sideways until none covers another, so that each can be clicked."""
    apart: list[tuple[float, float]] = []
    for x, y in places:
        while any(abs(x - u) < 18 and abs(y - v) < 18 for u, v in apart):
            x += 2.0
        apart.append((x, y))
    return apart


def _axes(x: Scale, y: Scale, energies: tuple[float, float], powers: tuple[int, int], height: int) -> str:
    floor = height - BOTTOM
    parts = [
        f"<circle cx='{LEFT + place}' cy='10' r='{radius}' fill='{css(color)}'/>"
        f"<text x='{LEFT + place + 9}' y='14'>{word}</text>"
        for word, color, radius, place in LEGEND
    ]
    bottom, top = powers
    for power in range(bottom, top + 1, max(1, round((top - bottom) / 5))):
        at, digits = y(10.0**power), str(power).replace("-", "−")
        parts.append(f"<path d='M{LEFT} {at:.1f}H{WIDTH - RIGHT}' class='grid'/>")
        label = f"10<tspan dy='-4' font-size='8'>{digits}</tspan>"
        parts.append(f"<text x='{LEFT - 5}' y='{at + 4:.1f}' text-anchor='end'>{label}</text>")
    low, high = energies
    step = next(s for s in STEPS if (high - low) / s <= 6)
    for k in range(int(np.ceil(low / step)), int(high / step) + 1):
        at = x(k * step)
        parts.append(f"<path d='M{at:.1f} {TOP}V{floor}' class='grid'/>")
        parts.append(f"<text x='{at:.1f}' y='{floor + 14}' text-anchor='middle'>{k * step:.3g}</text>")
    parts.append(f"<text x='{(LEFT + WIDTH) / 2}' y='{height - 5}' text-anchor='middle'>energy</text>")
    turned = f"translate(10 {(TOP + floor) / 2}) rotate(-90)"
    parts.append(f"<text transform='{turned}' text-anchor='middle'>error [σ]</text>")
    return "".join(parts)
