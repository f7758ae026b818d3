"""The fin law by hand against the plant, and wins that are none."""

import numpy as np
import pytest

from finlab.errors import DataError
from finlab.evaluation.experiments.wrench_tracking import score
from finlab.evaluation.splits import Case, make_split
from finlab.evaluation.statistics.recheck import recheck, wrench_by_hand
from finlab.layout import Fin, FinModelSpec, Layout
from finlab.physics import Plant

SIGMA = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35])


def _commands(case: Case, n: int, seed: int = 0) -> np.ndarray:
    lower, upper = (
        np.array([getattr(fin.limits, end) for fin in case.layout.fins]) for end in ("lower", "upper")
    )
    unit = np.random.default_rng(seed).random((n, case.layout.n_fins, 3))
    return np.clip(lower + unit * (upper - lower), lower, upper)


@pytest.mark.parametrize("split", ["id", "limits"])
def test_two_ways_to_the_same_wrench(split: str) -> None:
    for case in make_split(split, 4, 1, 5):
        command = _commands(case, 50)
        by_hand = wrench_by_hand(case.layout, command)
        np.testing.assert_allclose(by_hand, Plant(case.layout).wrench(command), atol=1e-12)


def test_another_law_is_refused() -> None:
    fin = Fin("fin", (0.1, 0.0, 0.0), 0.0, model=FinModelSpec("lighthill"))
    with pytest.raises(DataError, match="knows the fin law drag only"):
        wrench_by_hand(Layout("one", (fin,)), np.zeros((1, 1, 3)))


def test_wins_are_counted_and_broken_limits_seen() -> None:
    base = make_split("id", 1, 4, 5)[0]
    command = _commands(base, 4)
    case = base._replace(targets=Plant(base.layout).wrench(command))
    command[3, 0, 0] = 0.0  # below its limit, and off the target
    ours = score(case, case.targets, command, np.ones(4), SIGMA)
    dearer = ours.__class__(**{**vars(ours), "energy": ours.energy + np.array([1.0, 1.0, -1.0, 1.0])})
    found = recheck([case], ours, np.pad(command, ((0, 0), (0, 3), (0, 0))), dearer, SIGMA)
    assert ours.err_norm[3] > 0.05
    assert found["wins"] == 2 and found["outside"] == 0  # the third is dearer, the fourth misses its target
    assert found["worst_error"] < 0.05 and found["disagreement"] < 1e-12


def test_a_win_by_broken_limits_is_seen() -> None:
    base = make_split("id", 1, 4, 5)[0]
    command = _commands(base, 4)
    command[1, 0, 0] = base.layout.lower[0, 0] - 1e-9
    command[2, 0, 1] = base.layout.upper[0, 1] + 1e-9
    case = base._replace(targets=Plant(base.layout).wrench(command))
    ours = score(case, case.targets, command, np.ones(4), SIGMA)
    dearer = ours.__class__(**{**vars(ours), "energy": ours.energy + 1.0})
    found = recheck([case], ours, np.pad(command, ((0, 0), (0, 3), (0, 0))), dearer, SIGMA)
    assert found["wins"] == 4 and found["outside"] == 2 and found["worst_error"] < 1e-12
