"""The server's half of the boxes for numbers; the page's half is tested in a browser."""

import json
from typing import Any

import pytest
import viser

from tests.webapp.test_app import app, on_loop, server, view
from webapp.number_fields import MAX_MESSAGE
from webapp.view import View
from webapp.viser_internals import uuid_of

__all__ = ["app", "server", "view"]


class Boxes:
    """Types into a page without a browser."""

    def __init__(self, server: viser.ViserServer, view: View) -> None:
        self.server, self.view, self._number = server, view, 0
        self._fields = {field.handle.label: field for field in view.fields._fields.values()}

    def word(self, label: str, text: str, how: str = "enter", place: int = 0) -> list[Any]:
        self._number += 1
        return [self._number, uuid_of(self._fields[label].handle), place, how, text]

    def hear(self, *words: list[Any]) -> None:
        on_loop(self.server, lambda: self.view.fields.mailbox.read(json.dumps(words)))

    def type(self, label: str, text: str, how: str = "enter", place: int = 0) -> None:
        self.hear(self.word(label, text, how, place))

    def note(self, label: str) -> str:
        note = self._fields[label]._note
        return str(note.content) if note.visible else ""


@pytest.fixture
def boxes(server: viser.ViserServer, view: View) -> Boxes:
    on_loop(server, lambda: view.do(lambda: view.session.select("front_left")))
    return Boxes(server, view)


def position(view: View) -> tuple[float, ...]:
    layout = view.session.state.layout
    return layout.fins[layout.index("front_left")].position


def test_each_box_leaves_the_others_as_exact_as_they_were(boxes: Boxes, view: View) -> None:
    boxes.type("Position [m]", "1/3")
    boxes.type("Position [m]", "1 cm", place=2)
    assert position(view) == (1 / 3, 0.1502, 0.01)


def test_a_word_counts_once_however_often_it_is_sent(boxes: Boxes, view: View) -> None:
    step = boxes.word("Fx [N]", "1", "step")
    boxes.hear(step)
    boxes.hear(step, boxes.word("Fx [N]", "1", "step"))
    assert view.session.state.target[0] == pytest.approx(1.22)


def test_a_refusal_stands_below_its_box_until_something_is_different(
    server: viser.ViserServer, boxes: Boxes, view: View
) -> None:
    boxes.type("Position [m]", "5 <b>kg</b>")
    assert "is not a number" in boxes.note("Position [m]") and "<b>" not in boxes.note("Position [m]")
    boxes.type("Position [m]", "55", place=1)
    assert "y of front_left [m]: expected a number from -2 to 2, got 55" in boxes.note("Position [m]")
    assert view.client.notes == [] and position(view) == (0.25753, 0.1502, 0.0)
    boxes.type("Position [m]", "0.3", place=1)
    assert "is not a number" in boxes.note("Position [m]") and "55" not in boxes.note("Position [m]")
    on_loop(server, lambda: view.do(lambda: view.session.select("front_right")))
    assert boxes.note("Position [m]") == ""


def test_half_a_number_that_rests_changes_nothing(boxes: Boxes, view: View) -> None:
    before = view.session.state
    for text in ("-", "-1.", "1,", "3 +", "2 c", "1e", "(1"):
        boxes.type("Fx [N]", text, "pause")
    assert view.session.state == before and boxes.note("Fx [N]") == ""
    boxes.type("Fx [N]", "5000", "pause")
    assert view.session.state == before and "-1000 to 1000" in boxes.note("Fx [N]")
    boxes.type("Fx [N]", "", "escape")
    assert boxes.note("Fx [N]") == ""


def test_escape_takes_back_what_rested_and_nothing_else(boxes: Boxes, view: View) -> None:
    boxes.type("Fx [N]", "3", "pause")
    boxes.type("Fx [N]", "31", "pause")
    assert view.session.state.target[0] == 31.0
    boxes.type("Fx [N]", "rested", "escape")
    assert view.session.state.target[0] == 1.2
    boxes.type("Fx [N]", "2")
    boxes.type("Fx [N]", "", "escape")
    assert view.session.state.target[0] == 2.0


@pytest.mark.parametrize("text", ["", "[", "[1]", "[[1]]", "3", "null", "[" * 5000, "x" * (MAX_MESSAGE + 1)])
def test_any_message_may_come(boxes: Boxes, view: View, server: viser.ViserServer, text: str) -> None:
    before = view.session.state
    on_loop(server, lambda: view.fields.mailbox.read(text))
    boxes.hear([1e9, 2, 3, 4, 5], [True, "a", 0, "enter", "1"], boxes.word("Fx [N]", "1", "rm"))
    boxes.hear(boxes.word("Fx [N]", "1", place=7), boxes.word("Fx [N]", "1", place=-1))
    assert view.session.state == before
    boxes.type("Fx [N]", "0.5")
    assert view.session.state.target[0] == 0.5
