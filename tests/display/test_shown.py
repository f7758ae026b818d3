"""What values show in notebooks: the figures of the object, hostile names as plain text, and a
picture."""

import re
import sys
from base64 import b64decode
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.analysis import attainable_set, score_card, second_losses
from finlab.analysis.second_losses import pair_blocks
from finlab.display import text
from finlab.forces.reach import axis_ranges
from finlab.swim.simulation import ClosedLoop, make_trajectory

HOSTILE_NAME = "<img src=x onerror=alert(1)> & $\\frac{'\""
"""A name that HTML, TeX and quotes would break, where it is not escaped."""
WRENCH = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]
"""A wrench within reach of robot A: surge, heave and yaw [N, N m]."""


@cache
def robot() -> finlab.Layout:
    """Robot A, with hostile names."""
    layout = finlab.load_layout("A")
    parts = (replace(layout.fins[0], name=HOSTILE_NAME), *layout.actuators[1:])
    return replace(layout, name=HOSTILE_NAME, description=HOSTILE_NAME, actuators=parts)


def result(**asked: Any) -> finlab.Allocation:
    """An answer of this robot."""
    return finlab.Allocator(robot()).allocate(WRENCH, **asked)


@cache
def swim() -> Any:
    """A swim of this robot, one fin of which is lost after a second."""
    loop = ClosedLoop(
        robot(),
        finlab.Allocator(robot()),
        make_trajectory("station", 12.0),
        failures=[(HOSTILE_NAME, 1.0)],
    )
    return loop.run()


MAKERS: dict[str, Callable[[], Any]] = {
    "layout": robot,
    "result": result,
    "card": lambda: score_card(robot()),
    "swim": swim,
    "body": lambda: attainable_set(finlab.load_layout("turtle_hybrid"), "torque"),
    "flat": lambda: attainable_set(finlab.load_layout("no_yaw"), "torque"),
    "line": lambda: attainable_set(finlab.load_layout("pair"), "force"),
    "ranges": lambda: axis_ranges(finlab.load_layout("pair"), np.zeros(6)),
    "nothing works": lambda: finlab.Allocator(robot()).allocate(np.zeros(6)),
}
"""Name of a value that notebooks show -> what makes it."""


class Page(HTMLParser):
    """Tags, rows of cells and all text of a page."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.rows: list[list[str]] = []
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.tags.append(tag)
        if tag == "tr":
            self.rows.append([])

    def handle_data(self, data: str) -> None:
        self.text += data
        if self.tags[-1] in ("td", "th"):
            self.rows[-1].append(data)


@pytest.mark.parametrize("name", MAKERS)
def test_a_table_and_a_picture_are_shown_and_no_name_becomes_a_tag(name: str) -> None:
    shown = MAKERS[name]()._repr_html_()
    page = Page(shown)
    assert set(page.tags) <= {"table", "caption", "tr", "th", "td", "p", "br", "img"}
    assert page.tags.count("img") == 1 and "table" in page.tags
    (picture,) = re.findall(r"src='data:image/png;base64,([^']*)'", shown)
    assert b64decode(picture, validate=True).startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["layout", "result", "card", "swim"])
def test_hostile_names_are_read_as_written(name: str) -> None:
    assert HOSTILE_NAME in Page(MAKERS[name]()._repr_html_()).text


def test_figures_are_those_of_the_object() -> None:
    answer = result(lost=["back_left"])
    card = score_card(robot())
    log = swim()
    rows = {row[0]: row[1:] for row in Page(answer._repr_html_()).rows}
    np.testing.assert_allclose(np.array(rows["delivered"], float), answer.wrench, atol=6e-4)
    for part, force in zip(answer.names[1:], answer.forces[1:], strict=True):
        words = rows[part][1:]
        assert (
            words[0] == "lost"
            if part == "back_left"
            else float(words[1]) == pytest.approx(np.linalg.norm(force), abs=6e-4)
        )
    rows = {row[0]: row[1:] for row in Page(card._repr_html_()).rows}
    for axis, most in zip(("surge", "sway", "heave"), card.authority.largest, strict=False):
        unit, largest, *_ = rows[axis]
        assert unit == "N"
        # Three digits are shown.
        assert float(largest.removeprefix("±")) == pytest.approx(most, rel=5e-3)
    rows = {row[0]: row[1:] for row in Page(log._repr_html_()).rows}
    off = np.linalg.norm(log.position - log.reference, axis=1)
    assert float(rows["off the reference, largest [m]"][0]) == pytest.approx(off.max(), abs=6e-4)
    ranges = axis_ranges(robot(), WRENCH)
    rows = {row[0]: row[1:] for row in Page(ranges._repr_html_()).rows}
    np.testing.assert_allclose(
        [float(rows["Fz"][k]) for k in (0, 1)], [ranges.low[2], ranges.high[2]], atol=6e-4
    )


def test_text_is_the_table_of_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    from finlab.cli import main

    layout = finlab.load_layout("turtle_hybrid")
    pairs = text(pair_blocks(second_losses(layout), layout.n))
    assert main(["layout", "show", "turtle_hybrid"]) == 0
    assert capsys.readouterr().out == f"{layout}\n\n{score_card(layout)}\n\n{pairs}\n"


def test_without_matplotlib_the_tables_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("matplotlib", "matplotlib.figure"):
        monkeypatch.setitem(sys.modules, name, None)
    page = Page(robot()._repr_html_())
    assert "table" in page.tags and "img" not in page.tags and "[plot]" in page.text
