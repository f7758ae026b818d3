"""A power budget on the page: a step of undo, in files, links and scripts, and what binds is said.

What judges: the library's own answers, and the power by the actuators' laws."""

import contextlib
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.errors import FinlabError
from finlab.layout import Layout, load_layout
from finlab.layout.layout import Bus
from finlab.physics import plant_of
from webapp.markup.python_script import script_of
from webapp.markup.verdict import answer_sentence, verdict_sentence
from webapp.panels.files_tab import command_line
from webapp.panels.modes_tab import why_left_out
from webapp.session import Session
from webapp.session.files import layout_file, packed, read_layout, unpacked
from webapp.session.state import State, compared
from webapp.tasks.analysing import find_ranges
from webapp.tasks.solver import Solver

ASKED = (150.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""A wrench for which the BlueROV2 takes more than 216 W [N, N m]."""


@pytest.fixture
def rov() -> Session:
    """A session of a BlueROV2 that is asked for more than it may take."""
    session = Session(load_layout("bluerov2"))
    session.pull(ASKED)
    return session


def with_buses(layout: Layout) -> Layout:
    """A BlueROV2 with two buses of two thrusters each."""
    names = layout.names
    return replace(layout, buses=(Bus("aft", 60.0, names[2:4]), Bus("fore", 900.0, names[:2])))


def test_a_budget_is_kept_and_is_said_to_bind(rov: Session) -> None:
    rov.set_power(216)
    reply = Solver().reply(rov.state)
    assert reply.answer.power == pytest.approx(216.0, rel=1e-6)
    assert not reply.in_reach
    sentence = verdict_sentence(reply.answer, reply.in_reach)
    assert sentence == "Out of reach: power budget, closest"
    assert "; power budget used up;" in answer_sentence(rov.state, reply.answer, busy=False)
    assert rov.undo() == "Power budget"
    assert rov.state.layout == load_layout("bluerov2")
    rov.redo()
    rov.set_power(None)
    assert rov.history.undo_name == "No power budget" and rov.state.layout.power_w is None


def test_a_bus_that_binds_is_named_and_one_without_a_limit_goes(rov: Session) -> None:
    rov.open_layout(with_buses(rov.state.layout))
    reply = Solver().reply(rov.state)
    assert verdict_sentence(reply.answer, False) == "Out of reach: bus aft, closest"
    rov.set_bus_power(0, 80)
    assert rov.history.undo_name == "Power of bus aft"
    assert [bus.power_w for bus in rov.state.layout.buses] == [80.0, 900.0]
    rov.set_bus_power(0, None)
    assert [bus.name for bus in rov.state.layout.buses] == ["fore"]
    rov.undo()
    assert [bus.name for bus in rov.state.layout.buses] == ["aft", "fore"]
    with pytest.raises(FinlabError, match="gone"):
        rov.set_bus_power(2, 80)


@pytest.mark.parametrize("watts", [0.0, -5.0, float("nan"), float("inf"), 1e13, "much", True])
def test_what_is_no_budget_is_refused(rov: Session, watts: object) -> None:
    with pytest.raises(FinlabError, match=r"power budget \[W\]: expected"):
        rov.set_power(watts)  # type: ignore[arg-type]
    assert rov.state.layout.power_w is None


def test_files_and_links_carry_budgets(rov: Session) -> None:
    rov.set_power(216)
    for layout in (rov.state.layout, with_buses(load_layout("bluerov2"))):
        opened = read_layout(*layout_file(layout))
        assert not isinstance(opened, str) and opened.layout == layout  # type: ignore[union-attr]
        assert unpacked(packed(layout)).layout == layout


def test_the_script_prints_the_answer_of_the_page(rov: Session) -> None:
    rov.set_power(216)
    script = script_of(rov.state)
    assert "load_layout('bluerov2')" in script and "power=216.0" in script
    printed = io.StringIO()
    names: dict[str, object] = {}
    with contextlib.redirect_stdout(printed):
        exec(script, names)
    answer = names["answer"]
    assert isinstance(answer, finlab.Allocation)
    assert np.array_equal(answer.command, Solver().solve(rov.state).command)


def test_a_script_of_buses_opens_the_file_that_has_them(
    rov: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rov.open_layout(with_buses(rov.state.layout))
    name, content = layout_file(rov.state.layout)
    (tmp_path / name).write_bytes(content)
    monkeypatch.chdir(tmp_path)
    script = script_of(rov.state)
    assert f"load_layout({name!r})" in script and "power=" not in script
    assert name in command_line(rov.state)
    names: dict[str, object] = {}
    with contextlib.redirect_stdout(io.StringIO()):
        exec(script, names)
    answer = names["answer"]
    assert isinstance(answer, finlab.Allocation) and "bus aft" in answer.binding


def test_other_methods_say_that_they_keep_none(rov: Session) -> None:
    rov.set_power(216)
    solver = Solver()
    for method in compared(rov.state.layout)[1:4]:
        with pytest.raises(FinlabError) as refused:
            solver.solve(replace(rov.state, method=method))
        assert why_left_out(str(refused.value)) == "keeps no power budget"


@pytest.mark.parametrize("is_of_buses", [False, True])
def test_marks_end_where_the_budget_does(is_of_buses: bool) -> None:
    layout = load_layout("bluerov2")
    plain = find_ranges(State(layout, target=(20.0, 5.0, 0.0, 0.0, 0.0, 0.0)))
    limited = replace(layout, power_w=216.0)
    if is_of_buses:
        limited = with_buses(layout)
    state = State(limited, target=(20.0, 5.0, 0.0, 0.0, 0.0, 0.0))
    ranges = find_ranges(state)
    allocator = finlab.Allocator(limited)
    is_narrower = False
    for axis in np.flatnonzero(layout.commanded):
        for end, other in ((ranges.high, plain.high), (ranges.low, plain.low)):
            width = plain.high[axis] - plain.low[axis]
            assert abs(end[axis]) <= abs(other[axis]) + 1e-6 * width
            target = np.array(state.target)
            target[axis] = end[axis]
            assert allocator.allocate(target).err_norm <= 1e-4
            if abs(end[axis] - other[axis]) > 1e-6 * width:
                is_narrower = True
                target[axis] += 1e-3 * width * np.sign(other[axis] - end[axis])
                assert allocator.allocate(target).err_norm > 1e-4
    assert is_narrower


def test_no_candidate_breaks_the_budget() -> None:
    ucat = load_layout("ucat")
    target = (0.6, 0.0, 0.2, 0.0, 0.0, 0.02)
    solver = Solver()
    modes = solver.modes(solver.reply(State(ucat, target=target)))
    powers = [plant_of(ucat).power(named.mode.command).sum() for named in modes.visible]
    budget = 0.5 * float(min(powers) + max(powers))
    limited = replace(ucat, power_w=budget)
    shown = solver.modes(solver.reply(State(limited, target=target)))
    assert 1 <= len(shown.visible) < len(modes.visible)
    for named in shown.visible:
        assert plant_of(ucat).power(named.mode.command).sum() <= budget * (1.0 + 1e-6)
