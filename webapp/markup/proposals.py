"""What a network proposes: for each fin a disc with the forces that the samples of the mixture ask of it."""

from html import escape

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.allocation import Allocation
from finlab.physics import plant_of
from webapp.markup.answer import swatch
from webapp.markup.modes import sample_colors
from webapp.tasks.mode_names import Modes
from webapp.theme import css, fin_color

RADIUS = 40.0
"""Of a disc [px]."""
EDGE = 46.0
"""Half of the square around it [px]."""
SAID = (
    "Each dot is the force that one sample of the mixture asks of the fin, in the fin's own plane: right is "
    "its horizontal thrust axis, the rim its full thrust. The line is the answer. A sample has the colour of "
    "the mode that its component led to, and is grey where that led to none."
)

Array = NDArray[np.float64]


def proposal_discs(answer: Allocation, modes: Modes, full: Array) -> str:
    """One disc for each working fin; nothing for methods that draw no samples.

    Args:
        answer: whose samples are drawn.
        modes: its modes, which give the samples their colours.
        full: full thrust (n,) of each fin [N], the rim of its disc.
    """
    samples = answer.samples
    if samples is None:
        return ""
    plant = plant_of(answer.layout)
    scale = (RADIUS / np.maximum(full, 1e-9))[:, None]
    dots = plant.forces(samples.command)[..., 1:] * scale
    given = plant.forces(answer.command)[..., 1:] * scale
    colors = [css(color, 0.6) for color in sample_colors(modes, len(samples))]
    discs = []
    for i, name in enumerate(answer.layout.names):
        if np.isfinite(answer.command[i, 0]):
            label = f"{swatch(i)}<span class='name' title='{escape(name)}'>{escape(name)}</span>"
            discs.append(f"<div>{_disc(dots[:, i], colors, given[i], css(fin_color(i)))}{label}</div>")
    return f"<div class='fl'><div class='dim'>{SAID}</div><div class='discs'>{''.join(discs)}</div></div>"


def _disc(dots: Array, colors: list[str], given: Array, color: str) -> str:
    """A fin's plane with the samples' forces (K, 2) and the answer's (2,) [px]."""
    x, y = given[0], -given[1]
    parts = [
        f"<circle r='{RADIUS}' class='rim'/>",
        f"<path d='M{-RADIUS} 0H{RADIUS}M0 {-RADIUS}V{RADIUS}' class='grid'/>",
        f"<path d='M0 0L{x:.1f} {y:.1f}' stroke='{color}' stroke-width='3' stroke-linecap='round'/>",
        *(
            f"<circle cx='{h:.1f}' cy='{-v:.1f}' r='2' fill='{fill}'/>"
            for (h, v), fill in zip(dots, colors, strict=True)
        ),
    ]
    return f"<svg viewBox='{-EDGE} {-EDGE} {2 * EDGE} {2 * EDGE}'>{''.join(parts)}</svg>"
