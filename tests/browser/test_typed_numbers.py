"""What is typed into a number box is asked, or it is said why not: in every box of every panel."""

import math
from typing import Any

import pytest

BOXES_SCRIPT = """() => [...document.querySelectorAll('.mantine-NumberInput-input')]
  .filter((box) => box.checkVisibility() && !box.disabled)
  .map((box) => { box.dataset.typed = box.getAttribute('aria-label')
      ?? document.querySelector(`label[for="${box.id}"]`)?.textContent; return box.dataset.typed; })"""
"""Script: names of all number boxes that are seen."""
TEXTS: dict[str, float | None] = {
    "0,5": 0.5,
    "1,5": 1.5,
    "1e3": 1000.0,
    "1e-1": 0.1,
    "1/3": None,
    "abc": None,
    "": None,
    "100": 100.0,
}
"""What is typed -> the number that it says; None for none."""
ENDS = ("Enter", "Tab", "click")
"""How a box is left."""
PLACES: list[tuple[str, str, str]] = [
    ("Allocate", "ucat", ""),
    ("Allocate", "ucat", "Null space"),
    ("Allocate", "ucat", "stuck"),
    ("Allocate", "ucat", "running"),
    ("Allocate", "bluerov2", "stuck"),
    ("Design", "ucat", "actuator"),
    ("Design", "ucat", "Improve"),
    ("Design", "ucat", "robot"),
    ("Design", "bluerov2", "actuator"),
    ("Design", "fish", "actuator"),
    ("Simulate", "ucat", ""),
]
"""Task, robot, and what is selected or lies in the drawer: together they show all panels."""
FOLDED = {"stuck": ("Damage", "Which"), "running": ("Damage", "Which"), "robot": ("Hull", "Shape")}
"""Panels that are folded at first, and a label in each."""
FAULTS: dict[str, Any] = {"stuck": 0.1, "running": (0.3, 1.0, 0.2)}
"""Faults that have boxes of their own."""
TURNED = ("Axis", "Shaft", "Zero", "Angles", "Stuck at")
"""Boxes of directions: any length, and any turn more, is the same one."""
EVERY = 41
"""Of so many cases `make test` runs one."""


def names_of(page: Any) -> list[str]:
    """Names of the number boxes that are seen."""
    page.rest(250)  # boxes are named some time after they come
    return [name for name in page.page.evaluate(BOXES_SCRIPT) if name]


def leave(page: Any, box: Any, end: str) -> None:
    """Leave a box."""
    if end == "click":
        page.page.locator(".fl-status").click(force=True)
    else:
        box.press(end)


def shown(page: Any, name: str) -> str:
    """The text of a box."""
    box = page.page.locator(f'.mantine-NumberInput-input[data-typed="{name}"]').first
    return str(box.input_value())


def check(page: Any, name: str, text: str, end: str) -> str:
    """Types a text into a box and leaves it; what was changed without a word, else nothing."""
    page.close_notes()
    page.until(lambda: page.page.locator(".mantine-Notification-root").count() == 0)
    box = page.page.locator(f'.mantine-NumberInput-input[data-typed="{name}"]').first
    before = box.input_value()
    heard = page.view.page.number_boxes
    count = heard.taken
    if page.page.locator('[role="listbox"]:visible').count():
        page.page.keyboard.press("Escape")  # options that Tab opened may lie over the box
    box.click()
    page.page.keyboard.press("Control+a")
    page.page.keyboard.press("Delete")
    page.page.keyboard.type(text)
    leave(page, box, end)
    if end == "Tab" and page.page.evaluate(
        "name => document.activeElement.dataset.typed === name", name
    ):
        return "Tab stays in it"
    if text == before:
        return ""
    page.until(lambda: heard.taken > count, told=lambda: f"{name}: {text!r} was not heard")
    page.until(lambda: page.view.is_settled)  # on a busy machine the page is written later
    page.catch_up()
    page.rest(60)
    if any("Not possible" in note for note in page.notes()):
        after = shown(page, name)
        return "" if after == before else f"refused, and shows {after!r} instead of {before!r}"
    after = shown(page, name)
    wanted = TEXTS[text]
    if wanted is None:
        is_emptied = text == "" and after == ""
        return "" if is_emptied else f"shows {after!r}, and nothing is said"
    if name.startswith(TURNED):
        return ""
    digits = len(after.partition(".")[2])
    is_asked = after != "" and math.isclose(float(after), wanted, abs_tol=0.5 * 10.0**-digits)
    return "" if is_asked else f"shows {after!r}"


def show(page: Any, task: str, robot: str, what: str) -> None:
    """Show a place of the page."""
    if page.session.state.layout.name != robot:
        page.tab("Design")
        page.choose("Layout", robot)
        page.until(lambda: page.session.state.layout.name == robot and not page.view.busy)
    page.tab(task)
    if what in ("Null space", "Improve"):
        page.tab(what)
    elif what:
        session = page.session
        name = None if what == "robot" else session.state.layout.names[0]

        def select() -> None:
            session.select(name)
            if what in FAULTS and name is not None:
                session.damage(name, what, FAULTS[what])

        loop = page._served.server.get_event_loop()
        loop.call_soon_threadsafe(page.view.do, select)
        page.until(lambda: session.selected == name)
    if what in FOLDED:
        page.catch_up()
        page.unfold(*FOLDED[what])
    page.until(lambda: not page.view.busy)
    page.catch_up()


@pytest.mark.parametrize("place", PLACES, ids=lambda place: "-".join(filter(None, place)))
@pytest.mark.parametrize("every", [EVERY, pytest.param(1, marks=pytest.mark.exhaustive)])
def test_nothing_that_is_typed_is_changed_silently(
    page: Any, place: tuple[str, str, str], every: int
) -> None:
    show(page, *place)
    cases = [(name, text, end) for name in names_of(page) for text in TEXTS for end in ENDS]
    assert cases
    silent = []
    for name, text, end in cases[PLACES.index(place) % every :: every]:
        if name not in names_of(page):  # what was typed before has hidden it
            page.start_over()
            show(page, *place)
            names_of(page)
        word = check(page, name, text, end)
        if word:
            silent.append(f"{name}: {text!r}, left by {end}: {word}")
    assert silent == []


def test_tab_leaves_a_box_at_once(page: Any) -> None:
    box = page.row("Fx [N]").last
    box.click()
    page.page.keyboard.press("Control+a")
    page.page.keyboard.type("1,25")
    page.page.keyboard.press("Tab")
    page.page.keyboard.press("Tab")
    page.until(lambda: page.session.state.target[0] == 1.25)
    assert page.row("Fy [N]").last.evaluate("box => box === document.activeElement")


def test_a_number_beyond_the_slider_is_asked_however_the_box_is_left(page: Any) -> None:
    for value, end in enumerate(ENDS, start=100):
        box = page.row("Fx [N]").last
        box.click()
        page.page.keyboard.press("Control+a")
        page.page.keyboard.type(str(value))
        leave(page, box, end)
        page.until(lambda value=value: page.session.state.target[0] == value)
        page.until(lambda value=value, box=box: box.input_value() == str(value))


def test_an_arrow_goes_on_from_what_is_typed(page: Any) -> None:
    show(page, "Design", "bluerov2", "actuator")
    box = page.row("Dead band [N]").last
    box.click()
    page.page.keyboard.press("Control+a")
    page.page.keyboard.type("0,4")
    page.page.keyboard.press("ArrowUp")
    page.until(lambda: page.session.state.layout.actuators[0].dead_band == 0.5)
