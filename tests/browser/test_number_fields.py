"""Numbers typed with real keys, slowly and fast: what is typed is taken, once, and never half of it."""

import math
from collections.abc import Callable, Iterator
from itertools import cycle
from typing import Any

import pytest

PAUSE_MS = 1000
"""A number that stands so long in a field is meant, even without Enter; as in `number_fields.js`."""
WATCH = """() => {
  const note = (event) => (event.key ?? 'Escape') === 'Escape' && window.finlabKeys.push(performance.now());
  const known = window.finlabKeys;
  window.finlabKeys = [];
  if (!known) for (const kind of ['beforeinput', 'keyup']) window.addEventListener(kind, note, true);
}"""
LONGEST = "() => Math.max(0, ...window.finlabKeys.map((at, k) => at - (window.finlabKeys[k - 1] ?? at)))"

PACE = pytest.mark.parametrize("delay", [10, 150], ids=["fast", "slow"])
"""Time between two keys [ms]."""


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


def without_a_pause(page: Any, steps: list[Any], act: Callable[[], Any]) -> Any:
    """Type as `act` does; again, from first sight, where a busy machine made a pause between two keys."""
    for _ in range(5):
        page.page.evaluate(WATCH)
        result = act()
        if page.page.evaluate(LONGEST) < 0.9 * PAUSE_MS:
            return result
        page.rest(2 * PAUSE_MS)
        page.start_over()
        steps.clear()
    return pytest.fail("this machine is too busy to type on")


@PACE
def test_a_negative_target(page: Any, steps: list[Any], delay: int) -> None:
    def typed() -> Any:
        page.press("Cruise")
        page.until(lambda: page.session.state.target[0] == 2.0 and not page.view.busy)
        box = begin(page, "Fx [N]")
        page.page.keyboard.type("-0.5", delay=delay)
        assert box.input_value() == "-0.5"
        return box

    box = without_a_pause(page, steps, typed)
    page.page.keyboard.press("Enter")
    page.until(lambda: page.session.state.target[0] == -0.5 and box.input_value() == "-0.5")
    page.rest(400)
    assert steps == [("set_target", -0.5)] and box.input_value() == "-0.5"


@PACE
def test_half_a_degree(page: Any, steps: list[Any], delay: int) -> None:
    def typed() -> Any:
        page.key("n")
        page.tab("Design")
        box = begin(page, "Shaft [°]")
        page.page.keyboard.type("45.5", delay=delay)
        return box

    box = without_a_pause(page, steps, typed)
    page.page.keyboard.press("Tab")
    page.until(lambda: page.session.state.layout.fins[0].mounting_angle == pytest.approx(0.794125, abs=1e-6))
    page.until(lambda: box.input_value() == "45.5")
    page.rest(400)
    assert len(steps) == 1 and box.input_value() == "45.5"


@PACE
def test_three_coordinates_one_after_the_other(page: Any, steps: list[Any], delay: int) -> None:
    _, y, z = page.session.state.layout.fins[0].position

    def typed() -> None:
        page.key("n")
        page.tab("Design")
        begin(page, "Position [m]", 0)
        for text, key in (("-0.125", "Tab"), ("0.05", "Tab"), ("-.02", "Enter")):
            page.page.keyboard.type(text, delay=delay)
            page.page.keyboard.press(key)

    without_a_pause(page, steps, typed)
    page.until(lambda: page.session.state.layout.fins[0].position == (-0.125, 0.05, -0.02))
    page.rest(400)
    # A busy page may send two quick coordinates as one change; half a number is in none.
    whole = [(-0.125, y, z), (-0.125, 0.05, z), (-0.125, 0.05, -0.02)]
    taken = [whole.index(position) for _, position in steps]
    assert taken == sorted(set(taken)) and taken[-1] == 2
    wanted = ["-0.125", "0.05", "-0.02"]
    page.until(lambda: [page.row("Position [m]").nth(k).input_value() for k in range(3)] == wanted)


def test_a_pause_commits_a_whole_number_and_leaves_the_field_alone(page: Any, steps: list[Any]) -> None:
    box = begin(page, "Fx [N]")
    page.page.keyboard.type("-", delay=50)
    page.rest(1300)
    assert steps == [] and box.input_value() == "-"
    page.page.keyboard.insert_text("1.")  # at once, since a pause between the two keys would mean -1
    page.rest(1300)
    assert steps == [] and box.input_value() == "-1."
    page.page.keyboard.type("0", delay=50)
    page.until(lambda: page.session.state.target[0] == -1.0 and not page.view.busy)
    page.catch_up()
    assert box.input_value() == "-1.0", "the number is taken, the text is still the user's"
    page.page.keyboard.type("7", delay=50)
    page.page.mouse.click(30, 500)  # beside the robot
    page.until(lambda: steps == [("set_target", -1.0), ("set_target", -1.07)])
    page.until(lambda: box.input_value() == "-1.07")


