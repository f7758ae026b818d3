"""The fin law by hand against the plant."""

import numpy as np
import pytest

from finlab.errors import DataError
from finlab.evaluation.splits import Case, make_split
from finlab.evaluation.statistics.recheck import known_by_hand, wrench_by_hand
from finlab.layout import Fin, FinModelSpec, Layout
from finlab.physics import Plant


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
    layout = Layout("one", (fin,))
    assert not known_by_hand(layout) and known_by_hand(make_split("limits", 1, 1, 0)[0].layout)
    with pytest.raises(DataError, match="knows the fin law drag only"):
        wrench_by_hand(layout, np.zeros((1, 1, 3)))
