"""Several actuators selected and changed in one step: names, limits, models, order, and fins of any
law."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.actuators.fin.force_table_file import write_table
from finlab.allocation.report import allocation_record
from finlab.assets import shipped_checkpoints
from finlab.deploy.bundle import make_bundle
from finlab.errors import FinlabError, LayoutError
from finlab.files import yaml_text
from finlab.layout import FinModelSpec, Layout, layout_to_dict, load_layout
from finlab.physics import make_law, plant_of
from tests.allocator_cache import FIN_ROBOTS
from webapp.markup.verdict import verdict_sentence
from webapp.panels.actuator_list import actuator_list
from webapp.panels.files_tab import command_line
from webapp.session import Session, files
from webapp.session.layout_edits import modelled
from webapp.session.state import LEAST, State
from webapp.session.targets import PRESETS
from webapp.tasks.solver import Solver

FRONT_FINS = ("front_right", "front_left")
"""Names of U-CAT's front fins."""


def fin(session: Session, name: str):  # type: ignore[no-untyped-def]
    """A fin of a session's robot."""
    layout = session.state.layout
    return layout.fins[layout.index(name)]


def select(session: Session, *names: str) -> None:
    """Select actuators, one after the other."""
    session.select(names[0])
    for name in names[1:]:
        session.select_also(name)


def test_selection_grows_and_shrinks(session: Session) -> None:
    select(session, "back_left", "front_right")
    assert session.selection == ("front_right", "back_left") and session.selected == "front_right"
    session.select_also("front_left")
    assert session.selected == "front_left" and set(session.selection) == {*FRONT_FINS, "back_left"}
    session.select_also("back_left")
    assert session.selection == FRONT_FINS
    select(session, *session.state.layout.names)
    with pytest.raises(FinlabError, match="these are all actuators"):
        session.delete()
    session.select(None)
    assert session.selection == () and session.selected is None


def test_what_changes_counts_for_all_selected_in_one_step(session: Session) -> None:
    select(session, *FRONT_FINS)
    session.place_selected((0.2, *fin(session, "front_left").position[1:]))
    assert [fin(session, name).position for name in FRONT_FINS] == [
        (0.2, -0.1502, 0.0),
        (0.2, 0.1502, 0.0),
    ]
    session.history.end_merge()
    session.set_value("amplitude", (0.1, 0.5))
    session.choose_model("lighthill")
    session.set_value("width", 0.12)
    session.turn_selected(math.radians(45))
    for name in FRONT_FINS:
        changed = fin(session, name)
        assert changed.limits.amplitude == (0.1, 0.5) and changed.limits.frequency == (0.1, 2.1)
        assert changed.model == FinModelSpec("lighthill", (("width", 0.12),))
        assert changed.mounting_angle == pytest.approx(math.pi / 4)
    assert fin(session, "back_left") == load_layout("ucat").fins[2]
    assert len(session.history.past) == 5
    assert (
        session.history.past[1][0] == "Amplitude of 2 actuators"
        and session.history.past[3][0] == "Width of 2 actuators"
    )
    for _ in range(5):
        session.undo()
    assert session.state.layout == load_layout("ucat")


def test_usual_values_are_not_written_and_shared_ones_stay(session: Session) -> None:
    session.select("front_right")
    session.set_value("density", 1025.0)
    session.set_value("area", 0.03)
    session.choose_model("lighthill")
    assert fin(session, "front_right").model == FinModelSpec("lighthill", (("density", 1025.0),))
    session.set_value("density", 1000.0)
    assert fin(session, "front_right").model == FinModelSpec("lighthill")
    with pytest.raises(FinlabError, match="comes from a file"):
        modelled(fin(session, "front_right"), "table")


