"""Factors K of balls in zonotopes are proved, attained, and hold of columns at random."""

from itertools import combinations

import numpy as np
import pytest

from finlab.analysis.zonotope_ball import PLANAR_FACTORS, UNEVENNESS, ball_factor, inradius_factor
from tests.analysis.planar_factor import MULTIPLIERS, pair_index, relations, sums_of_triples
from tests.analysis.uneven_factor import (
    Signs,
    form_of,
    proposed_multipliers,
    proved_factor,
    sign_classes,
    sum_of_squares,
    triple_rows,
)
from tests.analysis.zonotope_oracle import largest_ball


@pytest.mark.parametrize("n", MULTIPLIERS)
def test_the_planar_factor_is_proved_and_attained(n: int) -> None:
    index = pair_index(n)
    form = sums_of_triples(n)
    angles = np.sort(np.random.default_rng(n).uniform(0.0, np.pi, n))
    size = np.random.default_rng(n).uniform(0.5, 2.0, n)
    crosses = np.array([size[a] * size[b] * np.sin(angles[b] - angles[a]) for a, b in index])
    total = form.copy()
    for gaps, relation in relations(n):
        assert abs(crosses @ relation @ crosses) < 1e-12, "a relation does not hold"
        total += MULTIPLIERS[n][gaps] * relation
    factor = inradius_factor(n, n - 2)
    assert np.linalg.eigvalsh(total)[-1] <= factor * (1.0 + 1e-9)
    even = np.array([2.0 / n * np.sin(np.pi / n * (b - a)) for a, b in index])
    assert even @ even == pytest.approx(1.0)
    assert even @ form @ even == pytest.approx(factor)
    assert factor < inradius_factor(n + 1, n - 1) and factor < 3.0 * (n - 2)


def test_the_factors_are_attained() -> None:
    """By orthogonal columns, by a simplex, and by four even directions of a plane."""
    simplex = np.linalg.svd(np.eye(7) - 1.0 / 7.0)[0][:, :6] * np.sqrt(7.0 / 6.0)
    even = np.pi / 4.0 * np.arange(4)
    for columns in (np.eye(6), simplex, np.stack([np.cos(even), np.sin(even)], axis=-1)):
        information = columns.T @ columns
        factor = inradius_factor(*columns.shape)
        bound = np.sqrt(factor / np.trace(np.linalg.inv(information)))
        assert largest_ball(columns[None])[0] == pytest.approx(bound, rel=1e-9)


@pytest.mark.parametrize("n", PLANAR_FACTORS)
@pytest.mark.parametrize("unevenness", UNEVENNESS[1:])
def test_the_uneven_factor_is_proved(n: int, unevenness: float) -> None:
    """For vectors in half a plane, which are the best."""
    form = form_of(n, (1,) * n, unevenness)
    proved = proved_factor(form, *proposed_multipliers(form))
    assert proved <= inradius_factor(n, n - 2, unevenness) <= proved * (1.0 + 2e-4)


def other_signs() -> list[tuple[int, Signs]]:
    """Numbers of vectors with all their signs but those of half a plane."""
    return [(n, signs) for n in PLANAR_FACTORS for signs in sign_classes(n)[1:]]


@pytest.mark.exhaustive
@pytest.mark.parametrize("unevenness", UNEVENNESS[1:])
@pytest.mark.parametrize(("n", "signs"), other_signs())
def test_the_uneven_factor_is_proved_of_all_signs(n: int, signs: Signs, unevenness: float) -> None:
    form = form_of(n, signs, unevenness)
    proved = proved_factor(form, *proposed_multipliers(form))
    assert proved <= inradius_factor(n, n - 2, unevenness)


def test_the_classes_of_signs_are_all() -> None:
    """Turns, mirror images and reversals of the classes give each choice of signs once."""
    assert [len(sign_classes(n)) for n in (4, 5, 6, 7, 8)] == [2, 4, 5, 9, 12]
    # By Burnside's lemma, with a turn by n lines a reversal of all signs.
    for n in (4, 6, 8):
        assert sign_classes(n)[0] == (1,) * n


