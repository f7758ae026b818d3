"""One change of a slider: the page is written with the answer, and once more with what comes beside it."""

import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest

from finlab.layout import load_layout
from tests.webapp.stand_in import load_stand_in
from tests.webapp.test_faults import Tab
from webapp.page import Page
from webapp.tasks.background import Workers
from webapp.tasks.solver import Solver

MOST_CALLS, MOST_WRITTEN = 1500, 2


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    workers = Workers()
    tab = Tab(workers, load_layout("ucat"), Solver(load=load_stand_in))
    yield tab
    tab.close()
    workers.stop()


def test_a_change_of_a_slider_writes_the_page_twice_with_few_calls(
    tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    written, calls, refresh = [0], [0], Page._refresh

    def counted(page: Page) -> None:
        written[0] += 1
        refresh(page)

    def heard(frame: Any, event: str, _argument: Any) -> None:
        calls[0] += event == "call" and "/webapp/" in frame.f_code.co_filename

    monkeypatch.setattr(Page, "_refresh", counted)
    for value in (1.3, 1.4):  # the first one may build what is met for the first time
        written[0] = calls[0] = 0
        tab.on_loop(lambda: sys.setprofile(heard))
        tab.on_loop(lambda value=value: tab.view.do(lambda: tab.view.session.set_target(0, value)))
        time.sleep(0.3)
        tab.settle()
        tab.on_loop(lambda: sys.setprofile(None))
    assert written[0] <= MOST_WRITTEN and calls[0] <= MOST_CALLS
    assert tab.view.jobs.answering.modes.steps > 0
