"""Sentences about a robot: restless fins, limits beyond tables, rudders at rest, fins that nobody
learned."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.actuators.azimuth import AzimuthCommand
from finlab.actuators.fin.fin import FinCommand
from finlab.actuators.rudder import Rudder, RudderCommand
from finlab.actuators.thrust_model import PowerTable
from finlab.actuators.thruster import Thruster, ThrusterCommand
from finlab.allocation import Allocator
from finlab.allocation.report import fin_notes
from finlab.assets import shipped_checkpoints
from finlab.errors import DataError
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout
from finlab.physics import make_law, write_table
from tests.allocation.quick_allocator import OF_FINS, quick_allocator
from tests.allocator_cache import FIN_ROBOTS

pytestmark = pytest.mark.skipif(
    not {"default", "paper"} <= set(shipped_checkpoints()),
    reason="no trained checkpoints in the tree",
)


DRAG = make_law(FinModelSpec("drag"))
"""The law of a fin that is written as a table."""
CIRCLE = np.linspace(-np.pi, np.pi, 25)
"""Zero directions of tables [rad], the whole circle."""


def robot(limits: Limits, path: Path | None = None) -> Layout:
    """Two fins, the first with limits and, by a path, with a table of forces."""
    model = FinModelSpec("drag") if path is None else FinModelSpec("table", (("path", str(path)),))
    return Layout(
        "two", (Fin("a", (0.2, 0.1, 0.0), 0.7, limits, model), Fin("b", (-0.2, 0.1, 0.0), 2.0))
    )


@pytest.mark.parametrize("name", sorted(FIN_ROBOTS))
def test_the_shipped_robots_need_no_note(name: str) -> None:
    assert fin_notes(load_layout(name)) == ()


def test_a_fin_that_cannot_rest_is_named_with_its_forces() -> None:
    layout = robot(Limits((0.3, 0.6), (1.0, 2.0)))
    (note,) = Allocator(layout, "analytic").allocate([0.5, 0, 0, 0, 0, 0]).notes
    least, most = (4.73741 * (f * np.sin(a)) ** 2 for a, f in ((0.3, 1.0), (0.6, 2.0)))
    assert note.startswith(
        f"fin a cannot rest: within its limits it always pushes with at least {least:.3g} N"
    )
    assert f"of at most {most:.3g} N" in note
    assert Allocator(layout).allocate_batch(np.zeros((2, 6))).notes == (note,)


def test_limits_beyond_a_table_are_told_until_the_table_is_wider(tmp_path: Path) -> None:
    path = tmp_path / "fin.csv"
    write_table(path, DRAG, np.linspace(0.0, 0.5, 5), np.linspace(0.2, 2.1, 5), CIRCLE)
    notes = fin_notes(robot(Limits(), path))
    assert [note[:44] for note in notes] == [
        "fin a may be asked for half amplitudes of 0.",
        "fin a may be asked for frequencies of 0.1 to",
    ]
    assert "of 0.05 to 0.6 rad, its table holds 0 to 0.5: beyond" in notes[0]
    write_table(path, DRAG, np.linspace(0.0, 0.6, 5), np.linspace(0.1, 2.1, 5), CIRCLE)
    os.utime(path, ns=(1, 1))
    assert fin_notes(robot(Limits(), path)) == ()


@pytest.mark.parametrize(
    ("limits", "told"),
    [((-1.0, 1.0), False), ((5.4, 6.2), False), ((-np.pi, np.pi), True), ((-1.5, 0.0), True)],
)
def test_zero_directions_beyond_a_table_are_told(
    tmp_path: Path, limits: tuple[float, float], told: bool
) -> None:
    path = tmp_path / "arc.csv"
    write_table(
        path, DRAG, np.linspace(0.0, 0.6, 5), np.linspace(0.1, 2.1, 5), np.linspace(-1.0, 1.0, 9)
    )
    notes = fin_notes(robot(Limits(zero_direction=limits), path))
    assert len(notes) == told
    assert all("zero directions of" in note and "its table holds -1 to 1" in note for note in notes)


def test_a_table_of_two_lines_is_told(tmp_path: Path) -> None:
    path = tmp_path / "fin.csv"
    write_table(path, DRAG, np.array([0.0, 0.6]), np.linspace(0.1, 2.1, 5), CIRCLE)
    (note,) = fin_notes(robot(Limits(), path))
    assert note.startswith("the table of fin a has two half amplitudes alone")


def test_a_table_without_thrust_within_the_limits_is_refused(tmp_path: Path) -> None:
    amplitude = np.array([0.0, 0.2, 0.3, 0.4, 0.6])
    grid = np.stack(np.meshgrid(amplitude, [0.1, 2.1], CIRCLE, indexing="ij"), axis=-1).reshape(
        -1, 3
    )
    force = np.where(grid[:, :1] > 0.35, DRAG.force(grid), 0.0)
    rows = [",".join(f"{value:.12g}" for value in row) for row in np.hstack([grid, force])]
    (tmp_path / "fin.csv").write_text("\n".join(["A,f,phi,Fx,Fy,Fz", *rows]))
    layout = robot(Limits((0.05, 0.2)), tmp_path / "fin.csv")
    with pytest.raises(
        DataError, match="gives no thrust within its limits, amplitudes 0.05 to 0.2 rad"
    ):
        Allocator(layout, "analytic").allocate([0.5, 0, 0, 0, 0, 0])


def test_a_layout_whose_fit_is_doubtful_says_so_with_every_answer() -> None:
    from dataclasses import replace

    plain = robot(Limits())
    doubted = replace(
        plain, description="not to be trusted: it hardly moved\nfitted to 40 s of swimming"
    )
    assert fin_notes(doubted) == ("layout two is not to be trusted: it hardly moved",)
    assert fin_notes(replace(plain, description="fitted to 40 s of swimming")) == ()


def test_rudders_at_rest_are_told() -> None:
    rudder = Rudder(
        "tail", (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.03, (-0.5, 0.5), 3.0
    )
    robot = Layout("torpedo", (*load_layout("turtle_hybrid").actuators, rudder))
    assert fin_notes(robot) == (
        "rudder tail gives nothing at rest; tell how the robot moves through the water (flow)",
    )
    assert fin_notes(robot, np.array([1.0, 0, 0, 0, 0, 0])) == ()
    assert fin_notes(load_layout("turtle_hybrid")) == ()
    assert "the flow is without effect" in fin_notes(load_layout("turtle_hybrid"), np.ones(6))[-1]


def test_commands_in_words() -> None:
    assert FinCommand(0.5, 1.0, np.pi / 2).words == "0.500 rad, 1.000 Hz, 90.0 deg"
    assert ThrusterCommand(10.0, 1700.0).words == "10.000 N, input 1700"
    assert AzimuthCommand(np.pi, 10.0).words == "10.000 N at 180.0 deg"
    assert RudderCommand(-0.5).words == "-28.6 deg"


def test_tables_hold_forces_at_rest() -> None:
    rudder = Rudder(
        "tail", (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.03, (-0.5, 0.5), 3.0
    )
    rows = tuple((float(u), float(u), float(abs(u) ** 1.5)) for u in range(-20, 21))
    pusher = Thruster("stern", (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-20.0, 20.0), PowerTable(rows))
    robot = Layout("torpedo", (pusher, rudder))
    assert fin_notes(robot, np.array([1.0, 0, 0, 0, 0, 0])) == (
        "the tables of stern hold forces at rest; what speed changes is not known",
    )


WRENCH = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]
"""A wrench within reach of robot A: surge, heave and yaw [N, N m]."""


def with_models(**models: FinModelSpec) -> Layout:
    """Robot A, with other models of some fins by their names."""
    layout = load_layout("A")
    return replace(
        layout, actuators=tuple(replace(f, model=models.get(f.name, f.model)) for f in layout.fins)
    )


@pytest.mark.parametrize("method", OF_FINS)
def test_fins_that_no_network_learned_are_named(method: str) -> None:
    allocator = quick_allocator(method)
    wide = FinModelSpec("drag", (("area", 0.03),))
    layout = with_models(front_left=FinModelSpec("lighthill"), back_right=wide)
    expected = ("front_left", "back_right") if method == "paper" else ()
    assert allocator.on(layout).unknown_fins == expected
    assert allocator.on(load_layout("A")).unknown_fins == ()


@pytest.mark.parametrize("method", OF_FINS)
def test_the_note_names_the_fins_that_work(method: str) -> None:
    layout = with_models(front_left=FinModelSpec("lighthill"))
    allocator = quick_allocator(method)
    notes = allocator.allocate(layout, WRENCH).notes
    assert len(notes) == (method == "paper")
    assert all("front_left" in note and "drag" in note for note in notes)
    assert allocator.allocate(layout, WRENCH, lost=["front_left"]).notes == ()
