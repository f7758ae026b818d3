"""Random work of a session: robot and question are what its history says, whatever was done."""

import random
from collections.abc import Callable
from typing import Any

import pytest

from finlab.actuators.kinds import KINDS
from finlab.errors import FinlabError
from finlab.layout import load_layout
from webapp.app import SessionStore
from webapp.session import Session
from webapp.session.lessons import LESSONS, TOUR
from webapp.session.looking import TASKS
from webapp.session.targets import PRESETS

SEQUENCES = 200
"""Sequences of random acts."""
SHARE = 20
"""Of them, those of `make test`."""
ACTS = 30
"""Acts of one sequence."""
ROBOTS = ("A", "penta", "bluerov2", "turtle_hybrid", "ucat")
"""Robots that are opened."""


class Worker:
    """A user who does anything, and remembers all robots that were there."""

    def __init__(self, seed: int) -> None:
        self.store = SessionStore(lambda: Session(load_layout("ucat")))
        self.key, self.session = self.store.enter([])
        self.random = random.Random(seed)
        self.left: Any = None
        """What there was before the open lesson."""

    @property
    def there(self) -> tuple[Any, ...]:
        """The robot and the question."""
        return self.session.state, self.session.shifts

    def reload(self) -> None:
        """Another page of the same browser."""
        self.store.leave(self.key)
        self.key, self.session = self.store.enter([self.key])

    def edit(self) -> None:
        """Change the layout."""
        session = self.session
        session.select(self.random.choice(session.state.layout.names))
        x, y, z = (round(self.random.uniform(-0.3, 0.3), 3) for _ in range(3))
        edits: list[Callable[[], object]] = [
            lambda: session.place_selected((x, y, z)),
            session.mirror,
            session.duplicate,
            session.delete,
            session.unlink,
            lambda: session.add(self.random.choice(tuple(KINDS))),
            lambda: session.toggle_loss(session.state.layout.names[0]),
            lambda: session.toggle_axis(self.random.randrange(6)),
        ]
        self.random.choice(edits)()

    def ask(self) -> None:
        """Change the question, or go along the null space."""
        session = self.session
        value = round(self.random.uniform(-2.0, 2.0), 2)
        questions: list[Callable[[], object]] = [
            lambda: session.set_target(self.random.randrange(6), value),
            lambda: session.set_preset(self.random.choice(tuple(PRESETS))),
            lambda: session.set_setting("policy", self.random.choice(("closest", "priority"))),
            lambda: session.shift(self.random.randrange(2), value),
        ]
        if self.random.random() < 0.5:
            session.history.end_merge()  # as before each drag of a slider
        self.random.choice(questions)()

    def undo(self) -> None:
        """Undo and redo come back to the same, as undo says it."""
        session = self.session
        before = self.there
        name = session.undo()
        if self.random.random() < 0.5:
            assert session.redo() == name and self.there == before

    def lesson(self) -> None:
        """Open a lesson or a stop of the tour."""
        if self.session.guide.stop is None:
            self.left = self.there
        self.session.guide.open(self.random.choice((*LESSONS, *TOUR)).name)

    def close(self) -> None:
        """Close the lesson: what was there before is there, and by undo what was made in it."""
        session = self.session
        if session.guide.stop is None:
            return
        in_lesson = self.there
        has_made = session.guide._has_made
        session.guide.end()
        assert self.there == self.left
        if has_made:
            session.undo()
            assert self.there == in_lesson
            session.redo()
            assert self.there == self.left

    def act(self) -> None:
        """Do anything."""
        session = self.session
        acts: list[Callable[[], object]] = [
            lambda: session.new_layout(self.random.choice(tuple(KINDS))),
            lambda: session.open_layout(load_layout(self.random.choice(ROBOTS))),
            self.lesson,
            lambda: session.guide.go(1) if session.guide.stop in LESSONS[:-1] else None,
            self.close,
            self.edit,
            self.edit,
            self.ask,
            self.ask,
            self.undo,
            session.redo,
            self.reload,
            lambda: session.show_task(self.random.choice(TASKS)),
        ]
        before = self.there
        try:
            self.random.choice(acts)()
        except FinlabError:
            assert self.there == before, "what is refused changes nothing"


@pytest.mark.parametrize(
    "seeds", [range(SHARE), pytest.param(range(SEQUENCES), marks=pytest.mark.exhaustive)]
)
def test_robot_and_question_are_what_the_history_says(seeds: range) -> None:
    undone = 0
    for seed in seeds:
        worker = Worker(seed)
        for _ in range(ACTS):
            worker.act()
        worker.close()
        session = worker.session
        seen = [worker.there]
        while session.history.past:
            session.undo()
            seen.append(worker.there)
        assert session.state == session._first, "all can be undone"
        for there in reversed(seen[:-1]):
            session.redo()
            assert worker.there == there
        undone += len(seen)
    assert undone > 5 * len(seeds)
