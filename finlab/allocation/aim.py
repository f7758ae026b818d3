"""What users set of the objective of a method that knows the fins' own laws."""

from typing import TypedDict

import numpy as np

from finlab.errors import AllocationError
from finlab.physics.energy import DEFAULT_WEIGHTS, EnergyWeights
from finlab.physics.objective import Name, Objective


class Aim(TypedDict, total=False):
    """The settings by name."""

    objective: Name
    """What is kept least: `power` in watts, or `effort`, the paper's energy proxy."""
    energy_weights: EnergyWeights
    """Weights of the effort."""
    copper_loss: float
    """Heat in a motor's windings [W/(N m)^2] that counts beside the mechanical power."""


def checked_objective(
    objective: Name = "power", energy_weights: EnergyWeights = DEFAULT_WEIGHTS, copper_loss: float = 0.0
) -> Objective:
    """Returns the objective that the settings stand for.

    Raises:
        AllocationError: an unknown objective, or a loss that is none.
        TypeError: weights of another type.
    """
    if objective not in ("power", "effort"):
        raise AllocationError(f"objective: expected 'power' or 'effort', got {objective!r}")
    if not isinstance(energy_weights, EnergyWeights):
        raise TypeError(f"energy_weights: expected EnergyWeights, got {energy_weights!r}")
    if not 0.0 <= copper_loss < np.inf:
        raise AllocationError(f"copper_loss: expected watts per (N m)^2, from 0, got {copper_loss!r}")
    return Objective(objective, energy_weights, float(copper_loss))
