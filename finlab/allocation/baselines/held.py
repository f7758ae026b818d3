"""Actuators that cannot be commanded, since damage or limits leave them one command: what they
give."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.physics import Plant


class Held(NamedTuple):
    """The actuators of a robot that have one command alone."""

    held: NDArray[np.bool_]
    """Which they are (n,)."""
    wrench: Array
    """What they give together (6,) [N, N m], jets apart; the others have to make up for it."""


def held_of(plant: Plant) -> Held:
    """Returns the actuators of a plant whose least and greatest commands are the same."""
    held = (plant.lower == plant.upper).all(axis=1)
    force = plant.force(plant.lower)
    wrench = np.einsum("nk,nkw->w", force[held], plant.effectiveness[held])
    return Held(held, np.asarray(wrench))
