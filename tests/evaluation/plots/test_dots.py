"""Dots with intervals, read from the drawn axes."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from finlab.evaluation.plots.dots import draw_dots  # noqa: E402


def test_dots_stand_at_their_values_with_their_intervals() -> None:
    def row(method: str, split: str, value: float | None) -> dict[str, object]:
        ends = None if value is None else [value - 0.1, value + 0.2]
        return {"method": method, "split": split, "cost": value, "cost_interval": ends}

    rows = [row("dual", "id", 1.5), row("dual", "ood", 1.2), row("qp", "id", 2.0), row("qp", "ood", None)]
    view = draw_dots(rows, "cost", "split", "cost [W]")
    (axis,) = view.axes
    search, qp = axis.containers
    assert (search.get_label(), qp.get_label()) == ("dual", "qp")
    assert search[0].get_ydata() == pytest.approx([1.5, 1.2]) and qp[0].get_ydata() == pytest.approx([2.0])
    place = np.asarray(search[0].get_xdata(), float)
    assert np.round(place).tolist() == [0, 1] and place[0] < float(qp[0].get_xdata()[0])
    segments = search[2][0].get_segments()
    assert segments[0][:, 1] == pytest.approx([1.4, 1.7])
    assert [label.get_text() for label in axis.get_xticklabels()] == ["id", "ood"]
    assert axis.get_ylabel() == "cost [W]"


def test_rounding_is_drawn_at_the_floor() -> None:
    (axis,) = draw_dots([{"method": "qp", "split": "id", "error": 0.0}], "error", "split", "", log=True).axes
    assert axis.containers[0][0].get_ydata() == pytest.approx([1e-8]) and axis.get_yscale() == "log"
