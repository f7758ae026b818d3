"""Candidates that do the same are one mode, and no two modes share a name."""

from typing import Any

import numpy as np

from finlab.allocation.allocation import Candidates
from finlab.assets import shipped_layouts
from finlab.layout import load_layout
from tests.webapp.stand_in import StandIn, load_stand_in
from webapp.answering import Answering
from webapp.figures import small, three_digits
from webapp.markup.mode_plot import mode_plot
from webapp.markup.modes import mode_table
from webapp.modes import distinct_modes, nearest_modes
from webapp.session import Session
from webapp.solver import Solver
from webapp.targets import PRESETS

PUSH, REST = (0.3, 1.1, 0.0), (0.05, 0.1, 0.0)


def candidates(*commands: list[tuple[float, float, float]]) -> Candidates:
    command = np.array(commands)
    k = len(command)
    return Candidates(command, np.zeros((k, 6)), np.full(k, 1e-6), np.arange(k) + 2.0, ("refined",) * k)


def test_how_a_fin_rests_is_no_news() -> None:
    modes = distinct_modes(candidates([PUSH, REST], [PUSH, (0.2, 0.1, 3.0)], [REST, PUSH]))
    assert [mode.name for mode in modes] == ["fin 2 rests", "fin 1 rests"]
    assert [mode.size for mode in modes] == [2, 1] and modes[1].index == 2


def test_directions_wrap() -> None:
    modes = distinct_modes(candidates([(0.3, 1.0, np.pi), PUSH], [(0.3, 1.0, -np.pi + 0.01), PUSH]))
    assert len(modes) == 1


def test_names_tell_modes_apart() -> None:
    modes = distinct_modes(
        candidates(
            [PUSH, PUSH],
            [PUSH, (0.3, 1.1, 3.1)],
            [(0.5, 0.7, 0.0), PUSH],
            [PUSH, (0.3, 1.1, 1.0)],
            [(0.3, 1.6, 0.0), PUSH],
        )
    )
    names = [mode.name for mode in modes]
    assert len(set(names)) == len(names) == 5
    assert names[0] == "all fins push" and names[1].endswith("fin 2 reversed")
    assert "fin 1 wider and slower" in names[2] and "fin 2 turned +57°" in names[3]
    assert "fin 1" in names[4]


def test_failed_fins_are_left_out() -> None:
    modes = distinct_modes(candidates([(np.nan,) * 3, PUSH, REST]))
    assert modes[0].name == "fin 3 rests"
    assert distinct_modes(None) == ()


def test_real_candidates_are_drawn_and_listed() -> None:
    answer = StandIn().allocate(load_layout(shipped_layouts()["ucat"]), PRESETS["Turn"])
    modes = distinct_modes(answer.candidates)
    assert answer.candidates is not None and answer.samples is not None
    assert sum(mode.size for mode in modes) == len(answer.candidates.energy)
    nearest = nearest_modes(answer.samples, answer.candidates, modes)
    assert nearest is not None and len(nearest) == len(answer.samples.energy)
    raw = answer.samples._replace(command=answer.candidates.command[[mode.index for mode in modes]])
    again = nearest_modes(raw, answer.candidates, modes)
    assert again is not None and list(again) == list(range(len(modes))), "each mode is nearest to itself"
    plot = mode_plot(answer, modes, nearest, 0, None, 200, "here")
    assert plot.count("onclick") == len(modes) + 1, "one for all samples together"
    assert plot.count("data-k") == len(answer.samples.energy)
    assert mode_plot(answer, modes, nearest, None, 3, 200, "here").count("class='ring'") == 2
    table = mode_table(answer.candidates, modes, 0, "here")
    assert table.count("onclick") == len(modes) and "0.0000" not in table
    assert "no candidates" in mode_table(None, (), 0, "here")


def test_figures_keep_their_width() -> None:
    assert {len(small(v)) for v in (0.0, 3.1e-5, 1.2345, 99.0)} == {8}
    assert [three_digits(v) for v in (2.319, 0.041, 12.5, 0.0)] == ["2.32", "0.0410", "12.5", "0.00"]
    assert three_digits(float("nan")) == small(float("nan")) == "–"
    assert "−" in small(1e-5) and "-" not in three_digits(-2e-9)


def test_another_sample_of_another_answer_is_shown() -> None:
    layout = load_layout(shipped_layouts()["ucat"])
    session = Session(layout)
    jobs: list[Any] = []
    worker: Any = type("AtOnce", (), {"submit": lambda _, key, job: jobs.append(job)})()
    answering = Answering(
        session, Solver(load=load_stand_in), worker, lambda act: act(), lambda: None, lambda _: None
    )
    shown = []
    for value in (0.5, 0.8):
        session.set_target(1, value)
        answering.ask()
        jobs.pop()()
        session.show_sample(2)
        shown.append(answering.shown)
        assert answering.shown is shown[-1], "it is made once"
        session.show_sample(3)
        assert answering.shown is not shown[-1]
    assert shown[0].target[1] == 0.5 and shown[1].target[1] == 0.8
