"""A random walk over the controls of the app with real keys and clicks, against a model.

After each action the session of the server, every row that is seen and the list of fins must agree with the
model; no note may lie over the page that was not due, and nothing may stand in the browser's log.
"""

from collections import Counter
from collections.abc import Callable
from random import Random
from typing import Any

from tests.browser.walk.boxes import Box, boxes
from tests.browser.walk.compare import differences
from tests.browser.walk.hand import Hand
from tests.browser.walk.lists import Choice, Tick, choices, ticks
from tests.browser.walk.longer import LONGER
from tests.browser.walk.model import Model
from tests.browser.walk.orders import ELSEWHERE, orders, pressed
from tests.browser.walk.presses import Press, presses
from tests.browser.walk.rows import Rows
from tests.browser.walk.typist import Typist
from webapp.commands import commands
from webapp.session.looking import DRAWERS, TASKS

KINDS = {"box": 34, "choice": 9, "tick": 9, "press": 14, "slider": 5, "row": 9, "key": 9}
KINDS |= {"palette": 3, "bar": 5, "longer": 3}
"""What may be done, and how often."""
SLIDERS = {"Strength [%]", "Stuck at [°]", "Shaft [°]", "Turn ± [°]", "Motion speed", "Speed"}
SLIDERS |= {"Current [cm/s]", "flows to [°]", "Waves [cm]", "Buoyancy [%]", "Fx [N]", "Tz [N m]"}
"""Boxes that stand beside a slider; of the wrench two."""
SETTLE_S = 60.0
"""Longest wait for the page to agree with the model."""


