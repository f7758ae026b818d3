"""What the app says about an answer, and what it writes into files."""

import ast
import re
from dataclasses import replace
from html import unescape
from itertools import chain
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.allocation import Allocation, Allocator
from finlab.allocation.binding import NOT_APART
from finlab.allocation.report import bound_words, missing_words
from finlab.analysis import score_card
from finlab.analysis.card_text import AXIS_COLUMNS, axis_rows, held_remarks
from finlab.analysis.score_card import quick_check
from finlab.assets import shipped_layouts
from finlab.axes import AXES, MOTIONS
from finlab.display import NO_NUMBER
from finlab.errors import LayoutError
from finlab.layout import FinModelSpec, Uncertainty, load_layout
from finlab.research.networks.learned_method import LearnedMethod
from finlab.swim.vehicle.fossen import GRAVITY
from tests.webapp.stand_in import StandIn
from webapp.markup.score_card import check_card, score_table, warnings
from webapp.markup.verdict import (
    COLORS,
    WORKING,
    Verdict,
    answer_sentence,
    verdict_of,
    verdict_sentence,
)
from webapp.markup.words import SPEED, authority_sentence, in_app, trim_sentence
from webapp.panels.actuator_model import LAWS, law_words
from webapp.panels.modes_tab import comparison_table
from webapp.panels.status import corner
from webapp.scene.wrench_nodes import ARROWS, LENGTH, NEWTONS, fitting
from webapp.session import Session, files
from webapp.session.layout_edits import blank
from webapp.session.lessons import TOUR
from webapp.session.state import State
from webapp.session.targets import PRESETS, axis_reach, full_thrust
from webapp.tasks.analysing import AnalysisQuestion, analyse
from webapp.tasks.comparing import Run
from webapp.tasks.solver import Solver
from webapp.theme import DELIVERED, UNLEARNED, css


def delivering(answer: Allocation, wrench: Any) -> Allocation:
    """The same answer with another delivered wrench."""
    other = replace(answer)
    vars(other)["wrench"] = wrench
    return other


def test_reachable_and_not() -> None:
    layout = load_layout("ucat")
    allocator = Allocator(layout, StandIn)
    easy = allocator.allocate(PRESETS["Turn"])
    assert easy.reachable and verdict_sentence(easy, True) == "Exact"
    assert missing_words(easy) == "nothing is left undone"
    hard = allocator.allocate([0, 0, 60, 0, 0, 0])
    assert not hard.reachable
    assert verdict_sentence(hard, False) == "Out of reach, closest"
    state = State(layout, target=(0.0, 0.0, 60.0, 0.0, 0.0, 0.0), method="sqp")
    assert not Solver().reply(state).in_reach
    assert "N of heave is left undone" in missing_words(hard)
    told = {"reachable": False, "scale": np.ones(6), "target": np.array([0.0, 0.0, 5.0, 0, 0, 0])}
    beside: Any = SimpleNamespace(unallocated=np.array([0.0, -2.0, 1.0, 0, 0, 0]), **told)
    assert (
        missing_words(beside)
        == "1.00 N of heave is left undone; 2.00 N of sway comes along unasked"
    )
    beside.unallocated = np.array([0.0, -2.0, -1.0, 0, 0, 0])  # more heave than asked
    assert missing_words(beside) == "2.00 N of sway and 1.00 N of heave come along unasked"


@pytest.mark.parametrize("share", [0.0, 0.5, 0.93, 0.985, 0.999, 1.0, 1.02, 1.5])
@pytest.mark.parametrize("target", [PRESETS["Turn"], (0.0, 0.0, 2.0, 0.0, 0.0, 0.1), (0.0,) * 6])
def test_all_that_is_said_of_an_answer_agrees(share: float, target: tuple[float, ...]) -> None:
    layout = load_layout("ucat")
    exact = Allocator(layout, StandIn).allocate(target)
    wrench = np.array(target)
    wrench[5] *= share
    wrench[4] += 1e-2 * (share < 1.0)
    error = float(np.linalg.norm((wrench - target) / exact.scale))
    answer = delivering(exact, wrench)
    state = State(layout, target=tuple(target))  # type: ignore[arg-type]
    said = str(answer_sentence(state, answer, False))
    verdict = verdict_sentence(answer, True)
    assert ("Nothing is left undone" in said) == (verdict == "Exact") == (error <= 1e-3)
    assert "100 %" not in said + verdict
    if verdict != "Exact":
        axis = int(np.argmax(np.abs((wrench - target) / answer.scale)))
        assert MOTIONS[axis] in said