def test_nothing_is_written_into_a_box_that_has_the_focus(page: Any) -> None:
    box = begin(page, "Fx [N]")
    loop = page._served.server.get_event_loop()

    def ask_for(preset: str, target: float) -> None:
        loop.call_soon_threadsafe(page.view.do, lambda: page.session.set_preset(preset))
        page.until(lambda: page.session.state.target[0] == target and not page.view.busy)
        page.catch_up()

    ask_for("Cruise", 2.0)
    assert box.input_value() == "1.2", "not even before the first key"
    page.page.keyboard.type("-", delay=50)
    ask_for("Dive", 0.8)
    page.page.keyboard.type("0.25", delay=50)
    assert box.input_value() == "-0.25"
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
    page.page.keyboard.type("33.25", delay=10)
    page.page.keyboard.press("Enter")
    page.shows("Shaft [°]", "33.25")


def test_escape_and_an_emptied_box_bring_back_what_is_in_force(page: Any, steps: list[Any]) -> None:
    def typed() -> Any:
        box = begin(page, "Fx [N]")
        page.page.keyboard.type("7", delay=30)
        page.page.keyboard.press("Escape")
        return box

    box = without_a_pause(page, steps, typed)
    page.until(lambda: box.input_value() == "1.2")
    for key in ("Enter", "Tab"):
        begin(page, "Fx [N]")
        page.page.keyboard.press("Delete")
        assert box.input_value() == ""
        page.page.keyboard.press(key)
        page.until(lambda: box.input_value() == "1.2")
    page.rest(400)
    assert steps == []


def test_escape_takes_back_what_a_rest_brought_into_force(page: Any) -> None:
    box = begin(page, "Fx [N]")
    page.page.keyboard.type("3", delay=50)
    page.until(lambda: page.session.state.target[0] == 3.0)
    page.page.keyboard.type("1", delay=50)
    page.until(lambda: page.session.state.target[0] == 31.0)
    page.page.keyboard.press("Escape")
    page.until(lambda: page.session.state.target[0] == 1.2 and box.input_value() == "1.2")


@PACE
@pytest.mark.parametrize(("text", "value"), [("30,5", 30.5), ("1/3", 1 / 3), ("1e-2", 0.01), ("300 mN", 0.3)])
def test_units_and_arithmetic(page: Any, steps: list[Any], text: str, value: float, delay: int) -> None:
    def typed() -> None:
        begin(page, "Fz [N]")
        page.page.keyboard.type(text, delay=delay)

    without_a_pause(page, steps, typed)
    page.page.keyboard.press("Tab")
    page.until(lambda: page.session.state.target[2] == pytest.approx(value, rel=1e-12))
    page.until(lambda: page.row("Fz [N]").last.input_value() == f"{value:.4f}".rstrip("0"))
    page.rest(400)
    assert len(steps) == 1


def test_what_is_refused_is_told_in_place(page: Any, steps: list[Any]) -> None:
    page.key("n")
    page.tab("Design")
    note = page.page.locator(".fl.note:visible")

    def typed() -> Any:
        box = begin(page, "Position [m]", 0)
        page.page.keyboard.type("12 kg", delay=20)
        page.page.keyboard.press("Tab")
        return box

    box = without_a_pause(page, steps, typed)
    page.until(lambda: note.all_inner_texts() == ["'12 kg' is not in m; type for example 12 cm"])
    assert box.input_value() == "12 kg" and box.get_attribute("aria-invalid") == "true"
    begin(page, "Position [m]", 1)
    page.page.keyboard.type("-10.5", delay=20)
    page.page.keyboard.press("Enter")
    page.until(lambda: "-10.5" in note.inner_text() and "12 kg" in note.inner_text())
    assert page.notes() == [] and all(position[0] == 0.25753 for _, position in steps), "no toast"
    begin(page, "Position [m]", 0)
    page.page.keyboard.type("12 cm", delay=20)
    page.page.keyboard.press("Enter")
    page.until(lambda: page.session.state.layout.fins[0].position[0] == 0.12)
    page.until(lambda: "12 kg" not in note.inner_text() and box.get_attribute("aria-invalid") is None)
    page.key("n")  # another fin: nothing of this is about it
    page.until(lambda: note.count() == 0)
    page.until(lambda: page.row("Position [m]").nth(1).input_value() == "0.1502")