@pytest.mark.parametrize("name", ["supply", "drillship"])
def test_actuators_of_ships_move_as_far_as_the_ship_is_long(name: str) -> None:
    session = Session(load_layout(name))
    layout = session.state.layout
    k = int(np.abs(layout.position[:, 0]).argmax())
    x, y, z = layout.actuators[k].position
    session.select(layout.names[k])
    session.place_selected((1.2 * x, y, z))
    session.nudge((0.5, 0.0, 0.0))
    assert session.state.layout.position[k] == pytest.approx([1.2 * x + 0.5, y, z])
    with pytest.raises(FinlabError, match=f"x of {layout.names[k]}"):
        session.place_selected((3.0 * x, y, z))
    with pytest.raises(FinlabError, match=f"x of {layout.names[k]}"):
        session.place_selected((1001.0, y, z))


@pytest.mark.parametrize(
    ("act", "says"),
    [
        (lambda s: s.set_value("amplitude", (0.5, 0.2)), "minimum 0.5 is above maximum 0.2"),
        (lambda s: s.set_value("frequency", (0.0, 0.0)), "maximum must be at least"),
        (lambda s: s.set_value("zero_direction", (-4.0, 4.0)), "one turn"),
        (lambda s: s.set_value("area", -0.1), "must lie within"),
        (lambda s: s.set_value("area", float("nan")), "must lie within"),
        (lambda s: s.place_selected((55.0, 0.0, 0.0)), "x of front_right"),
        (
            lambda s: s.rename("front_right", "front_left"),
            "there is an actuator 'front_left' already",
        ),
        (lambda s: s.rename("front_right", "  "), "name"),
        (lambda s: s.rename("front_right", "x" * 65), "name"),
        (lambda s: s.rename("nobody", "x"), "has no fin"),
    ],
)
def test_what_makes_no_sense_is_refused_and_changes_nothing(
    session: Session, act, says: str
) -> None:  # type: ignore[no-untyped-def]
    session.select("front_right")
    before = session.state
    with pytest.raises(FinlabError, match=says):
        act(session)
    assert session.state == before


def test_a_renamed_fin_keeps_its_damage_link_and_selection(session: Session) -> None:
    session.select("front_left")
    session.mirror()
    session.select("front_left")
    session.toggle_loss("front_left")
    session.rename("front_left", " bow <b> ")
    state = session.state
    assert state.lost == ("bow <b>",) and ("bow <b>", "front_right") in state.layout.mirror_pairs
    assert session.selected == "bow <b>"
    assert (
        "<b>"
        not in actuator_list(state, session.selection).split("<table>")[1].split("bow")[1][:12]
    )
    session.undo()
    assert session.selected == "front_left" and session.state.lost == ("front_left",)


def test_linked_fins_that_are_both_selected_move_once(session: Session) -> None:
    session.select("front_left")
    session.mirror()
    select(session, *FRONT_FINS)
    session.place_selected((0.2, 0.2, 0.0))
    assert fin(session, "front_left").position == (0.2, 0.2, 0.0)
    assert fin(session, "front_right").position == (0.2, -0.2, 0.0)


SOLVER = Solver()
"""One for all tests here."""
Target = tuple[float, float, float, float, float, float]
"""A wrench as a state holds it."""
needs_network = pytest.mark.skipif(
    not {"default", "paper"} <= set(shipped_checkpoints()),
    reason="no trained checkpoints in the tree",
)
"""Skips a test where no trained network is."""


def reachable(layout: Layout) -> Target:
    """A wrench that the fins give by their own laws."""
    plant = plant_of(layout)
    fx, fy, fz, tx, ty, tz = plant.wrench(plant.sample(np.random.default_rng(1), (1,)))[0].tolist()
    return fx, fy, fz, tx, ty, tz


