"""From a layout and a target wrench to what the network sees.

The one featurizer for training (torch), inference and deployment (numpy): the functions take arrays
of either library and answer in kind. Two sets of node features exist.

`raw` are the paper's ten: position, mounting angle and six limits of each fin.

`fin_frame` describe each fin by what it can do, in its own frame, so that position and mounting angle
need not be learned. They use geometry and limits alone, no identified parameter:

==========  =====================================================================================
index       meaning
==========  =====================================================================================
0-4         wrench of a full horizontal force over sigma: Fx, Fy, Tx, Ty, Tz
5-7         wrench of a full vertical force over sigma: Fz, Tx, Ty
8-10        how much the robot depends on the fin: its block (hh, zz, hz) of the hat matrix
11          size of a full force against a nominal fin's
12-17       limits: amplitude, frequency, zero direction (lower, upper)
18-19       share of a full force that the regularized pseudo-inverse asks of the fin (h, z)
20-21       direction of that force
22          fourth root of its size: thrust goes like (A f)^2, so this is like an amplitude
23-24       projection of the normalized target on the fin's two wrenches
==========  =====================================================================================
"""

import math
from typing import Any, NamedTuple

import numpy as np

from finlab.array_library import library_of
from finlab.layout.arrays import force_columns

RAW_SIZE = 10
"""Number of raw node features (paper: x_i in R^10)."""
FIN_FRAME_SIZE = 25
"""Number of fin-frame node features."""
SIZES = {"raw": RAW_SIZE, "fin_frame": FIN_FRAME_SIZE}
"""Feature set -> width."""

NOMINAL_AMPLITUDE = 0.6
"""[rad]"""
NOMINAL_FREQUENCY = 2.1
"""[Hz]"""
FULL_FORCE = 6.0
"""Force [N] taken for a nominal fin at full amplitude and frequency; a scale only."""
RIDGE = 1e-3
"""Regularization of the pseudo-inverse, in squared normalized wrench."""

Array = Any
"""A numpy array or a torch tensor."""


class Geometry(NamedTuple):
    """What a layout looks like to the features, for B layouts of n fins."""

    static: Array
    """Features 0-17 (B, n, 18)."""
    columns: Array
    """Normalized wrench of each fin's full planar force (B, 6, 2n); zero for padded fins."""
    solver: Array
    """Regularized pseudo-inverse (B, 2n, 6): normalized wrench to shares of full force."""


def raw_features(position: Array, mounting_angle: Array, lower: Array, upper: Array) -> Array:
    """The paper's node features (..., n, 10): position, mounting angle and six limits, scaled."""
    xp = library_of(position)
    limits = _scaled_limits(xp, lower, upper)
    return xp.concatenate([position / 0.3, mounting_angle[..., None] / math.pi, limits], axis=-1)


def geometry(
    position: Array, mounting_angle: Array, lower: Array, upper: Array, std: Array, mask: Array | None = None
) -> Geometry:
    """The part of the fin-frame features that does not depend on the target.

    Args:
        position: fin positions (B, n, 3) [m].
        mounting_angle: (B, n) [rad].
        lower: lower limits (B, n, 3).
        upper: upper limits (B, n, 3).
        std: per-axis standard deviation (6,) of the wrench.
        mask: True where a fin exists (B, n).
    """
    xp = library_of(position)
    full = upper[..., 0] * upper[..., 1] / (NOMINAL_AMPLITUDE * NOMINAL_FREQUENCY)
    full = full * full
    if mask is not None:
        full = full * mask
    scale = (FULL_FORCE * full)[..., None, None]
    pairs = force_columns(position, mounting_angle)[..., 1:, :] / std * scale  # (B, n, 2, 6)
    batch, n = position.shape[0], position.shape[1]
    rows = pairs.reshape(batch, 2 * n, 6)
    columns = xp.swapaxes(rows, -1, -2)  # (B, 6, 2n)
    identity = xp.eye(6, dtype=position.dtype)
    if xp is not np:
        identity = identity.to(position.device)
    inverse = xp.linalg.inv(columns @ rows + RIDGE * identity)
    solver = rows @ inverse  # (B, 2n, 6)
    solved = solver.reshape(batch, n, 2, 6)
    hat = [(solved[:, :, i] * pairs[:, :, j]).sum(-1) for i, j in ((0, 0), (1, 1), (0, 1))]
    shape = xp.concatenate([pairs[..., 0, [0, 1, 3, 4, 5]], pairs[..., 1, [2, 3, 4]]], axis=-1)
    limits = _scaled_limits(xp, lower, upper)
    static = xp.concatenate([shape * 0.25, xp.stack([*hat, full], axis=-1), limits], axis=-1)
    return Geometry(static, columns, solver)


def fin_frame_features(layout: Geometry, target: Array) -> Array:
    """Fin-frame node features (B, n, 25) of B layouts (or one, repeated) for normalized targets (B, 6)."""
    xp = library_of(target)
    batch, n = target.shape[0], layout.static.shape[1]
    static = layout.static
    if static.shape[0] == 1 and batch > 1:
        static = xp.broadcast_to(static, (batch, n, static.shape[2]))
    share = (layout.solver @ target[..., None])[..., 0].reshape(batch, n, 2)
    size = xp.sqrt((share * share).sum(-1) + 1e-8)[..., None]
    projection = (xp.swapaxes(layout.columns, -1, -2) @ target[..., None])[..., 0].reshape(batch, n, 2)
    dynamic = [share, share / size, xp.sqrt(xp.sqrt(size)), projection * 0.1]
    return xp.concatenate([static, *dynamic], axis=-1)


def _scaled_limits(xp: Any, lower: Array, upper: Array) -> Array:
    scales = (NOMINAL_AMPLITUDE, NOMINAL_FREQUENCY, math.pi)
    return xp.stack([limit[..., i] / scales[i] for i in range(3) for limit in (lower, upper)], axis=-1)
