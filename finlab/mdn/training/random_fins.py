"""Random fins to learn from: laws with a formula over wide ranges, and tables of fins that have none.

Nothing here is a fin that is evaluated: those are drawn by other generators, from other seeds.
"""

import math
from dataclasses import dataclass

import numpy as np

from finlab.actuators.fin.blade import Blade
from finlab.actuators.fin.models import make_law
from finlab.actuators.fin.table import TableLaw
from finlab.actuators.law import FinLaw
from finlab.layout import FinModelSpec, Limits
from finlab.layout.random import random_layout
from finlab.layout.random_fins import Numbers, log_uniform, random_fin_model
from finlab.mdn.effort_fin import EffortFin, compile_fin
from finlab.physics.effort import DEFAULT_WEIGHTS

WEAKEST = 1e-2
"""Largest force [N] of the weakest fin worth learning from."""
GRID = (7, 9, 12)
"""Amplitudes, frequencies and zero directions of a random table."""


SHARES = {"drag": 0.3, "lighthill": 0.2, "soft": 0.38, "table": 0.12}
"""How often each family is drawn."""


NUMBERS: dict[str, Numbers] = {
    "drag": {"area": (0.003, 0.06), "lever": (0.04, 0.2)},
    "lighthill": {"length": (0.08, 0.4), "width": (0.04, 0.2)},
    "soft": {
        "e": (0.0, 0.3),
        "k": (0.5, 12.0),
        "p": (0.7, 2.5),
        "x0": (0.4, 2.0),
        "q": (2.0, 8.0),
        "phi_e": (-math.pi, math.pi),
        "d": (-0.3, 0.3),
    },
}
"""Families with a formula: wider than any fin that is evaluated."""


@dataclass(frozen=True, eq=False)
class RandomFin:
    """One law within its limits, compiled."""

    law: FinLaw
    """What it does."""
    limits: Limits
    """Of its commands."""
    compiled: EffortFin
    """What its forces cost."""


def random_fin(rng: np.random.Generator, limits: Limits) -> RandomFin:
    """Draw a law of a random family and compile it."""
    law = random_law(rng, str(rng.choice(list(SHARES), p=list(SHARES.values()))))
    compiled = compile_fin(law, limits, DEFAULT_WEIGHTS)
    # A fin that hardly pushes at all is drawn again: it has nothing to teach.
    if compiled.largest.max() < WEAKEST:
        return random_fin(rng, limits)
    return RandomFin(law, limits, compiled)


def varied_limits(rng: np.random.Generator) -> Limits:
    """Limits of one fin, drawn as in split `limits`."""
    return random_layout(rng, n_fins=1, limits="varied").fins[0].limits


def random_law(rng: np.random.Generator, family: str) -> FinLaw:
    """Draw a law of one of the families in `SHARES`; half of the soft fins push alike in all directions."""
    if family == "table":
        return _table(rng)
    model = random_fin_model(rng, family, NUMBERS)
    if family == "soft" and rng.random() < 0.5:
        model = FinModelSpec("soft", tuple({**dict(model.parameters), "e": 0.0}.items()))
    return make_law(model)


def _table(rng: np.random.Generator) -> FinLaw:
    """A fin that no formula describes: a dead zone, saturation, decline, unevenness, lean and noise, on a
    grid that may know the power."""
    amplitude, frequency = np.linspace(0.03, 0.9, GRID[0]), np.linspace(0.1, 3.2, GRID[1])
    direction = np.linspace(-math.pi, math.pi, GRID[2], endpoint=False)
    a, f, d = np.meshgrid(amplitude, frequency, direction, indexing="ij")
    beat = (a / 0.6) ** rng.uniform(0.6, 1.6) * (f / 2.1) ** rng.uniform(0.6, 1.6)
    dead = rng.uniform(0.0, 0.25) * (rng.random() < 0.4)
    beat = np.maximum(beat - dead, 0.02 * beat)
    saturation = rng.uniform(0.5, 2.0)
    size = beat ** rng.uniform(0.7, 2.2) / (1.0 + (beat / saturation) ** rng.uniform(1.0, 5.0))
    for order in (1, 2):
        size *= 1.0 + rng.uniform(0.0, 0.25) * np.cos(order * d - rng.uniform(-math.pi, math.pi))
    size *= log_uniform(rng, 0.3, 10.0) * (1.0 + 0.03 * rng.standard_normal(size.shape))
    deflection = rng.uniform(-0.3, 0.3) + rng.uniform(0.0, 0.2) * np.sin(d - rng.uniform(-math.pi, math.pi))
    columns = [np.zeros_like(size), size * np.cos(d + deflection), size * np.sin(d + deflection)]
    if rng.random() < 0.5:
        blade = Blade()
        power = blade.power(a, f) * (0.2 + beat ** rng.uniform(0.0, 1.0))
        columns.append(power * log_uniform(rng, 0.3, 3.0))
    return TableLaw([amplitude, frequency, direction], np.stack(columns, axis=-1), True)
