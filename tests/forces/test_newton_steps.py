"""Single steps of the convex solver by hand: what it starts from, when it stops and how far it goes."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from finlab.forces import interior_point
from finlab.forces.fin_sets import FinSets
from finlab.forces.interior_point import (
    LEAST_GAP,
    SHORT,
    UNMET,
    _outset,
    _State,
    _step,
    _way_to_zero,
    minimize,
)
from tests.forces.test_interior_point import robots

Array = NDArray[np.float64]


def one_fin(radius: float = 1.0, half: float = np.pi) -> FinSets:
    """A fin that pushes along two axes and knows no other."""
    return FinSets(np.eye(2)[None, None], np.array([[radius]]), np.zeros((1, 1)), np.full((1, 1), half))


def resting(weight: float = 2.0, **changed: Any) -> _State:
    """A free fin at rest that is asked for nothing: all conditions hold, its gap is half its weight."""
    state = _outset(one_fin(), np.zeros((1, 2)), np.ones(2), 0.0)
    return state._replace(slack=np.full((1, 1, 1), 0.5), weight=np.full((1, 1, 1), weight), **changed)


def finished(state: _State, tolerance: float) -> bool:
    return bool(_step(state, tolerance)[0][0])


def test_it_ends_where_the_gap_is_no_larger_than_asked() -> None:
    assert finished(resting(2.0), 1.0)
    assert not finished(resting(2.0), np.nextafter(1.0, 0.0))
    assert _step(resting(2.0), 0.1)[1] == 1.0


def test_it_does_not_end_while_a_condition_is_violated() -> None:
    # The multiplier (0, u) of a wrench that is as asked is off by u; sizes are relative to one.
    for share, end in ((0.9, True), (1.0, True), (1.1, False)):
        assert finished(resting(2.0, multiplier=np.array([[0.0, share * UNMET]])), 1.0) is end
    slack = np.full((1, 1, 1), 0.5 + 2 * UNMET)
    assert not finished(resting(2.0)._replace(slack=slack), 1.1)


def test_a_tiny_gap_or_a_short_step_ends_it_whatever_is_violated() -> None:
    off = np.array([[0.0, 1.0]])
    assert finished(resting(2 * LEAST_GAP, multiplier=off), 0.0)
    assert not finished(resting(2.1 * LEAST_GAP, multiplier=off), 0.0)
    assert not finished(resting(multiplier=off, length=np.array([SHORT])), 0.0)
    assert finished(resting(multiplier=off, length=np.array([0.99 * SHORT])), 0.0)


def test_the_outset_by_hand() -> None:
    """A fin of 2 N asked for (6, 8) N: shares of its strongest wrench, sqrt(2) * 2 N, all the way."""
    unit = 2.0 * np.sqrt(2.0)
    c, b = np.array([0.25, 4.0]), np.array([[0.5]])
    state = _outset(one_fin(2.0), np.array([[6.0, 8.0]]), c, b)
    assert state.wanted == pytest.approx(np.array([[6.0, 8.0]]) / unit)
    assert state.bend == pytest.approx(0.5 * 4.0 / 8.0)
    assert state.full == pytest.approx(np.eye(2)[None] * 2.0 / unit)
    assert state.slack == pytest.approx(3.0)
    assert state.weight == pytest.approx(10.0 * (1.0 + 6.0 / unit))  # the second counts a quarter of 8
    _, off, _ = _step(state, 0.0)
    size = 1.0 + np.sqrt(36.0 / 8.0 / 0.25 + 64.0 / 8.0 / 4.0)
    gap, unmet = 3.0 * state.weight.item(), 8.0 / unit + 2.5
    assert off == pytest.approx((gap + unmet) / size)
    # Half way out its own cost counts, and the disc's condition is less astray.
    there = state._replace(point=np.array([[[0.5], [0.0]]]))
    missing = np.array([6.0, 8.0]) / unit - [1.0 / unit, 0.0]
    size = 1.0 + np.sqrt(missing[0] ** 2 / 0.25 + missing[1] ** 2 / 4.0 + state.bend.item() * 0.25)
    assert _step(there, 0.0)[1] == pytest.approx((gap + missing[1] + 3.0 - 0.375) / size)


def test_the_way_to_zero_ends_at_the_first_limit_that_shrinks() -> None:
    weight = np.array([[[1.0, 2.0], [3.0, 4.0]]])
    assert _way_to_zero(weight, np.array([[[-0.5, -4.0], [5.0, 0.0]]])) == 0.5
    assert _way_to_zero(weight, np.array([[[1.0, 0.0], [5.0, 0.25]]])) == np.inf


def test_a_step_keeps_slacks_and_multipliers_positive() -> None:
    sets = robots(1.0)
    state = _outset(sets, 50.0 * np.random.default_rng(0).standard_normal((40, 6)), np.ones(6), 0.0)
    for _ in range(12):
        done, _, after = _step(state, 1e-11)
        assert (after.slack > 0.0).all() and (after.weight > 0.0).all()
        assert (after.length[~done] > 0.0).all() and (after.length <= 1.0).all()
        assert (after.length[done] == 0.0).all()
        state = after


def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many rows each step of the solver works on, from now on."""
    rows: list[int] = []

    def spy(state: _State, tolerance: float) -> Any:
        rows.append(len(state.wanted))
        return _step(state, tolerance)

    monkeypatch.setattr(interior_point, "_step", spy)
    return rows


@pytest.mark.parametrize(("half", "most"), [(0.4, 30), (np.pi / 2, 30), (np.pi, 15)])
@pytest.mark.parametrize("held", [1.0, 1e-9, 1e-12])
@pytest.mark.parametrize("far", [0.1, 3.0, 300.0])
def test_few_steps_are_enough(
    half: float, most: int, held: float, far: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However far the target, and whether or not most axes must be met: 25 on one processor, 27 on another,
    that rounds otherwise."""
    sets = robots(half, rows=10, n=7)
    rows = counted(monkeypatch)
    wanted = far * np.random.default_rng(3).standard_normal((10, 6))
    wanted[:, 1:] *= 0.0 if held < 1.0 else 1.0
    minimize(sets, wanted, np.array([1.0, *(held,) * 5]), gap=1e-9)
    assert len(rows) <= most


def test_rows_that_are_done_are_left_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    sets = robots(np.pi, rows=3)
    hard = sets._replace(columns=sets.columns.copy())
    hard.columns[2] *= np.geomspace(1.0, 1e-5, 5)[:, None, None]
    wanted = np.array([[0.0] * 6, [0.0] * 6, [3.0, -1.0, 2.0, 1.0, 0.0, 4.0]])
    alone = minimize(hard.take(np.array([2])), wanted[2:], np.ones(6))
    rows = counted(monkeypatch)
    together = minimize(hard, wanted, np.ones(6))
    assert rows[0] == 3 and rows[-1] == 1
    assert together.force[2] == pytest.approx(alone.force[0], abs=1e-9)
