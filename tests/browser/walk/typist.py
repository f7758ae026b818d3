"""Real keys in the boxes for numbers: whole texts, halves, nonsense, second thoughts, arrows."""

from collections.abc import Callable
from random import Random
from typing import Any

from finlab.errors import FinlabError
from tests.browser.walk.boxes import Box
from tests.browser.walk.hand import Hand
from tests.browser.walk.model import Model
from webapp.number_fields import NumberField
from webapp.session.quantities import read_number

WAIT_S = 60.0
"""Longest wait for the page to hear keys, and to show what came of them."""
NONSENSE = ("1/", "12 kg^2 m", "abc", "--", "1 2", "1e", "(3", "5 5 N", "1/0", "..")
"""Texts that stand for no number."""
KINDS = {"type": 40, "refuse": 12, "escape": 10, "empty": 6, "arrows": 12, "rest": 3}
"""What may be done with a box, and how often."""


class Typist:
    """Types, and works out what the page should make of it."""

    def __init__(self, hand: Hand, model: Model, random: Random) -> None:
        """Listen to what the server is told, since on a slow machine the time between two keys is a rest."""
        self._hand, self._model, self._random = hand, model, random
        self._heard: list[tuple[int, str, str]] = []
        for field in hand.page.view.fields._fields.values():
            self._listen(field)

    def _listen(self, field: NumberField) -> None:
        hear: Callable[[int, str, str], Any] = field.hear

        def noted(place: int, how: str, text: str) -> Any:
            self._heard.append((place, how, text))
            return hear(place, how, text)

        setattr(field, "hear", noted)  # noqa: B010

    def act(self, box: Box) -> str:
        """Do something with one box of a row; returns what."""
        kind = self._random.choices(list(KINDS), list(KINDS.values()))[0]
        place = self._random.randrange(len(box.values(self._model)))
        field = self._hand.inputs(box.spot, box.label, box.nth)
        field = field.nth(place) if len(box.values(self._model)) > 1 else field.last  # a slider's is the last
        field.scroll_into_view_if_needed()
        field.click()
        self._hand.keys.press("Control+a")
        self._heard.clear()
        begun = box.values(self._model)[place]
        said = getattr(self, f"_{kind}")(box, place, field)
        self._hand.page.catch_up()
        refused = self._follow(box, place, begun)
        if refused:
            self._hand.page.until(lambda: field.get_attribute("aria-invalid") == "true", WAIT_S)
            self._hand.page.until(
                lambda: self._hand.page.page.locator(".fl.note:visible .missing").count() > 0
            )
            field.click()
            self._hand.keys.press("Escape")
        self._hand.page.until(
            lambda: field.input_value() == box.text(box.values(self._model)[place]) or self._moved(box),
            WAIT_S,
        )
        self._hand.rest_of_page()
        return f"{kind} {said!r} in {box.label} {place}"

    def _moved(self, box: Box) -> bool:
        """Whether the row is not there any more."""
        return not box.there(self._model) or self._hand.labels(box.spot, box.label).count() == 0

    def _follow(self, box: Box, place: int, begun: float) -> bool:
        """Tell the model what was heard; whether the last of it was refused."""
        refused = False
        for where, how, text in self._heard:
            assert where == place, f"box {place} spoke as {where}"
            now = box.values(self._model)[place]
            if how == "pause":
                refused = not text.endswith((".", ",")) and self._read(box, place, text) is False
            elif how == "enter":
                refused = self._read(box, place, text) is not True
            elif how == "step":
                way = -1.0 if text.startswith("-") else 1.0
                refused = not self._take(box, place, round(now + way * box.step, box.digits))
            elif how == "escape" and text:
                refused = not self._take(box, place, begun)
            else:
                refused = False
        return refused

    def _read(self, box: Box, place: int, text: str) -> bool | None:
        """Whether a text was taken; None where it is no number."""
        try:
            asked = read_number(text, box.unit)
        except FinlabError:
            return None
        return self._take(box, place, asked)

    def _take(self, box: Box, place: int, asked: float) -> bool:
        values = list(box.values(self._model))
        if asked == values[place]:
            return True
        values[place] = asked
        return self._model.told(lambda model: box.take(model, tuple(values))) is None

    def _number(self, box: Box) -> str:
        """A text that stands for a number, now and then for one that is too large."""
        beyond = 0.1 * (box.high - box.low) * (self._random.random() < 0.15)
        value = round(self._random.uniform(box.low - beyond, box.high + beyond), self._random.randrange(4))
        plain = f"{value:g}"
        texts = [plain, plain, f"{value:.6f}", plain.replace(".", ","), f"{2 * value:g}/2", f"({plain})"]
        texts += [f"{plain} {box.unit}".strip(), plain.replace("0.", ".", 1), f"{value:e}", f"0 + {plain}"]
        if box.unit == "m":
            texts += [f"{100 * value:g} cm", f"{1000 * value:.3f}mm"]
        return str(self._random.choice(texts))

    def _keys(self, text: str) -> None:
        self._hand.keys.type(text, delay=self._random.choice((0, 0, 10, 60)))

    def _leave(self, text: str) -> None:
        """Be done with a box in one of three ways; what is heard last is the whole text."""
        way = self._random.choice(("Enter", "Tab", "click"))
        if way == "click":
            self._hand.page.page.locator(".fl-tasks [aria-current]").click()
        else:
            self._hand.keys.press(way)
        self._hears("enter", text)

    def _hears(self, how: str, text: str) -> None:
        self._hand.page.until(lambda: any(word[1] == how for word in self._heard), WAIT_S)
        assert self._heard[-1][1:] == (how, text), f"{how} {text!r} came as {self._heard[-1]}"

    def _type(self, _box: Box, _place: int, _field: Any) -> str:
        text = self._number(_box)
        self._keys(text)
        self._leave(text)
        return text

    def _rest(self, box: Box, _place: int, field: Any) -> str:
        """Half of a text, a rest, and the other half."""
        text = self._number(box)
        cut = self._random.randrange(1, len(text) + 1)
        self._keys(text[:cut])
        self._hand.page.rest(1250)
        assert field.input_value() == text[:cut], "nothing is written into a box that has the focus"
        if text[cut:]:
            self._keys(text[cut:])
        self._leave(text.strip())
        return f"{text[:cut]}|{text[cut:]}"

    def _refuse(self, _box: Box, _place: int, field: Any) -> str:
        text = self._random.choice(NONSENSE)
        self._keys(text)
        self._leave(text)
        assert field.input_value() == text, "a refused text stays to be mended"
        return text

    def _escape(self, box: Box, _place: int, _field: Any) -> str:
        text = self._number(box)
        self._keys(text)
        if self._random.random() < 0.2:
            self._hand.page.rest(1250)
        self._hand.keys.press("Escape")
        self._hand.page.until(lambda: any(word[1] == "escape" for word in self._heard), WAIT_S)
        return text

    def _empty(self, _box: Box, _place: int, _field: Any) -> str:
        self._hand.keys.press("Delete")
        way = self._random.choice(("Enter", "Tab"))
        self._hand.keys.press(way)
        self._hears("empty", "")
        return ""

    def _arrows(self, _box: Box, _place: int, _field: Any) -> str:
        ways = [self._random.choice(("ArrowUp", "ArrowDown")) for _ in range(self._random.randrange(1, 5))]
        for way in ways:
            self._hand.keys.press(way)
        self._hand.page.until(lambda: sum(word[1] == "step" for word in self._heard) == len(ways), WAIT_S)
        self._hand.keys.press("Escape")
        return " ".join(ways)