@pytest.fixture
def tabled(tmp_path: Path) -> Layout:
    """U-CAT with fins that follow a table: soft ones, neither aligned nor the same in all
    directions."""
    law = make_law(FinModelSpec("soft", (("d", 0.1), ("e", 0.15))))
    grid = np.linspace(0.05, 0.6, 9), np.linspace(0.1, 2.1, 9), np.linspace(-np.pi, np.pi, 25)
    write_table(tmp_path / "fin.csv", law, *grid)
    spec = FinModelSpec("table", (("path", str(tmp_path / "fin.csv")),))
    ucat = load_layout("ucat")
    return replace(
        ucat, name="tabled", actuators=tuple(replace(fin, model=spec) for fin in ucat.fins)
    )


@pytest.mark.parametrize("name", FIN_ROBOTS)
def test_every_shipped_layout_is_answered_exactly(name: str) -> None:
    layout = load_layout(name)
    for method in LEAST.values():
        answer = SOLVER.solve(State(layout, target=reachable(layout), method=method))
        assert answer.err_norm < 1e-4 and answer.power > 0.0
        assert answer.notes == () and verdict_sentence(answer, True) == "Exact"


@needs_network
def test_only_paper_warns_of_fins() -> None:
    state = State(load_layout("mixed"), target=reachable(load_layout("mixed")))
    for method in ("mdn", "sqp"):
        answer = SOLVER.solve(replace(state, method=method))
        assert answer.err_norm < 1e-4 and answer.unknown_fins == ()
    warned = SOLVER.solve(replace(state, method="paper"))
    assert (
        verdict_sentence(warned, True) == "Not learned: fins 1, 2, 3 and 4. Choose another method"
    )


def test_a_table_fin_goes_through_the_whole_app(
    tabled: Layout, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    session = Session(load_layout("ucat"))
    session.open_layout(files.read_layout(*files.layout_file(tabled)).layout)
    for axis, value in enumerate(reachable(tabled)):
        session.set_target(axis, round(value, 4))
    reply = SOLVER.reply(replace(session.state, method="mdn"))
    assert reply.answer.err_norm < 1e-4 and len(SOLVER.modes(reply).visible) > 0
    assert reply.answer.notes == (reply.answer.measure_next,)
    state = session.state
    session.undo()
    while session.history.undo_name is not None:
        session.undo()
    assert session.state.layout.name == "ucat"
    while session.history.redo_name is not None:
        session.redo()
    assert session.state == state
    allocator = SOLVER.allocator(State(tabled))
    assert any(name.startswith("tables/") for name in make_bundle(allocator).files)
    assert command_line(session.state).startswith("finlab allocate tabled_bundle.zip --wrench")


def test_a_table_that_did_not_come_along_is_told_when_the_layout_is_opened(tabled: Layout) -> None:
    content = yaml_text(layout_to_dict(tabled)).encode()
    with pytest.raises(LayoutError, match="or its learned interaction, into one ZIP archive"):
        files.read_layout("other.yaml", content.replace(b"tabled", b"other"))


@needs_network
def test_one_error_everywhere() -> None:
    """Status line, candidates, modes and file of a method with a learned model: all by the fins'
    own laws."""
    layout = load_layout("ucat")
    state = State(layout, target=PRESETS["Turn"], method="paper")
    solver = Solver()
    reply = solver.reply(state)
    answer = reply.answer
    plant = plant_of(layout)
    assert answer.candidates is not None and answer.wrench_expected is not None
    modes = [named.mode for named in solver.modes(reply).visible]
    errors = [(mode.command, mode.err_norm) for mode in modes]
    for candidates in (answer.candidates, answer.samples):
        if candidates:
            errors += zip(candidates.command, candidates.err_norm, strict=True)
    for command, error in errors:
        missing = (np.array(state.target) - plant.wrench(command)) / answer.scale
        assert error == pytest.approx(float(np.linalg.norm(missing)), abs=1e-9)
    assert modes[0].err_norm == pytest.approx(answer.err_norm, rel=1e-9)
    record = allocation_record(answer)
    assert (
        record["err_norm"] == answer.err_norm
        and record["unallocated"] == answer.unallocated.tolist()
    )
