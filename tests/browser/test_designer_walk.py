"""A designer builds a robot from nothing, and takes it home; the way is in `designer_walk.py`."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import finlab
from tests.browser.conftest import serving
from tests.browser.designer_walk import PAIRS, walk
from tests.browser.page import Page
from webapp.session.design_links import packed
from webapp.tasks.solver import Solver


@pytest.fixture
def away(browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Page, Any, Any]]:
    """A page of an app with the methods that are shipped, its app, and another browser."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    here = browser.new_context(viewport={"width": 1400, "height": 860}, accept_downloads=True)
    there = browser.new_context(viewport={"width": 900, "height": 600})
    with serving(Solver()) as served:
        yield Page(here.new_page(), served), served.app, there.new_page()
        here.close()
        there.close()


def test_a_robot_from_nothing_to_its_bundle(away: tuple[Page, Any, Any], tmp_path: Path) -> None:
    page, app, other = away
    session, link = page.session, ""
    for step in walk(page, tmp_path):
        if step == "improved":
            before = session.state.layout
        elif step == "compared":
            assert session.state.layout != before and session.reference == before
            page.page.get_by_text("pinned", exact=True).first.wait_for()
        elif step == "shared":
            link = page.page.locator(".fl-share input").input_value()
    layout = session.state.layout
    assert layout.name == "Manta" and [fin.name for fin in layout.fins[::2]] == [name for name, *_ in PAIRS]
    assert {fin.model.type for fin in layout.fins} == {"table"} and layout.body.hull.mesh is not None
    for left, right in zip(layout.fins[::2], layout.fins[1::2], strict=True):
        x, y, z = right.position
        assert left.position == pytest.approx((x, -y, z)), "what was mirrored has stayed so"

    other.goto(link.replace("?", "?fixedDpr=0.3&"))

    def others() -> list[Any]:
        return [view.session for view in app.views.values() if view.session is not session]

    page.until(lambda: any(there.state.layout.name == "Manta" for there in others()))
    assert link.endswith(packed(others()[0].state.layout)), "the same design, whose link is the same again"

    result = finlab.load_allocator(tmp_path / "robot.zip").allocate(layout, session.state.target)
    assert result.err_norm < 1e-3 and result.command.shape == (6, 3)
    assert page.problems == []
