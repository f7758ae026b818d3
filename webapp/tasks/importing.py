"""Robots that are read from files of other programs: what a file leaves open is asked in a dialog,
and the file is read with the answers."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from finlab.errors import FinlabError
from finlab.exchange import Answers, Question
from finlab.files.worker import in_worker
from finlab.swim.design_files import Opened, Unanswered
from finlab.swim.hull import hull_of
from webapp.inquiry import Inquiry
from webapp.session import Session, files
from webapp.session.granted import SourceFile, granted_of, remarks_of
from webapp.tasks.slot import Deferred

TITLE = "Before {} is opened"
"""Title of the dialog."""
INTRODUCTION = "The file leaves this open. What is marked is likely, or usual."
"""First sentence of the dialog."""
AGAIN = (
    "The file is read again with your answer. What you have changed since then stays in Undo alone."
)
"""First sentence of the dialog about a robot that is there already."""
NO_ANSWERS: Answers = {}


class Importing:
    """The files of one page that were opened as robots."""

    def __init__(
        self,
        session: Session,
        inquiry: Inquiry,
        deferred: Deferred,
        take: Callable[[Opened, SourceFile], object],
    ) -> None:
        """`take` puts a robot on the page, with the file that it is from."""
        self._session = session
        self._inquiry = inquiry
        self._deferred = deferred
        self._take = take

    def open(self, name: str, content: bytes) -> None:
        """A robot from a file that the browser sent."""
        self._read(SourceFile(name, content, NO_ANSWERS, {}))

    def ask_again(self, option: str) -> None:
        """Ask a question about the file of the present robot again. FinlabError: the robot is from
        no file, or that question was never asked."""
        source = self._session.state.source
        question = None if source is None else source.asked.get(option)
        if source is None or question is None:
            raise FinlabError("this robot is from no file that can be read again")
        answer = source.answers.get(question.option, question.default)
        self._ask(source, (replace(question, default=answer),), AGAIN)

    def _read(self, source: SourceFile) -> None:
        """Reads a file with the answers that there are, on a thread."""
        read = partial(in_worker, files.read_layout, source.name, source.content, source.answers)

        def ready() -> Opened | Unanswered | FinlabError:
            try:
                result = read()
            except FinlabError as error:
                if not source.answers:
                    raise
                return error  # by the answers; they can be changed
            if isinstance(result, Opened):
                hull_of(result.layout)  # what is drawn of it takes its time
            return result

        self._deferred.make(ready, partial(self._use, source), "open")

    def _use(self, source: SourceFile, result: Opened | Unanswered | FinlabError) -> None:
        """Opens what was read, or asks what it leaves open."""
        if isinstance(result, FinlabError):
            questions = [
                replace(question, default=source.answers[question.option])
                for question in source.asked.values()
                if question.option in source.answers
            ]
            self._ask(source, tuple(questions), str(result))
        elif isinstance(result, Unanswered):
            self._ask(source, result.questions, INTRODUCTION)
        else:
            remarks = remarks_of(result.notes)
            # Questions whose defaults were taken can be asked as well.
            questions_of = dict(source.asked)
            for note in result.notes:
                if note.question is not None:
                    questions_of.setdefault(note.question.option, note.question)
            self._take(result, replace(source, asked=questions_of, remarks=remarks))

    def _ask(self, source: SourceFile, questions: tuple[Question, ...], text: str) -> None:
        """Asks questions about a file, and reads it with the answers."""

        def answered(answers: Mapping[Any, tuple[str, ...]]) -> None:
            questions_of = dict(source.asked)
            for question in questions:
                questions_of[question.option] = question
            self._read(replace(source, answers={**source.answers, **answers}, asked=questions_of))

        self._inquiry.ask(TITLE.format(source.name), text, questions, answered)


def rows_of(opened: Opened, source: SourceFile) -> dict[str, Any]:
    """Returns what a session keeps of a file beside its robot, as arguments of `open_layout`."""
    granted = granted_of(opened.layout, opened.notes, source.answers, source.asked)
    return {"granted": granted, "source": source if granted or source.remarks else None}
