"""Numbers typed with real keys, slowly and fast: what is typed is taken, once, and never half of it."""

from collections.abc import Callable, Iterator
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

    names = ("set_target", "move_fin", "turn_fin")
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
        page.tab("Layout")
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
        page.tab("Layout")
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


def test_the_server_does_not_write_into_a_field_that_is_typed_in(page: Any) -> None:
    box = begin(page, "Fx [N]")
    page.page.keyboard.type("-", delay=50)
    loop = page._served.server.get_event_loop()
    loop.call_soon_threadsafe(page.view.do, lambda: page.session.set_preset("Dive"))
    page.until(lambda: page.session.state.target[0] == 0.8 and not page.view.busy)
    page.catch_up()
    page.page.keyboard.type("0.25", delay=50)
    assert box.input_value() == "-0.25"
    page.page.keyboard.press("Enter")
    page.until(lambda: page.session.state.target == (-0.25, 0.0, -1.5, 0.0, 0.0, 0.0))
    loop.call_soon_threadsafe(page.view.do, lambda: page.session.set_preset("Cruise"))
    page.until(lambda: box.input_value() == "2")  # no longer in the user's hands, though still in focus


def test_escape_and_nonsense_go_back(page: Any, steps: list[Any]) -> None:
    def typed() -> Any:
        box = begin(page, "Fx [N]")
        page.page.keyboard.type("7x", delay=30)
        assert box.input_value() == "7"
        page.page.keyboard.press("Escape")
        return box

    box = without_a_pause(page, steps, typed)
    page.until(lambda: box.input_value() == "1.2")
    page.page.keyboard.press("Control+a")
    page.page.keyboard.type("-.", delay=30)
    page.page.keyboard.press("Tab")
    page.until(lambda: box.input_value() == "1.2")
    assert steps == []


def test_beyond_the_slider_and_a_comma(page: Any, steps: list[Any]) -> None:
    def typed() -> None:
        begin(page, "Fz [N]")
        page.page.keyboard.type("30,5", delay=10)

    without_a_pause(page, steps, typed)
    page.page.keyboard.press("Tab")
    page.until(lambda: page.session.state.target[2] == 30.5)
    page.rest(400)
    assert steps == [("set_target", 30.5)]


def test_an_arrow_key_steps_from_what_was_typed(page: Any) -> None:
    begin(page, "Fx [N]")
    page.page.keyboard.type("3", delay=10)
    page.page.keyboard.press("ArrowUp")
    page.until(lambda: page.session.state.target[0] == pytest.approx(3.01))