def test_what_became_of_a_number_is_told(page: Any) -> None:
    page.key("n")
    page.tab("Design")
    note = page.page.locator(".fl.note:visible")
    begin(page, "Shaft [°]")
    page.page.keyboard.type("270 deg", delay=20)
    page.page.keyboard.press("Enter")
    page.until(lambda: note.all_inner_texts() == ["270 became −90"])
    assert page.row("Shaft [°]").last.input_value() == "-90"
    page.choose("Snap place", "5 mm")
    begin(page, "Position [m]", 2)
    page.page.keyboard.type("33 mm", delay=20)
    page.page.keyboard.press("Enter")
    page.until(lambda: "0.033 became 0.035" in note.all_inner_texts())


def test_every_field_of_every_tab(page: Any, steps: list[Any]) -> None:
    session, delays = page.session, cycle((10, 150))

    def commit(label: str, text: str, place: int, value: Callable[[], float], wanted: float) -> None:
        begin(page, label, place)
        page.page.keyboard.type(text, delay=next(delays))
        page.page.keyboard.press("Enter")
        page.until(lambda: value() == pytest.approx(wanted, rel=1e-9))
        assert page.notes() == []

    page.key("n")
    commit("Ty [N m]", "3 N cm", -1, lambda: session.state.target[4], 0.03)
    page.unfold("Damage a fin", "Strength [%]")
    commit("Strength [%]", "62.5", -1, lambda: sum(share for _, share in session.state.weak), 0.625)
    page.tab("Damage a fin")
    page.tab("Design")
    commit("Shaft [°]", "33.25", -1, lambda: math.degrees(session.state.layout.fins[0].mounting_angle), 33.25)
    commit("Position [m]", ".03", 0, lambda: session.state.layout.fins[0].position[0], 0.03)
    page.key("Escape")  # the hull is the robot's: nothing else is selected
    page.unfold("Hull", "Size [m]")
    commit("Size [m]", "52 cm", 0, lambda: session.state.layout.body.hull.size_m[0], 0.52)
    commit("Centre of gravity [m]", "-5 mm", 2, lambda: -session.state.layout.body.hull.center_m[2], -0.005)
    page.tab("Hull")
    page.tab("Improve")
    commit("Reach ± [m]", "2 cm", 1, lambda: session.draft.way("all")[1], 0.02)
    commit("Turn ± [°]", "pi/4 rad", -1, lambda: session.draft.way("all")[3], 45.0)
    page.tab("Candidates")
    page.choose("Method", "mdn")
    commit("Candidates K", "32", -1, lambda: session.state.n_candidates, 32)
    commit("Temperature T", ".125", -1, lambda: session.state.temperature, 0.125)
    page.tab("Simulate")
    commit("Current [cm/s]", "0.07 m/s", -1, lambda: session.swim.current_cm_s, 7.0)
    page.unfold("More", "Battery [Wh]")
    commit("Battery [Wh]", "0.05 kWh", -1, lambda: session.swim.pack_wh, 50.0)
    page.tab("More")
    page.unfold("Display", "Motion speed")
    commit("Motion speed", "1/8", -1, lambda: session.display.speed, 0.125)


def test_an_arrow_key_steps_from_what_was_typed(page: Any) -> None:
    box = begin(page, "Fx [N]")
    page.page.keyboard.type("3", delay=10)
    page.page.keyboard.press("ArrowUp")
    page.until(lambda: page.session.state.target[0] == pytest.approx(3.01) and box.input_value() == "3.01")
    for _ in range(5):
        page.page.keyboard.press("ArrowDown")
    page.until(lambda: page.session.state.target[0] == pytest.approx(2.96) and box.input_value() == "2.96")


def test_a_button_at_once_after_a_number_loses_neither(page: Any) -> None:
    begin(page, "Fy [N]")
    page.page.keyboard.type("0.25", delay=10)
    page.page.get_by_role("button", name="Undo").click()
    page.until(lambda: page.session.history.redo_name == "Set Fy" and page.session.state.target[1] == 0.0)
    page.page.get_by_role("button", name="Redo").click()
    page.until(lambda: page.session.state.target[1] == 0.25)
