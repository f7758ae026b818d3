"""Dots with intervals, read from the drawn axes, and pictures in files."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from finlab.evaluation.plots.dots import draw_dots  # noqa: E402
from finlab.evaluation.plots.style import picture  # noqa: E402


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


def test_a_saved_picture_has_its_colours_and_size(tmp_path: Path) -> None:
    from PIL import Image

    with picture(height=2.0) as view:
        view.axes[0].plot([0, 1], [0, 1], color="#0072B2", lw=20)
    view.save(tmp_path / "line.png")
    image = Image.open(tmp_path / "line.png")
    assert image.size == (1056, 220)
    red, green, blue = (np.asarray(image.convert("RGB"))[..., k].astype(int) for k in range(3))
    drawn = (abs(red - 0x00) < 12) & (abs(green - 0x72) < 12) & (abs(blue - 0xB2) < 12)
    assert 0.02 < drawn.mean() < 0.3
    assert view.svg("line").count("<svg") == 1
