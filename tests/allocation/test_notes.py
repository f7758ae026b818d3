"""What is said of a robot's fins: those that cannot rest, and those whose limits leave their table."""

import os
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.allocation.notes import fin_notes
from finlab.errors import DataError
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout
from finlab.physics import make_law, write_table
from tests.fin_robots import FIN_ROBOTS

DRAG = make_law(FinModelSpec("drag"))
CIRCLE = np.linspace(-np.pi, np.pi, 25)


def robot(limits: Limits, path: Path | None = None) -> Layout:
    model = FinModelSpec("drag") if path is None else FinModelSpec("table", (("path", str(path)),))
    return Layout("two", (Fin("a", (0.2, 0.1, 0.0), 0.7, limits, model), Fin("b", (-0.2, 0.1, 0.0), 2.0)))


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
    write_table(path, DRAG, np.linspace(0.0, 0.6, 5), np.linspace(0.1, 2.1, 5), np.linspace(-1.0, 1.0, 9))
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
    grid = np.stack(np.meshgrid(amplitude, [0.1, 2.1], CIRCLE, indexing="ij"), axis=-1).reshape(-1, 3)
    force = np.where(grid[:, :1] > 0.35, DRAG.force(grid), 0.0)
    rows = [",".join(f"{value:.12g}" for value in row) for row in np.hstack([grid, force])]
    (tmp_path / "fin.csv").write_text("\n".join(["A,f,phi,Fx,Fy,Fz", *rows]))
    layout = robot(Limits((0.05, 0.2)), tmp_path / "fin.csv")
    with pytest.raises(DataError, match="gives no thrust within its limits, amplitudes 0.05 to 0.2 rad"):
        Allocator(layout, "analytic").allocate([0.5, 0, 0, 0, 0, 0])


def test_a_layout_whose_fit_is_doubtful_says_so_with_every_answer() -> None:
    from dataclasses import replace

    plain = robot(Limits())
    doubted = replace(plain, description="not to be trusted: it hardly moved\nfitted to 40 s of swimming")
    assert fin_notes(doubted) == ("layout two is not to be trusted: it hardly moved",)
    assert fin_notes(replace(plain, description="fitted to 40 s of swimming")) == ()
