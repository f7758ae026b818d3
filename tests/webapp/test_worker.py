"""The worker: newest wins, turns are fair, stopping ends it."""

import threading

import pytest

from webapp.worker import Worker


def test_only_the_newest_waits() -> None:
    worker, gate, done = Worker(), threading.Event(), threading.Event()
    ran: list[int] = []
    worker.submit("block", lambda: gate.wait(10) and None)
    for k in range(100):
        worker.submit("a", lambda k=k: ran.append(k))
    worker.submit("end", done.set)
    gate.set()
    assert done.wait(10)
    assert ran == [99]
    worker.stop()


def test_askers_take_turns() -> None:
    worker, gate, done = Worker(), threading.Event(), threading.Event()
    ran: list[str] = []
    worker.submit("block", lambda: gate.wait(10) and None)
    for key in ("a", "b", "c", "a"):
        worker.submit(key, lambda key=key: ran.append(key))
    worker.forget("b")
    worker.submit("end", done.set)
    gate.set()
    assert done.wait(10)
    assert ran == ["a", "c"]
    worker.stop()


def test_a_fault_does_not_end_the_thread(capsys: pytest.CaptureFixture[str]) -> None:
    worker, done = Worker(), threading.Event()
    worker.submit("bad", lambda: 1 / 0)  # type: ignore[arg-type]
    worker.submit("good", done.set)
    assert done.wait(10)
    worker.stop()
    assert "ZeroDivisionError" in capsys.readouterr().err
