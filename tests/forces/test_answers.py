"""How single fins answer: within their sets, furthest along the pull, with true derivatives."""

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces.answers import Answer, cheap, strong
from finlab.forces.fin_sets import FinSets

Array = NDArray[np.float64]
HALVES = [0.0, 0.4, np.pi / 2, 1.9, 2.9, np.pi]


def fins(half: float, rows: int = 200) -> FinSets:
    """Robots of one fin that pushes along x and y alone."""
    rng = np.random.default_rng(0)
    columns = np.zeros((rows, 1, 2, 6))
    columns[:, 0, 0, 0] = columns[:, 0, 1, 1] = 1.0
    middle = rng.uniform(-np.pi, np.pi, (rows, 1))
    return FinSets(columns, np.full((rows, 1), 3.0), middle, np.full((rows, 1), half))


def pulls(rows: int = 200) -> Array:
    return np.random.default_rng(1).standard_normal((rows, 1, 2)) * 2.0


def sector(sets: FinSets, row: int) -> Array:
    """Points (S, 2) all over one fin's sector, its rim and its tip included."""
    angle = sets.middle[row, 0] + np.linspace(-1.0, 1.0, 721) * sets.half[row, 0]
    rim = sets.radius[row, 0] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.concatenate([rim * share for share in np.linspace(0.0, 1.0, 60)])


@pytest.mark.parametrize("half", HALVES)
def test_farthest_is_the_farthest_point_of_the_sector(half: float) -> None:
    sets, pull = fins(half), pulls()
    normal = np.pad(pull[:, 0], ((0, 0), (0, 4)))
    reach, force = sets.farthest(normal)
    assert np.allclose((force * pull).sum((-1, -2)), reach)
    for row in range(0, 200, 20):
        best = (sector(sets, row) @ pull[row, 0]).max()
        assert best - 1e-9 <= reach[row] <= best + 1e-3


@pytest.mark.parametrize("half", HALVES)
@pytest.mark.parametrize("answer", [strong, cheap])
def test_derivatives_are_true(answer: Answer, half: float) -> None:
    sets, pull = fins(half), pulls()
    softness = np.full((200, 1), 0.3)
    _, force, follow = answer(sets, pull, softness)
    for axis in range(2):
        step = np.zeros(2)
        step[axis] = 1e-6
        up, down = (answer(sets, pull + sign * step, softness) for sign in (1.0, -1.0))
        assert np.allclose((up[0] - down[0]) / 2e-6, force[..., axis], atol=1e-6)
        slope = (up[1] - down[1]) / 2e-6
        # A pull that lies on a kink of the slope, by chance, has none.
        assert np.quantile(np.abs(slope - follow[..., axis]).max((-1, -2)), 0.98) < 1e-4


@pytest.mark.parametrize("half", HALVES)
@pytest.mark.parametrize("answer", [strong, cheap])
def test_answers_lie_within_the_set(answer: Answer, half: float) -> None:
    sets = fins(half)
    _, force, _ = answer(sets, pulls(), np.full((200, 1), 0.3))
    angle = np.linspace(-np.pi, np.pi, 90)
    for normal in np.stack([np.cos(angle), np.sin(angle)], axis=-1):
        reach, _ = sets.farthest(np.tile(np.pad(normal, (0, 4)), (200, 1)))
        assert (force[:, 0] @ normal <= reach + 1e-9).all()


@pytest.mark.parametrize("half", [0.0, 0.4, np.pi / 2, np.pi])
def test_the_cheap_answer_is_the_best_point(half: float) -> None:
    sets, pull = fins(half), pulls()
    value, _, _ = cheap(sets, pull, np.full((200, 1), 0.7))
    for row in range(0, 200, 40):
        points = sector(sets, row)
        best = (points @ pull[row, 0] - 0.35 * (points**2).sum(-1)).max()
        assert best - 1e-9 <= value[row, 0] <= best + 2e-3
