"""The list of fins: rows to press, cells to edit where they stand, locks and eyes."""

import math
from collections.abc import Callable
from random import Random
from typing import Any

from finlab.errors import FinlabError
from tests.browser.walk.hand import Hand
from tests.browser.walk.model import Model
from tests.browser.walk.typist import WAIT_S
from webapp.session.quantities import read_number

CELLS = ("fin-x", "fin-y", "fin-z", "fin-shaft", "fin-name")
SHOWN = """() => [...document.querySelectorAll('.fin-list tr[data-fin]')].filter((row) => row.offsetParent)
  .map((row) => [row.dataset.fin, row.classList.contains('chosen'),
    [...row.querySelectorAll('td.place')].map((cell) => cell.innerText.trim())])"""
"""Name, whether it is marked, and the numbers of each row that is seen."""


class Rows:
    """What can be done with the list of fins."""

    def __init__(self, hand: Hand, model: Model, random: Random) -> None:
        """Nothing is done yet."""
        self._hand, self._model, self._random = hand, model, random

    def act(self, told: Callable[..., None]) -> str:
        """Do something with a row; `told` does it on the page and on the model."""
        names = self._model.session.state.layout.names
        index = self._random.randrange(len(names))
        row = self._hand.page.page.locator(".fin-list tr[data-fin]").nth(index)
        kind = self._random.choice(("select", "select", "mark", "cell", "cell", "robot"))
        if kind == "robot":
            whole = self._hand.page.page.locator(".fin-list tr[data-press=robot]")
            told(whole.click, lambda m: m.session.select(None))
            return "press the robot in the list"
        if kind == "select":
            held = self._random.choice(("", "", "Control", "Shift"))
            acts = {"": "select", "Control": "select_also", "Shift": "select_to"}
            keys = [held] if held else []
            told(
                lambda: row.locator(".swatch").click(modifiers=keys),
                lambda m: getattr(m.session, acts[held])(names[index]),
            )
            return f"press row {index} with {held or 'nothing'}"
        if kind == "mark":
            mark = self._random.choice(("locked", "hidden"))
            among = self._model.session.selection if names[index] in self._model.session.selection else ()
            which = (names[index], *(other for other in among if other != names[index]))
            told(row.locator(f"[data-press={mark}]").click, lambda m: m.session.toggle_mark(mark, which))
            return f"{mark} in row {index}"
        return self._edit(row, index, names[index])

    def _edit(self, row: Any, index: int, name: str) -> str:
        """Type into a cell; the first of two presses selects the fin, as it does anywhere in the row."""
        page = self._hand.page
        large = self._model.session.display.large  # the presenter's view, where the list has names alone
        kind = self._random.choice(CELLS[-1:] if large else CELLS)
        if kind == "fin-name":
            text = self._random.choice((f"fin {self._random.randrange(99)}", "", name, "<b>x</b>", "fin_1"))
        elif kind == "fin-shaft":
            text = self._random.choice((f"{self._random.uniform(-400, 400):.2f}", "0.5 rad", "north"))
        else:
            text = self._random.choice(
                (f"{self._random.uniform(-0.6, 0.6):.3f}", "12 cm", "1/8", "-.03", "12 q")
            )
        row.locator(f"[data-edit={kind}]").dblclick()
        box = page.page.locator(".fl-editor")
        box.wait_for()
        self._model.session.select(name)
        self._hand.keys.press("Control+a")
        self._hand.keys.type(text, delay=self._random.choice((0, 15)))
        if not text:
            self._hand.keys.press("Delete")
        if self._random.random() < 0.15:
            self._hand.keys.press("Escape")
            page.until(lambda: box.count() == 0, WAIT_S)
            return f"escape from {kind} of row {index}"
        untouched = box.input_value() == row.locator(f"[data-edit={kind}]").get_attribute("data-value")
        refused = None if untouched else self._model.told(lambda m: self._meant(m, kind, name, text))
        self._hand.keys.press("Enter")
        if refused is not None:
            page.until(lambda: refused in page.page.locator(".fl-editor-note").inner_text(), WAIT_S)
            self._hand.keys.press("Escape")
        page.until(lambda: box.count() == 0, WAIT_S)
        return f"type {text!r} into {kind} of row {index}"

    @staticmethod
    def _meant(model: Model, kind: str, name: str, text: str) -> None:
        session = model.session
        if kind == "fin-name":
            session.rename_fin(name, text)
        elif kind == "fin-shaft":
            session.turn_one(name, read_number(text, "°"))
        else:
            session.place_one(name, kind[-1], read_number(text, "m"))

    def check(self) -> None:
        """The page's rows against the model."""
        session = self._model.session
        wanted = []
        for fin in session.state.layout.fins:
            numbers = [*(f"{value:.3f}" for value in fin.position), f"{math.degrees(fin.mounting_angle):.0f}"]
            plain = [(text if float(text) else text.lstrip("-")).replace("-", "−") for text in numbers]
            wanted.append([fin.name, fin.name in session.selection, plain])
        shown = self._hand.page.page.evaluate(SHOWN)
        if shown != wanted:
            raise FinlabError(f"the list shows {shown}, expected {wanted}")
