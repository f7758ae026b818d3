"""What a fin gives within its limits: thrust over frequency at three amplitudes."""

from functools import lru_cache

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout import Fin
from finlab.layout.fin import FinModelSpec, Limits
from finlab.physics import make_law
from webapp.markup.html import html
from webapp.markup.plot import Plot, cost_axis, positive
from webapp.theme import BLUE, GREEN, ORANGE

HEIGHT = 150
"""Height of the plot [px]."""
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
    across = cost_axis("frequency [Hz]", frequency)
    least = float(frequency[0])
    across = across._replace(low=least, ticks=tuple(tick for tick in across.ticks if tick[0] >= least))
    plot = Plot(across, positive("thrust [N]", np.array([1e-6, thrust.max()])), HEIGHT)
    parts = []
    for k, (size, curve, color) in enumerate(zip(amplitude, thrust, COLORS, strict=True)):
        parts += [plot.curve(frequency, curve, color), plot.key(104 * k, color, f"A {size:.2f} rad")]
    return html("<div class='fl'>{}</div>", plot.drawn(parts))


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
