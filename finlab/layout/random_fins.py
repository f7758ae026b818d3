"""Random fins: laws with numbers of their own, as wide as built fins of U-CAT's size may be."""

import math

import numpy as np

from finlab.layout.fin import FinModelSpec

Numbers = dict[str, tuple[float, float]]
"""Names of a fin model's numbers, and from where each is drawn."""
LOGARITHMIC = ("area", "lever", "length", "width", "k")
"""Numbers whose logarithm is uniform; the others are uniform themselves."""
FAMILIES: dict[str, Numbers] = {
    "drag": {"area": (0.005, 0.04), "lever": (0.05, 0.15)},
    "lighthill": {"length": (0.1, 0.3), "width": (0.05, 0.15)},
    "soft": {
        "k": (1.0, 8.0),
        "p": (1.0, 2.0),
        "x0": (0.6, 1.5),
        "q": (3.0, 6.0),
        "e": (0.0, 0.2),
        "phi_e": (-math.pi, math.pi),
        "d": (-0.15, 0.15),
    },
}
"""Fin model -> its numbers; what is not named stays as it is by default."""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def random_fin_model(
    rng: np.random.Generator, kind: str | None = None, families: dict[str, Numbers] = FAMILIES
) -> FinModelSpec:
    """A fin with random numbers, of one kind or of each equally often."""
    kind = kind or str(rng.choice(list(families)))
    drawn = {
        name: log_uniform(rng, *ends) if name in LOGARITHMIC else float(rng.uniform(*ends))
        for name, ends in families[kind].items()
    }
    return FinModelSpec(kind, tuple(drawn.items()))
