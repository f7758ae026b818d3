"""Messages in the core beside their formulas in numpy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from finlab.arrays import Array
from finlab.interaction.interaction import JetGeometry, lever_of
from finlab.interaction.messages import ROW_SIZES, Messages, unpack_rows
from finlab.layout.jet_geometry import jet_geometry_of
from finlab.research.random_layouts import random_jet_robot
from tests.interaction.message_formulas import JetPairs, complex_slope, pack_hull_rows


def geometry_of(seed: int, with_hull: bool = True) -> JetGeometry:
    """A random robot; one of its actuators has no jet."""
    rng = np.random.default_rng([91, seed])
    geometry = jet_geometry_of(random_jet_robot(rng, "robot", (4, 6)))
    diameter = geometry.diameter.copy()
    diameter[-1] = 0.0
    hull = np.array([[0.05, 0.0, -0.02], [0.3, 0.2, 0.1]]) if with_hull else np.zeros((2, 3))
    return geometry._replace(diameter=diameter, hull=hull)


def some_forces(geometry: JetGeometry, seed: int, count: int) -> Array:
    """Forces (count, n, 3) [N], of which one is at rest."""
    force = 8.0 * np.random.default_rng(seed).normal(size=(count, len(geometry.diameter), 3))
    force[0, 1] = 0.0
    return force


@pytest.mark.parametrize("seed", range(3))
def test_rows_and_slopes_are_those_of_the_formulas(seed: int) -> None:
    geometry = geometry_of(seed)
    messages = Messages(geometry)
    pairs = JetPairs(geometry)
    np.testing.assert_array_equal(messages.source, pairs.source)
    np.testing.assert_array_equal(messages.receiver, pairs.receiver)
    force = some_forces(geometry, seed, 3)
    source = force[:, pairs.source]
    receiver = force[:, pairs.receiver]
    rows, slopes = messages.rows_and_slopes(force)

    of_pairs, by_source = complex_slope(lambda varied: pairs.rows(varied, receiver), source)
    _, by_receiver = complex_slope(lambda varied: pairs.rows(source, varied), receiver)
    assert_allclose(rows["pair"], of_pairs, rtol=1e-12, atol=1e-13)
    by_both = np.concatenate([by_source, by_receiver], axis=-2)
    assert_allclose(slopes["pair"], by_both, rtol=1e-10, atol=1e-11)

    of_hull, by_force = complex_slope(lambda varied: pack_hull_rows(geometry, varied), force)
    assert_allclose(rows["hull"], of_hull, rtol=1e-12, atol=1e-13)
    assert_allclose(slopes["hull"], by_force, rtol=1e-10, atol=1e-11)

    without_slopes = messages.rows(force)
    for kind in ROW_SIZES:
        np.testing.assert_array_equal(without_slopes[kind], rows[kind])


def test_without_a_hull_there_are_messages_of_pairs_alone() -> None:
    messages = Messages(geometry_of(4, with_hull=False))
    force = some_forces(geometry_of(4), 4, 2)
    assert messages.rows(force)["hull"].shape == (2, 0, 16)
    assert messages.counts["hull"] == 0


@pytest.mark.parametrize("with_hull", [True, False])
def test_wrenches_and_slopes_are_sums_over_messages(with_hull: bool) -> None:
    """By factors that are linear in the features, as of the simplest model."""
    geometry = geometry_of(7, with_hull)
    messages = Messages(geometry)
    rng = np.random.default_rng(7)
    jacobian = {
        kind: 0.2 * rng.normal(size=(size.vectors, size.features))
        for kind, size in ROW_SIZES.items()
    }
    receivers = {"pair": messages.receiver, "hull": np.arange(messages.counts["hull"])}
    lever = lever_of(geometry.position)

    def factors_of(rows: dict[str, Array]) -> dict[str, Array]:
        return {kind: unpack_rows(kind, rows[kind])[0] @ jacobian[kind].T for kind in ROW_SIZES}

    def offset_of(force: Array) -> Array:
        rows = messages.rows(force)
        factors = factors_of(rows)
        offset = np.zeros((*force.shape[:-2], 6))
        for kind in ROW_SIZES:
            _, vectors = unpack_rows(kind, rows[kind])
            sent = (factors[kind][..., None] * vectors).sum(axis=-2)
            offset += np.einsum("...pb,pbw->...w", sent, lever[receivers[kind]])
        return offset

    force = some_forces(geometry, 8, 2)[1:]
    rows, slopes = messages.rows_and_slopes(force)
    jacobians = {
        kind: np.broadcast_to(jacobian[kind], (*rows[kind].shape[:-1], *jacobian[kind].shape))
        for kind in ROW_SIZES
    }
    offset, slope = messages.wrench_and_slope(rows, slopes, factors_of(rows), jacobians)
    assert_allclose(offset, offset_of(force), atol=1e-11)
    assert_allclose(messages.wrench(rows, factors_of(rows)), offset, atol=1e-13)
    step = 1e-5
    for i in range(force.shape[1]):
        for axis in range(3):
            change = np.zeros_like(force)
            change[:, i, axis] = step
            by_difference = (offset_of(force + change) - offset_of(force - change)) / (2.0 * step)
            assert_allclose(slope[:, i, axis], by_difference, atol=1e-7)
