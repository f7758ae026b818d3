"""What one step of a slider costs: own Python calls in all threads, who calls whom, and what is
sent.

The figures are printed with `-s`; the most expensive functions of a step with `FINLAB_CALLS=1` as
well.
"""

import os
import threading
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

import finlab
import webapp
from finlab.assets import shipped_checkpoints
from finlab.layout import load_layout
from tests.webapp.listener import Listener
from tests.webapp.test_faults import Tab
from tests.webapp.test_faults_in_handlers import handles, use
from tools.slider import CASES, step_cost
from webapp.tasks.slot import Pools
from webapp.tasks.solver import Solver
from webapp.view import View

APP_FOLDER = f"{Path(webapp.__file__).parent}/"
"""Start of the paths of the app's files."""
OWN_FOLDERS = (f"{Path(finlab.__file__).parent}/", APP_FOLDER)
"""Start of the paths of files whose calls count."""
SETTLED_S = 1.6
"""Longer than the page lets anything wait that belongs to a step [s]."""
MOST_CALLS = {"Candidates": 1200, "folded": 360}
"""Calls of the library's and the app's functions together, until the page is at rest: the answer
and what is proved of it take 100 of them, and the candidates of a network 700."""
MOST_OF_APP = {"Candidates": 460, "folded": 240}
"""Calls of the app's functions among them."""
MOST_FILES = 64
"""Files in which the called functions are: what has to be read to follow one step. A step runs
through the page, the session, the task, the library's allocator and plant, and the panels that are
visible, with a few files each; a file more is a detour."""
MOST_WRITTEN = 2
"""Times that the page is written: with the answer, and with what is found beside it."""
MOST_MESSAGES = {"Candidates": 12, "folded": 9}
"""Messages to the browser."""
MOST_BYTES = {"Candidates": 5700, "folded": 3200}
"""Size of these messages [bytes]."""
MOST_TIMES_PINV = 3000.0
"""Processor time of a step of a slider that is dragged, over that of one line of numpy; some 700 on
a machine that has nothing else to do."""


class CallCount:
    """Calls of own code by function, and between files, in all threads that begin after it was
    made; a profiler, see `threading.setprofile`."""

    def __init__(self) -> None:
        self.is_on = False
        self.calls_by_code: Counter[CodeType] = Counter()
        self.calls_between_files: Counter[tuple[str, str]] = Counter()

    def __call__(self, frame: FrameType, event: str, _argument: Any) -> None:
        if not self.is_on or event != "call":
            return
        file = frame.f_code.co_filename
        if not file.startswith(OWN_FOLDERS):
            return
        self.calls_by_code[frame.f_code] += 1
        caller = frame.f_back
        while caller is not None and not caller.f_code.co_filename.startswith(OWN_FOLDERS):
            caller = caller.f_back
        if caller is not None:
            self.calls_between_files[caller.f_code.co_filename, file] += 1

    def start(self) -> None:
        """Count anew."""
        self.calls_by_code.clear()
        self.calls_between_files.clear()
        self.is_on = True

    @property
    def calls(self) -> int:
        """Calls of all functions."""
        return sum(self.calls_by_code.values())

    @property
    def calls_of_app(self) -> int:
        """Those of the app's own functions."""
        return sum(
            count
            for code, count in self.calls_by_code.items()
            if code.co_filename.startswith(APP_FOLDER)
        )

    @property
    def files(self) -> set[str]:
        """Files in which the called functions are."""
        return {code.co_filename for code in self.calls_by_code}

    @property
    def pairs(self) -> set[tuple[str, str]]:
        """Files of the app that call each other."""
        pairs = set()
        for caller, called in self.calls_between_files:
            in_app = caller.startswith(APP_FOLDER) and called.startswith(APP_FOLDER)
            if in_app and caller < called and (called, caller) in self.calls_between_files:
                pairs.add((caller.removeprefix(APP_FOLDER), called.removeprefix(APP_FOLDER)))
        return pairs


