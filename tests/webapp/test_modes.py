"""Candidates that do the same are one mode, and no two modes share a name."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finlab.allocation.solution import Candidates
from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.research.mdn.method import TRACE_STEPS
from tests.webapp.stand_in import Direct, context_of, load_stand_in
from webapp.markup.mode_plot import AXIS_LEFT, LABEL_SIZE, mode_plot
from webapp.markup.plot import WIDTH
from webapp.markup.refinement import step_words, vain_sentence
from webapp.markup.words import error_digits, small, three_digits
from webapp.panels.modes_tab import mode_table
from webapp.session import Session
from webapp.session.state import State
from webapp.session.targets import PRESETS
from webapp.tasks.answering import HOLD, Answering, Refining
from webapp.tasks.modes import find_modes
from webapp.tasks.solver import MAX_SHOWN, NO_MODES, Modes, NamedMode, Solver, named_modes

PUSH_COMMAND = (0.3, 1.1, 0.0)
"""A command of a fin that pushes."""
REST_COMMAND = (0.05, 0.1, 0.0)
"""A command of a fin that rests."""


def candidates_of(*commands: list[tuple[float, float, float]]) -> Candidates:
    """Candidates by the commands of their fins, the cheaper ones first."""
    command = np.array(commands)
    k = len(command)
    source = tuple(f"component {i + 1}" for i in range(k))
    return Candidates(
        command, np.zeros((k, 6)), np.full(k, 1e-6), np.arange(k) + 2.0, np.arange(k) + 0.5, source
    )


def modes_of(*commands: list[tuple[float, float, float]]) -> tuple[NamedMode, ...]:
    """Named modes of such candidates."""
    command = np.array(commands)
    lower, upper = (
        np.tile(end, (command.shape[1], 1)) for end in ([0.05, 0.1, -np.pi], [0.6, 2.1, np.pi])
    )
    with np.errstate(invalid="ignore"):
        force = np.nan_to_num(np.sin(command[..., 0]) ** 2 * command[..., 1] ** 2)
    return named_modes(find_modes(candidates_of(*commands), force, lower, upper), "network")


def test_how_a_fin_rests_is_no_news() -> None:
    modes = modes_of(
        [PUSH_COMMAND, REST_COMMAND], [PUSH_COMMAND, (0.2, 0.1, 3.0)], [REST_COMMAND, PUSH_COMMAND]
    )
    assert [named.name for named in modes] == ["fin 2 rests", "fin 1 rests"]
    assert len(modes) == 2


def test_directions_wrap() -> None:
    assert (
        len(modes_of([(0.3, 1.0, np.pi), PUSH_COMMAND], [(0.3, 1.0, -np.pi + 0.01), PUSH_COMMAND]))
        == 1
    )


def test_names_tell_modes_apart() -> None:
    modes = modes_of(
        [PUSH_COMMAND, PUSH_COMMAND],
        [PUSH_COMMAND, (0.3, 1.1, 3.1)],
        [(0.5, 0.7, 0.0), PUSH_COMMAND],
        [PUSH_COMMAND, (0.3, 1.1, 1.0)],
        [(0.3, 1.6, 0.0), PUSH_COMMAND],
    )
    names = [named.name for named in modes]
    assert names == ["all fins push", *(f"all fins push ({k})" for k in (2, 3, 4, 5))]


def test_failed_fins_are_left_out() -> None:
    lost = (np.nan,) * 3
    assert modes_of([lost, PUSH_COMMAND, REST_COMMAND])[0].name == "fin 3 rests"
    assert modes_of([lost, PUSH_COMMAND, PUSH_COMMAND])[0].name == "all that work push"


def test_no_more_are_shown_than_have_colours() -> None:
    assert (
        len(modes_of(*([PUSH_COMMAND, PUSH_COMMAND, (0.3, 1.1, 0.5 * k)] for k in range(12))))
        == MAX_SHOWN
    )


def modes_of_turn(method: str = "mdn") -> Modes:
    """Modes of U-CAT that turns."""
    solver = Solver(load=load_stand_in)
    return solver.modes(
        solver.reply(State(load_layout("ucat"), target=PRESETS["Turn"], method=method))
    )


def test_samples_and_modes_are_drawn_and_listed() -> None:
    modes = modes_of_turn()
    samples, middle, end = modes.refinement
    assert len(modes.ends) == len(samples) == len(end)
    for source, place in zip(samples.source, modes.ends, strict=True):
        assert place < 0 or source in modes.visible[place].mode.sources, (
            "the mode that its component led to"
        )
    still = mode_plot(modes, 0, None, 200)
    moving = mode_plot(modes, 0, 1, 200)
    assert still.count("data-press='mode'") == len(modes.visible)
    first, *others = (named.mode.effort for named in modes.visible)
    drawn = int((samples.effort <= max(first, *others, 2.0 * max(others))).sum())
    assert still.count("r='3'") == drawn and moving.count("r='3'") == 2 * drawn
    assert moving.count("class='moving'") == 1 and "class='moving'" not in still
    hollow = "class='mode' stroke='[^']*' fill='transparent'"
    assert len(re.findall(hollow, still)) == len(modes.visible) - 1, "one is on the robot"
    assert len(re.findall(hollow, moving)) == len(modes.visible), "a step on the way to it is"
    table = mode_table(modes, 0)
    assert table.count("data-press=") == len(modes.visible) and "0.0000" not in table
    assert "more are" not in table
    assert table.count(">network</span>") == len(modes.visible)
    assert "2 more are" in mode_table(replace(modes, count=modes.count + 2), 0)
    assert mode_table(NO_MODES, 0) == mode_plot(NO_MODES, 0, None, 200) == ""
    assert "samples of the network" in step_words(modes, 0) and "median error" in step_words(
        modes, None
    )


def refined_to(modes: Modes, errors: list[float], answer: Any = None) -> Modes:
    """Modes whose samples end with errors, one after the other."""
    *ways, end = modes.refinement
    repeated = np.resize(errors, len(end.err_norm))
    # Of the stand-in's two steps neither is as late as the one in which samples become exact.
    late = [replace(end, err_norm=repeated)] * TRACE_STEPS.steps
    return replace(modes, refinement=(*ways[:1], *late), answer=answer or modes.answer)


def test_samples_are_called_exact_where_they_are() -> None:
    modes = modes_of_turn()
    answer = Solver(load=load_stand_in).reply(
        State(load_layout("ucat"), target=(12.0, 0.0, 0.0, 0.0, 0.0, -0.25))
    )
    n_samples = len(modes.refinement[-1].err_norm)
    vain = refined_to(modes, [2.66e-2, 3e-2], answer.answer)
    words = step_words(vain, None)
    assert f"none of {n_samples} made exact" in words and "2.66e−02" not in words.split("·")[0]
    assert vain.is_in_vain
    sentence = vain_sentence(vain)
    asked = f"Fx 12 N and Tz −0.25 N m: none of {n_samples} samples was refined to it."
    assert asked in sentence and "he nearest misses 2.66e−02" in sentence
    some = refined_to(modes, [1e-6, 3e-2])
    assert f"{n_samples // 2} of {n_samples} made exact" in step_words(some, None)
    assert not some.is_in_vain and vain_sentence(some) == ""
    assert "made exact" in step_words(refined_to(modes, [1e-6]), None)
    assert vain_sentence(NO_MODES) == ""


def test_samples_that_end_at_a_limit_are_counted() -> None:
    modes = modes_of_turn()
    layout = load_layout("ucat")
    vain = refined_to(modes, [1.0])
    end = vain.refinement[-1]
    command = np.broadcast_to(0.5 * (layout.lower + layout.upper), end.command.shape).copy()
    command[:3, 1, 0] = layout.upper[1, 0]
    command[:, 0] = np.nan
    limited = replace(vain, refinement=(*vain.refinement[:-1], replace(end, command=command)))
    assert "In 3 of them a fin came" in vain_sentence(limited)
    command[:, 2, 1] = layout.upper[2, 1]
    assert "In each a fin came" in vain_sentence(limited)


def test_figures_keep_their_width() -> None:
    assert {len(small(v)) for v in (0.0, 3.1e-5, 0.099, 2e5)} == {8}
    assert [small(v) for v in (0.1, 1.2345, 16.24, 9999.0)] == ["0.100", "1.23", "16.2", "9999"]
    assert [three_digits(v) for v in (2.319, 0.041, 0.09996, 0.0, -5.5e-14)] == [
        "2.32",
        "0.0410",
        "0.100",
        "0.00",
        "0.00",
    ]
    assert three_digits(float("nan")) == small(float("nan")) == "–"
    assert [error_digits(v) for v in (0.0, 5.4e-16, 2e-9, 16.24)] == [
        "≤ 1e−9",
        "≤ 1e−9",
        "2.00e−09",
        "16.2",
    ]
    assert "−" in small(1e-5) and "-" not in three_digits(-2e-9)


def test_a_refinement_is_played_step_by_step_on_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("webapp.tasks.answering.SEARCH_REST_S", 0.0)
    monkeypatch.setattr("webapp.tasks.answering.STEP_S", 0.0)
    session = Session(load_layout("ucat"))
    session.set_setting("method", "mdn")
    context = context_of(Direct(), session)
    answering = Answering(context)
    refining = Refining(context, answering)
    with pytest.raises(FinlabError, match="proposes nothing"):
        refining.toggle()
    answering.ask()
    answering.slot.attend()
    answering.ask()
    answering.search.attend()
    modes = answering.modes
    best = answering.shown_answer().shown_allocation
    assert modes.steps == 2 and not answering.searching
    session.show_mode(1)
    refining.toggle()
    seen = []
    while session.step is not None:
        proposal = modes.ends.index(1)
        shown = answering.shown_answer().shown_allocation
        assert shown is not None and refining.running
        np.testing.assert_array_equal(
            shown.command, modes.refinement[session.step].command[proposal]
        )
        seen.append(session.step)
        refining.attend()
    assert (
        seen == [0, 1]
        and not refining.running
        and answering.shown_answer().shown_allocation not in (None, best)
    )
    np.testing.assert_array_equal(
        answering.shown_answer().shown_allocation.command, modes.visible[1].mode.command
    )
    session.set_loop(True)
    refining.toggle()
    for _ in range(2 + HOLD):
        refining.attend()
    assert session.step == 0 and refining.running, "it begins anew"
    session.set_target(1, 0.3)
    assert session.step is None
    refining.attend()
    assert not refining.running, "another question ends it"


def test_play_follows_the_nearest_sample_where_none_becomes_exact(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("webapp.tasks.answering.SEARCH_REST_S", 0.0)
    session = Session(load_layout("ucat"))
    session.set_setting("method", "mdn")
    context = context_of(Direct(), session)
    answering = Answering(context)
    refining = Refining(context, answering)
    answering.ask()
    answering.slot.attend()
    answering.ask()
    answering.search.attend()
    found = answering.modes
    errors = np.linspace(1.0, 0.5, len(found.ends))
    *path, last = found.refinement
    in_vain = replace(
        found, ends=(-1,) * len(found.ends), refinement=(*path, replace(last, err_norm=errors))
    )
    answering.search.answer = in_vain
    refining.toggle()
    assert refining.running and session.step == 0
    shown = answering.shown_answer().shown_allocation
    assert shown is not None
    np.testing.assert_array_equal(shown.command, in_vain.refinement[0].command[-1])


@pytest.mark.parametrize("spread", [0.0, 1e-6, 0.01, 1.0])
def test_dots_stand_at_their_values_and_their_numbers_beside_them(spread: float) -> None:
    modes = modes_of_turn()
    first = modes.visible[0].mode
    effort = np.append(
        0.801 + spread * np.random.default_rng(3).uniform(size=MAX_SHOWN - 1), 0.957 + spread
    )
    visible = tuple(
        NamedMode(replace(first, effort=float(value)), f"{k}", "network")
        for k, value in enumerate(effort)
    )
    plot = mode_plot(replace(modes, visible=visible, ends=(0,) * len(modes.ends)), 3, None, 200)
    across = [
        float(x)
        for x in re.findall(r"<circle cx='([\d.]+)' cy='[\d.]+' r='[\d.]+' class='mode'", plot)
    ]
    labels = re.findall(r"<text x='([\d.]+)' y='([\d.]+)' class='digit'[^>]*>(\d+)<", plot)
    # the best one is on top
    across = across[::-1]
    numbers = [(float(x), float(y)) for x, y, _ in labels][::-1]
    assert [int(k) for *_, k in labels][::-1] == list(range(1, MAX_SHOWN + 1))
    scale, start = np.polyfit(effort, across, 1)
    assert scale > 0 and np.abs(scale * effort + start - across).max() < 0.2, "each at its value"
    assert np.argmax(across) == MAX_SHOWN - 1
    width, height = LABEL_SIZE
    for k, (x, y) in enumerate(numbers):
        assert AXIS_LEFT <= x <= WIDTH
        assert all(abs(x - u) >= width - 0.2 or abs(y - v) >= height - 0.2 for u, v in numbers[:k])
