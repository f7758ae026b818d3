"""Work that one step of a slider makes: own Python calls in all threads, files that they lie in, and how
often the page is written: with the answer, and once more with what comes beside it."""

import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import CodeType
from typing import Any

import pytest

import finlab
import webapp
from finlab.assets import shipped_checkpoints
from finlab.layout import load_layout
from tests.webapp.test_faults import Tab
from tests.webapp.test_faults_in_handlers import handles, use
from webapp.board import Board, Facts
from webapp.tasks.slot import Pools
from webapp.tasks.solver import Solver

OURS = tuple(f"{Path(room.__file__).parent}/" for room in (finlab, webapp))
LATER_S = 1.0
"""Longer than the page lets anything wait that belongs to a step [s]."""
MOST_FILES, MOST_WRITTEN = 60, 2


class Count:
    """Calls of own code by function, while it is on, in all threads that begin after it was made."""

    def __init__(self) -> None:
        self.on = False
        self.of: Counter[CodeType] = Counter()

    def __call__(self, frame: Any, event: str, _argument: Any) -> None:
        if self.on and event == "call" and frame.f_code.co_filename.startswith(OURS):
            self.of[frame.f_code] += 1

    @property
    def calls(self) -> int:
        return sum(self.of.values())

    @property
    def files(self) -> set[str]:
        return {code.co_filename for code in self.of}


@pytest.fixture(scope="module")
def count() -> Iterator[Count]:
    before, count = threading.getprofile(), Count()
    threading.setprofile(count)
    yield count
    threading.setprofile(before)


@pytest.fixture(scope="module")
def tab(count: Count) -> Iterator[Tab]:
    workers = Pools()
    tab = Tab(workers, load_layout("ucat"), Solver())
    tab.on_loop(lambda: tab.view.do(lambda: tab.view.session.set_display("drawn", "none")))
    yield tab
    tab.close()
    workers.stop()


@pytest.mark.skipif("default" not in shipped_checkpoints(), reason="no trained checkpoint in the tree")
@pytest.mark.parametrize(("drawer", "most"), [("Candidates", 4000), ("folded", 800)])
def test_a_step_makes_few_calls_in_few_files(
    tab: Tab, count: Count, drawer: str, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, refresh, written = tab.view.session, Board.refresh, [0]

    def counted(board: Board, facts: Facts) -> None:
        written[0] += 1
        refresh(board, facts)

    tab.on_loop(
        lambda: tab.view.do(lambda: session.show_drawer("Candidates" if drawer == "folded" else drawer))
    )
    if session.desk.folded != (drawer == "folded"):
        tab.on_loop(lambda: tab.view.do(session.fold_drawer))
    tab.settle()
    slider = next(handle for handle in handles(tab.server) if getattr(handle, "label", "") == "Fx [N]")
    monkeypatch.setattr(Board, "refresh", counted)
    steps = []
    time.sleep(LATER_S)
    for value in (1.3, 1.4, 1.5):  # the first one warms up
        count.of.clear()
        written[0], count.on = 0, True
        use(tab.server, tab.view, slider, value)
        tab.settle()
        time.sleep(LATER_S)
        count.on = False
        assert tab.view.shown is not None and tab.view.shown.target[0] == value
        assert (tab.view.jobs.answering.modes.steps > 0) == (drawer == "Candidates")
        steps.append((count.calls, len(count.files), written[0]))
    print(f"{drawer}: {steps[1:]} own calls, files and times that the page is written in a step")
    calls, files = max(step[0] for step in steps[1:]), max(step[1] for step in steps[1:])
    times = min(step[2] for step in steps[1:])  # on a busy machine an answer may be later than the page waits
    assert 100 < calls <= most and files <= MOST_FILES and 1 < times <= MOST_WRITTEN
