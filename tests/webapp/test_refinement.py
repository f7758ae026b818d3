"""Play the refinement: every step is named, judged by the fins' own laws, and can be looked at again."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finlab.errors import FinlabError
from finlab.layout import load_layout
from finlab.physics import Plant
from tests.webapp.loops import AtOnce, page_of
from webapp.markup.refinement import way_table
from webapp.markup.words import error_digits, three_digits
from webapp.session import Session
from webapp.session.state import State
from webapp.session.targets import PRESETS
from webapp.tasks.answering import Answering
from webapp.tasks.refinement import Shown, way_to
from webapp.tasks.solver import Solver

UCAT = load_layout("ucat")
READY: Any = type("Ready", (), {"submit": lambda _, key, job, failed: job(), "forget": lambda *_: None})()


@pytest.mark.parametrize("failed", [(), ("back_left",)])
@pytest.mark.parametrize("method", ["search", "mdn", "paper"])
def test_each_step_has_the_plants_error_and_power(method: str, failed: tuple[str, ...]) -> None:
    solver = Solver()
    state = State(UCAT, failed=failed, target=PRESETS["Turn"], method=method, objective="effort")
    reply = solver.reply(state)
    modes = solver.modes(reply).shown
    plant, works = Plant(UCAT.without(failed)), [name not in failed for name in UCAT.names]
    for k, (mode, name) in enumerate(modes[:2]):
        end = reply.answer.with_command(mode.command)
        way = way_to(solver, Shown(reply, (k, None), end, f"Mode {k + 1}, {name}"))
        assert way.steps[-1] == (f"Mode {k + 1}, {name}", end) and len(way.steps) > 1
        rows = re.findall(r"<tr class='pick.*?</tr>", way_table(way, None))
        assert len(rows) == len(way.steps) and "chosen" in rows[-1] and "chosen" not in rows[0]
        for (title, step), row in zip(way.steps, rows, strict=True):
            command = step.command[works]
            missing = (np.array(state.target) - plant.wrench(command)) / reply.answer.sigma
            error, power = float(np.linalg.norm(missing)), float(plant.power(command).sum())
            assert step.err_norm == pytest.approx(error, abs=1e-12) and step.power == pytest.approx(power)
            cells = re.findall(r"<td[^>]*>(.*?)</td>", row)
            assert cells[1].lower() == title.lower()
            assert cells[2:4] == [error_digits(error), three_digits(power)], "what is read is the plant's"
        errors = [step.err_norm for _, step in way.steps]
        assert errors[-1] < errors[0]


def test_steps_are_played_held_and_forgotten() -> None:
    session, loop = Session(UCAT), AtOnce()
    session.set_preset("Turn")
    told: list[str] = []
    answering = Answering(page_of(READY, session, loop=loop, notify=lambda *note: told.append(note[1])))
    with pytest.raises(FinlabError, match="no answer yet"):
        answering.play()
    answering.ask()
    loop.ring()  # the wider search
    session.show_mode(1)
    end = answering.shown
    assert end is not None
    answering.play()
    seen = []
    while answering.step is not None:
        seen.append(answering.step.name)
        assert answering.shown is answering.step.answer and answering.shown is not end
        loop.ring()
    assert seen == ["start", "search, step 1", "refinement, step 1"] and answering.shown is end
    answering.refinement.show(1)
    assert answering.step is not None and answering.step.name == "search, step 1"
    loop.ring()
    assert answering.step.name == "search, step 1", "a step that was chosen stays"
    with pytest.raises(FinlabError, match="expected one of 4, got 4"):
        answering.refinement.show(4)
    session.show_mode(0)
    assert answering.step is None and not answering.is_refined, "it is the way to another mode"
    session.show_mode(1)
    assert answering.is_refined
    session.set_target(1, 0.4)
    answering.ask()
    assert not answering.is_refined and told == []


def test_methods_that_do_not_tell_say_so() -> None:
    solver = Solver()
    reply = solver.reply(State(UCAT, target=PRESETS["Turn"], method="qp"))
    with pytest.raises(FinlabError, match="'qp' does not tell how it came to this; use 'search'"):
        way_to(solver, Shown(reply, (0, None), reply.answer, "Mode 1"))
    session = Session(UCAT)
    session.set_setting("method", "qp")
    answering = Answering(page_of(READY, session))
    answering.ask()
    with pytest.raises(FinlabError, match="refines no candidates"):
        answering.play()
    assert replace(session.state, method="search") != session.state
