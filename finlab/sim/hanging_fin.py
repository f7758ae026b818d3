"""What a fin that hangs still does to a robot that swims: it drags, as a plate in the flow.

The plate feels the flow across it, 1/2 rho Cd W L u |u| with u the speed of the fin's foot through the water
along the plate's normal, and nothing along it (the cross-flow principle). The hull's damping counts fins that
beat; this is what one that does not beat adds, broadside to the flow or edge on, as it stopped.
"""

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.arrays import own_effectiveness
from finlab.physics import plant_of

DRAG_COEFFICIENT = 1.2
"""Of a rectangular plate twice as long as wide, broadside to a steady flow (S. F. Hoerner, Fluid-Dynamic
Drag, chapter 3). A beating blade's is larger."""


class HangingFins:
    """The fins of one layout as plates."""

    def __init__(self, layout: Layout) -> None:
        """Takes the true robot."""
        blade = plant_of(layout).blade
        self._resistance = 0.5 * blade.density * DRAG_COEFFICIENT * blade.width * blade.length
        # What a newton does to the robot is what the robot's motion does to the fin's foot.
        self._foot = own_effectiveness(layout)[:, 1:]

    def force(self, direction: Array, water: Array) -> Array:
        """Force (n, 3) [N] of each fin in its own frame (shaft, e_h, e_z), as if all hung still.

        Args:
            direction: zero directions (n,) at which they hang [rad].
            water: how the robot moves through the water (6,) [m/s, rad/s], body frame.
        """
        # Across the plate, which lies along the shaft and the zero direction.
        normal = np.stack([-np.sin(direction), np.cos(direction)], axis=-1)
        across = (self._foot @ water * normal).sum(axis=-1)
        force = np.zeros((len(direction), 3))
        force[:, 1:] = (-self._resistance * across * np.abs(across))[:, None] * normal
        return force
