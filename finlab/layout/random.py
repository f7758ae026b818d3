"""Random layouts, in numpy: for held-out splits, tests and data on disk.

The numbers that define the training distribution (box, fin counts, spread of limits) are here and nowhere
else.
"""

import math
from typing import Literal

import numpy as np

from finlab.errors import DataError
from finlab.layout.fin import Fin, Limits
from finlab.layout.layout import Layout

TRAINING_BOX = (0.3, 0.3, 0.1)
"""Largest |x|, |y|, |z| of a fin in training and in split `id` [m]."""
TRAINING_FINS = (2, 5)
"""Least and most fins of a layout in training and in split `id`."""
AMPLITUDE_MAX_RANGE = (0.3, 0.8)
"""Where a varied amplitude maximum is drawn from [rad]."""
FREQUENCY_MAX_RANGE = (1.0, 3.0)
"""Where a varied frequency maximum is drawn from [Hz]."""
ARC_SHARE = 1.0 / 3.0
"""Share of fins with varied limits whose zero direction is confined to an arc."""
ARC_RANGE = (math.pi / 2, 1.5 * math.pi)
"""Where the width of such an arc is drawn from [rad]; the arc lies within [-pi, pi]."""


def random_layout(
    rng: np.random.Generator,
    name: str = "random",
    n_fins: int | tuple[int, int] = TRAINING_FINS,
    box: tuple[float, float, float] = TRAINING_BOX,
    limits: Literal["nominal", "varied"] = "nominal",
    outside: tuple[float, float, float] | None = None,
) -> Layout:
    """Returns a random layout with fins `fin_1`, `fin_2`, ...

    Positions are uniform in the box and angles in [-pi, pi). With `limits="varied"` every fin gets its own
    limits as in split `limits`.

    Args:
        rng: source of randomness.
        name: of the layout.
        n_fins: the fin count, or its least and most (uniform).
        box: largest |x|, |y|, |z| [m].
        limits: see above.
        outside: when given, at least one fin lies outside this smaller box.

    Raises:
        DataError: `outside` is not smaller than `box` in any direction, so no such layout exists.
    """
    least, most = (n_fins, n_fins) if isinstance(n_fins, int) else n_fins
    extent = np.array(box)
    if outside is not None and not np.any(extent > np.array(outside)):
        raise DataError(f"no fin within {box} can lie outside {outside}; make the first box larger")
    # As many fins are drawn as there could be, so that a seed's layouts stay what they are.
    count = int(rng.integers(least, most + 1, size=1)[0])
    while True:
        position = rng.uniform(-1.0, 1.0, (most, 3)) * extent
        if outside is None or (np.abs(position[:count]) > np.array(outside)).any():
            break
    angle = rng.uniform(-math.pi, math.pi, most)
    own = _varied_limits(rng, most) if limits == "varied" else [Limits()] * most
    fins = [Fin(f"fin_{i + 1}", tuple(position[i].tolist()), float(angle[i]), own[i]) for i in range(count)]
    return Layout(name=name, actuators=tuple(fins))


def _varied_limits(rng: np.random.Generator, count: int) -> list[Limits]:
    amplitude, frequency = rng.uniform(*AMPLITUDE_MAX_RANGE, count), rng.uniform(*FREQUENCY_MAX_RANGE, count)
    width = rng.uniform(*ARC_RANGE, count)
    center = rng.uniform(-1.0, 1.0, count) * (math.pi - width / 2)
    arc = rng.uniform(size=count) < ARC_SHARE
    nominal = Limits()
    return [
        Limits(
            (nominal.amplitude[0], float(amplitude[i])),
            (nominal.frequency[0], float(frequency[i])),
            (float(center[i] - width[i] / 2), float(center[i] + width[i] / 2))
            if arc[i]
            else nominal.zero_direction,
        )
        for i in range(count)
    ]