def test_an_axis_that_nothing_gives_is_spoken_of_once() -> None:
    layout = blank("thruster")  # one, which points ahead
    target = (0.0, 2.0, 0.0, 0.0, 0.0, 0.0)
    answer = Allocator(layout).allocate(target)
    assert any(words.endswith(NOT_APART) for words in answer.binding)
    said = str(answer_sentence(State(layout, target=target), answer, False, searching=True))
    assert (
        "This robot cannot sway, heave, roll and pitch." in said
        and "of sway is left undone" in said
    )
    assert "apart" not in said


def test_no_verdict_stands_beside_a_new_question() -> None:
    layout = load_layout("ucat")
    answer = Allocator(layout, StandIn).allocate(PRESETS["Turn"])
    state = State(layout, target=(0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    shown = corner(state, "", answer, True, None, in_reach=True) + answer_sentence(
        state, answer, True
    )
    assert shown.count(WORKING) == 2 and "Exact" not in shown and "undone" not in shown
    assert css(DELIVERED) not in shown


def test_how_far_the_watts_may_be_from_the_least_is_told() -> None:
    layout = load_layout("ucat")
    answer = Allocator(layout).allocate(PRESETS["Turn"])
    state = State(layout, target=PRESETS["Turn"])
    assert "proved least" in answer_sentence(state, answer, False)
    dearer = replace(answer)
    vars(dearer)["bound"] = answer.power / 1.25
    assert "at most 25 % above the least" in answer_sentence(state, dearer, False)
    assert bound_words(Allocator(layout, StandIn).allocate(PRESETS["Turn"])) == ""


def test_what_is_exact_by_an_uncertain_model_says_so() -> None:
    layout = load_layout("ucat").replace_actuator("front_left", uncertainty=Uncertainty(0.2))
    answer = Allocator(layout).allocate(PRESETS["Turn"])
    error = f"{answer.expected_error:.2g}"
    assert verdict_sentence(answer, True) == f"Exact by the model, expected within {error}"
    said = answer_sentence(State(layout, target=PRESETS["Turn"]), answer, False)
    assert f"The true wrench is expected to be off by {error}; measure front_left next" in said


def test_fins_that_were_not_learned_are_told_in_words_of_their_own() -> None:
    layout = load_layout("ucat")
    own = {
        "fin_model": layout.fins[0].model,
        "read_networks": classmethod(lambda cls, checkpoint: None),
    }
    learned = type("Learned", (StandIn, LearnedMethod), own)
    other = replace(layout.fins[2], model=FinModelSpec("lighthill"))
    strange = replace(layout, actuators=(*layout.fins[:2], other, layout.fins[3]))
    allocator = Allocator(strange, learned)
    for wrench in (PRESETS["Turn"], [0, 0, 60, 0, 0, 0]):  # even where the numbers happen to fit
        answer = allocator.allocate(wrench)
        assert verdict_sentence(answer, True) == "Not learned: fin 3. Choose another method"
        shown = corner(State(strange), "", answer, False, None)
        assert css(UNLEARNED) in shown and css(DELIVERED) not in shown and "reach" not in shown
        run = Run(State(strange), (("mdn", answer),))
        assert "Not learned: fin 3" in comparison_table(run, False)
    without = allocator.allocate(PRESETS["Turn"], lost=[other.name])
    assert verdict_of(without, True) is Verdict.EXACT


def test_what_a_method_cannot_is_not_what_the_fins_cannot() -> None:
    """A method that shares out a linear model misses what the others give exactly."""
    layout = load_layout("mixed")
    answer = Allocator(layout, "qp").allocate(PRESETS["Zero"])
    assert not answer.reachable
    state = State(layout, target=PRESETS["Zero"], method="qp")
    assert Solver().reply(state).in_reach
    assert verdict_of(answer, True) is Verdict.APPROXIMATE
    assert verdict_sentence(answer, True) == "Approximate: the robot can, qp does not"
    assert len(set(COLORS.values())) == len({verdict.value for verdict in Verdict}) == 4


def test_robot_without_yaw_says_so() -> None:
    layout = load_layout(shipped_layouts()["no_yaw"])
    sentence = authority_sentence(layout, (), axis_reach(layout))
    assert sentence is not None and "cannot" in sentence and "yaw" in sentence
    ucat = load_layout("ucat")
    assert authority_sentence(ucat, (), axis_reach(ucat)) is None


def test_reach_is_a_bound_that_is_met_on_heave() -> None:
    layout = load_layout("ucat")
    assert axis_reach(layout)[2] == pytest.approx(full_thrust(layout).sum())
    assert axis_reach(layout, ("front_left",))[2] == pytest.approx(full_thrust(layout)[1:].sum())


def test_arrow_scale_fits_and_rests() -> None:
    def newtons_for(largest: float, current: float) -> float:
        return fitting(NEWTONS, largest, current, LENGTH, ARROWS)

    for largest in (0.01, 0.3, 1.2, 9.0, 60.0):
        newtons = newtons_for(largest, 1.0)
        assert LENGTH * largest / newtons <= ARROWS[1]
    assert newtons_for(1.3, newtons_for(1.2, 1.0)) == newtons_for(1.2, 1.0)


def test_layout_files_go_out_and_come_back() -> None:
    layout = load_layout("ucat")
    assert files.read_layout("x.yaml", files.layout_file(layout)[1]).layout == layout


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("big.yaml", b"a" * 2_000_000, "larger"),
        ("bin.yaml", bytes(range(256)), "UTF-8"),
        ("nul.yaml", b"format: \x00", "binary"),
        ("bad.json", b"{", "bad.json"),
        ("../../x.yaml", b"format: other", "x.yaml"),
        ("empty.yaml", b"", "empty.yaml"),
    ],
)
def test_bad_uploads_are_refused_by_name(name: str, content: bytes, said: str) -> None:
    with pytest.raises(LayoutError, match=said):
        files.read_layout(name, content)


