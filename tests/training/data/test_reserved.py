"""Shipped layouts are kept out of training."""

import math

import numpy as np
import pytest
import torch

from finlab.assets import shipped_layouts
from finlab.layout import LayoutArrays, layout_from_arrays, load_layout, random_layouts, stack_layouts
from finlab.training.data import sampling
from finlab.training.data.reserved import ReservedLayouts, shipped_reserved
from finlab.training.data.sampling import ForwardSampler, sample_layouts, seeded_generator


def is_reserved(position, angle):
    """Whether one layout, fins at (n, 3) with angles (n,), is a shipped one."""
    return bool(shipped_reserved().matches(position[None], angle[None])[0])


SHIPPED = [load_layout(path) for path in shipped_layouts().values()]


@pytest.mark.parametrize("layout", SHIPPED, ids=lambda layout: layout.name)
def test_every_shipped_layout_is_recognised_in_any_order_and_nearly(layout):
    arrays = stack_layouts([layout])
    position, angle = arrays.position[0], arrays.mounting_angle[0]
    order = np.random.default_rng(0).permutation(layout.n_fins)
    assert is_reserved(position, angle)
    assert is_reserved(position[order] + 1e-3, angle[order] - 4 * math.pi)
    assert not is_reserved(position + 0.02, angle)
    assert not is_reserved(position, angle + 0.1)
    if layout.n_fins > 1:
        assert not is_reserved(position[1:], angle[1:])


def test_training_draws_none_of_them():
    reserved = shipped_reserved()
    for step in range(3):
        batch = ForwardSampler(seed=0, batch_size=2048).batch(step)
        assert not reserved.matches(
            batch.position.numpy(), batch.mounting_angle.numpy(), batch.mask.numpy()
        ).any()


def test_a_reserved_layout_that_is_drawn_is_changed_into_another(monkeypatch):
    """A shipped layout never comes up by chance, so two of the drawn layouts are reserved here."""
    before = sample_layouts(seeded_generator(3, 0), 400)
    drawn = LayoutArrays(*(part.numpy() for part in before))
    taken = ReservedLayouts([layout_from_arrays(drawn, row) for row in (5, 77)])
    monkeypatch.setattr(sampling, "shipped_reserved", lambda: taken)
    after = sample_layouts(seeded_generator(3, 0), 400)
    changed = (before.position != after.position).any(-1).any(-1)
    assert torch.nonzero(changed).squeeze(1).tolist() == [5, 77]
    assert torch.equal(after.position[5, 0], -before.position[5, 0])
    assert not taken.matches(after.position.numpy(), after.mounting_angle.numpy(), after.mask.numpy()).any()


def test_the_sieve_misses_no_reserved_place():
    sieve = shipped_reserved().sieve
    rng = np.random.default_rng(0)
    for layout in SHIPPED:
        for x, y, _ in (fin.position for fin in layout.fins):
            near = np.array([x, y]) + rng.uniform(-1.4e-3, 1.4e-3, (50, 2))
            cell = ((near + sieve.reach) / sieve.cell).astype(int).clip(0, len(sieve.occupied) - 1)
            assert sieve.occupied[cell[:, 0], cell[:, 1]].all()
    assert sieve.occupied.mean() < 0.01


def test_random_layouts_are_not_reserved():
    arrays = random_layouts(np.random.default_rng(0), 3000)
    assert not shipped_reserved().matches(arrays.position, arrays.mounting_angle, arrays.mask).any()
