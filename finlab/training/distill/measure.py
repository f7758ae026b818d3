"""How good the fast path is beside the full pipeline, on layouts that no training run has seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from finlab.allocation.learned.fast import FastAllocator
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.inference.fast_weights import FastWeights
from finlab.layout import random_layout
from finlab.physics import Plant
from finlab.physics.energy import command_energy

SEED = 90_000
"""Of the layouts and targets measured here."""


def fast_metrics(
    allocator: LearnedAllocator, weights: FastWeights, n_layouts: int = 60, n_targets: int = 50
) -> dict[str, float]:
    """Error by the analytic fin model, and energy over that of the full pipeline, on nominal limits.

    `energy_ratio` is the mean over targets of the one energy over the other.
    """
    fast = FastAllocator(replace(allocator.weights, fast=weights))
    rng = np.random.default_rng(SEED)
    errors, ratios = [], []
    for _ in range(n_layouts):
        layout = random_layout(rng)
        plant = Plant(layout)
        lower = layout.lower
        upper = layout.upper
        targets = plant.wrench(lower + rng.random((n_targets, layout.n_fins, 3)) * (upper - lower))
        quick = fast.allocate_batch(layout, targets).command
        whole = allocator.allocate_batch(layout, targets).command
        errors.append(allocator.normalization.error(plant.wrench(quick), targets))
        ratios.append(command_energy(quick, upper) / command_energy(whole, upper))
    error, ratio = np.concatenate(errors), np.concatenate(ratios)
    return {
        "err_norm_mean": float(error.mean()),
        "err_norm_max": float(error.max()),
        "energy_ratio": float(ratio.mean()),
        "energy_ratio_p95": float(np.percentile(ratio, 95)),
    }