class Walk:
    """A page, a model of it, and random actions on both."""

    def __init__(self, page: Any, seed: int, kinds: dict[str, int] = KINDS) -> None:
        """Take over a page at first sight; the seed and how often each kind is done decide the rest."""
        self._kinds = kinds
        self.page, self.random, self.seed = page, Random(seed), seed
        self.model = Model(page.session.state, page.session.display)
        page.session.history._clock = self.model.session.history._clock
        self.hand = Hand(page)
        self.typist = Typist(self.hand, self.model, self.random)
        self.rows = Rows(self.hand, self.model, self.random)
        self.boxes, self.choices, self.ticks, self.presses = boxes(), choices(), ticks(), presses()
        table, self.orders = commands(page.view), orders()
        strange = {command.label for command in table} ^ {*self.orders, *ELSEWHERE}
        assert not strange, f"commands that the page or the walk does not know: {strange}"
        self.keys = {c.label: pressed(c.key, c.modifier) for c in table if c.key}
        self.log: list[str] = []
        """What was done."""
        self.done: Counter[str] = Counter()
        """How often each kind of action was done."""

    def act(self) -> None:
        """One action, and a look at what came of it."""
        self.model.tick += 10.0
        kind = self.random.choices(list(self._kinds), list(self._kinds.values()))[0]
        self.log.append(f"{kind} ...")
        try:
            self.log[-1] = f"{kind}: {getattr(self, f'_{kind}')()}"
            self.done[kind] += 1
            self.compare()
        except Exception as error:
            where = "\n".join(self.log[-8:])
            raise AssertionError(f"action {len(self.log)} of seed {self.seed}: {error!r}\n{where}") from error

    def told(self, on_page: Callable[[], object], intent: Callable[[Model], object]) -> None:
        """Do something on the page and tell the model; what that refuses the page must refuse in a note."""
        refused = self.model.told(intent)
        on_page()
        if refused is not None:
            self.page.until(lambda: any(refused in note for note in self.page.notes()), SETTLE_S)
            self.page.close_notes()
            self.page.until(lambda: self.page.notes() == [], SETTLE_S)

    def _there(self, controls: list[Any], show: bool = True) -> Any:
        """One of those that are there now, most often of the task that is open; brought to sight."""
        there = [control for control in controls if control.there(self.model)]
        here = [control for control in there if control.spot[0] == self.model.session.task]
        control = self.random.choice(here if here and self.random.random() < 0.7 else there)
        self.hand.go(control.spot, self.model)
        folder = getattr(control, "folder", "")
        if folder:
            self.hand.unfold(control.spot, folder, control.label)
        return control

    def _box(self) -> str:
        box: Box = self._there(self.boxes)
        return self.typist.act(box)

    def _choice(self) -> str:
        choice: Choice = self._there(self.choices)
        entry = self.random.choice(list(choice.entries(self.model)))
        before = choice.shows(self.model)
        self.told(
            lambda: self.hand.choose(choice.spot, choice.label, entry),
            (lambda _: None) if entry == before else (lambda m: choice.take(m, entry)),
        )
        if choice.label == "Sweep":  # its ends come from what is within reach: read, and held from here on
            self.page.catch_up()
            low, high = (float(box.input_value()) for box in self.hand.inputs(choice.spot, "From, to").all())
            self.model.ends = (low, high)
        return f"{entry} in {choice.label}"

    def _tick(self) -> str:
        tick: Tick = self._there(self.ticks)
        wanted = not tick.shows(self.model)
        box = self.hand.inputs(tick.spot, tick.label).first
        self.told(box.click, lambda m: tick.take(m, wanted))
        if tick.label == "Shadows":  # which no machine without a graphics card can draw for long
            self.page.catch_up()
            self.told(box.click, lambda m: tick.take(m, not wanted))
        return f"{tick.label} {wanted}"

    def _press(self) -> str:
        press: Press = self._there(self.presses)
        button = press.button if isinstance(press.button, str) else press.button(self.model, self.random)
        place = button if isinstance(button, int) else 0
        self.told(
            lambda: self.hand.click(press.spot, press.label, button),
            lambda m: press.take(m, place),
        )
        return f"{button} in {press.label}"

    def _slider(self) -> str:
        """Arrow keys on the thumb; what the page shows then is what was meant."""
        box: Box = self._there([box for box in self.boxes if box.label in SLIDERS])
        thumb = self.hand.row(box.spot, box.label, box.nth).get_by_role("slider")
        thumb.focus()
        way = self.random.choice(("ArrowRight", "ArrowLeft"))
        before = float(thumb.get_attribute("aria-valuenow"))
        self.hand.keys.press(way)
        now = float(thumb.get_attribute("aria-valuenow"))
        if now != before:
            assert (now > before) == (way == "ArrowRight"), (
                f"{box.label} went from {before} to {now} on {way}"
            )
            self.model.told(lambda m: box.take(m, (now,)))
        self.page.catch_up()
        self.hand.rest_of_page()
        return f"{way} on {box.label}, {before} to {now}"

    def _row(self) -> str:
        self.hand.go(("Design", "Fins"), self.model)
        return self.rows.act(self.told)

    def _key(self) -> str:
        label = self.random.choice([label for label in self.keys if label not in ELSEWHERE])
        self.hand.rest_of_page()
        self.told(lambda: self.hand.keys.press(self.keys[label]), self.orders[label])
        return f"{self.keys[label]}, {label}"

    def _palette(self) -> str:
        label = self.random.choice(list(self.orders))
        self.hand.rest_of_page()
        self.hand.keys.press("Control+k")
        search = self.page.page.get_by_placeholder("Search commands")
        search.wait_for()
        self.page.until(lambda: search.evaluate("box => box === document.activeElement"))  # it opens slowly
        self.hand.keys.type(label, delay=5)
        entry = self.page.page.locator(".mantine-Spotlight-action").filter(has_text=label).first
        self.told(entry.click, self.orders[label])
        search.wait_for(state="hidden")
        return label

    def _bar(self) -> str:
        """Tasks, tabs of the drawer, its fold, and the buttons beside the axes."""
        page, session = self.page.page, self.model.session
        kind = self.random.choice(("task", "drawer", "fold", "undo", "redo", "camera"))
        if kind == "task":
            name = self.random.choice(TASKS)
            self.told(
                page.locator(".fl-tasks button", has_text=name).click, lambda m: m.session.show_task(name)
            )
            return name
        if kind in ("undo", "redo"):
            step = getattr(session.history, f"{kind}_name")
            said = f"{kind.capitalize()}: {step}" if step else kind.capitalize()
            button = page.get_by_role("button", name=said, exact=True).first
            self.told(button.click, lambda m: getattr(m.session, kind)())
            return said
        if kind == "camera" and session.display.large:
            return "no camera bar in the presenter's view"
        if kind == "camera":
            self.told(page.locator(".fl-camera button", has_text="Frame").click, lambda _: None)
            return "Frame"
        if not DRAWERS[session.task]:
            return "no drawer"
        if kind == "fold":
            self.told(page.locator(".fl-strip .fold").click, lambda m: m.session.fold_drawer())
            return "fold"
        name = self.random.choice(DRAWERS[session.task])
        self.told(
            page.locator(".fl-strip button", has_text=name).click, lambda m: m.session.show_drawer(name)
        )
        return name

    def _longer(self) -> str:
        name = self.random.choice(list(LONGER))
        LONGER[name](self)
        return name

    def compare(self, patience: float = SETTLE_S) -> None:
        """Server, page and model; they may need a while [s] to come round."""
        told = ["nothing was compared"]

        def agree() -> bool:
            told[:] = differences(self)
            return not told

        self.page.catch_up()
        try:
            self.page.until(agree, patience)
        except AssertionError:
            raise AssertionError("; ".join(told)) from None
        self.page.until(lambda: not self.page.view.busy, 60.0)
        assert self.page.problems == [], self.page.problems
