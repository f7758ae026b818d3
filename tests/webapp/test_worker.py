"""The worker: newest wins, turns are fair, stopping ends it."""

import threading

import pytest

from finlab.errors import FinlabError
from webapp.tasks.background import Worker


def shout(text: str) -> None:
    raise AssertionError(text)


def test_only_the_newest_waits(worker: Worker) -> None:
    gate, done = threading.Event(), threading.Event()
    ran: list[int] = []
    worker.submit("block", lambda: gate.wait(10) and None, shout)
    for k in range(100):
        worker.submit("a", lambda k=k: ran.append(k), shout)
    worker.submit("end", done.set, shout)
    gate.set()
    assert done.wait(10)
    assert ran == [99]


def test_askers_take_turns(worker: Worker) -> None:
    gate, done = threading.Event(), threading.Event()
    ran: list[str] = []
    worker.submit("block", lambda: gate.wait(10) and None, shout)
    for key in ("a", "b", "c", "a"):
        worker.submit(key, lambda key=key: ran.append(key), shout)
    worker.forget("b")
    worker.submit("end", done.set, shout)
    gate.set()
    assert done.wait(10)
    assert ran == ["a", "c"]


def test_a_fault_does_not_end_the_thread(worker: Worker, capsys: pytest.CaptureFixture[str]) -> None:
    done = threading.Event()
    told: list[str] = []

    def refuse() -> None:
        raise FinlabError("not so")

    worker.submit("bad", lambda: 1 / 0, told.append)  # type: ignore[arg-type]
    worker.submit("refused", refuse, told.append)
    worker.submit("good", done.set, shout)
    assert done.wait(10)
    assert told == ["it failed: division by zero", "not so"]
    printed = capsys.readouterr().err
    assert "ZeroDivisionError" in printed and "FinlabError" not in printed, "a refusal is no fault"
