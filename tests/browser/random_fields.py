"""Random typing with real keys over the boxes for numbers, against a model.

`python -m tests.browser.random_fields --actions 2000 --seed 0`. After each action the box, the session and
the model must agree, no note may lie over the page, and nothing may stand in the browser's log.
"""

import argparse
import math
import random
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from finlab.errors import FinlabError
from webapp.session.quantities import read_number

HEADINGS = {
    "Allocate": "Preset",
    "Design": "How many",
    "Improve": "May move",
    "Simulate": "Break a fin",
}
"""Words in each tab that can be clicked without anything happening."""


KINDS = {
    "type": 40,
    "refuse": 14,
    "escape": 10,
    "empty": 6,
    "arrows": 12,
    "undo": 6,
    "fin": 4,
    "rest": 8,
}
"""What may be done, and how often."""
NONSENSE = ("1/", "12 kg^2", "abc", "--", "1 2", "1e", "(3", "5 5 N", "1/0", "..")
"""Texts that stand for no number."""


@dataclass(frozen=True)
class Box:
    """One box, and what the model knows of it."""

    tab: str
    label: str
    place: int
    unit: str
    low: float
    high: float
    step: float
    digits: int
    value: Callable[[Any], float]
    """What is in force, of a session."""
    becomes: Callable[[float], float] = lambda asked: asked
    """What a number that is taken turns into."""

    def text(self, value: float) -> str:
        """As the box shows it."""
        text = f"{value:.{self.digits}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
        return "0" if text == "-0" else text


def _wrapped(degrees: float) -> float:
    return math.degrees(math.atan2(math.sin(math.radians(degrees)), math.cos(math.radians(degrees))))


def _fin(session: Any) -> Any:
    return session.state.layout.fins[session.state.layout.index(session.selected)]


def boxes() -> list[Box]:
    """All that the walk types into."""
    wrench = [
        Box(
            "Allocate",
            f"{axis} [{unit}]",
            -1,
            unit,
            -1000.0,
            1000.0,
            step,
            4,
            lambda s, k=k: s.state.target[k],
        )
        for k, (axis, unit, step) in enumerate(
            [(a, "N", 0.01) for a in ("Fx", "Fy", "Fz")] + [(a, "N m", 0.001) for a in ("Tx", "Ty", "Tz")]
        )
    ]
    place = [
        Box("Design", "Position [m]", k, "m", -2.0, 2.0, 0.005, 4, lambda s, k=k: _fin(s).position[k])
        for k in range(3)
    ]
    shaft = Box(
        "Design",
        "Shaft [°]",
        -1,
        "°",
        -3600.0,
        3600.0,
        1.0,
        2,
        lambda s: math.degrees(_fin(s).mounting_angle),
        _wrapped,
    )
    reach = [
        Box("Improve", "Reach ± [m]", k, "m", 0.0, 0.5, 0.01, 4, lambda s, k=k: s.draft.way("all")[k])
        for k in range(3)
    ]
    turn = Box("Improve", "Turn ± [°]", -1, "°", 0.0, 180.0, 5.0, 2, lambda s: s.draft.way("all")[3])
    apart = Box("Improve", "Apart [m]", -1, "m", 0.0, 1.0, 0.01, 4, lambda s: s.draft.apart_m)
    swim = [
        Box("Simulate", label, -1, unit, low, high, step, 3, lambda s, key=key: getattr(s.swim, key))
        for key, label, unit, low, high, step in (
            ("current_cm_s", "Current [cm/s]", "cm/s", 0.0, 30.0, 0.1),
            ("heading_deg", "flows to [°]", "°", -180.0, 180.0, 1.0),
            ("waves_cm", "Waves [cm]", "cm", 0.0, 60.0, 1.0),
            ("buoyancy_percent", "Buoyancy [%]", "%", -3.0, 3.0, 0.1),
        )
    ]
    speed = Box("Allocate", "Motion speed", -1, "", 0.02, 1.0, 0.05, 3, lambda s: s.display.speed)
    return [*wrench, *place, shaft, *reach, turn, apart, *swim, speed]


