"""Actuators that cannot be commanded, since damage or limits leave them one command: what they
give, which the others have to make up for."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.physics import Plant


class FixedActuators(NamedTuple):
    """The actuators of a robot that have one command alone."""

    is_fixed: NDArray[np.bool_]
    """Which they are (n,)."""
    wrench: Array
    """What they give together (6,) [N, N m], jets apart."""


def fixed_actuators_of(plant: Plant) -> FixedActuators:
    """Returns the actuators of a plant whose least and greatest commands are the same."""
    is_fixed = (plant.lower == plant.upper).all(axis=1)
    force = plant.force(plant.lower)
    wrench = np.einsum("nk,nkw->w", force[is_fixed], plant.effectiveness[is_fixed])
    return FixedActuators(is_fixed, np.asarray(wrench))
