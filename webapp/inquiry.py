"""The dialog of one page with questions about a file, which `inquiry.js` draws."""

import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import viser

from finlab.errors import FinlabError
from finlab.exchange import Question
from webapp.handles import Presses
from webapp.viser_internals import run_file, run_script

MAX_FORCE = 1e9
"""Largest force that is taken for an answer [N]."""
Take = Callable[[Mapping[str, tuple[str, ...]]], object]
"""Takes the answers, by option."""


class Inquiry:
    """Questions of one page to its user; newer ones take the place of older ones."""

    def __init__(self, gui: viser.GuiApi, presses: Presses) -> None:
        """Listen to the page."""
        self._gui = gui
        self._questions: tuple[Question, ...] = ()
        self._take: Take | None = None
        presses.on("inquiry", self._answer)
        run_file(gui, "inquiry.js")

    def ask(self, title: str, text: str, questions: tuple[Question, ...], take: Take) -> None:
        """Shows questions, each with its choices and what is likely among them.

        Args:
            title: of the dialog.
            text: a sentence before the questions.
            questions: what is asked.
            take: gets the answers, once they are given.
        """
        self._questions = questions
        self._take = take
        plain = []
        for question in questions:
            plain.append(
                {
                    "option": question.option,
                    "asks": question.asks,
                    "why": question.why,
                    "choices": [list(choice) for choice in question.choices],
                    "marked": list(question.default),
                    "several": question.takes_several,
                    "numbers": question.takes_numbers,
                }
            )
        run_script(self._gui, f"finlabInquiry.ask(...{json.dumps([title, text, plain])});")

    def _answer(self, _key: str, text: str) -> None:
        """What the page sends: the answers by option, which may be anything."""
        take = self._take
        if take is None:
            return
        try:
            sent = json.loads(text)
        except (ValueError, RecursionError):
            return
        if not isinstance(sent, dict):
            return
        answers: dict[str, tuple[str, ...]] = {}
        for question in self._questions:
            answers[question.option] = checked_answer(question, sent.get(question.option))
        self._take = None
        run_script(self._gui, "finlabInquiry.close();")
        take(answers)


def checked_answer(question: Question, sent: Any) -> tuple[str, ...]:
    """Returns the answer to a question that a page sent. FinlabError: it is none of the choices, or
    two numbers that are no limits of a force."""
    values = sent if isinstance(sent, list) else []
    known = [choice.value for choice in question.choices]
    if question.takes_numbers and len(values) == 2:
        low, high = _force(values[0]), _force(values[1])
        if not (low <= 0.0 <= high and low < high):
            raise FinlabError(
                f"{question.asks} Expected a force astern of 0 or less, and one ahead of 0 or "
                f"more, got {values[0]} and {values[1]}"
            )
        return f"{low:g}", f"{high:g}"
    if any(value not in known for value in values) or (
        len(values) != 1 and not question.takes_several
    ):
        raise FinlabError(f"{question.asks} Choose one of the answers")
    return tuple(value for value in known if value in values)


def _force(value: Any) -> float:
    """A force that was typed, with a point or a comma [N]. FinlabError: it is no number."""
    text = str(value).strip().replace("−", "-").replace(",", ".")
    try:
        force = float(text)
    except ValueError:
        force = math.nan
    if not abs(force) <= MAX_FORCE:  # a NaN compares false as well
        raise FinlabError(f"Force [N]: expected a number, got {text!r:.40}")
    return force
