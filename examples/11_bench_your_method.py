"""Your own method on the benchmark: SciPy's least squares on the commands, in fifteen lines.

You will see how much of what is asked of the paper's layout A it delivers, at what power and in what time.
"""

from typing import Any

import numpy as np
from scipy.optimize import least_squares

import finlab
from finlab.cli import main
from finlab.physics import plant_of


def allocate(layout: finlab.Layout, targets: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Commands (N, n, 3) [rad, Hz, rad] for wrenches (N, 6)."""
    plant = plant_of(layout)
    low, high = plant.lower.ravel(), plant.upper.ravel()

    def missing(u: np.ndarray, target: np.ndarray) -> Any:
        return (plant.wrench(u.reshape(-1, 3)) - target) / sigma

    def slopes(u: np.ndarray, target: np.ndarray) -> Any:
        return plant.linearize(u.reshape(-1, 3))[1] / sigma[:, None]

    start, limits = (low + high) / 2, (low, high)
    found = [least_squares(missing, start, slopes, limits, args=(t,), max_nfev=30).x for t in targets]
    return np.reshape(found, (len(targets), -1, 3))


if __name__ == "__main__":
    main(["bench", f"{__file__}:allocate", "--quick", "--splits", "id"])
