"""The data set of the paper's training: what is in it, and that an epoch meets every sample once."""

import numpy as np
import pytest
import torch

from finlab.errors import DataError
from finlab.layout import FinModelSpec
from finlab.paper.training.recipes import SampledTraining
from finlab.paper.training.sampling import Batch, RecordedSamples
from finlab.physics import assemble_wrench, make_law

DRAG = make_law(FinModelSpec())


def samples(seed: int = 3, batch_size: int = 12, layouts: int = 8, commands: int = 6) -> RecordedSamples:
    training = SampledTraining(1, batch_size, 1e-3, layouts=layouts, commands=commands)
    return RecordedSamples(DRAG, training, seed, torch.device("cpu"))


def whole_epoch(data: RecordedSamples, epoch: int = 0) -> Batch:
    batches = [data.batch(4 * epoch + k) for k in range(4)]
    return Batch(*(torch.cat(parts) for parts in zip(*batches, strict=True)))


def test_every_layout_has_its_commands_within_its_limits() -> None:
    batch = whole_epoch(samples())
    places = batch.position.flatten(1).unique(dim=0)
    assert len(places) == 8
    for place in places:
        mine = (batch.position.flatten(1) == place).all(1)
        assert mine.sum() == 6 and len(batch.command[mine].flatten(1).unique(dim=0)) == 6
    inside = (batch.command >= batch.lower - 1e-6) & (batch.command <= batch.upper + 1e-6)
    assert inside[batch.mask].all() and not batch.command[~batch.mask].any()


def test_wrenches_are_those_of_the_law() -> None:
    batch = whole_epoch(samples())
    place = batch.position.double(), batch.mounting_angle.double(), batch.mask
    expected = assemble_wrench(DRAG, batch.command.double().numpy(), *(part.numpy() for part in place))
    np.testing.assert_allclose(batch.wrench.numpy(), expected, atol=1e-5)


def test_an_epoch_meets_every_sample_once_each_time_in_another_order() -> None:
    data = samples()
    first, second = (whole_epoch(data, epoch).wrench for epoch in (0, 1))
    assert len(first.unique(dim=0)) == data.size == 48
    torch.testing.assert_close(first.unique(dim=0), second.unique(dim=0))
    assert not torch.equal(first, second)


def test_batches_depend_on_seed_and_number_alone() -> None:
    data, again = samples(), samples()
    wanted = data.batch(9)
    again.batch(2)
    for got, expected in zip(again.batch(9), wanted, strict=True):
        assert torch.equal(got, expected)
    assert not torch.equal(samples(seed=4).batch(9).wrench, wanted.wrench)


def test_layouts_do_not_depend_on_how_many_are_drawn_together(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = samples().batch(0)
    monkeypatch.setattr("finlab.paper.training.sampling.CHUNK", 12)
    got = samples().batch(0)
    torch.testing.assert_close(got.position, expected.position)
    assert got.command.shape == expected.command.shape


def test_batches_larger_than_the_data_are_refused() -> None:
    with pytest.raises(DataError, match="batches of 49 samples .* got 8 layouts x 6 commands"):
        samples(batch_size=49)
