"""Every layout answers with its own fins' physics, tables included, and only `paper` warns of fins."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation.report import allocation_record
from finlab.assets import shipped_checkpoints
from finlab.deploy.bundle import make_bundle
from finlab.errors import LayoutError
from finlab.files.plain_values import yaml_text
from finlab.layout import FinModelSpec, Layout, layout_to_dict, load_layout
from finlab.layout.force_table_file import write_table
from finlab.physics import make_law, plant_of
from tests.fin_robots import FIN_ROBOTS
from webapp.markup.verdict import verdict_sentence
from webapp.panels.files_tab import command_line
from webapp.session import Session, files
from webapp.session.state import LEAST, State
from webapp.session.targets import PRESETS
from webapp.tasks.solver import Solver

SOLVER = Solver()
Target = tuple[float, float, float, float, float, float]
needs_network = pytest.mark.skipif(
    not {"default", "paper"} <= set(shipped_checkpoints()), reason="no trained checkpoints in the tree"
)


def reachable(layout: Layout) -> Target:
    """A wrench that the fins give by their own laws."""
    plant = plant_of(layout)
    fx, fy, fz, tx, ty, tz = plant.wrench(plant.sample(np.random.default_rng(1), (1,)))[0].tolist()
    return fx, fy, fz, tx, ty, tz


@pytest.fixture
def tabled(tmp_path: Path) -> Layout:
    """U-CAT with fins that follow a table: soft ones, neither aligned nor the same in all directions."""
    law = make_law(FinModelSpec("soft", (("d", 0.1), ("e", 0.15))))
    grid = np.linspace(0.05, 0.6, 9), np.linspace(0.1, 2.1, 9), np.linspace(-np.pi, np.pi, 25)
    write_table(tmp_path / "fin.csv", law, *grid)
    spec = FinModelSpec("table", (("path", str(tmp_path / "fin.csv")),))
    ucat = load_layout("ucat")
    return replace(ucat, name="tabled", actuators=tuple(replace(fin, model=spec) for fin in ucat.fins))


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
    assert verdict_sentence(warned, True) == "Not learned: fins 1, 2, 3 and 4. Choose another method"


def test_a_table_fin_goes_through_the_whole_app(
    tabled: Layout, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    session = Session(load_layout("ucat"))
    session.open_layout(files.read_layout(*files.layout_file(tabled)).layout)
    for axis, value in enumerate(reachable(tabled)):
        session.set_target(axis, round(value, 4))
    reply = SOLVER.reply(replace(session.state, method="mdn"))
    assert reply.answer.err_norm < 1e-4 and len(SOLVER.modes(reply).shown) > 0
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
    with pytest.raises(LayoutError, match="put the layout and its tables into one ZIP archive"):
        files.read_layout("other.yaml", content.replace(b"tabled", b"other"))


@needs_network
def test_one_error_everywhere() -> None:
    """Status line, candidates, modes and file of a method with a learned model: all by the fins' own laws."""
    layout = load_layout("ucat")
    state = State(layout, target=PRESETS["Turn"], method="paper")
    solver = Solver()
    reply = solver.reply(state)
    answer, plant = reply.answer, plant_of(layout)
    assert answer.candidates is not None and answer.wrench_expected is not None
    modes = [named.mode for named in solver.modes(reply).shown]
    told = [
        (c, e)
        for found in (answer.candidates, answer.samples)
        if found
        for c, e in zip(found.command, found.err_norm, strict=True)
    ]
    for command, error in [*told, *((mode.command, mode.err_norm) for mode in modes)]:
        missing = (np.array(state.target) - plant.wrench(command)) / answer.scale
        assert error == pytest.approx(float(np.linalg.norm(missing)), abs=1e-9)
    assert modes[0].err_norm == pytest.approx(answer.err_norm, rel=1e-9)
    record = allocation_record(answer)
    assert record["err_norm"] == answer.err_norm and record["unallocated"] == answer.unallocated.tolist()
