"""Pictures in files: what is written on their axes."""

from typing import Any

import pytest

from finlab.display.figures import figure_bytes, panels


def test_logarithmic_axes_have_plain_numbers() -> None:
    """Text in a figure is no formula, so neither are the numbers of its axes."""
    pytest.importorskip("matplotlib")

    def picture() -> Any:
        figure, axes = panels((3.0, 2.0))
        axes[0, 0].plot([1.0, 1000.0], [0.01, 1.0])
        axes[0, 0].set(xscale="log", yscale="log")
        return figure

    drawn = figure_bytes(picture, "svg").decode()
    assert "<!-- 100 -->" in drawn
    assert "mathdefault" not in drawn
