"""What the network sees: the same in both libraries, equivariant, blind to padding, and as documented."""

import math

import numpy as np
import pytest
import torch

from finlab.inference.features import (
    FIN_FRAME_SIZE,
    FULL_FORCE,
    RAW_SIZE,
    RIDGE,
    SIZES,
    fin_frame_features,
    geometry,
    raw_features,
)
from finlab.layout import Fin, Layout, LayoutArrays, Limits, random_layouts, stack_layouts
from finlab.layout.arrays import force_columns

STD = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.34])


@pytest.fixture
def arrays() -> LayoutArrays:
    """Eight random layouts of 2-5 fins, half with limits of their own."""
    return random_layouts(np.random.default_rng(3), 8, limits="mixed")


@pytest.fixture
def target() -> np.ndarray:
    return np.random.default_rng(4).normal(size=(8, 6))


def fin_frame(arrays: LayoutArrays, target: np.ndarray) -> np.ndarray:
    *layout, mask = arrays
    return np.asarray(fin_frame_features(geometry(*layout, STD, mask), target))


def test_widths_are_what_they_say(arrays: LayoutArrays, target: np.ndarray) -> None:
    assert SIZES == {"raw": RAW_SIZE, "fin_frame": FIN_FRAME_SIZE} == {"raw": 10, "fin_frame": 25}
    assert raw_features(*arrays[:4]).shape == (8, 5, 10)
    assert fin_frame(arrays, target).shape == (8, 5, 25)


def test_numpy_and_torch_agree(arrays: LayoutArrays, target: np.ndarray) -> None:
    tensors = [torch.from_numpy(value) for value in arrays]
    np.testing.assert_allclose(raw_features(*tensors[:4]).numpy(), raw_features(*arrays[:4]), rtol=1e-12)
    got = fin_frame_features(
        geometry(*tensors[:4], torch.from_numpy(STD), tensors[4]), torch.from_numpy(target)
    )
    np.testing.assert_allclose(got.numpy(), fin_frame(arrays, target), rtol=1e-9, atol=1e-12)


def test_single_precision_is_good_enough(arrays: LayoutArrays, target: np.ndarray) -> None:
    tensors = [torch.from_numpy(value).float() for value in arrays[:4]]
    mask = torch.from_numpy(arrays.mask)
    static = geometry(*tensors, torch.from_numpy(STD).float(), mask)
    got = fin_frame_features(static, torch.from_numpy(target).float())
    assert got.dtype == torch.float32
    np.testing.assert_allclose(got.numpy(), fin_frame(arrays, target), atol=5e-3)


def test_fins_may_come_in_any_order(arrays: LayoutArrays, target: np.ndarray) -> None:
    order = [3, 0, 4, 2, 1]
    shuffled = LayoutArrays(*(value[:, order] for value in arrays))
    np.testing.assert_allclose(fin_frame(shuffled, target), fin_frame(arrays, target)[:, order], atol=1e-9)
    np.testing.assert_array_equal(raw_features(*shuffled[:4]), raw_features(*arrays[:4])[:, order])


def test_padding_does_not_change_the_real_fins(arrays: LayoutArrays, target: np.ndarray) -> None:
    dirty = LayoutArrays(*(value.copy() for value in arrays))
    dirty.position[~dirty.mask] = 7.0
    dirty.mounting_angle[~dirty.mask] = 1.0
    padded = fin_frame(dirty, target)
    for row, n in enumerate(arrays.mask.sum(1)):
        alone = LayoutArrays(*(value[row : row + 1, :n] for value in arrays))
        np.testing.assert_allclose(padded[row, :n], fin_frame(alone, target[row : row + 1])[0], atol=1e-9)


def test_one_layout_serves_many_targets(arrays: LayoutArrays, target: np.ndarray) -> None:
    one = LayoutArrays(*(value[:1] for value in arrays))
    many = fin_frame(one, target)
    for row in range(8):
        np.testing.assert_allclose(many[row], fin_frame(one, target[row : row + 1])[0], atol=1e-12)


def test_columns_are_the_geometry_of_the_layout_module(arrays: LayoutArrays) -> None:
    *layout, mask = arrays
    columns = geometry(*layout, STD, mask).columns  # (B, 6, 2n)
    share = (arrays.upper[..., 0] * arrays.upper[..., 1] / (0.6 * 2.1)) ** 2 * mask
    planar = force_columns(arrays.position, arrays.mounting_angle)[..., 1:, :]
    effect = np.swapaxes(planar, -1, -2)  # (B, n, 6, 2)
    expected = effect / STD[:, None] * (FULL_FORCE * share)[..., None, None]
    np.testing.assert_allclose(columns.reshape(8, 6, 5, 2).transpose(0, 2, 1, 3), expected, atol=1e-12)


