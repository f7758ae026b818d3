"""Features of a robot and its targets for the network of method `mdn`, and the proposals that
follow from it.

The cheapest forces y_i = F_i x_i, F_i the largest force of fin i, solve min sum c_i(x_i) s.t. C x =
w, where C holds the normalized wrenches of full forces. The same forces solve it when P x = p is
asked for instead, with P = C^T (C C^T)^-1 C, which says how fins can stand in for each other, and p
= C^T (C C^T)^-1 w, the least shares that give w. Neither knows of sizes, levers or axes any more,
so one network serves robots of any size.

Each fin is described in a frame of its own that turns with the direction of its p_i; planar vectors
are complex numbers, and the 2 x 2 blocks of P are pairs (a, b) with x -> a x + b conj(x). Node
features:

=====  ============================================================================================
index  meaning
=====  ============================================================================================
0-2    size of p_i: root, saturating, logarithm
3-5    block of P of the fin itself: a, b
6      logarithm of the effort at the top beside the other fins'
7-10   effort at `SHARES` of the largest force over that at the top
11-13  largest force by direction over the largest of all: mean, first Fourier term
14-15  first Fourier term of the directions
16     root of the smallest force over the largest
17-19  arc of directions: half of it over pi, its middle where it is no full circle
20-22  effort of turning by a radian over that at the top, and where turning costs nothing
23-24  fixed numbers by which fins that are the same in all else are distinguished
25     number of fins
=====  ============================================================================================

Pair features are the block (a, b) of P between two fins, in their frames.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray
from finlab.research.mdn.descent import EffortProblem
from finlab.research.mdn.effort_fins import EFFORT
from finlab.research.mdn.network import NODE_SIZE, ForceMixture

SHARES = (0.02, 0.1, 0.3, 0.6)
"""Shares of the largest force at which a fin's effort is looked up."""
N_DIRECTIONS = 16
"""Directions in which it is looked up."""
RIDGE = 1e-6
"""Regularization of C C^T, relative to its trace."""
GOLDEN = 0.6180339887498949
"""Its multiples spread evenly between whole numbers."""


class RobotView(NamedTuple):
    """One robot of n fins as the network sees it, whatever the target."""

    static: AnyArray
    """Node features 6-25 (n, 20) before their vectors are turned."""
    blocks: AnyArray
    """a and b (2, n, n) of the blocks of P, complex."""
    solver: AnyArray
    """Normalized wrenches to p (6, n), complex."""
    largest: AnyArray
    """F (n,) [N]."""


class RobotFeatures(NamedTuple):
    """N targets on one robot as the network sees them."""

    nodes: AnyArray
    """Node features (N, n, 26)."""
    pairs: AnyArray
    """Pair features (N, n, n, 4), from the last but one axis (seen) to the one before (seeing)."""
    frame: AnyArray
    """Unit vectors (N, n), complex, along each fin's p_i."""


VECTORS = (6, 8, 12, 15)
"""Where among the static features planar vectors begin."""


def robot_view(problem: EffortProblem) -> RobotView:
    """What the network sees of one robot, whatever the target; see the table above."""
    fins = problem.fins
    n = len(problem.fins.maximum)
    full = fins.half >= np.pi
    # Around a circle, no direction counts twice.
    on_circle = np.linspace(-1.0, 1.0, N_DIRECTIONS + 1)[:-1, None]
    on_arc = np.linspace(-1.0, 1.0, N_DIRECTIONS)[:, None]
    direction = fins.middle + fins.half * np.where(full, on_circle, on_arc)
    gauge = np.broadcast_to(fins.gauges(direction), direction.shape)
    unit = np.exp(1j * direction)
    top = np.maximum(fins.table[:, -1, EFFORT], 1e-12)
    shares = [fins.lookup(share * fins.largest)[..., EFFORT] / top for share in SHARES]
    reach = gauge * fins.largest / fins.maximum
    idle = problem.idle_direction + fins.deflection(problem.idle_direction)
    index = np.arange(n)
    static = [
        np.log(top / top.mean()),
        *shares,
        reach.mean(0),
        *_parts(2.0 * (reach * unit).mean(0)),
        *_parts(2.0 * unit.mean(0)),
        np.sqrt(fins.smallest * gauge.mean(0) / fins.maximum),
        fins.half / np.pi,
        *_parts(np.where(full, 0.0, np.exp(1j * fins.middle))),
        problem.direction_cost / top,
        *_parts(np.where(problem.direction_cost > 0.0, np.exp(1j * idle), 0.0)),
        2.0 * np.mod(0.5 + index * GOLDEN, 1.0) - 1.0,
        2.0 * np.mod(0.25 + index * GOLDEN**2, 1.0) - 1.0,
        np.full(n, n / 12.0),
    ]
    # C^T, and P = C^T (C C^T)^-1 C with its 2 x 2 blocks as x -> a x + b conj(x).
    C_T = problem.effectiveness * np.repeat(fins.maximum, 2)[:, None]  # (2n, 6)
    gram = C_T.T @ C_T
    gram += (RIDGE * np.trace(gram) + 1e-300) * np.eye(6)
    solver = np.linalg.solve(gram, C_T.T)
    P = (C_T @ solver).reshape(n, 2, n, 2)
    xx = P[:, 0, :, 0]
    xz = P[:, 0, :, 1]
    zx = P[:, 1, :, 0]
    zz = P[:, 1, :, 1]
    a = 0.5 * ((xx + zz) + 1j * (zx - xz))
    b = 0.5 * ((xx - zz) + 1j * (zx + xz))
    return RobotView(
        static=np.stack(static, axis=-1),
        blocks=np.stack([a, b]),
        solver=solver[:, 0::2] + 1j * solver[:, 1::2],
        largest=fins.maximum,
    )


