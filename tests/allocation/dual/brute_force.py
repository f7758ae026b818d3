"""The cheapest exact allocation by brute force: SLSQP on commands from many random starts, on the plant."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from finlab.layout import Layout
from finlab.physics import Plant
from finlab.physics.objective import Name, cost_meter

Array = NDArray[np.float64]


def least_cost(
    layout: Layout,
    target: Array,
    sigma: Array,
    objective: Name,
    *,
    n_starts: int = 24,
    seed: int = 0,
    also: Array | None = None,
) -> float:
    """The least cost found for a wrench (6,), infinite where no start reached it to 1e-5.

    Starts are random commands, of which every other one has fins at rest, and `also`, a command (n, 3).
    """
    plant, rng = Plant(layout), np.random.default_rng(seed)
    meter, n = cost_meter(objective, plant), layout.n_fins
    full = plant.full_turn
    low, width = plant.lower, np.maximum(plant.width, 1e-12)

    def command(share: Array) -> Array:
        return low + share.reshape(n, 3) * width

    def missing(share: Array) -> Array:
        return np.asarray((plant.wrench(command(share)) - target) / sigma)

    def bent(share: Array) -> Array:
        jacobian = plant.linearize(command(share))[1]
        return np.asarray(jacobian * width.ravel() / sigma[:, None])

    starts = rng.uniform(size=(n_starts, n, 3))
    resting = rng.uniform(size=(n_starts, n)) < 0.35
    resting[::2] = False
    starts[..., :2] = np.where(resting[..., None], 0.0, starts[..., :2])
    if also is not None:
        starts = np.concatenate([(also - low)[None] / width, starts])
    bounds = [(None, None) if axis == 2 and full[i] else (0.0, 1.0) for i in range(n) for axis in range(3)]
    # Equations beyond the rank of what the fins can do only confuse the solver.
    axes = np.linalg.svd(plant.effectiveness[:, 1:].reshape(2 * n, 6) / sigma, full_matrices=False)
    rank = int((axes[1] > 1e-9 * axes[1][0]).sum())
    seen = axes[2][:rank] if not plant.force(plant.sample(rng, (3,)))[..., 0].any() else np.eye(6)
    scale = max(float(meter(plant.upper[None])[0]), 1e-9)
    best = np.inf
    for start in starts:
        found = minimize(
            lambda s: float(meter(command(s)[None])[0]) / scale,
            start.ravel(),
            jac=lambda s: (meter.gradient(command(s)[None])[0] * width).ravel() / scale,
            bounds=bounds,
            constraints={"type": "eq", "fun": lambda s: seen @ missing(s), "jac": lambda s: seen @ bent(s)},
            method="SLSQP",
            options={"maxiter": 150, "ftol": 1e-10},
        )
        answer = plant.feasible(command(found.x))
        error = float(np.linalg.norm((plant.wrench(answer) - target) / sigma))
        if error < 1e-5:
            best = min(best, float(meter(answer[None])[0]))
    return best