@pytest.mark.parametrize("n", PLANAR_FACTORS)
def test_forms_are_the_sums_of_squares_of_vectors(n: int) -> None:
    """Cross products of vectors in the order of their lines, and areas of triangles."""
    random = np.random.default_rng(n)
    angle = np.sort(random.uniform(0.0, np.pi, (1, n)))
    signs = random.choice([-1, 1], n)
    size = signs * random.uniform(0.5, 2.0, (1, n))
    vectors = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)
    norm = np.sqrt(np.linalg.det(np.swapaxes(vectors, -1, -2) @ vectors))[0]
    crosses = [
        abs(np.linalg.det(vectors[0, list(pair)])) / norm for pair in combinations(range(n), 2)
    ]
    terms = [
        size_row @ crosses - 0.3 * abs(area_row @ crosses)
        for size_row, area_row in triple_rows(n, signs)
    ]
    assert sum_of_squares(vectors, 0.3)[0] == pytest.approx(np.square(terms).sum())
    form = form_of(n, signs, 0.3)
    zero = np.zeros(len(form.by_multiplier))
    for tau in (-1.0, 0.0, 0.7):
        total = proved_factor(form, np.full(len(form.by_tau), tau), zero)
        assert np.square(terms).sum() <= total
    assert abs(form.by_multiplier @ crosses @ crosses).max() < 1e-12, "a relation does not hold"


@pytest.mark.parametrize("n", PLANAR_FACTORS)
def test_no_random_vectors_exceed_the_uneven_factor(n: int) -> None:
    random = np.random.default_rng(n)
    vectors = random.standard_normal((4_000, n, 2))
    # Half of them near a line that misses the origin, as the best are.
    vectors[::2] *= (0.1, 1.0)
    vectors[::2, :, 0] += 0.5
    for unevenness in (0.0, 0.05, *UNEVENNESS, 0.7, 1.0):
        largest = sum_of_squares(vectors, unevenness).max()
        factor = inradius_factor(n, n - 2, unevenness)
        assert 0.85 * factor < largest <= factor


@pytest.mark.parametrize(("n", "m"), [(6, 4), (8, 6)])
def test_balls_of_uneven_columns_keep_it(n: int, m: int) -> None:
    """Balls by all facets, of columns near the best, are within a bound that needs rho."""
    random = np.random.default_rng(n)
    unevenness = 0.2
    half_range = 1.0 / (1.0 + unevenness)
    least = np.full(n, -(1.0 - unevenness) * half_range)
    most = np.ones(n)
    factor, force = ball_factor(least, most, n, m)
    assert factor == inradius_factor(n, m, unevenness) < 0.94 * inradius_factor(n, m)
    assert force == pytest.approx(half_range)
    turns = np.pi / n * (np.arange(n) - 0.5 * (n - 1))
    # The outer ones are longer, so that all are nearer to a line.
    fan = np.stack([np.cos(turns), np.sin(turns)], axis=-1) / np.cos(turns)[:, None] ** 0.25
    fans = fan + 0.05 * random.standard_normal((500, n, 2))
    # Columns whose null space the fans span, in a basis that is nearly orthonormal.
    basis = np.linalg.svd(fans)[0][..., 2:]
    columns = basis @ (np.eye(m) + 0.03 * random.standard_normal((500, m, m)))
    columns *= half_range
    share = largest_ball(columns, unevenness) ** 2 / factor
    share *= np.trace(np.linalg.inv(np.swapaxes(columns, -1, -2) @ columns), axis1=1, axis2=2)
    assert 0.85 < share.max() <= 1.0


def test_even_limits_are_no_better_known_than_before() -> None:
    for n, m in ((6, 6), (7, 6), (8, 6), (9, 6)):
        factor, force = ball_factor(np.full(n, -40.0), np.full(n, 40.0), n, m)
        assert factor == inradius_factor(n, m)
        assert force == pytest.approx(40.0)


def test_thrusters_that_differ_take_the_least_unevenness() -> None:
    """The weaker ways are raised until all are as uneven, where that bounds them by less."""
    most = np.array([50.0] * 7 + [49.0])
    least = np.array([-40.0] * 8)
    factor, force = ball_factor(least, most, 8, 6)
    unevenness = 4.5 / 44.5
    assert factor == pytest.approx(inradius_factor(8, 6, unevenness))
    assert force == pytest.approx(np.append(np.full(7, 50.0), 49.0) / (1.0 + unevenness))
    # One that is even: half of the ranges are less.
    most[-1] = 40.0
    factor, force = ball_factor(least, most, 8, 6)
    assert factor == inradius_factor(8, 6)
    assert force == pytest.approx(np.append(np.full(7, 45.0), 40.0))
    # Which way is the stronger one is no matter.
    turned = ball_factor(-most[::-1], -least[::-1], 8, 6)
    assert turned.factor == factor and (turned.force == force[::-1]).all()
