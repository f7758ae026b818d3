"""Padding: every fin has its row, once, and rows come back to where they were."""

import pytest
import torch

from finlab.research.networks.padding import BLOCK, Padding


@pytest.mark.parametrize("robots", [1, 7, 40, 256])
def test_rows_are_all_fins_once_in_whole_blocks(robots: int) -> None:
    mask = torch.rand((robots, 5), generator=torch.Generator().manual_seed(robots)) < 0.7
    index = Padding.of(mask).index
    fins = int(mask.sum())
    assert mask.flatten()[index[:fins]].all() and not mask.flatten()[index[fins:]].any()
    assert len(index.unique()) == len(index)
    assert len(index) == min(-(-fins // BLOCK) * BLOCK, mask.numel())


def test_what_is_padded_again_is_as_it_was() -> None:
    mask = torch.tensor([[True, False, True], [False, True, False]])
    values = torch.randn(2, 3, 4)
    padding = Padding.of(mask)
    found = padding.padded(padding.rows(values))
    assert torch.equal(found[mask], values[mask])
    of_robots = padding.padded(padding.rows_of_robots(torch.tensor([1.0, 2.0])))
    assert torch.equal(of_robots[mask], torch.tensor([1.0, 1.0, 2.0]))
