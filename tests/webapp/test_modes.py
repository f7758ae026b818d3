"""Candidates that do the same are one mode, and no two modes share a name."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.modes import find_modes
from finlab.allocation.solution import Candidates
from finlab.layout import load_layout
from tests.webapp.loops import AtOnce, page_of
from tests.webapp.stand_in import StandIn
from webapp.markup.mode_plot import LABEL, LEFT, mode_plot
from webapp.markup.plot import WIDTH
from webapp.markup.words import error_digits, small, three_digits
from webapp.panels.modes_tab import mode_table
from webapp.session import Session
from webapp.session.targets import PRESETS
from webapp.tasks.answering import Answering
from webapp.tasks.mode_names import (
    MAX_SHOWN,
    NO_MODES,
    Modes,
    NamedMode,
    known_modes,
    led_to,
    listed_modes,
    named_modes,
    same_mode,
)

PUSH, REST = (0.3, 1.1, 0.0), (0.05, 0.1, 0.0)


def candidates(*commands: list[tuple[float, float, float]]) -> Candidates:
    command = np.array(commands)
    k = len(command)
    source = tuple(f"component {i + 1}" for i in range(k))
    return Candidates(
        command, np.zeros((k, 6)), np.full(k, 1e-6), np.arange(k) + 2.0, np.arange(k) + 0.5, source
    )


def modes_of(*commands: list[tuple[float, float, float]]) -> tuple[NamedMode, ...]:
    command = np.array(commands)
    lower, upper = (np.tile(end, (command.shape[1], 1)) for end in ([0.05, 0.1, -np.pi], [0.6, 2.1, np.pi]))
    with np.errstate(invalid="ignore"):
        force = np.nan_to_num(np.sin(command[..., 0]) ** 2 * command[..., 1] ** 2)
    return named_modes(find_modes(candidates(*commands), force, lower, upper))


def test_how_a_fin_rests_is_no_news() -> None:
    modes = modes_of([PUSH, REST], [PUSH, (0.2, 0.1, 3.0)], [REST, PUSH])
    assert [name for _, name in modes] == ["fin 2 rests", "fin 1 rests"]
    assert len(modes) == 2


def test_directions_wrap() -> None:
    assert len(modes_of([(0.3, 1.0, np.pi), PUSH], [(0.3, 1.0, -np.pi + 0.01), PUSH])) == 1


def test_names_tell_modes_apart() -> None:
    modes = modes_of(
        [PUSH, PUSH],
        [PUSH, (0.3, 1.1, 3.1)],
        [(0.5, 0.7, 0.0), PUSH],
        [PUSH, (0.3, 1.1, 1.0)],
        [(0.3, 1.6, 0.0), PUSH],
    )
    names = [name for _, name in modes]
    assert names == ["all fins push", *(f"all fins push ({k})" for k in (2, 3, 4, 5))]


def test_failed_fins_are_left_out() -> None:
    assert modes_of([(np.nan,) * 3, PUSH, REST])[0].name == "fin 3 rests"


def test_a_mode_is_found_again_in_another_list() -> None:
    modes = modes_of([PUSH, REST], [REST, PUSH], [PUSH, PUSH])
    fewer = modes_of([PUSH, PUSH], [REST, (0.301, 1.1, 0.01)])
    assert same_mode(fewer[1].mode, modes) == 1 and same_mode(fewer[0].mode, modes) == 2
    assert same_mode(modes[0].mode, fewer) == 0, "the best one where it is not there"
    assert len(modes_of(*([PUSH, (0.3, 1.1, 0.5 * k)] for k in range(12)))) == MAX_SHOWN


def test_real_candidates_are_drawn_and_listed() -> None:
    answer = Allocator(load_layout("ucat"), StandIn).allocate(PRESETS["Turn"])
    found = known_modes(answer)
    modes = named_modes(found)
    assert answer.candidates is not None and answer.samples is not None
    listed = listed_modes(found, answer.samples)
    led = listed.of_samples
    assert led is not None and len(led) == len(answer.samples.effort)
    for source, place in zip(answer.samples.source, led.tolist(), strict=True):
        led_here = [k for k, (mode, _) in enumerate(modes) if source in mode.sources]
        assert place == (led_here[0] if led_here else -1), "the mode that its component led to"
    strange = replace(answer.samples, source=("sample",) * len(led))
    assert set(led_to(strange, modes)) == {-1}, "of no component"
    plot = mode_plot(listed, 0, 200)
    assert plot.count("data-press='mode'") == len(modes)
    assert plot.count("r='3'") == len(answer.samples.effort)
    table = mode_table(listed, False, 0)
    assert table.count("data-press=") == len(modes) and "0.0000" not in table and "more are" not in table
    assert "2 more are" in mode_table(replace(listed, count=listed.count + 2), False, 0)
    assert mode_table(NO_MODES, False, 0) == ""
    assert "looking for more" in mode_table(listed, True, 0)


def test_figures_keep_their_width() -> None:
    assert {len(small(v)) for v in (0.0, 3.1e-5, 0.099, 2e5)} == {8}
    assert [small(v) for v in (0.1, 1.2345, 16.24, 9999.0)] == ["0.100", "1.23", "16.2", "9999"]
    assert [three_digits(v) for v in (2.319, 0.041, 0.09996, 0.0)] == ["2.32", "0.0410", "0.100", "0.00"]
    assert three_digits(float("nan")) == small(float("nan")) == "–"
    assert [error_digits(v) for v in (0.0, 5.4e-16, 2e-9, 16.24)] == ["≤ 1e−9", "≤ 1e−9", "2.00e−09", "16.2"]
    assert "−" in small(1e-5) and "-" not in three_digits(-2e-9)


def test_a_mode_stays_on_the_robot_when_all_are_known() -> None:
    session = Session(load_layout("ucat"))
    jobs: list[Any] = []
    submit = {"submit": lambda _, key, job, failed: jobs.append(job)}
    worker: Any = type("Ready", (), {**submit, "forget": lambda *_: None})()
    loop = AtOnce()
    answering = Answering(page_of(worker, session, loop=loop))
    session.set_target(1, 0.8)
    answering.ask()
    jobs.pop()()
    session.show_mode(1)
    wanted = answering.modes.shown[1].mode
    loop.ring()
    jobs.pop()()
    assert answering.modes.count >= len(answering.modes.shown) > 0
    place = same_mode(wanted, answering.modes.shown)
    assert session.mode == place, "what is on the robot stays there when all modes are known"


@pytest.mark.parametrize("spread", [0.0, 1e-6, 0.01, 1.0])
def test_dots_stand_at_their_values_and_their_numbers_beside_them(spread: float) -> None:
    answer = Allocator(load_layout("hexa"), StandIn).allocate(PRESETS["Turn"])
    first = known_modes(answer)[0]
    effort = np.append(0.801 + spread * np.random.default_rng(3).uniform(size=MAX_SHOWN - 1), 0.957 + spread)
    shown = tuple(NamedMode(replace(first, effort=float(value)), f"{k}") for k, value in enumerate(effort))
    plot = mode_plot(Modes(shown, MAX_SHOWN, answer.samples, np.zeros(64, dtype=np.intp)), 3, 200)
    across = [
        float(x) for x in re.findall(r"<circle cx='([\d.]+)' cy='[\d.]+' r='[\d.]+' class='mode'", plot)
    ]
    labels = re.findall(r"<text x='([\d.]+)' y='([\d.]+)' class='digit'[^>]*>(\d+)<", plot)
    across, numbers = (
        across[::-1],
        [(float(x), float(y)) for x, y, _ in labels][::-1],
    )  # the best one is on top
    assert [int(k) for *_, k in labels][::-1] == list(range(1, MAX_SHOWN + 1))
    scale, start = np.polyfit(effort, across, 1)
    assert scale > 0 and np.abs(scale * effort + start - across).max() < 0.2, "each at its value"
    assert np.argmax(across) == MAX_SHOWN - 1
    width, height = LABEL
    for k, (x, y) in enumerate(numbers):
        assert LEFT <= x <= WIDTH
        assert all(abs(x - u) >= width - 0.2 or abs(y - v) >= height - 0.2 for u, v in numbers[:k])