class Walk:
    """A page, a model of it, and random actions on both."""

    def __init__(self, page: Any, seed: int) -> None:
        """Take over a page at first sight; all that follows is decided by the seed."""
        self._page, self._random = page, random.Random(seed)
        self._session, self._boxes = page.session, boxes()
        self._tab = "Allocate"
        self.done: Counter[str] = Counter()
        """How often each kind of action was done."""
        page.unfold("Display", "Motion speed")
        page.key("n")
        page.until(lambda: self._session.selected is not None)
        self._model = {box: box.value(self._session) for box in self._boxes}

    def act(self) -> None:
        """One action, and a look at what came of it."""
        here = [box for box in self._boxes if box.tab == self._tab]
        box = self._random.choice(here if self._random.random() < 0.8 else self._boxes)
        if box.tab != self._tab:
            self._page.tab(box.tab)
            self._tab = box.tab
        kind = self._random.choices(list(KINDS), list(KINDS.values()))[0]
        self.done[kind] += 1
        try:
            getattr(self, f"_{kind}")(box)
            self._page.catch_up()
            self._compare()
        except AssertionError as error:
            raise AssertionError(
                f"action {self.done.total()}, {kind} in {box.label} {box.place}: {error}"
            ) from error

    def _focus(self, box: Box) -> Any:
        row = self._page.row(box.label)
        found = row.last if box.place < 0 else row.nth(box.place)
        found.scroll_into_view_if_needed()
        found.click()
        self._page.page.keyboard.press("Control+a")
        return found

    def _keys(self, text: str) -> None:
        self._page.page.keyboard.type(text, delay=self._random.choice((0, 10, 40, 120)))

    def _leave(self) -> str:
        """Be done with a box in one of three ways."""
        way = self._random.choice(("Enter", "Tab", "click"))
        if way == "click":
            self._page.page.get_by_text(HEADINGS[self._tab], exact=True).first.click()
        else:
            self._page.page.keyboard.press(way)
        return way

    def _number(self, box: Box) -> tuple[str, float]:
        """A text and the number that it stands for, within the box's range."""
        low, high = max(box.low, -20.0 * box.step - 1.0), min(box.high, 20.0 * box.step + 1.0)
        value = round(self._random.uniform(low, high), 3)
        value = min(max(value, box.low), box.high)
        plain = f"{value:g}"
        texts = [plain, f"{value:.6f}", plain.replace(".", ","), f"{2 * value:g}/2", f"({plain})"]
        texts += [f"{plain} {box.unit}".strip(), plain.replace("0.", ".", 1), f"{value:e}", f"0 + {plain}"]
        if box.unit == "m":
            texts += [f"{100 * value:g} cm", f"{1000 * value:.3f}mm"]
        text = self._random.choice(texts)
        return text, read_number(text, box.unit)

    def _type(self, box: Box) -> None:
        field = self._focus(box)
        text, value = self._number(box)
        self._keys(text)
        self._leave()
        self._model[box] = box.becomes(value)
        self._settles(box, field)

    def _rest(self, box: Box) -> None:
        """Half of a text, a rest, and the other half."""
        field = self._focus(box)
        text, value = self._number(box)
        cut = self._random.randrange(1, len(text) + 1)
        self._keys(text[:cut])
        self._page.rest(1250)
        assert field.input_value() == text[:cut], "nothing is written into a box that has the focus"
        self._keys(text[cut:])
        self._leave()
        self._model[box] = box.becomes(value)
        self._settles(box, field)

    def _refuse(self, box: Box) -> None:
        field = self._focus(box)
        beyond = f"{box.high + 1.0:g}" if self._random.random() < 0.4 else None
        text = beyond or self._random.choice(NONSENSE)
        self._keys(text)
        self._leave()
        note = self._page.page.locator(".fl.note:visible .missing")
        self._page.until(lambda: note.count() > 0, 15)
        assert field.input_value() == text and field.get_attribute("aria-invalid") == "true"
        taken = {self._model[box]}
        for end in range(1, len(text)):  # a busy machine may make a rest of the time between two keys
            try:
                part = read_number(text[:end], box.unit)
            except FinlabError:
                continue
            taken |= {box.becomes(part)} if box.low <= part <= box.high else set()
        now = box.value(self._session)
        assert any(abs(now - value) < 1e-9 for value in taken), f"{text!r} brought {now} into force"
        self._model[box] = now
        field.click()
        self._page.page.keyboard.press("Escape")
        self._settles(box, field)

    def _escape(self, box: Box) -> None:
        field = self._focus(box)
        self._keys(self._number(box)[0])
        if self._random.random() < 0.3:
            self._page.rest(1250)
        self._page.page.keyboard.press("Escape")
        self._settles(box, field)

    def _empty(self, box: Box) -> None:
        field = self._focus(box)
        self._page.page.keyboard.press("Delete")
        self._leave()
        self._settles(box, field)

    def _arrows(self, box: Box) -> None:
        field = self._focus(box)
        for _ in range(self._random.randrange(1, 6)):
            way = self._random.choice((1.0, -1.0))
            self._page.page.keyboard.press("ArrowUp" if way > 0 else "ArrowDown")
            asked = round(self._model[box] + way * box.step, box.digits)
            if box.low <= asked <= box.high:
                self._model[box] = box.becomes(asked)
        self._page.page.keyboard.press("Escape")
        self._settles(box, field)

    def _undo(self, box: Box) -> None:
        """What undo brings back is for the session's own tests to say: here the page has to show it."""
        history = self._session.history
        name = "Undo" if history.past and (not history.future or self._random.random() < 0.6) else "Redo"
        if history.past or history.future:
            revision = self._session.revision
            self._page.press(name)
            self._page.until(lambda: self._session.revision != revision, 15)
            if self._session.selected is None:
                self._fin(box)
        self._model |= {other: other.value(self._session) for other in self._boxes}

    def _fin(self, box: Box) -> None:
        selected = self._session.selected
        self._page.key("n")
        self._page.until(lambda: self._session.selected not in (selected, None), 15)
        self._model |= {other: other.value(self._session) for other in self._boxes}

    def _settles(self, box: Box, field: Any) -> None:
        """Wait until the box shows what the model expects of it."""
        wanted = self._model[box]

        def agrees() -> bool:
            now = box.value(self._session)
            # What lies between two digits may be rounded either way, so the text is that of what is in force.
            return abs(now - wanted) <= 1e-9 * max(1.0, abs(wanted)) and field.input_value() == box.text(now)

        try:
            self._page.until(agrees, 15)
        except AssertionError:
            raise AssertionError(f"shows {field.input_value()!r}, expected {box.text(wanted)!r}") from None

    def _compare(self) -> None:
        """The session against the model, and every box of the tab against both."""
        for box, wanted in self._model.items():
            now = box.value(self._session)
            assert abs(now - wanted) <= 1e-9 * max(1.0, abs(wanted)), (
                f"{box.label} {box.place}: {now}, not {wanted}"
            )
        for box in self._boxes:
            if box.tab == self._tab:
                row = self._page.row(box.label)
                self._settles(box, row.last if box.place < 0 else row.nth(box.place))
        assert self._page.notes() == [], "no note lies over the page"
        assert self._page.problems == [], self._page.problems


def main() -> None:
    """Walk for so many actions."""
    from playwright.sync_api import sync_playwright

    from tests.browser.conftest import CHROMIUM, FLAGS, serving
    from tests.browser.page import Page

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--actions", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with serving() as served, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM, headless=True, chromium_sandbox=False, args=FLAGS
        )
        context = browser.new_context(viewport={"width": 900, "height": 700})
        walk = Walk(Page(context.new_page(), served), options.seed)
        for k in range(options.actions):
            walk.act()
            if (k + 1) % 50 == 0:
                print(f"{k + 1} actions, no mismatch: {dict(walk.done)}", flush=True)
        print(f"{options.actions} actions with seed {options.seed}, no mismatch: {dict(walk.done)}")
        browser.close()


if __name__ == "__main__":
    main()
