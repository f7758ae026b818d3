"""`Slot`: one question at a time, a rest before it is worked on, and errors as sentences."""

import threading
import time

import pytest

from finlab.errors import FinlabError
from tests.webapp.stand_in import LoneBell, until
from webapp.tasks.slot import QUICK_S, Pool, Slot, Work


def test_live_slot_answers_one_question_and_then_the_newest(worker: Pool) -> None:
    gate = threading.Event()
    asked = list[int]()

    def solve(question: int) -> int:
        asked.append(question)
        assert gate.wait(30)
        return question

    slot: Slot[int, int] = Slot(worker, LoneBell(), solve, live=True)
    for question in range(100):
        slot.ask(question)
    gate.set()
    until(lambda: not slot.busy)
    assert asked == [0, 99] and slot.answer == 99


def test_slot_cancels_old_work_and_never_takes_a_stale_answer(worker: Pool) -> None:
    gate = threading.Event()
    seen = list[bool]()

    def solve(question: int, work: Work[int]) -> int:
        assert gate.wait(30)
        seen.append(work.cancelled.is_set())
        return question

    slot: Slot[int, int] = Slot(worker, LoneBell(), solve, watched=True)
    answers = set()
    for question in range(3):
        slot.ask(question)
    gate.set()

    def ended() -> bool:
        answers.add(slot.answer)
        return not slot.busy

    until(ended)
    assert (
        answers <= {None, 2} and slot.answer == 2 and seen[-1] is False and seen.count(False) == 1
    )


def test_slot_waits_rest_s_and_ignores_a_repeated_question(worker: Pool) -> None:
    asked: list[str] = []
    begun_s: list[float] = []

    def solve(question: str) -> None:
        begun_s.append(time.monotonic())
        asked.append(question)

    slot: Slot[str, None] = Slot(worker, LoneBell(), solve, rest_s=0.05)
    for question in ("a", "b", "c", "c"):
        slot.ask(question)
        assert not slot.attend()
    last_asked_s = time.monotonic()
    until(lambda: not slot.busy)
    assert begun_s[0] - last_asked_s > 0.04
    slot.ask("c")
    assert not slot.busy and asked == ["c"]
    slot.ask("d", at_once=True)
    worker.submit(lambda: None).result(30)
    assert asked == ["c", "d"]


def test_forgotten_question_is_never_worked_on(worker: Pool) -> None:
    asked: list[str] = []
    bell = LoneBell()
    slot: Slot[str, None] = Slot(worker, bell, asked.append, rest_s=0.01)
    slot.ask("a")
    slot.forget()
    assert not slot.busy
    time.sleep(0.02)
    bell.attend()
    worker.submit(lambda: None).result(30)
    assert asked == []


def test_slot_says_an_error_and_its_thread_goes_on(
    worker: Pool, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(_question: str) -> None:
        raise FinlabError("not so")

    bad: Slot[str, None] = Slot(worker, LoneBell(), lambda _: 1 / 0)  # type: ignore[arg-type,return-value]
    refused: Slot[str, None] = Slot(worker, LoneBell(), refuse)
    good: Slot[str, str] = Slot(worker, LoneBell(), str.upper)
    for slot in (bad, refused, good):
        slot.ask("a")
    until(lambda: not any(slot.busy for slot in (bad, refused, good)))
    assert (bad.error, refused.error) == (
        "it failed: division by zero",
        "not so",
    ) and good.answer == "A"
    printed = capsys.readouterr().err
    assert "ZeroDivisionError" in printed and "FinlabError" not in printed, "a refusal is no fault"


def test_a_question_like_a_quick_one_is_answered_where_it_is_asked(worker: Pool) -> None:
    threads: list[int] = []

    def solve(question: tuple[str, int]) -> int:
        threads.append(threading.get_ident())
        if question[0] == "bad":
            raise FinlabError("not so")
        end_s = time.thread_time() + (2.0 * QUICK_S if question[0] == "slow" else 0.0)
        while time.thread_time() < end_s:
            pass
        return question[1]

    slot: Slot[tuple[str, int], int] = Slot(
        worker, LoneBell(), solve, alike=lambda a, b: a[0] == b[0]
    )
    own = threading.get_ident()

    def answered_here(question: tuple[str, int]) -> bool:
        """Whether a question is answered at once, on this thread."""
        slot.ask(question)
        is_here = not slot.busy
        until(lambda: not slot.busy)
        assert (threads[-1] == own) == is_here and slot.answered == question
        return is_here

    assert not answered_here(("quick", 1)), "nobody knows yet how long it takes"
    assert answered_here(("quick", 2)) and slot.answer == 2
    assert not answered_here(("slow", 3)), "it is another question"
    assert not answered_here(("slow", 4)), "the one before took long"
    assert not answered_here(("quick", 5)) and answered_here(("quick", 6))
    gate = threading.Event()
    worker.submit(lambda: gate.wait(30))
    slot.ask(("quick", 7))
    assert slot.busy, "the thread is at work, and nobody else may use what is its own"
    gate.set()
    until(lambda: not slot.busy)
    assert slot.answer == 7 and threads[-1] != own


def test_an_error_where_it_is_asked_is_told_as_one_of_the_thread(worker: Pool) -> None:
    def solve(question: int) -> int:
        if question == 2:
            raise FinlabError("not so")
        return question

    bell = LoneBell()
    slot: Slot[int, int] = Slot(worker, bell, solve, title="No answer", alike=lambda *_: True)
    for question in (0, 1):
        slot.ask(question)
        until(lambda: not slot.busy)
    slot.ask(2)
    until(lambda: not slot.busy)
    assert (slot.error, slot.answer, bell.refused) == ("not so", None, ["No answer: not so"])
    slot.ask(3)
    until(lambda: not slot.busy)
    assert (slot.error, slot.answer) == (None, 3)


def test_a_quick_question_that_rested_first_is_told_to_the_page(worker: Pool) -> None:
    threads: list[int] = []

    def solve(question: int) -> int:
        threads.append(threading.get_ident())
        return question

    slot: Slot[int, int] = Slot(worker, LoneBell(), solve, rest_s=0.01, alike=lambda *_: True)
    for question in (0, 1):
        slot.ask(question)
        assert slot.busy
        until(lambda: not slot.busy)
        assert slot.answer == question
    assert threads[0] != threads[1] == threading.get_ident()
