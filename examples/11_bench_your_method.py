# %% [markdown]
# # Your own method on the benchmark
# SciPy's least squares on the commands, in fifteen lines. You will see how much it delivers of what is asked
# of robots that it has never seen, at what power and in what time, beside method `dual`.

# %%
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

import finlab
from finlab.physics import plant_of
from finlab.research.evaluation.experiments.wrench import experiment


def allocate(layout: finlab.Layout, targets: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Commands (N, n, 3) [rad, Hz, rad] for wrenches (N, 6)."""
    plant = plant_of(layout)
    low = plant.lower.ravel()
    high = plant.upper.ravel()

    def missing(u: np.ndarray, target: np.ndarray) -> Any:
        return (plant.wrench(u.reshape(-1, 3)) - target) / scale

    def slopes(u: np.ndarray, target: np.ndarray) -> Any:
        return plant.linearize(u.reshape(-1, 3))[1] / scale[:, None]

    start = (low + high) / 2
    limits = (low, high)
    found = [
        least_squares(missing, start, slopes, limits, args=(t,), max_nfev=30).x for t in targets
    ]
    return np.reshape(found, (len(targets), -1, 3))


# %% [markdown]
# At the command line: `finlab bench 11_bench_your_method.py:allocate dual --quick`.

# %%
if __name__ == "__main__":
    methods = ("__main__:allocate", "dual")
    rows = experiment.rows(split=("id",), layouts=5, targets=4, methods=methods, seed=8821)
    for row in rows:
        print("{method}: mean err_norm {err_norm_mean:.1e}, {power_mean:.2f} W".format(**row))
    figure, axes = plt.subplots(figsize=(6, 2), layout="constrained")
    axes.barh(methods, [row["solve_ms_p50"] for row in rows])
    axes.set(xscale="log", xlabel="median time of a target [ms]")
    plt.show()
