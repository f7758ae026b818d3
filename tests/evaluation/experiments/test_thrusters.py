"""Autopilots beside `dual`: who misses more in an order of axes, and what the rows say of a robot."""

import numpy as np

from finlab.allocation.baselines.autopilots import PX4_ORDER
from finlab.evaluation.experiment import load_experiment
from finlab.evaluation.experiments.thrusters import misses_more, missing_by_group


def test_groups_are_compared_in_order() -> None:
    missing = np.array([[3.0, 4.0, 0.5, 0.0, 0.2, 0.1], [0.0, 0.0, 0.5, 0.0, 0.2, 0.1]])
    sizes = missing_by_group(missing, PX4_ORDER)
    np.testing.assert_allclose(sizes, [[0.2, 0.5, 0.1, 5.0], [0.2, 0.5, 0.1, 0.0]])
    more = np.array([[0.1, 9.0, 0.0, 0.0], [0.2, 0.5, 0.2, 0.0]])
    assert misses_more(more, sizes).tolist() == [False, True]
    assert misses_more(sizes, more).tolist() == [True, False]
    assert not misses_more(sizes, sizes + 1e-7).any()


def test_beside_the_autopilots_dual_misses_no_more_and_takes_the_least() -> None:
    """BlueROV2 Heavy, whole and with one thruster lost."""
    sizes = {"lost": (0, 1), "reach": (0.8, 1.2, 3.0), "layouts": 2, "targets": 6, "seed": 12}
    rows = load_experiment("thrusters").rows(robots=("bluerov2_heavy",), **sizes)
    assert len(rows) == 2 * 3 * 5
    for row in rows:
        assert row["n"] == 12
        assert row.get("dual_more_mean", 0.0) == 0.0
        if row["method"] == "dual":
            assert row["not_delivered"] == (0.0 if row["of_reach"] < 100.0 else 1.0)
            assert row["of_reach"] > 100.0 or row["watts_max"] < 1.001
    near = {(row["lost"], row["method"]): row for row in rows if row["of_reach"] == 80.0}
    assert near[0, "pseudo-inverse"]["not_delivered"] > 0.05 and near[0, "pseudo-inverse"]["watts"] > 1.01
    assert near[0, "ardusub"]["not_delivered"] > near[0, "pseudo-inverse"]["not_delivered"]


def test_a_surveyed_frame_shows_the_axis_that_a_drawing_hides() -> None:
    """Nothing drives pitch alone; thrusters a little out of place seem to, and the pseudo-inverse clips."""
    rows = load_experiment("thrusters").rows(
        robots=("surveyed",), lost=(0,), reach=(0.8,), layouts=2, targets=6
    )
    by = {row["method"]: row for row in rows}
    assert by["dual"]["not_delivered"] == 0.0
    assert by["pseudo-inverse"]["n"] == 12