def test_the_solver_is_the_regularized_pseudo_inverse(arrays: LayoutArrays) -> None:
    *layout, mask = arrays
    known = geometry(*layout, STD, mask)
    for columns, solver in zip(known.columns, known.solver, strict=True):
        expected = columns.T @ np.linalg.inv(columns @ columns.T + RIDGE * np.eye(6))
        np.testing.assert_allclose(solver, expected, atol=1e-8)
    full = LayoutArrays(*(value[:1] for value in random_layouts(np.random.default_rng(0), 1, n_fins=5)))
    known = geometry(*full[:4], STD, full.mask)
    assert np.linalg.matrix_rank(known.columns[0]) == 6
    np.testing.assert_allclose(known.columns[0] @ known.solver[0], np.eye(6), atol=0.1)


def test_documented_meaning_of_every_feature_on_a_hand_made_fin() -> None:
    # One fin in front, shaft forward (a = 0): e_h is +y; half a nominal fin's A f, so a quarter of its force.
    limits = Limits((0.06, 0.3), (0.21, 2.1), (-math.pi / 2, math.pi))
    layout = Layout("one", (Fin("bow", (0.3, 0.1, -0.2), 0.0, limits),))
    arrays = stack_layouts([layout])
    target = np.array([[0.0, 0.5, -0.25, 0.0, 0.0, 0.0]])
    feature = fin_frame(arrays, target)[0, 0]
    force = 0.25 * FULL_FORCE
    horizontal = np.array([0, 1, 0, 0.2, 0, 0.3]) * force / STD  # e_h and r x e_h
    vertical = np.array([0, 0, 1, 0.1, -0.3, 0]) * force / STD  # e_z and r x e_z
    np.testing.assert_allclose(feature[:5], horizontal[[0, 1, 3, 4, 5]] / 4)
    np.testing.assert_allclose(feature[5:8], vertical[[2, 3, 4]] / 4)
    b = np.stack([horizontal, vertical], axis=1)
    hat = b.T @ np.linalg.solve(b @ b.T + RIDGE * np.eye(6), b)
    np.testing.assert_allclose(feature[8:11], [hat[0, 0], hat[1, 1], hat[0, 1]], atol=1e-8)
    assert feature[8] > 0.99  # the only fin: everything depends on it
    assert feature[11] == pytest.approx(0.25)
    np.testing.assert_allclose(feature[12:18], [0.1, 0.5, 0.1, 1.0, -0.5, 1.0])
    share = np.linalg.solve(b.T @ b + RIDGE * np.eye(2), b.T @ target[0])
    np.testing.assert_allclose(feature[18:20], share, atol=1e-8)
    size = np.linalg.norm(share)
    np.testing.assert_allclose(feature[20:22], share / size, atol=1e-4)
    assert feature[22] == pytest.approx(size**0.25, rel=1e-3)
    np.testing.assert_allclose(feature[23:25], b.T @ target[0] * 0.1, atol=1e-12)


def test_documented_meaning_of_the_raw_features() -> None:
    layout = Layout(
        "one", (Fin("bow", (0.3, -0.15, 0.06), math.pi / 2, Limits((0.06, 0.3), (0.21, 2.1), (-1.0, 2.0))),)
    )
    arrays = stack_layouts([layout])
    expected = [1.0, -0.5, 0.2, 0.5, 0.1, 0.5, 0.1, 1.0, -1.0 / math.pi, 2.0 / math.pi]
    np.testing.assert_allclose(raw_features(*arrays[:4])[0, 0], expected)


def test_features_do_not_depend_on_where_forward_is(arrays: LayoutArrays, target: np.ndarray) -> None:
    """Turning robot and target together leaves what a fin is asked for, where the yardstick turns along."""
    std = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.34])
    yaw = 1.1
    c, s = math.cos(yaw), math.sin(yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turned = arrays._replace(
        position=arrays.position @ rotation.T, mounting_angle=arrays.mounting_angle + yaw
    )
    target_turned = np.concatenate([target[:, :3] @ rotation.T, target[:, 3:] @ rotation.T], axis=1)
    invariant = [*range(8, 12), *range(12, 18), *range(18, 25)]
    before = fin_frame_features(geometry(*arrays[:4], std, arrays.mask), target)
    after = fin_frame_features(geometry(*turned[:4], std, turned.mask), target_turned)
    np.testing.assert_allclose(after[..., invariant], before[..., invariant], atol=1e-8)
    assert np.abs(after - before).max() > 0.1  # the wrenches of features 0-7 do turn


def test_a_layout_without_authority_gives_finite_features() -> None:
    arrays = stack_layouts([Layout("one", (Fin("fin", (0.0, 0.0, 0.0), 0.0, Limits()),))])
    assert np.isfinite(fin_frame(arrays, np.zeros((1, 6)))).all()
    assert np.isfinite(fin_frame(arrays, np.full((1, 6), 50.0))).all()
