"""Fins that beat in each other's jets: the layout's fin law, less what a jet takes.

A fin that pushes the robot one way throws water the other way. A fin that this jet meets works in water that
already moves, and loses up to 30 % of its thrust: by the angle between the jet and the way to that fin, by
the distance, and by how strong the jet is. The numbers are our choice, of the order of what tandem foils
lose.
"""

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics.wrench import body_force
from finlab.sim.fin_force import STILL, MeanForce
from finlab.vehicle.fin_motion import FinMotion

MOST = 0.30
"""Largest share of its thrust that a fin loses."""
SPREAD = 0.7
"""Angle off the jet [rad] at which the loss is 1 / e of that in its middle."""
REACH = 1.2
"""Distance [m] at which the same holds."""
HALF_THRUST = 0.3
"""Thrust [N] of the front fin at which the loss is half as large as behind a very strong one."""


class WakeForce(MeanForce):
    """The fins of one layout."""

    def __init__(self, layout: Layout) -> None:
        super().__init__(layout)
        self._frames = layout.frames
        way = layout.position[None] - layout.position[:, None]
        distance = np.linalg.norm(way, axis=-1)
        self._way = way / np.maximum(distance, 1e-9)[..., None]
        self._near = np.exp(-((distance / REACH) ** 2)) * (distance > 1e-9)

    def step(self, motion: FinMotion, dt: float, water: Array = STILL) -> Array:
        force = super().step(motion, dt, water)
        return force * (1.0 - self.loss(force))[:, None]

    def loss(self, force: Array) -> Array:
        """Share (n,) that each fin loses where alone they would give forces (n, 3) in their frames [N]."""
        thrust = np.linalg.norm(force, axis=-1)
        jet = -body_force(force, self._frames) / np.maximum(thrust, 1e-9)[:, None]
        angle = np.arccos(np.clip(np.einsum("ik,ijk->ij", jet, self._way), -1.0, 1.0))
        strength = thrust / (thrust + HALF_THRUST)
        met = np.exp(-((angle / SPREAD) ** 2)) * self._near * strength[:, None]
        loss: Array = np.minimum(MOST * met.sum(axis=0), MOST)
        return loss
