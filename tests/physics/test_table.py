"""The table of forces: faithful to what it was made from, smooth, periodic, and strict about its file."""

import math

import numpy as np
import pytest
import torch

from finlab.errors import DataError
from finlab.layout import Fin, FinModelSpec, Layout
from finlab.physics import Drag, Lighthill, Plant, TableFinModel, write_table

AMPLITUDE, FREQUENCY = np.linspace(0.0, 0.7, 9), np.linspace(0.0, 2.4, 9)
CIRCLE = np.linspace(-math.pi, math.pi, 25)


def commands(n, seed=0):
    unit = torch.rand(n, 3, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    return torch.tensor([0.05, 0.1, -math.pi]) + unit * torch.tensor(
        [0.55, 2.0, 2 * math.pi], dtype=torch.float64
    )


@pytest.fixture
def table(tmp_path):
    write_table(tmp_path / "drag.csv", Drag(), AMPLITUDE, FREQUENCY, CIRCLE)
    return TableFinModel(tmp_path / "drag.csv")


def test_the_grid_points_come_back_exactly_and_the_rest_closely(table):
    points = torch.tensor([[AMPLITUDE[3], FREQUENCY[5], CIRCLE[7]], [0.7, 2.4, math.pi]], dtype=torch.float64)
    torch.testing.assert_close(table.force(points), Drag().force(points), rtol=1e-8, atol=1e-8)
    u = commands(2000)
    error = (table.force(u) - Drag().force(u)).norm(dim=-1)
    assert error.mean() < 0.002 * Drag().force(u).norm(dim=-1).max()
    assert error.max() < 0.02 * Drag().force(u).norm(dim=-1).max()


def test_gradients_agree_with_differences_and_with_the_original(table):
    u = commands(20).requires_grad_()
    assert torch.autograd.gradcheck(table.force, u)
    (slope,) = torch.autograd.grad(table.force(u)[:, 1].sum(), u)
    (original,) = torch.autograd.grad(Drag().force(u)[:, 1].sum(), u)
    assert (slope - original).abs().max() < 0.15 * original.abs().max()


def test_force_and_slope_are_continuous_across_cells_and_around_the_circle(table):
    for axis, knot in [(0, AMPLITUDE[4]), (1, FREQUENCY[4]), (2, CIRCLE[4]), (2, math.pi)]:
        u = torch.tensor([[0.31, 1.37, 0.4]] * 2, dtype=torch.float64)
        u[:, axis] = torch.tensor([knot - 1e-7, knot + 1e-7])
        u.requires_grad_()
        force = table.force(u)
        (slope,) = torch.autograd.grad(force[:, 1:].sum(), u)
        torch.testing.assert_close(force[0], force[1], rtol=0, atol=1e-5)
        torch.testing.assert_close(slope[0], slope[1], rtol=0, atol=1e-4)


def test_full_circle_is_periodic_with_or_without_its_end_point(table, tmp_path):
    write_table(tmp_path / "open.csv", Drag(), AMPLITUDE, FREQUENCY, CIRCLE[:-1])
    without_end = TableFinModel(tmp_path / "open.csv")
    assert table.periodic and without_end.periodic
    u = commands(50)
    turned = u + torch.tensor([0.0, 0.0, 2 * math.pi], dtype=torch.float64)
    torch.testing.assert_close(table.force(u), table.force(turned))
    torch.testing.assert_close(table.force(u), without_end.force(u))


def test_an_arc_is_not_periodic_and_holds_at_its_ends(tmp_path):
    write_table(tmp_path / "arc.csv", Lighthill(), AMPLITUDE, FREQUENCY, np.linspace(-1.0, 1.0, 9))
    model = TableFinModel(tmp_path / "arc.csv")
    assert not model.periodic
    u = torch.tensor([[0.3, 1.0, 1.0], [0.3, 1.0, 1.4], [0.3, 1.0, 1.0 - 2 * math.pi]], dtype=torch.float64)
    force = model.force(u)
    torch.testing.assert_close(force[1:], force[:1].expand(2, 3))


def test_beyond_the_table_is_its_edge(table):
    edge = torch.tensor([0.7, 2.4, 0.3], dtype=torch.float64)
    beyond = torch.tensor([1.5, 9.0, 0.3], dtype=torch.float64)
    torch.testing.assert_close(table.force(beyond), table.force(edge))


def test_float32_and_batch_shapes(table):
    u = commands(12)
    force = table.force(u.float().reshape(3, 4, 3))
    assert force.dtype == torch.float32 and force.shape == (3, 4, 3)
    torch.testing.assert_close(force.double().reshape(12, 3), table.force(u), rtol=1e-4, atol=1e-4)


def test_forces_along_the_shaft_are_kept(tmp_path):
    rows = [f"{a},{f},{d},{a * f},{f},{d}" for a in (0, 1) for f in (1, 2) for d in (-1, 0, 1)]
    (tmp_path / "t.csv").write_text("\n".join(["A,f,phi,Fx,Fy,Fz", *rows]))
    force = TableFinModel(tmp_path / "t.csv").force(torch.tensor([0.5, 1.5, 0.25], dtype=torch.float64))
    torch.testing.assert_close(force, torch.tensor([0.75, 1.5, 0.25], dtype=torch.float64))


def test_a_layout_may_use_a_table(tmp_path):
    write_table(tmp_path / "fin.csv", Drag(), AMPLITUDE, FREQUENCY, CIRCLE)
    fin = Fin("a", (0.2, 0.1, 0.0), 0.7, model=FinModelSpec("table", (("path", str(tmp_path / "fin.csv")),)))
    command = [[0.4, 1.1, 0.9]]
    exact = Plant(Layout("drag", (Fin("a", (0.2, 0.1, 0.0), 0.7),))).wrench(command)
    np.testing.assert_allclose(Plant(Layout("table", (fin,))).wrench(command), exact, atol=0.01)


HEADER = "A,f,phi,Fx,Fy,Fz"
BLOCK = [f"{a},{f},{d},0,1,2" for a in (0.1, 0.2) for f in (1, 2) for d in (0, 1)]


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        ([], "column A is missing"),
        (["A,f,Fx,Fy,Fz", "1,2,3,4,5"], "column phi is missing"),
        (["A,f,phi,Fx,Fy,Fz,Fz", "1,2,3,4,5,6,7"], "appears twice"),
        ([HEADER], "no rows"),
        ([HEADER, "1,2,3,4"], "line 2 has 4 values"),
        ([HEADER, "1,2,x,4,5,6"], "line 2 holds something that is not a number"),
        ([HEADER, *BLOCK[:-1], "0.2,2,1,nan,1,2"], "line 9 holds a value that is not finite"),
        ([HEADER, *BLOCK[:-1]], "do not fill the grid of 2 amplitudes, 2 frequencies and 2 zero directions"),
        ([HEADER, *BLOCK, BLOCK[0]], "appears in two rows"),
        ([HEADER, *BLOCK[:4]], "column A has one value"),
        ([HEADER, *BLOCK, *(row.replace(",1,0,1,2", ",7,0,1,2") for row in BLOCK[1::2])], "span 7 rad"),
    ],
)
def test_a_bad_table_is_refused_with_file_and_place(lines, why, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("\n".join(lines))
    with pytest.raises(DataError) as caught:
        TableFinModel(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert why in str(caught.value)


def test_one_turn_apart_forces_must_agree(tmp_path):
    rows = [f"{a},{f},{d},0,{d},0" for a in (0, 1) for f in (1, 2) for d in (-3.14159265, 0, 3.14159265)]
    (tmp_path / "t.csv").write_text("\n".join([HEADER, *rows]))
    with pytest.raises(DataError, match="one turn later differ"):
        TableFinModel(tmp_path / "t.csv")


def test_a_missing_or_binary_file_is_refused(tmp_path):
    with pytest.raises(DataError, match="no such file"):
        TableFinModel(tmp_path / "missing.csv")
    (tmp_path / "b.csv").write_bytes(bytes(range(256)))
    with pytest.raises(DataError, match="cannot be read"):
        TableFinModel(tmp_path / "b.csv")
