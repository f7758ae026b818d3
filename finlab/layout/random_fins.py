"""Random fins: laws with numbers of their own, as wide as built fins of U-CAT's size may be."""

import math
from collections.abc import Callable

import numpy as np

from finlab.layout.fin import FinModelSpec

Draw = Callable[[np.random.Generator, float, float], float]
Numbers = dict[str, tuple[Draw, tuple[float, float]]]
"""Names of a fin model's numbers, how each is drawn and from where."""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Returns a number whose logarithm is uniform."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Returns a uniform number."""
    return float(rng.uniform(low, high))


FAMILIES: dict[str, Numbers] = {
    "drag": {"area": (log_uniform, (0.005, 0.04)), "lever": (log_uniform, (0.05, 0.15))},
    "lighthill": {"length": (log_uniform, (0.1, 0.3)), "width": (log_uniform, (0.05, 0.15))},
    "soft": {
        "k": (log_uniform, (1.0, 8.0)),
        "p": (uniform, (1.0, 2.0)),
        "x0": (uniform, (0.6, 1.5)),
        "q": (uniform, (3.0, 6.0)),
        "e": (uniform, (0.0, 0.2)),
        "phi_e": (uniform, (-math.pi, math.pi)),
        "d": (uniform, (-0.15, 0.15)),
    },
}
"""Fin model -> its numbers; what is not named stays as it is by default."""


def random_fin_model(
    rng: np.random.Generator, kind: str | None = None, families: dict[str, Numbers] = FAMILIES
) -> FinModelSpec:
    """Returns a fin with random numbers, of one kind or of each equally often."""
    kind = kind or str(rng.choice(list(families)))
    drawn = {name: draw(rng, *ends) for name, (draw, ends) in families[kind].items()}
    return FinModelSpec(kind, tuple(drawn.items()))