def features_of(view: RobotView, target: AnyArray) -> RobotFeatures:
    """Returns the features of normalized targets (N, 6) on one robot."""
    p = target @ view.solver
    a, b = view.blocks
    rows = len(target)
    return features(
        p,
        np.broadcast_to(view.static, (rows, *view.static.shape)),
        np.broadcast_to(a, (rows, *a.shape)),
        np.broadcast_to(b, (rows, *b.shape)),
    )


def features(p: AnyArray, static: AnyArray, a: AnyArray, b: AnyArray) -> RobotFeatures:
    """Returns the features of N targets, each on a robot of its own.

    Args:
        p: least shares that give each target (N, n), complex.
        static: node features as in `RobotView` (N, n, 20).
        a: first part of the blocks of P (N, n, n), complex.
        b: second part (N, n, n), complex.
    """
    rows, n = p.shape
    size = np.abs(p)
    frame = np.where(size > 1e-9, p, 1.0)
    frame = frame / np.abs(frame)
    to_frame = frame.conj()
    nodes = np.empty((rows, n, NODE_SIZE), dtype=np.float32)
    nodes[..., 0] = np.sqrt(size)
    nodes[..., 1] = size / (1.0 + size)
    nodes[..., 2] = np.log(size + 1e-3) / 7.0
    nodes[..., 6:] = static
    for column in VECTORS:
        in_frame = (static[..., column] + 1j * static[..., column + 1]) * to_frame
        nodes[..., 6 + column] = in_frame.real
        nodes[..., 7 + column] = in_frame.imag
    a = a * to_frame[:, :, None] * frame[:, None]
    b = b * to_frame[:, :, None] * to_frame[:, None]
    pairs = np.stack([a.real, a.imag, b.real, b.imag], axis=-1).astype(np.float32)
    fin = np.arange(n)
    nodes[..., 3] = pairs[:, fin, fin, 0]
    nodes[..., 4:6] = pairs[:, fin, fin, 2:]
    return RobotFeatures(nodes, pairs, frame)


def _parts(values: AnyArray) -> tuple[AnyArray, AnyArray]:
    """Real and imaginary parts of complex numbers."""
    return values.real, values.imag


class Proposal(NamedTuple):
    """K proposals for each of N targets, none of them exact yet."""

    force: AnyArray
    """Planar forces (N, K, n) [N], complex: horizontal, and 1j times vertical."""
    component: NDArray[np.intp]
    """Mixture component of each (N, K)."""


def propose(
    mixture: ForceMixture,
    view: RobotView,
    features: RobotFeatures,
    n_candidates: int,
    temperature: float,
    seed: int,
) -> Proposal:
    """Returns K proposals for each of N targets on one robot, from the network's mixture.

    The components' means come first, by falling weight. Where K exceeds their number M, the rest
    are drawn by the components' weights, with variances times the temperature.

    Args:
        mixture: of all targets.
        view: the robot.
        features: what the network was given, for the frames of the fins.
        n_candidates: K.
        temperature: factor of the variances of what is drawn.
        seed: of what is drawn.
    """
    weight, mean, std = mixture.complex_parts()
    rows, m, n = mean.shape
    row = np.arange(rows)[:, None]
    component = np.argsort(-weight, axis=1)[:, :n_candidates]
    root = mean[row, component]
    if n_candidates > m:
        rng = np.random.default_rng(seed)
        more = n_candidates - m
        uniform = rng.random((rows, more, 1), dtype=np.float32)
        parts = rng.standard_normal((rows, more, n, 2), dtype=np.float32)
        cumulative = weight.cumsum(1)
        others = (uniform * cumulative[:, None, -1:] > cumulative[:, None, :-1]).sum(-1)
        spread = math.sqrt(temperature) * std[row, others]
        drawn = mean[row, others] + spread * (parts[..., 0] + 1j * parts[..., 1])
        component = np.hstack([component, others])
        root = np.hstack([root, drawn])
    return Proposal(shares(root) * (features.frame * view.largest)[:, None], component)


def shares(root: AnyArray) -> AnyArray:
    """Shares of the largest forces, none above one, from what the mixture gives: their roots."""
    size = np.abs(root)
    return np.asarray(root * np.minimum(size, 1.0 / np.maximum(size, 1e-9)))
