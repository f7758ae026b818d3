"""Attainable sets: closed forms, brute force, symmetry, and what a lost fin does to them."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.analysis import AttainableSet, attainable_set
from finlab.errors import LayoutError
from finlab.forces.attainable import _sphere
from finlab.forces.force_sets import SCALE, force_sets
from finlab.layout import Layout
from tests.forces.conftest import THRUST

Array = NDArray[np.float64]
Layouts = Callable[[str], Layout]
OWN = {"force": slice(0, 3), "torque": slice(3, 6)}


def outside(body: AttainableSet, points: Array) -> float:
    """How far the farthest of points (P, 3) lies outside any face of a body."""
    a, b, c = (body.vertices[body.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    size = np.linalg.norm(normals, axis=-1)
    normals, a = normals[size > 1e-12] / size[size > 1e-12, None], a[size > 1e-12]
    return float(((points @ normals.T) - (a * normals).sum(-1)).max())


@pytest.mark.parametrize("kind", ["force", "torque"])
def test_sets_with_all_else_zero_hold_what_was_found_otherwise(shipped: Layouts, kind: str) -> None:
    # Sums of planar forces that leave no other wrench, made by projecting random ones and shrinking them.
    layout = shipped("mixed")
    sets = force_sets(layout)
    own, other = OWN[kind], OWN["torque" if kind == "force" else "force"]
    effectiveness = sets.effectiveness[0].reshape(-1, 6)
    _, _, directions = np.linalg.svd(effectiveness[:, other].T)
    kept = directions[3:]
    drawn = np.random.default_rng(0).standard_normal((20_000, len(kept))) @ kept
    thrust = np.linalg.norm(drawn.reshape(-1, layout.n_fins, 2), axis=-1)
    drawn /= (thrust / sets.radius[0]).max(axis=-1)[:, None]
    points = (drawn @ effectiveness)[:, own] * SCALE[own]
    body = attainable_set(layout, kind)
    assert outside(body, points) <= body.gap + 1e-6
    # The draws reach most of the way in every direction.
    reach = (body.vertices @ points.T).max(axis=1) / (body.vertices**2).sum(-1)
    assert reach.min() > 0.6
    assert np.quantile(reach, 0.5) > 0.85


def test_a_pair_gives_a_disc(shipped: Layouts) -> None:
    disc = attainable_set(shipped("pair"), "force")
    assert disc.dimension == 2
    assert len(disc.faces) == 0
    assert len(disc.outline) == len(disc.vertices)
    assert np.linalg.norm(disc.vertices, axis=-1) == pytest.approx(2 * THRUST, rel=1e-4)
    assert np.abs(disc.vertices[:, 1]).max() < 1e-9


def test_no_yaw_gives_no_yaw(shipped: Layouts) -> None:
    flat = attainable_set(shipped("no_yaw"), "torque")
    assert flat.dimension == 2
    assert np.abs(flat.vertices[:, 2]).max() < 1e-9
    assert np.abs(flat.vertices[:, 0]).max() == pytest.approx(2 * 0.25 * THRUST, rel=1e-3)


def test_one_fin_alone_gives_nothing_without_torque(shipped: Layouts) -> None:
    layout = shipped("A")
    one = attainable_set(layout, "force", failed=layout.names[1:])
    assert one.dimension == 0
    assert np.abs(one.vertices).max() < 1e-4
    assert attainable_set(layout, "force", failed=layout.names).dimension == 0


def test_layout_a_looks_the_same_in_the_mirror(shipped: Layouts) -> None:
    body = attainable_set(shipped("A"), "force")
    for mirror in ([-1, 1, 1], [1, -1, 1], [1, 1, -1]):
        assert outside(body, body.vertices * mirror) <= body.gap + 1e-6


@pytest.mark.parametrize("kind", ["force", "torque"])
@pytest.mark.parametrize("name", ["A", "restricted"])
def test_losing_a_fin_never_enlarges_a_set(shipped: Layouts, name: str, kind: str) -> None:
    layout = shipped(name)
    whole = attainable_set(layout, kind, tolerance=0.05)
    left = attainable_set(layout, kind, failed=layout.names[:1], tolerance=0.05)
    assert outside(whole, left.vertices) <= whole.gap + 1e-4


def test_faces_are_seen_from_outside(shipped: Layouts) -> None:
    body = attainable_set(shipped("A"), "torque")
    a, b, c = (body.vertices[body.faces[:, k]] for k in range(3))
    assert ((np.cross(b - a, c - a) * (a + b + c)).sum(-1) > -1e-12).all()


def test_an_unknown_failed_fin_is_an_error(shipped: Layouts) -> None:
    with pytest.raises(LayoutError, match="has no fin 'nobody'"):
        attainable_set(shipped("A"), "force", failed=("nobody",))


def test_directions_are_spread_evenly() -> None:
    """As far apart as the same number of circles that tile the sphere, or nearly."""
    for n in (50, 400):
        points = _sphere(n)
        np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0)
        near = np.sort(points @ points.T, axis=1)[:, -2]
        gap = np.arccos(near) / np.sqrt(4.0 * np.pi / n)
        assert gap.min() > 0.86 and gap.max() < 1.0  # the golden angle leaves no near pair
