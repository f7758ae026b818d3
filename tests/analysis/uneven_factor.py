"""Multipliers that prove K of uneven thrusters, two more of them than dimensions.

Vectors c_1 .. c_n of a plane, with sum_i c_i c_i^T = I, are signs s_i times unit directions within
half a turn, in their order. With D_ab >= 0 the size of c_a x c_b, a triple i < j < k of them has

    H = D_jk + D_ik + D_ij,  L = s_i D_jk - s_j D_ik + s_k D_ij,

and K is the largest sum over triples of (H - rho |L|)^2. For any tau within [-1, 1],

    (H - rho |L|)^2 <= H^2 - 2 rho tau H L + rho^2 L^2,

a quadratic form of all D. Relations of Plücker among the D may be added with any multipliers, and
since sum D_ab^2 = 1 the largest eigenvalue of the result is a bound. It depends on the signs but
for their symmetries. A semidefinite programme proposes tau and the multipliers; what proves the
bound is the eigenvalue, which needs nothing of the programme.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations, product
from typing import NamedTuple

import clarabel
import numpy as np
from scipy import sparse

from finlab.arrays import Array
from tests.analysis.planar_factor import pair_index, relations

Signs = tuple[int, ...]
"""The sign of each vector, in the order of their lines."""


def sign_classes(n: int) -> list[Signs]:
    """Returns one choice of signs of each class; the first is that of vectors in half a plane.

    The first line may be made the last one, where its vector changes its sign; the order may be
    reversed, and all signs.
    """
    seen = set[Signs]()
    classes = list[Signs]()
    for signs in product((1, -1), repeat=n):
        if signs in seen:
            continue
        classes.append(signs)
        open_signs = [signs]
        while open_signs:
            one = open_signs.pop()
            if one not in seen:
                seen.add(one)
                turned = (*one[1:], -one[0])
                negative = tuple(-sign for sign in one)
                open_signs += [turned, one[::-1], negative]
    return classes


def triple_rows(n: int, signs: Sequence[int]) -> Iterator[tuple[Array, Array]]:
    """Yields the coefficients of H and of L (N,) of each triple."""
    index = pair_index(n)
    for i, j, k in combinations(range(n), 3):
        size = np.zeros(len(index))
        area = np.zeros(len(index))
        for pair, sign in (((j, k), signs[i]), ((i, k), -signs[j]), ((i, j), signs[k])):
            size[index[pair]] = 1.0
            area[index[pair]] = sign
        yield size, area


class Form(NamedTuple):
    """The form H^2 - 2 rho tau H L + rho^2 L^2, summed over triples, plus multiples of relations:
    affine in tau and the multipliers."""

    constant: Array
    """What depends on neither (N, N)."""
    by_tau: Array
    """What tau multiplies, for each triple (T, N, N)."""
    by_multiplier: Array
    """What the multipliers multiply, for each relation (R, N, N)."""


def form_of(n: int, signs: Sequence[int], unevenness: float) -> Form:
    """Returns the form of n vectors with some signs, for one rho."""
    constant = np.zeros((n * (n - 1) // 2,) * 2)
    by_tau = []
    for size, area in triple_rows(n, signs):
        constant += np.outer(size, size) + unevenness**2 * np.outer(area, area)
        by_tau.append(-unevenness * (np.outer(size, area) + np.outer(area, size)))
    by_multiplier = [relation for _, relation in relations(n)]
    return Form(constant, np.array(by_tau), np.array(by_multiplier))


def proposed_multipliers(form: Form) -> tuple[Array, Array]:
    """Returns tau (T,) and multipliers (R,) for which the largest eigenvalue is small."""
    n_tau = len(form.by_tau)
    parts = np.concatenate([form.by_tau, form.by_multiplier])
    # Least kappa with kappa I - constant - sum_k x_k part_k positive semidefinite, and |tau| <= 1.
    cone = [-_scaled_triangle(np.eye(len(form.constant)))]
    cone += [_scaled_triangle(part) for part in parts]
    limits = np.zeros((2 * n_tau, 1 + len(parts)))
    limits[:n_tau, 1 : 1 + n_tau] = np.eye(n_tau)
    limits[n_tau:, 1 : 1 + n_tau] = -np.eye(n_tau)
    rows = sparse.csc_matrix(np.vstack([np.transpose(cone), limits]))
    right = np.append(-_scaled_triangle(form.constant), np.ones(2 * n_tau))
    cost = np.eye(1, rows.shape[1])[0]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cones = [clarabel.PSDTriangleConeT(len(form.constant)), clarabel.NonnegativeConeT(2 * n_tau)]
    no_curvature = sparse.csc_matrix((rows.shape[1],) * 2)
    solver = clarabel.DefaultSolver(no_curvature, cost, rows, right, cones, settings)
    found = np.array(solver.solve().x)
    return np.clip(found[1 : 1 + n_tau], -1.0, 1.0), found[1 + n_tau :]


def proved_factor(form: Form, tau: Array, multipliers: Array) -> float:
    """Returns the largest eigenvalue of the form: a bound for any tau within [-1, 1] and any
    multipliers."""
    assert np.abs(tau).max() <= 1.0
    total = form.constant + np.tensordot(tau, form.by_tau, 1)
    total += np.tensordot(multipliers, form.by_multiplier, 1)
    return float(np.linalg.eigvalsh(total)[-1])


def sum_of_squares(vectors: Array, unevenness: float) -> Array:
    """Returns the sum over triples of (H - rho |L|)^2 of vectors (P, n, 2), made orthonormal: by
    their cross products and by twice the areas of triangles."""
    size, rotation = np.linalg.eigh(np.swapaxes(vectors, -1, -2) @ vectors)
    c = vectors @ (rotation / np.sqrt(size)[:, None])
    i, j, k = np.array(list(combinations(range(c.shape[1]), 3))).T
    sizes = np.abs(_cross(c[:, j], c[:, k])) + np.abs(_cross(c[:, i], c[:, k]))
    sizes += np.abs(_cross(c[:, i], c[:, j]))
    twice_area = np.abs(_cross(c[:, j] - c[:, i], c[:, k] - c[:, i]))
    return np.asarray(((sizes - unevenness * twice_area) ** 2).sum(axis=-1))


def _cross(a: Array, b: Array) -> Array:
    """Cross products of vectors (..., 2) of a plane."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _scaled_triangle(matrix: Array) -> Array:
    """The upper triangle of a symmetric matrix, column by column, with off-diagonal entries times
    sqrt 2: as Clarabel reads it."""
    row, column = np.tril_indices(len(matrix))
    scale = np.where(row == column, 1.0, np.sqrt(2.0))
    return np.asarray(scale * matrix[row, column])
