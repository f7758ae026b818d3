"""Intervals against known spreads, and whether reruns land inside them."""

import numpy as np
import pytest

from finlab.evaluation.scoring import (
    mean_interval,
    ratio_interval,
    share_interval,
)

GROUPS, EACH = 100, 20
SPREAD = 1.96 * np.sqrt(2.0)


def _draw(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Values that resemble each other within a group: the spread of groups is what counts."""
    rng = np.random.default_rng(seed)
    group = np.repeat(np.arange(GROUPS), EACH)
    return 5.0 + np.repeat(rng.normal(size=GROUPS), EACH) + 0.1 * rng.normal(size=len(group)), group


def test_the_width_is_that_of_the_groups() -> None:
    values, group = _draw(0)
    low, high = mean_interval(values, group)
    assert high - low == pytest.approx(2 * SPREAD / np.sqrt(GROUPS), rel=0.15)


@pytest.mark.parametrize("kind", ["mean", "share", "ratio"])
def test_reruns_land_inside(kind: str) -> None:
    def look(seed: int) -> tuple[float, object]:
        values, group = _draw(seed)
        if kind == "mean":
            return values.mean(), mean_interval(values, group)
        if kind == "share":
            return (values < 5.5).mean(), share_interval(values < 5.5, group)
        below = values + np.random.default_rng(seed + 999).normal(size=GROUPS).repeat(EACH)
        return values.sum() / below.sum(), ratio_interval(values, below, group)

    seen = [look(seed) for seed in range(24)]
    inside = [low <= value <= high for value, _ in seen for _, (low, high) in seen]
    assert np.mean(inside) > 0.88


def test_no_failure_is_no_proof() -> None:
    low, high = share_interval(np.ones(1000, bool), np.arange(1000) // 10)
    assert high == 1.0 and 0.985 < low < 0.997


def test_one_layout_is_drawn_by_its_targets() -> None:
    values = np.random.default_rng(0).normal(size=400)
    low, high = mean_interval(values, np.zeros(400, np.int64))
    assert 0 < high - low == pytest.approx(2 * SPREAD / 20, rel=0.2)


def test_same_seed_same_interval() -> None:
    values, group = _draw(1)
    assert mean_interval(values, group) == mean_interval(values, group)
