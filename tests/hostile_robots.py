"""Robots that are valid but hostile: degenerate limits, geometry and fin models.

The library's makers (`finlab/research/random_layouts.py`) draw robots that somebody could build;
these lie on the borders of what a layout file may hold.
"""

import math
from collections.abc import Sequence

import numpy as np

from finlab.actuators.fin.fin_model import (
    FIN_MODELS,
    LEAST,
    LEAST_WIDTH,
    MAX_AMPLITUDE,
    MAX_FREQUENCY,
)
from finlab.arrays import Array
from finlab.layout import Fin, FinModelSpec, Layout, Limits

DOMAIN = 0xF022
"""Leads the seed of every robot."""
GEOMETRIES = ("box", "far", "origin", "coincident", "collinear", "parallel", "nearly parallel")
"""How fins stand to each other."""
RANGES = ("nominal", "fixed", "from zero", "tiny", "large", "narrow")
"""What ranges of amplitude and frequency there are."""
ARCS = (
    "full",
    "fixed",
    "narrow",
    "almost full",
    "within a turn",
    "past the seam",
    "ends at zero",
    "shifted full",
)
"""What arcs of zero directions there are."""


def hostile_robot(number: int, seed: int) -> Layout:
    """Robot `number` of a seed: 1 to 16 fins, each robot with a mixture of degeneracies of its own.

    Args:
        number: which robot.
        seed: of the whole set.
    """
    rng = np.random.default_rng([DOMAIN, seed, number])
    n = int(rng.choice([1, 2, 3, 4, 5, 6, 8, 12, 16]))
    position, angle = _places(rng, str(rng.choice(GEOMETRIES)), n)
    ranges = rng.choice(RANGES, size=int(rng.integers(1, 4)))
    arcs = rng.choice(ARCS, size=int(rng.integers(1, 4)))
    models = _models(rng)
    fins = (
        Fin(
            f"fin_{i}",
            (float(position[i, 0]), float(position[i, 1]), float(position[i, 2])),
            float(angle[i]),
            Limits(
                _range(
                    rng, str(rng.choice(ranges)), (0.05, 0.6), LEAST["amplitude"], MAX_AMPLITUDE
                ),
                _range(rng, str(rng.choice(ranges)), (0.1, 2.1), LEAST["frequency"], MAX_FREQUENCY),
                _arc(rng, str(rng.choice(arcs))),
            ),
            models[int(rng.integers(len(models)))],
        )
        for i in range(n)
    )
    return Layout(f"hostile {number}", tuple(fins))


def _places(rng: np.random.Generator, geometry: str, n: int) -> tuple[Array, Array]:
    """Positions (n, 3) [m] and mounting angles (n,) [rad]."""
    position = rng.uniform(-1.0, 1.0, (n, 3)) * [0.3, 0.3, 0.1]
    angle = rng.uniform(-math.pi, math.pi, n)
    if geometry == "far":
        position *= rng.uniform(3.0, 10.0) / np.abs(position).max()
    elif geometry == "origin":
        position[:] = 0.0
    elif geometry == "coincident":
        position[:] = position[0]
        angle[:] = angle[0]
    elif geometry == "collinear":
        position = np.linspace(-1.0, 1.0, n)[:, None] * position[0]
    elif geometry == "parallel":
        angle[:] = angle[0]
    elif geometry == "nearly parallel":
        angle = angle[0] + rng.normal(size=n) * 1e-9
    return position, angle


def _range(
    rng: np.random.Generator, kind: str, nominal: tuple[float, float], least: float, most: float
) -> tuple[float, float]:
    """Minimum and maximum of an amplitude [rad] or a frequency [Hz]."""
    low, high = nominal
    if kind == "fixed":
        value = float(rng.uniform(low, most))
        return value, value
    if kind == "from zero":
        return 0.0, high
    if kind == "tiny":
        high = float(rng.choice([least, least * 10.0 ** rng.uniform(0.0, 2.0)]))
        return float(rng.choice([0.0, max(least, 0.5 * high), high])), high
    if kind == "large":
        return float(rng.choice([0.0, low, 0.9 * most])), most
    if kind == "narrow":
        return high - _width(rng), high
    return nominal


def _width(rng: np.random.Generator) -> float:
    """Width of a narrow range [rad, Hz]."""
    return 1.01 * LEAST_WIDTH * 10.0 ** float(rng.choice([0.0, rng.uniform(0.0, 4.0)]))


def _arc(rng: np.random.Generator, kind: str) -> tuple[float, float]:
    """First and last zero direction [rad]."""
    start = float(rng.uniform(-math.pi, math.pi))
    if kind == "fixed":
        return start, start
    if kind == "narrow":
        return start, start + _width(rng)
    if kind == "almost full":
        short = float(rng.choice([1e-3, 1e-4, 1e-5, 2e-6, 1e-6, 1e-7, 1e-9]))
        return -math.pi, math.pi - short
    if kind == "within a turn":
        return start, start + float(rng.uniform(0.01, 1.0)) * (math.pi - start)
    if kind == "past the seam":
        return float(rng.uniform(1.0, 3.0)), float(rng.uniform(3.2, 2 * math.pi))
    if kind == "ends at zero":
        return -float(rng.uniform(0.1, 3.0)), float(rng.choice([0.0, 1e-6]))
    if kind == "shifted full":
        start = float(rng.choice([-2 * math.pi, 0.0, -1.0]))
        return start, start + 2 * math.pi
    return -math.pi, math.pi


def _extreme(rng: np.random.Generator, kind: str) -> FinModelSpec:
    """A fin whose parameters are anywhere within their bounds, many at one of them."""
    values = []
    for name, rule in FIN_MODELS[kind].items():
        drawn = float(rng.uniform(rule.low, rule.high))
        if rule.low > 0.0:
            drawn = float(rule.low * (rule.high / rule.low) ** rng.random())
        values.append((name, float(rng.choice([rule.low, rule.default, drawn, rule.high]))))
    return FinModelSpec(kind, tuple(values))


def _models(rng: np.random.Generator) -> Sequence[FinModelSpec]:
    """The fin models of one robot: one kind, or a mixture."""
    large = float(rng.uniform(1.0, 5.0))
    kinds = [
        FinModelSpec(),
        FinModelSpec("drag", (("area", 0.04 * large), ("lever", 0.1 * large))),
        FinModelSpec("lighthill", (("length", 0.2 * large), ("width", 0.1 * large))),
        FinModelSpec("soft", (("k", 8.0 * large),)),
        *(_extreme(rng, kind) for kind in ("drag", "lighthill", "soft")),
    ]
    chosen = int(rng.integers(len(kinds) + 2))
    return kinds if chosen >= len(kinds) else [kinds[chosen]]
