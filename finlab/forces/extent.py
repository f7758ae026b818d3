"""How far the set of all wrenches reaches in its weakest direction."""

from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.forces.force_sets import ForceSets
from finlab.forces.reach import COARSE, FINE, max_wrench_along

RANK_TOLERANCE = 1e-6
"""Share of the largest singular value below which another counts as zero."""
N_RANDOM = 24
"""Random directions from which the weakest one is sought, beside axes and singular vectors."""
N_WALKS = 6
"""Steps from face to face of the set of wrenches."""


class Extent(NamedTuple):
    """The weakest direction of the sets of wrenches of P robots, in scaled wrenches."""

    size: Array
    """(P,) [N]."""
    direction: Array
    """Unit scaled wrench (P, m)."""


def singular_values(sets: ForceSets) -> tuple[Array, Array]:
    """Returns singular values (P, m) [N], falling, and their directions (P, m, m), in columns.

    Each column of the matrix is what one actuator does at its largest force along one axis of its plane.
    """
    matrix = np.swapaxes(sets.full_effectiveness(), -1, -2)
    directions, values, _ = np.linalg.svd(matrix, full_matrices=True)
    return np.pad(values, ((0, 0), (0, directions.shape[-1] - values.shape[-1]))), directions


def weakest(sets: ForceSets, n_random: int = N_RANDOM, n_walks: int = N_WALKS, fine: bool = True) -> Extent:
    """Returns the direction in which the sets of wrenches end soonest, and where.

    Every wrench of that size, in any direction, is within reach. The walk starts from axes, singular vectors
    and random directions, goes to the face of the set that lies that way, turns to the face's normal and goes
    again; each step ends nearer. The least end of all walks is returned: an end that truly is there.
    """
    values, vectors = singular_values(sets)
    size = np.zeros(len(values))
    direction = vectors[:, :, -1].copy()
    full = np.flatnonzero(values[:, -1] > RANK_TOLERANCE * np.maximum(values[:, 0], 1e-9))
    if not len(full):
        return Extent(size, direction)
    rng = np.random.default_rng(0)
    axes = values.shape[1]
    drawn = rng.standard_normal((n_random, axes))
    drawn /= np.linalg.norm(drawn, axis=-1, keepdims=True)
    common = np.concatenate([np.eye(axes), drawn])
    of_robot = np.swapaxes(vectors[full], -1, -2)
    starts = np.concatenate([np.broadcast_to(common, (len(full), *common.shape)), of_robot], axis=1)
    if (sets.half[full] < np.pi).any() or sets.center is not None:  # else opposite directions are alike
        starts = np.concatenate([starts, -starts], axis=1)
    n_starts = starts.shape[1]
    rows = sets.take(np.repeat(full, n_starts))
    ends = starts.reshape(-1, axes)
    for walk in range(n_walks):
        last = fine and walk == n_walks - 1
        normal = max_wrench_along(rows, ends, FINE if last else COARSE).normal
        ends = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    reach = rows.farthest(ends)[0].reshape(len(full), n_starts)
    best = reach.argmin(axis=1)
    size[full] = np.maximum(reach[np.arange(len(full)), best], 0.0)
    direction[full] = ends.reshape(len(full), n_starts, axes)[np.arange(len(full)), best]
    return Extent(size, direction)
