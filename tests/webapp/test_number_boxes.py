"""What is typed into number boxes: numbers as people write them; all else is refused in a sentence."""

from collections.abc import Iterator
from typing import Any

import pytest

from finlab.errors import FinlabError
from finlab.layout import load_layout
from tests.webapp.test_faults import Tab
from tests.webapp.test_faults_in_handlers import handles
from webapp.number_boxes import number_of
from webapp.tasks.slot import Pools


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    """A page of U-CAT."""
    pools = Pools()
    tab = Tab(pools, load_layout("ucat"))
    yield tab
    tab.close()
    pools.stop()


@pytest.fixture
def opened(tab: Tab) -> Tab:
    """The page, as at first sight and without notes."""
    tab.on_loop(lambda: tab.view.do(tab.view.session.start_over))
    tab.settle()
    tab.client.notes.clear()
    return tab


def box(tab: Tab, label: str) -> Any:
    """The first input of a label."""
    return next(each for each in handles(tab.server) if getattr(each, "label", "") == label)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0,5", 0.5),
        ("1.5", 1.5),
        ("1e3", 1000.0),
        ("1E-1", 0.1),
        (" \u22122 ", -2.0),
        (",5", 0.5),
        ("+3.", 3.0),
        ("1 000", 1000.0),
    ],
)
def test_numbers_as_people_write_them(text: str, value: float) -> None:
    assert number_of(text, "Fx [N]") == value


@pytest.mark.parametrize("text", ["1/3", "abc", "1.234,5", "nan", "inf", "0x10", "1_0", "e3", "."])
def test_what_is_no_number_is_said(text: str) -> None:
    with pytest.raises(FinlabError, match=r"^Fx \[N\]: .* is no number"):
        number_of(text, "Fx [N]")


def test_an_empty_box_is_said() -> None:
    with pytest.raises(FinlabError, match="left empty"):
        number_of("  ", "Fx [N]")


def test_a_wrench_beyond_its_slider_is_asked_with_all_its_digits(opened: Tab) -> None:
    slider = box(opened, "Fx [N]")
    opened.type(slider, "100,123456")
    assert opened.view.session.state.target[0] == 100.123456
    assert slider.value == 100.1235 and slider.max >= slider.value
    opened.type(slider, "0,5", steps=1)
    assert opened.view.session.state.target[0] == pytest.approx(0.5 + slider.step)
    assert opened.client.notes == []


def test_what_is_refused_changes_nothing_and_is_said(opened: Tab) -> None:
    session = opened.view.session
    opened.on_loop(lambda: opened.view.do(lambda: session.select("front_left")))
    opened.settle()
    for label, text, words in (
        ("Fx [N]", "abc", "'abc' is no number"),
        ("Fx [N]", "1e13", "expected a number from -1e+12 to 1e+12"),
        ("Strength [%]", "0,5", "expected a number from 5 to 100, got 0.5"),
        ("Step", "0,5", "expected a whole number"),
        ("Step", "100", "expected a number from 0 to"),
        ("Position [m]", "abc", "Position [m], 1 of 3: 'abc' is no number"),
        ("Shaft [°]", "", "left empty"),
    ):
        before = session.state, session.step
        opened.type(box(opened, label), text)
        assert (session.state, session.step) == before
        assert words in opened.client.notes[-1]


def test_one_number_of_several_is_typed(opened: Tab) -> None:
    session = opened.view.session
    opened.on_loop(lambda: opened.view.do(lambda: session.select("front_left")))
    opened.settle()
    x, _, z = session.state.layout.actuator("front_left").position
    opened.type(box(opened, "Position [m]"), "0,2", place=1)
    assert session.state.layout.actuator("front_left").position == (x, 0.2, z)


@pytest.mark.parametrize("key", ["", "nobody 0 0", "{uuid} x 0", "{uuid} 0 7", "{uuid}"])
def test_words_that_are_not_of_our_page_do_nothing(opened: Tab, key: str) -> None:
    before = opened.view.session.state
    uuid = box(opened, "Fx [N]")._impl.uuid
    opened.on_loop(lambda: opened.view.page.number_boxes._take(key.format(uuid=uuid), "3"))
    opened.settle()
    assert opened.view.session.state is before and opened.client.notes == []


def jump(tab: Tab, handle: Any, key: str, place: int = 0) -> None:
    """Press a key in a number box, and wait for what comes of it."""
    word = f"{handle._impl.uuid} {place}"
    tab.on_loop(lambda: tab.view.page.number_boxes._jump(word, key))
    tab.settle()


def test_page_keys_go_ten_steps_and_end_goes_to_the_end(opened: Tab) -> None:
    session = opened.view.session
    slider = box(opened, "Fx [N]")
    start = session.state.target[0]
    jump(opened, slider, "PageUp")
    assert session.state.target[0] == pytest.approx(start + 10.0 * slider.step)
    jump(opened, slider, "PageDown")
    assert session.state.target[0] == pytest.approx(start)
    jump(opened, slider, "End")
    assert session.state.target[0] == slider.max == slider.value
    jump(opened, slider, "PageUp")
    assert session.state.target[0] == slider.max, "a key does not leave the track"
    jump(opened, slider, "Home")
    assert session.state.target[0] == slider.min
    assert opened.client.notes == []


def test_page_keys_that_repeat_are_all_heard(opened: Tab) -> None:
    slider = box(opened, "Fx [N]")
    start = opened.view.session.state.target[0]
    word = f"{slider._impl.uuid} 0"

    def hold() -> None:  # before the page is written once
        for _ in range(3):
            opened.view.page.number_boxes._jump(word, "PageUp")

    opened.on_loop(hold)
    opened.settle()
    assert opened.view.session.state.target[0] == pytest.approx(start + 30.0 * slider.step)


def test_page_keys_move_one_number_of_several(opened: Tab) -> None:
    session = opened.view.session
    opened.on_loop(lambda: opened.view.do(lambda: session.select("front_left")))
    opened.on_loop(lambda: opened.view.do(lambda: session.show_task("Design")))
    opened.settle()
    handle = box(opened, "Position [m]")
    x, y, z = session.state.layout.actuator("front_left").position
    jump(opened, handle, "PageUp", place=2)
    moved = session.state.layout.actuator("front_left").position
    assert moved == pytest.approx((x, y, z + 10.0 * handle.step))


@pytest.mark.parametrize("word", [("", "PageUp"), ("{uuid} 0", "Insert"), ("{uuid} x", "End")])
def test_keys_that_are_not_of_our_page_do_nothing(opened: Tab, word: tuple[str, str]) -> None:
    before = opened.view.session.state
    place, key = word
    uuid = box(opened, "Fx [N]")._impl.uuid
    opened.on_loop(lambda: opened.view.page.number_boxes._jump(place.format(uuid=uuid), key))
    opened.settle()
    assert opened.view.session.state is before and opened.client.notes == []
