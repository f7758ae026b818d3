"""What a fin gives within its limits: thrust over frequency at three amplitudes."""

from functools import lru_cache

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout import Fin
from finlab.layout.fin import FinModelSpec, Limits
from finlab.physics import make_law
from webapp.markup.html import html
from webapp.markup.mode_plot import BOTTOM, RIGHT, TOP, WIDTH, axes, cost_axis
from webapp.theme import BLUE, GREEN, ORANGE, css

LEFT, HEIGHT = 44, 150
"""Left margin and height of the plot [px]."""
SHARES, COLORS = (1.0, 2 / 3, 1 / 3), (ORANGE, GREEN, BLUE)
"""Of the largest amplitude, and the colours of their curves."""
POINTS = 41
"""Frequencies of a curve."""


def thrust_curves(fin: Fin) -> str:
    """The plot of one fin; nothing where its table cannot be read, which is reported elsewhere."""
    try:
        amplitude, frequency, thrust = thrust_within(fin.model, fin.limits)
    except DataError:
        return ""
    least, most = frequency[0], frequency[-1]
    high = most + 0.02 * (most - least) + 1e-9
    across = cost_axis("frequency [Hz]", frequency)._replace(low=least, high=high)
    up = cost_axis("thrust [N]", np.array([0.0, max(1e-6, thrust.max())]))._replace(low=0.0)
    across = across._replace(ticks=tuple(tick for tick in across.ticks if tick[0] >= least))

    def x(value: float) -> float:
        return LEFT + across.share(value) * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        return HEIGHT - BOTTOM - up.share(value) * (HEIGHT - BOTTOM - TOP)

    parts = [axes(across, up, LEFT, HEIGHT, upright=False)]
    for k, (size, curve, color) in enumerate(zip(amplitude, thrust, COLORS, strict=True)):
        way = " ".join(f"{x(f):.1f},{y(t):.1f}" for f, t in zip(frequency, curve, strict=True))
        parts.append(
            html("<polyline points='{}' fill='none' stroke='{}' stroke-width='2'/>", way, css(color))
        )
        place = LEFT + 104 * k
        parts.append(html("<rect x='{}' y='7' width='14' height='5' rx='2' fill='{}'/>", place, css(color)))
        parts.append(html("<text x='{}' y='14'>A {:.2f} rad</text>", place + 19, size))
    return html("<div class='fl'><svg class='plot' viewBox='0 0 {} {}'>{}</svg></div>", WIDTH, HEIGHT, parts)


@lru_cache(maxsize=64)
def thrust_within(model: FinModelSpec, limits: Limits) -> tuple[Array, Array, Array]:
    """Amplitudes (3,) [rad], frequencies (F,) [Hz], and the size of the mean force (3, F) [N] in the middle
    of the zero directions.

    Raises:
        DataError: the fin is a table that cannot be read.
    """
    amplitude = np.array(SHARES) * limits.amplitude[1]
    frequency = np.linspace(*limits.frequency, POINTS)
    command = np.zeros((len(SHARES), POINTS, 1, 3))
    command[..., 0, 0], command[..., 0, 1] = amplitude[:, None], frequency
    command[..., 0, 2] = np.mean(limits.zero_direction)
    force = make_law(model).force(command)
    return amplitude, frequency, np.linalg.norm(force[..., 0, :], axis=-1)
