"""Thrust that falls while the fin moves through the water: the layout's fin law, less by the advance ratio.

As a propeller's, a fin's thrust depends on how fast it comes into fresh water beside how fast it beats:
J = V / (2 pi f A L), with V the speed of the fin's foot through the water along its thrust. The thrust is
multiplied by 1 - 0.4 tanh(J): it falls where the fin runs ahead and grows a little where it brakes. The
number is our choice.
"""

import math

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.sim.fin_force import STILL, MeanForce
from finlab.vehicle.fin_motion import FinMotion

MOST = 0.4
"""Largest share that is lost, at a speed far beyond that of the tip."""


class InflowForce(MeanForce):
    """The fins of one layout."""

    def __init__(self, layout: Layout) -> None:
        super().__init__(layout)
        self._length = plant_of(layout).blade.length

    def step(self, motion: FinMotion, dt: float, water: Array = STILL) -> Array:
        force = super().step(motion, dt, water)
        # What a newton does to the robot is what the robot's motion does to the fin's foot.
        foot = self.effectiveness @ water
        speed = (foot * force).sum(axis=-1) / np.maximum(np.linalg.norm(force, axis=-1), 1e-9)
        tip = 2 * math.pi * motion.frequency * motion.amplitude * self._length
        result: Array = force * (1.0 - MOST * np.tanh(speed / np.maximum(tip, 1e-3)))[:, None]
        return result
