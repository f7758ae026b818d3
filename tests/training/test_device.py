"""Reduced precision is used where the hardware has it, and nowhere else."""

import pytest
import torch

from finlab.training.device import autocast_dtype, join_processes


@pytest.mark.parametrize(("has_it", "expected"), [(True, torch.bfloat16), (False, None)])
def test_precision_follows_the_processor(
    has_it: bool, expected: torch.dtype | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cpu, "_is_avx512_bf16_supported", lambda: has_it)
    assert autocast_dtype("cpu") is expected


def test_graphics_cards_always_have_it() -> None:
    assert autocast_dtype("cuda") is torch.bfloat16


def test_alone_there_is_nothing_to_join(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("RANK", raising=False)
    assert join_processes() == (0, 1)
    monkeypatch.setenv("RANK", "0")
    monkeypatch.setenv("WORLD_SIZE", "1")
    assert join_processes() == (0, 1)