def test_fins_in_the_way_are_told() -> None:
    layout = load_layout("ucat")
    assert warnings(layout) == ()
    crowded = layout.replace_actuator("front_left", position=layout.fins[0].position)
    assert "may touch" in warnings(crowded)[0]
    inside = layout.replace_actuator("front_left", position=(0.0, 0.0, 0.0))
    assert any("inside the hull" in text for text in warnings(inside))


def test_cards_say_what_a_layout_can_do() -> None:
    ucat, blind = (
        replace(load_layout(shipped_layouts()[name]), axes=AXES) for name in ("ucat", "no_yaw")
    )
    found = analyse(AnalysisQuestion(ucat, ("front_left",), blind, "forces"))
    assert found.now is not None and found.whole is not None
    assert found.before is not None and found.before.layout == "no_yaw", (
        "any layout may stand beside"
    )
    table = score_table(ucat, found.card, None)
    assert "6 of 6" in table and table.count("swatch") == 3
    both = score_table(ucat, score_card(ucat), score_card(blind))
    assert "before" in both and "▲" in both and "none" in both
    single = ucat.without(ucat.names[1:])
    beside = score_table(ucat, score_card(ucat), score_card(single))
    assert re.search(r"worst loss \[N\]</td><td>–</td><td>[\d.]+</td><td></td>", beside)
    card = check_card(quick_check(blind), True, ("<b>",))
    assert "yaw" in card and "&lt;b&gt;" in card


@pytest.mark.parametrize("name", ["A", "D", "no_yaw", "turtle_hybrid"])
def test_the_panel_shows_what_the_command_line_prints(name: str) -> None:
    layout = load_layout(shipped_layouts()[name])
    card = score_card(layout)
    panel = unescape(score_table(layout, card, None)).replace("−", "-")
    for remark in held_remarks(card.authority, card.counted):
        assert remark.text in panel and remark.text in str(card)
    for axis_row in axis_rows(card):
        for column in AXIS_COLUMNS[2:]:
            cell = column.cell(axis_row)
            assert cell in str(card) and (cell in panel or cell == NO_NUMBER)


