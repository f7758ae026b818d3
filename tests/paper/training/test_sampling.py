"""Streamed training data: reproducible, distributed as promised, with wrenches that the plant confirms."""

import math

import numpy as np
import pytest
import torch

from finlab.layout import FinModelSpec, LayoutArrays, Limits, layout_from_arrays
from finlab.layout.random import TRAINING_BOX
from finlab.paper.training.sampling import fresh_batch
from finlab.physics import Plant, make_law

DRAG = make_law(FinModelSpec())
BATCH = fresh_batch(DRAG, 20_000, seed=1)


def layouts_of(batch):
    return LayoutArrays(*(part.numpy() for part in batch[:5]))


def test_shapes_and_types():
    assert (
        BATCH.position.shape
        == BATCH.lower.shape
        == BATCH.upper.shape
        == BATCH.command.shape
        == (20_000, 5, 3)
    )
    assert BATCH.mounting_angle.shape == BATCH.mask.shape == (20_000, 5) and BATCH.wrench.shape == (20_000, 6)
    assert BATCH.mask.dtype == torch.bool
    assert all(part.dtype == torch.float32 for name, part in BATCH._asdict().items() if name != "mask")


def test_layouts_keep_to_the_training_box_and_fin_counts():
    assert (BATCH.position.abs() <= torch.tensor(TRAINING_BOX)).all()
    assert BATCH.mounting_angle.abs().max() <= math.pi + 1e-6
    count = BATCH.mask.sum(1)
    share = torch.bincount(count, minlength=6)[2:] / len(count)
    torch.testing.assert_close(share, torch.full((4,), 0.25), atol=0.015, rtol=0)
    assert (BATCH.mask == (torch.arange(5) < count[:, None])).all()
    absent = ~BATCH.mask
    assert not BATCH.position[absent].any() and not BATCH.command[absent].any()
    assert not BATCH.mounting_angle[absent].any()
    assert (BATCH.upper[absent] == torch.tensor(Limits().upper)).all()


def test_commands_fill_their_limits_and_never_leave_them():
    here = BATCH.mask
    command, lower, upper = BATCH.command[here], BATCH.lower[here], BATCH.upper[here]
    assert (command >= lower).all() and (command <= upper).all()
    unit = ((command - lower) / (upper - lower)).double()
    assert unit.mean(0).sub(0.5).abs().max() < 0.01
    assert unit.var(0).sub(1 / 12).abs().max() < 0.003


def test_half_of_the_layouts_have_limits_of_their_own():
    nominal = (BATCH.upper == torch.tensor(Limits().upper)).all(-1).all(-1)
    assert nominal.float().mean().item() == pytest.approx(0.5, abs=0.02)
    never = fresh_batch(DRAG, 500, seed=0, varied_limits=0.0)
    assert (never.upper == torch.tensor(Limits().upper)).all()


def test_the_plant_confirms_the_wrenches():
    arrays = layouts_of(BATCH)
    for row in range(40):
        layout = layout_from_arrays(arrays, row)
        command = BATCH.command[row, : layout.n_fins]
        np.testing.assert_allclose(Plant(layout).wrench(command), BATCH.wrench[row], rtol=1e-4, atol=1e-4)


def test_another_fin_model():
    batch = fresh_batch(make_law(FinModelSpec("lighthill")), 100, seed=0)
    assert not torch.equal(batch.wrench, fresh_batch(DRAG, 100, seed=0).wrench)
