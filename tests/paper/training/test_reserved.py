"""Shipped layouts are kept out of training."""

import math

import numpy as np
import pytest
import torch

from finlab.assets import shipped_layouts
from finlab.layout import (
    LayoutArrays,
    layout_from_arrays,
    load_layout,
    random_layout,
    random_layouts,
    stack_layouts,
)
from finlab.paper.training import sampling
from finlab.paper.training.sampling import Batch, ForwardSampler, find_reserved, shipped_reserved

SHIPPED = [load_layout(path) for path in shipped_layouts().values()]


def layouts_of(batch: Batch) -> LayoutArrays:
    return LayoutArrays(*(part.numpy() for part in batch[:5]))


@pytest.mark.parametrize("layout", SHIPPED, ids=lambda layout: layout.name)
def test_every_shipped_layout_is_recognised_in_any_order_and_nearly(layout):
    arrays = stack_layouts([layout])
    order = np.random.default_rng(0).permutation(layout.n_fins)

    def is_reserved(**changes: np.ndarray) -> bool:
        return bool(find_reserved(arrays._replace(**changes), shipped_reserved())[0])

    assert is_reserved()
    assert is_reserved(
        position=arrays.position[:, order] + 1e-3,
        mounting_angle=arrays.mounting_angle[:, order] - 4 * math.pi,
    )
    assert not is_reserved(position=arrays.position + 0.02)
    assert not is_reserved(mounting_angle=arrays.mounting_angle + 0.1)
    if layout.n_fins > 1:
        fewer = LayoutArrays(*(part[:, 1:] for part in arrays))
        assert not find_reserved(fewer, shipped_reserved())[0]


def test_padding_does_not_matter():
    wide = stack_layouts([*SHIPPED, random_layout(np.random.default_rng(0), n_fins=12)])
    wide = LayoutArrays(*(part[:-1] for part in wide))
    assert wide.mask.shape[1] == 12
    assert find_reserved(wide, shipped_reserved()).all()


def test_training_draws_none_of_them():
    for step in range(3):
        batch = ForwardSampler(seed=0, batch_size=2048).batch(step)
        assert not find_reserved(layouts_of(batch), shipped_reserved()).any()


def test_a_reserved_layout_that_is_drawn_is_changed_into_another(monkeypatch):
    """A shipped layout never comes up by chance, so two of the drawn layouts are reserved here."""
    before = ForwardSampler(3, 400).batch(0)
    taken = stack_layouts([layout_from_arrays(layouts_of(before), row) for row in (5, 77)])
    monkeypatch.setattr(sampling, "shipped_reserved", lambda: taken)
    after = ForwardSampler(3, 400).batch(0)
    changed = (before.position != after.position).any(-1).any(-1)
    assert torch.nonzero(changed).squeeze(1).tolist() == [5, 77]
    assert torch.equal(after.position[5, 0], -before.position[5, 0])
    assert not find_reserved(layouts_of(after), taken).any()


def test_random_layouts_are_not_reserved():
    assert not find_reserved(random_layouts(np.random.default_rng(0), 3000), shipped_reserved()).any()