@pytest.fixture(scope="module")
def count() -> Iterator[CallCount]:
    """Counts calls while a test runs."""
    old_profiler = threading.getprofile()
    count = CallCount()
    threading.setprofile(count)
    yield count
    threading.setprofile(old_profiler)


@pytest.fixture(scope="module")
def tab(count: CallCount) -> Iterator[Tab]:
    """A page of U-CAT without arrows."""
    pools = Pools()
    tab = Tab(pools, load_layout("ucat"), Solver())
    tab.on_loop(lambda: tab.view.do(lambda: tab.view.session.set_display("drawn", "none")))
    tab.settle()
    yield tab
    tab.close()
    pools.stop()


@pytest.mark.skipif(
    "default" not in shipped_checkpoints(), reason="no trained checkpoint in the tree"
)
@pytest.mark.parametrize("drawer", ["Candidates", "folded"])
def test_a_step_is_cheap(
    tab: Tab, count: CallCount, drawer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = tab.view.session
    write = View._write_words
    written = [0]

    def counted(view: View) -> None:
        written[0] += 1
        write(view)

    tab.on_loop(lambda: tab.view.do(lambda: session.show_drawer("Candidates")))
    if session.desk.folded != (drawer == "folded"):
        tab.on_loop(lambda: tab.view.do(session.fold_drawer))
    tab.settle()
    listener = Listener(tab.server)
    slider = next(
        handle for handle in handles(tab.server) if getattr(handle, "label", "") == "Fx [N]"
    )
    monkeypatch.setattr(View, "_write_words", counted)
    steps = []
    listener.wait()
    for value in (1.3, 1.4, 1.5):  # the first one warms up
        listener.forget()
        written[0] = 0
        count.start()
        use(tab.server, tab.view, slider, value)
        time.sleep(SETTLED_S)  # whoever asks whether it has settled makes calls, too
        count.is_on = False
        tab.settle()
        assert (
            tab.view.shown_allocation is not None and tab.view.shown_allocation.target[0] == value
        )
        assert (tab.view.jobs.answering.modes.steps > 0) == (drawer == "Candidates")
        assert count.pairs == set(), "files that call each other back"
        messages = len(listener.heard), listener.bytes
        steps.append((count.calls, count.calls_of_app, len(count.files), written[0], *messages))
    listener.close()
    words = "own calls, those of the app, files, times that the page is written, messages, bytes"
    print(f"{drawer}: {steps[1:]} {words} in a step")
    if os.environ.get("FINLAB_CALLS"):
        for code, calls in count.calls_by_code.most_common():
            print(f"{calls:6} {'/'.join(code.co_filename.split('/')[-3:])} {code.co_name}")
    # On a busy machine an answer may be later than the page waits, and the page is written once
    # more, with the calls and messages of that.
    calls, of_app, _, times, sent, _ = map(min, zip(*steps[1:], strict=True))
    _, _, files, _, _, size = map(max, zip(*steps[1:], strict=True))
    assert (
        100 < calls <= MOST_CALLS[drawer]
        and 50 < of_app <= MOST_OF_APP[drawer]
        and files <= MOST_FILES
    )
    assert 1 < times <= MOST_WRITTEN and 3 < sent <= MOST_MESSAGES[drawer]
    assert size <= MOST_BYTES[drawer]


def test_processor_time_of_a_step_is_measured() -> None:
    cost = step_cost(CASES[0], drags=2, singles=2)
    print(f"{CASES[0]}: {cost}, {cost.drag_ms / cost.answer_ms:.0f} answers")
    assert 3 < cost.messages <= MOST_MESSAGES["folded"] and cost.size <= MOST_BYTES["folded"]
    assert 0.0 < cost.key_ms < 1000.0
    assert cost.answer_ms < cost.drag_ms < MOST_TIMES_PINV * cost.pinv_ms
