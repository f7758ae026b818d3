"""Numbers typed with real keys: what is typed is taken, once, and never half of it."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest


@pytest.fixture
def steps(page: Any) -> Iterator[list[tuple[str, Any]]]:
    """What the session is asked to do from now on: every value that reaches it."""
    heard: list[tuple[str, Any]] = []
    session = page.session

    def recorded(name: str, act: Callable[..., Any]) -> Callable[..., Any]:
        def hear(*arguments: Any) -> Any:
            heard.append((name, arguments[-1]))
            return act(*arguments)

        return hear

    names = ("set_target", "place_selected", "turn_selected")
    for name in names:
        setattr(session, name, recorded(name, getattr(session, name)))
    yield heard
    for name in names:
        delattr(session, name)


def begin(page: Any, label: str, place: int = -1) -> Any:
    """Click into a number box and select all that is in it."""
    boxes = page.row(label)
    box = boxes.last if place < 0 else boxes.nth(place)
    box.click()
    page.page.keyboard.press("Control+a")
    return box


def commit(page: Any, label: str, text: str, place: int = -1, end: str = "Enter") -> Any:
    """Type at once, so that no pause of a busy machine commits half of it, and end."""
    box = begin(page, label, place)
    page.page.keyboard.insert_text(text)
    page.page.keyboard.press(end)
    return box


def test_what_is_typed_is_taken_once(page: Any, steps: list[Any]) -> None:
    box = commit(page, "Fx [N]", "-0.5")
    page.until(lambda: page.session.state.target[0] == -0.5 and box.input_value() == "-0.5")
    for text, value in (("30,5", 30.5), ("1/3", 1 / 3), ("1e-2", 0.01), ("300 mN", 0.3)):
        commit(page, "Fz [N]", text, end="Tab")
        page.until(lambda value=value: page.session.state.target[2] == pytest.approx(value, rel=1e-12))
        page.shows_last("Fz [N]", f"{value:.4f}".rstrip("0"))
    page.rest(300)
    assert len(steps) == 5
    page.key("n")
    page.tab("Design")
    box = commit(page, "Shaft [°]", "45.5", end="Tab")
    page.until(lambda: page.session.state.layout.fins[0].mounting_angle == pytest.approx(0.794125, abs=1e-6))
    page.until(lambda: box.input_value() == "45.5")
    wanted = ("-0.125", "0.05", "-0.02")
    begin(page, "Position [m]", 0)
    for text in wanted:
        page.page.keyboard.insert_text(text)
        page.page.keyboard.press("Tab")
    page.until(lambda: page.session.state.layout.fins[0].position == (-0.125, 0.05, -0.02))
    for place, text in enumerate(wanted):
        page.until(lambda place=place, text=text: page.row("Position [m]").nth(place).input_value() == text)


def test_a_pause_commits_a_whole_number_and_leaves_the_field_alone(page: Any, steps: list[Any]) -> None:
    box = begin(page, "Fx [N]")
    page.page.keyboard.insert_text("-")
    page.rest(1300)
    assert steps == [] and box.input_value() == "-"
    page.page.keyboard.insert_text("1.")
    page.rest(1300)
    assert steps == [] and box.input_value() == "-1."
    page.page.keyboard.insert_text("0")
    page.until(lambda: page.session.state.target[0] == -1.0 and not page.view.busy)
    page.catch_up()
    assert box.input_value() == "-1.0", "the number is taken, the text is still the user's"
    page.page.keyboard.insert_text("7")
    page.page.mouse.click(30, 500)  # beside the robot
    page.until(lambda: steps == [("set_target", -1.0), ("set_target", -1.07)])
    page.until(lambda: box.input_value() == "-1.07")
    box = begin(page, "Fx [N]")
    page.page.keyboard.insert_text("3")
    page.until(lambda: page.session.state.target[0] == 3.0)
    page.page.keyboard.press("Escape")
    page.until(lambda: page.session.state.target[0] == -1.07 and box.input_value() == "-1.07")


def test_nothing_is_written_into_a_box_that_has_the_focus(page: Any) -> None:
    box = begin(page, "Fx [N]")
    loop = page._served.server.get_event_loop()

    def ask_for(preset: str, target: float) -> None:
        loop.call_soon_threadsafe(page.view.do, lambda: page.session.set_preset(preset))
        page.until(lambda: page.session.state.target[0] == target and not page.view.busy)
        page.catch_up()

    ask_for("Cruise", 2.0)
    assert box.input_value() == "1.2", "not even before the first key"
    page.page.keyboard.insert_text("-")
    ask_for("Dive", 0.8)
    page.page.keyboard.insert_text("0.25")
    page.page.keyboard.press("Enter")
    page.until(lambda: page.session.state.target == (-0.25, 0.0, -1.5, 0.0, 0.0, 0.0))
    ask_for("Cruise", 2.0)
    assert box.input_value() == "-0.25"
    page.page.keyboard.press("Tab")
    page.until(lambda: box.input_value() == "2")


def test_a_slow_framework_leaves_the_selection_alone(page: Any) -> None:
    page.key("n")
    page.tab("Design")
    page.until(lambda: page.row("Shaft [°]").last.input_value() == "-60")
    page.page.evaluate("""() => {
      const soon = window.soon = window.setTimeout;
      window.setTimeout = (act, time, ...more) => soon(act, (time || 0) + 300, ...more);
    }""")
    page.row("Shaft [°]").last.click(position={"x": 2, "y": 10})  # before the sign, where no caret may stay
    page.page.keyboard.press("Control+a")
    page.page.evaluate("() => new Promise(done => window.soon(done, 600))")
    page.page.evaluate("window.setTimeout = window.soon")
    page.page.keyboard.insert_text("33.25")
    page.page.keyboard.press("Enter")
    page.shows_last("Shaft [°]", "33.25")


def test_escape_and_an_emptied_box_bring_back_what_is_in_force(page: Any) -> None:
    box = commit(page, "Fx [N]", "70", end="Escape")
    page.until(lambda: box.input_value() == "1.2")
    for key in ("Enter", "Tab"):
        begin(page, "Fx [N]")
        page.page.keyboard.press("Delete")
        assert box.input_value() == ""
        page.page.keyboard.press(key)
        page.until(lambda: box.input_value() == "1.2")
    page.catch_up()
    assert page.session.state.target[0] == 1.2


def test_what_is_refused_or_changed_is_told_in_place(page: Any, steps: list[Any]) -> None:
    page.key("n")
    page.tab("Design")
    note = page.page.locator(".fl.note:visible")
    box = commit(page, "Position [m]", "12 kg", 0, end="Tab")
    page.until(lambda: note.all_inner_texts() == ["'12 kg' is not in m; type for example 12 cm"])
    assert box.input_value() == "12 kg" and box.get_attribute("aria-invalid") == "true"
    commit(page, "Position [m]", "-10.5", 1)
    page.until(lambda: "-10.5" in note.inner_text() and "12 kg" in note.inner_text())
    assert page.notes() == [] and all(position[0] == 0.25753 for _, position in steps), "no toast"
    commit(page, "Position [m]", "12 cm", 0)
    page.until(lambda: page.session.state.layout.fins[0].position[0] == 0.12)
    page.until(lambda: "12 kg" not in note.inner_text() and box.get_attribute("aria-invalid") is None)
    page.key("n")  # another fin: nothing of this is about it
    page.until(lambda: note.count() == 0)
    commit(page, "Shaft [°]", "270 deg")
    page.until(lambda: note.all_inner_texts() == ["270 became −90"])


def test_fields_of_every_task(page: Any, steps: list[Any]) -> None:
    session = page.session

    def take(label: str, text: str, place: int, value: Callable[[], float], wanted: float) -> None:
        commit(page, label, text, place)
        page.until(lambda: value() == pytest.approx(wanted, rel=1e-9))
        assert page.notes() == []

    page.key("n")
    take("Ty [N m]", "3 N cm", -1, lambda: session.state.target[4], 0.03)
    page.tab("Design")
    take("Shaft [°]", "33.25", -1, lambda: math.degrees(session.state.layout.fins[0].mounting_angle), 33.25)
    page.key("Escape")  # the hull is the robot's: nothing else is selected
    page.unfold("Hull", "Size [m]")
    take("Size [m]", "52 cm", 0, lambda: session.state.layout.body.hull.size_m[0], 0.52)
    page.tab("Improve")
    take("Turn ± [°]", "pi/4 rad", -1, lambda: session.draft.way("all")[3], 45.0)
    page.tab("Simulate")
    take("Current [cm/s]", "0.07 m/s", -1, lambda: session.swim.current_cm_s, 7.0)


def test_arrow_keys_and_buttons_go_on_from_what_was_typed(page: Any) -> None:
    box = begin(page, "Fx [N]")
    page.page.keyboard.insert_text("3")
    page.page.keyboard.press("ArrowUp")
    page.until(lambda: page.session.state.target[0] == pytest.approx(3.01) and box.input_value() == "3.01")
    for _ in range(5):
        page.page.keyboard.press("ArrowDown")
    page.until(lambda: page.session.state.target[0] == pytest.approx(2.96) and box.input_value() == "2.96")
    begin(page, "Fy [N]")
    page.page.keyboard.insert_text("0.25")
    page.page.get_by_role("button", name="Undo").click()
    page.until(lambda: page.session.history.redo_name == "Set Fy" and page.session.state.target[1] == 0.0)
    page.page.get_by_role("button", name="Redo").click()
    page.until(lambda: page.session.state.target[1] == 0.25)
