"""The fin law written out apart from the plant: a win that came from a wrong plant would show here."""

import numpy as np

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout import Layout


def known_by_hand(layout: Layout) -> bool:
    """Whether all fins follow the law that is written out here."""
    return all(fin.model.type == "drag" for fin in layout.fins)


def wrench_by_hand(layout: Layout, command: Array) -> Array:
    """Wrenches (N, 6) of commands (N, n, 3) by the drag law `F = 2 rho Cd S rc^2 (2 pi f)^2 (1 - cos 2A)`.

    Raises:
        DataError: a fin follows another law.
    """
    total = np.zeros((len(command), 6))
    for fin, (amplitude, frequency, direction) in zip(layout.fins, command.transpose(1, 2, 0), strict=True):
        if fin.model.type != "drag":
            raise DataError(f"recheck: knows the fin law drag only, fin {fin.name!r} has {fin.model.type!r}")
        law = {key: float(value) for key, value in fin.model.values().items()}
        size = 2 * law["density"] * law["drag_coefficient"] * law["area"] * law["lever"] ** 2
        thrust = size * (2 * np.pi * frequency) ** 2 * (1 - np.cos(2 * amplitude))
        across, angle = thrust * np.cos(direction), fin.mounting_angle
        force = np.stack(
            [-np.sin(angle) * across, np.cos(angle) * across, thrust * np.sin(direction)], axis=-1
        )
        total[:, :3] += force
        total[:, 3:] += np.cross(np.array(fin.position), force)
    return total
