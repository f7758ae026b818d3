"""A search that is watched, stopped, taken or left; the analyst answers what came to rest."""

import asyncio
import threading
import time
from collections.abc import Callable

import pytest

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from webapp.analyst import Analyst, Question
from webapp.improving import Improver
from webapp.session import Session
from webapp.worker import Worker

NO_YAW = load_layout(shipped_layouts()["no_yaw"])


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_search_is_cancelled_and_what_it_found_is_offered() -> None:
    worker = Worker()
    improver: Improver = Improver(worker, lambda act: act(), lambda: None)
    improver.start(NO_YAW, NO_YAW.names, "weakest direction", 0.05)
    with pytest.raises(FinlabError, match="running already"):
        improver.start(NO_YAW, NO_YAW.names, "weakest direction", 0.05)
    until(lambda: improver.progress is not None)
    improver.cancel()
    until(lambda: improver.found is not None)
    assert improver.found is not None and improver.found.cancelled and not improver.running
    session = Session(NO_YAW)
    session.accept_layout(improver.found.layout)
    assert session.history.undo_name == "Improve the layout"
    session.undo()
    assert session.state.layout == NO_YAW
    improver.forget()
    assert improver.found is None and not improver.running
    worker.stop()


def test_bad_searches_are_refused() -> None:
    worker = Worker()
    improver = Improver(worker, lambda act: act(), lambda: None)
    for goal, reach in (("gold", 0.05), ("weakest direction", float("nan"))):
        with pytest.raises(FinlabError):
            improver.start(NO_YAW, NO_YAW.names, goal, reach)
    assert not improver.running
    worker.stop()


def test_analyst_answers_only_the_question_that_stays() -> None:
    worker, asked = Worker(), threading.Event()
    layout = load_layout(shipped_layouts()["pair"])

    async def run() -> Analyst:
        loop = asyncio.get_running_loop()
        analyst = Analyst(worker, loop, loop.call_soon_threadsafe, asked.set)
        for k in range(20):
            moved = layout.replace_fin(layout.names[0], position=(0.01 * k, 0.2, 0.0))
            analyst.ask(Question(moved, (), layout, "none", True))
            await asyncio.sleep(0.01)
        while analyst.busy:
            await asyncio.sleep(0.02)
        return analyst

    analyst = asyncio.run(run())
    worker.stop()
    assert analyst.findings is not None
    assert analyst.findings.question.layout.fins[0].position[0] == pytest.approx(0.19)
    assert analyst.findings.before is not None
