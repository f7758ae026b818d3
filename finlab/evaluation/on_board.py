"""U-CAT's own way to allocate, the layout-specific baseline of the paper's experiments, as far as known.

The force of each fin comes from a pseudo-inverse made for the layout; all fins flap at one fixed frequency
and the thrust law gives the amplitude. With fins lost, their columns leave the matrix: the one-fin
fault-tolerant form. The published allocation and its fault rule are known to us by abstract only; frequency,
thrust law and scaling at the limit are those of the robot's open software.
"""

import numpy as np

from finlab.allocation.baselines.model_based import ModelBased
from finlab.arrays import Array
from finlab.layout import layout_effectiveness

FREQUENCY_HZ = 2.0
"""Of the wrench driver in U-CAT's simulator; the robot itself has modes of 1.1 and 2.1 Hz."""
TABLE_SIZE = 400


class OnBoard(ModelBased):
    """Pseudo-inverse, fixed frequency, amplitude by the thrust law.

    Where a fin would need more than its largest amplitude, the amplitudes of all are scaled down together.
    """

    name = "on-board"

    def _commands(self, targets: Array, seed: int) -> Array:
        plant = self.plant
        planar = layout_effectiveness(plant.layout)
        force = (targets @ np.linalg.pinv(planar, rcond=1e-6).T).reshape(len(targets), plant.n_fins, 2)
        frequency = np.clip(FREQUENCY_HZ, plant.lower[:, 1], plant.upper[:, 1])
        # Beyond the limit too, so that the scaling sees how much too large an amplitude is.
        amplitudes = np.linspace(0.0, 0.5 * np.pi, TABLE_SIZE)
        thrust = plant.thrust(amplitudes[:, None] + np.zeros(plant.n_fins), frequency)
        wanted = np.linalg.norm(force, axis=-1)
        amplitude = np.empty_like(wanted)
        for i, column in enumerate(np.maximum.accumulate(thrust, axis=0).T):
            amplitude[:, i] = np.interp(wanted[:, i], column, amplitudes)
        excess = (amplitude / plant.upper[:, 0]).max(axis=1, keepdims=True)
        amplitude /= np.maximum(excess, 1.0)
        direction = np.arctan2(force[..., 1], force[..., 0])
        return np.stack([amplitude, np.broadcast_to(frequency, amplitude.shape), direction], axis=-1)
