"""What a network proposes: for each fin a disc with the forces that the samples of the mixture ask of it."""

from html import escape

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.allocation.solution import Candidates
from finlab.arrays import Array
from finlab.physics import plant_of
from webapp.markup.answer import swatch
from webapp.markup.mode_plot import FAR, sample_colors
from webapp.markup.words import three_digits
from webapp.tasks.mode_names import Modes
from webapp.theme import css, fin_color

RADIUS = 40.0
"""Of a disc [px]."""
EDGE = 46.0
"""Half of the square around it [px]."""
SAID = (
    "Each dot is the force that one sample of the mixture asks of the fin, in the fin's own plane: right is "
    "its horizontal thrust axis. The line is the answer. A sample has the colour of the mode that its "
    "component led to, and is grey where what came of it was not kept."
)


def asked_of_fins(answer: Allocation, samples: Candidates) -> tuple[Array, Array, float]:
    """Forces [N] of K samples (K, n, 2) and of the answer (n, 2) in its fins' planes; the largest drawn."""
    plant = plant_of(answer.layout)
    dots, given = (plant.forces(command)[..., 1:] for command in (samples.command, answer.command))
    return dots, given, FAR * max(float(np.nanmax(np.linalg.norm(given, axis=-1))), 1e-3)


def proposal_discs(answer: Allocation, modes: Modes) -> str:
    """One disc for each working fin; nothing for methods that draw no samples.

    Args:
        answer: whose samples are drawn.
        modes: its modes, which give the samples their colours.
    """
    samples = answer.samples
    if samples is None:
        return ""
    dots, given, rim = asked_of_fins(answer, samples)
    # What is beyond the rim stands on it.
    dots, given = dots / np.maximum(np.linalg.norm(dots, axis=-1, keepdims=True), rim), given / rim
    dots, given = dots * RADIUS, given * RADIUS
    colors = [css(color, 0.6) for color in sample_colors(modes, len(samples))]
    discs = []
    for i, name in enumerate(answer.layout.names):
        if np.isfinite(answer.command[i, 0]):
            label = f"{swatch(i)}<span class='name' title='{escape(name)}'>{escape(name)}</span>"
            discs.append(f"<div>{_disc(dots[:, i], colors, given[i], css(fin_color(i)))}{label}</div>")
    said = f"{SAID} The rim is {three_digits(rim)} N; what is beyond stands on it."
    return f"<div class='fl'><div class='dim'>{said}</div><div class='discs'>{''.join(discs)}</div></div>"


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