def test_no_option_of_a_command_is_named_where_the_page_has_a_control() -> None:
    # Of files of others the page asks questions, and shows notes without what to do about them
    # (tests/exchange/test_questions.py); of a bench it asks for the voltage.
    rooms = ("analysis", "allocation", "fit", "layout")
    option = re.compile(r"--[a-z]+")
    paths = chain.from_iterable(
        (Path(finlab.__file__).parent / room).rglob("*.py") for room in rooms
    )
    texts = []
    for path in paths:
        if path.name == "thruster_bench.py":
            continue
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                texts.append(node.value)
    texts = [text for text in texts if option.search(text)]
    assert any("--flow" in text for text in texts)
    for text in texts:
        for named in option.finditer(in_app(text)):
            assert re.search(r"finlab [a-z ]+$", in_app(text)[: named.start()]), text
    card = score_card(load_layout("torpedo"))
    shown = score_table(load_layout("torpedo"), card, None)
    assert "--flow" not in shown and SPEED.removesuffix(" [m/s]") in shown
    torpedo = State(load_layout("torpedo"), target=(1.2, 0.0, 0.0, 0.0, 0.0, 0.25))
    said = answer_sentence(torpedo, Allocator(torpedo.able, "dual").allocate(torpedo.target), False)
    assert "nan" not in said and "beside its slider" in said


def test_every_stop_of_the_tour_stands() -> None:
    for step in TOUR:
        assert step.state.layout.name == step.layout
    session = Session(load_layout(shipped_layouts()["A"]))
    session.set_target(1, 0.5)
    session.select(session.state.layout.names[1])
    session.set_display("drawn", "forces")
    session.show_drawer("Improve")

    def all_there_is() -> tuple[object, ...]:
        return (
            session.state,
            session.display,
            session.desk,
            session.selected,
            session.history.undo_name,
        )

    before = all_there_is()
    for step in TOUR:
        session.guide.tour()
        assert session.drawer == step.drawer and session.selected is None
    session.guide.go(-1)
    assert session.guide.stop is TOUR[-2]
    session.guide.tour()
    session.guide.tour()
    assert session.guide.stop is None and all_there_is() == before


def test_the_best_mode_is_shown_again_after_a_tour() -> None:
    session = Session(load_layout("ucat"))
    for leave in (session.guide.end, session.start_over):
        session.guide.tour()
        session.guide.tour()
        assert session.mode == TOUR[1].mode == 1 and session.state == TOUR[1].state
        leave()
        assert session.mode == 0, "although the stop asked just what was asked before"


@pytest.mark.parametrize(
    ("lift_n", "words"),
    [
        (None, ()),
        (400.0, ("rises with", "push down with", "cannot keep its depth")),
        (150.0, ("sinks with", "push up with", "cannot keep its depth")),
    ],
)
def test_whether_the_fins_hold_the_weight_is_said(
    lift_n: float | None, words: tuple[str, ...]
) -> None:
    ucat = load_layout("ucat")
    assert ucat.body is not None
    layout = replace(ucat, body=replace(ucat.body, buoyancy_n=lift_n))
    sentence = trim_sentence(layout, axis_reach(layout))
    assert (sentence is None) == (not words)
    assert all(word in (sentence or "") for word in words)


def test_a_weight_that_takes_most_of_what_fins_give_is_said() -> None:
    ucat = load_layout("ucat")
    assert ucat.body is not None and ucat.body.mass_kg is not None
    reach = axis_reach(ucat)
    lift = ucat.body.mass_kg * GRAVITY - 0.7 * float(reach[2])
    layout = replace(ucat, body=replace(ucat.body, buoyancy_n=lift))
    assert "that is most" in (trim_sentence(layout, reach) or "")


def test_a_law_that_the_app_has_no_words_for_is_known_by_its_class(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fin = load_layout(shipped_layouts()["A"]).fins[0]
    assert law_words(fin).startswith("a stiff blade")
    monkeypatch.delitem(LAWS, "drag")
    assert law_words(fin).startswith("T = 2 rho Cd S rc^2 (2 pi f)^2 (1 - cos 2A) with half")
    assert "\n" not in law_words(fin)


def test_a_table_of_reach_says_of_each_axis_which_way_it_went() -> None:
    layout = replace(load_layout(shipped_layouts()["ucat"]), axes=AXES)
    x, y, z = layout.actuators[0].position
    wider = layout.replace_actuator("front_right", position=(x, 1.5 * y, z))
    before, now = score_card(layout), score_card(wider)
    table = score_table(wider, now, before)
    signs = []
    for old, new in zip(axis_rows(before), axis_rows(now), strict=True):
        change = (new.largest + new.most_negative) / (old.largest + old.most_negative) - 1.0
        signs.append("=" if abs(change) < 1e-3 else "▲" if change > 0.0 else "▼")
    assert len(set(signs)) > 1, "it is no test where all go the same way"
    axes_table = table.split("<table>")[2]
    assert re.findall("[=▲▼](?=</span>)", axes_table) == signs
