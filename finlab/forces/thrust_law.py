"""What thrust one fin can give, and the cheapest command for it, without torch where a formula will do."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.physics.energy import DEFAULT_WEIGHTS

Array = NDArray[np.float64]

LEVELS = 129
"""Thrust levels of a cheapest-command curve, evenly spaced in the fourth root of thrust."""
GRID = 201
"""Amplitudes and frequencies that are looked at."""
TABLE_GRID = (41, 21, 13)
"""Amplitudes, frequencies and zero directions at which a table is looked at."""


class ThrustLaw(NamedTuple):
    """Thrust and least energy of one fin, whatever its direction."""

    minimum: float
    """Least thrust [N] within the limits; a fin at rest still gives it."""
    maximum: float
    """Largest thrust [N]."""
    spread: float
    """How much less than `maximum` the weakest direction gives [N]; 0 unless a table says otherwise."""
    thrust: Array
    """Thrust levels (LEVELS,) [N], rising from `minimum` to `maximum`."""
    energy: Array
    """Least energy (LEVELS,) at each level, without the cost of the zero direction."""

    def energy_at(self, thrust: Array) -> Array:
        """Least energies of thrusts (...) [N], clamped to what the fin can give."""
        # Energy is nearly a straight line over the square root of thrust.
        return np.interp(np.sqrt(thrust), np.sqrt(self.thrust), self.energy)


def thrust_laws(layout: Layout) -> tuple[ThrustLaw, ...]:
    """Returns the law of each fin, in the layout's order."""
    return tuple(_law(fin.limits, fin.model) for fin in layout.fins)


@lru_cache(maxsize=256)
def _law(limits: Limits, model: FinModelSpec) -> ThrustLaw:
    """Thrusts on a grid of amplitudes and frequencies, then the cheapest way to each level."""
    if model.type == "table":
        amplitude, frequency, thrust, spread = _table_thrust(limits, model)
    else:
        amplitude, frequency = np.linspace(*limits.amplitude, GRID), np.linspace(*limits.frequency, GRID)
        spread = 0.0
        thrust = np.outer(_formula(model, amplitude), frequency**2)
    low, high = float(thrust.min()), float(thrust.max())
    level = low + (high - low) * np.linspace(0.0, 1.0, LEVELS) ** 4
    w, a = DEFAULT_WEIGHTS, amplitude / limits.amplitude[1]
    energy = np.full(LEVELS, np.inf)
    for share, row in zip(a, thrust, strict=True):
        # The least frequency at which this amplitude gives the level.
        rising = np.maximum.accumulate(row)
        f = np.interp(np.sqrt(level), np.sqrt(rising), frequency) / limits.frequency[1]
        cost = w.amplitude * share**2 + w.frequency * f**2 + w.product * share * f
        energy = np.minimum(energy, np.where(level <= rising[-1] * (1.0 + 1e-12), cost, np.inf))
    return ThrustLaw(low, high, spread, level, np.maximum.accumulate(energy))


def _formula(model: FinModelSpec, amplitude: Array) -> Array:
    """Thrust at 1 Hz (GRID,) [N] of the models with a closed form, as in `finlab.physics`."""
    value = {name: float(number) for name, number in model.values().items()}
    if model.type == "drag":
        factor = 4.0 * value["density"] * value["drag_coefficient"] * value["area"] * value["lever"] ** 2
        shape = np.sin(amplitude) ** 2
    else:
        from scipy.special import j1  # here, so that what answers on a robot does without scipy

        factor = 0.5 * np.pi / 4.0 * value["density"] * value["width"] ** 2 * value["length"] ** 2
        shape = amplitude * j1(amplitude)
    return factor * (2.0 * np.pi) ** 2 * shape


def _table_thrust(limits: Limits, model: FinModelSpec) -> tuple[Array, Array, Array, float]:
    """Amplitudes, frequencies, thrusts (amplitudes, frequencies) [N] in the strongest direction, the spread.

    The plant is asked, so this alone loads torch.
    """
    from finlab.physics import Plant

    alone = Plant(Layout("alone", (Fin("fin", (0.0, 0.0, 0.0), 0.0, limits, model),)))
    ends = (limits.amplitude, limits.frequency, limits.zero_direction)
    axes = [np.linspace(*pair, n) for pair, n in zip(ends, TABLE_GRID, strict=True)]
    force = alone.fin_forces(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)[..., None, :])[..., 0, :]
    thrust = np.linalg.norm(force[..., 1:], axis=-1)  # at angle zero, e_h is y; the shaft's part is left out
    strongest = thrust.max(axis=(0, 1))
    return axes[0], axes[1], thrust.max(axis=2), float(strongest.max() - strongest.min())
