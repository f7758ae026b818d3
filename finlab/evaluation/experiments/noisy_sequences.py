"""Sequences of wrenches with noise, as a controller's: how far each method's commands move from tick to tick.

A smooth path (`steadiness.smooth_path`) with white noise on every axis, as estimates from sensors bring it.
Each tick is one call that is given the previous command; a method that takes no heed of it answers anew. The
plant scores every tick, once as commanded and once as fins deliver it that follow late.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.evaluation.experiments.steadiness import rollout, smooth_path
from finlab.evaluation.progress import progress
from finlab.evaluation.statistics.tables import Row
from finlab.layout import Layout

NOISE = 0.1
"""Standard deviation of the noise on an axis, over the root mean square of the path on it."""
DOMAIN = 0x9015E
"""Leads the seed of every noise."""


def noisy_path(layout: Layout, sigma: Array, seed: int, ticks: int, noise: float = NOISE) -> Array:
    """A path of wrenches (ticks, 6) [N, N m] with white noise; arguments as in `smooth_path`."""
    path = smooth_path(layout, sigma, seed, ticks)
    size = noise * np.sqrt(np.mean(path**2, axis=0))
    return np.asarray(path + size * np.random.default_rng((DOMAIN, seed)).standard_normal(path.shape))


def noisy_sequence_rows(
    allocators: Mapping[str, Allocator],
    layouts: Sequence[Layout],
    *,
    n_paths: int,
    ticks: int,
    seed: int,
    noise: float = NOISE,
) -> list[Row]:
    """One row per layout and method: means and 99th percentiles over ticks and fins of what commands change.

    Args:
        allocators: methods by name; the first one's yardstick scales the paths.
        layouts: the robots.
        n_paths: paths of each.
        ticks: length of each, ten a second.
        seed: of the first path; the others follow.
        noise: as in `noisy_path`.

    Returns:
        Rows of `layout`, `method`, `ticks`, `amplitude_mean`, `frequency_mean`, `turn_mean` and the same with
        `_p99` [rad, Hz, rad per tick], `err_norm_mean`, `late_mean` and `power_mean` [W].
    """
    sigma = next(iter(allocators.values())).normalization.std
    rows: list[Row] = []
    for layout in progress(layouts, "layout"):
        paths = [noisy_path(layout, sigma, seed + k, ticks, noise) for k in range(n_paths)]
        for name, method in allocators.items():
            runs = [rollout(method, layout, path, steady=True) for path in paths]
            steps = np.concatenate([run.step for run in runs]).reshape(-1, 3)
            row: Row = {"layout": layout.name, "method": name, "ticks": n_paths * ticks}
            for what, change in zip(("amplitude", "frequency", "turn"), steps.T, strict=True):
                row |= {f"{what}_mean": float(change.mean())}
                row |= {f"{what}_p99": float(np.quantile(change, 0.99))}
            for what in ("err_norm", "late", "power"):
                row[f"{what}_mean"] = float(np.mean([getattr(run, what).mean() for run in runs]))
            rows.append(row)
    return rows
