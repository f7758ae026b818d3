"""Layouts from and to tables."""

import math
from pathlib import Path

import pytest

import finlab
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.errors import LayoutError
from finlab.exchange import read_csv, write_csv
from tests.fin_robots import FIN_ROBOTS


def read(text: str, tmp_path: Path) -> finlab.Layout:
    path = tmp_path / "robot.csv"
    path.write_text(text)
    return read_csv(path)


def test_positions_are_enough(tmp_path: Path) -> None:
    layout = read("x_m,y_m,z_m\n0.2,0.1,0\n-0.2,0,0.05\n", tmp_path)
    assert layout.name == "robot" and layout.names == ("fin_1", "fin_2")
    assert layout.fins[0].mounting_angle == pytest.approx(math.atan2(0.1, 0.2)), "outward"
    assert layout.fins[1].limits.amplitude == (0.05, 0.6)


@pytest.mark.parametrize("name", sorted(FIN_ROBOTS))
def test_shipped_layouts_survive_the_way_there_and_back(name: str, tmp_path: Path) -> None:
    layout = finlab.load_layout(shipped_layouts()[name])
    write_csv(layout, tmp_path / "x.csv")
    for a, b in zip(layout.fins, read_csv(tmp_path / "x.csv").fins, strict=True):
        assert (a.name, a.position, a.limits) == (b.name, b.position, b.limits)
        assert a.mounting_angle == pytest.approx(b.mounting_angle, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "column 'x_m' is missing"),
        ("x_m,y_m\n1,2\n", "column 'z_m' is missing"),
        ("x_m,y_m,z_m,colour\n1,2,3,red\n", "unknown column 'colour'"),
        ("x_m,x_m,y_m,z_m\n1,1,2,3\n", "a column is given twice"),
        ("x_m,y_m,z_m\n0,zero,0\n", "row 1.y_m: expected a number, got 'zero'"),
        ("x_m,y_m,z_m\n0,0,0,0\n", "row 1: has more values than the header"),
        ("x_m,y_m,z_m\n0,0,nan\n", "row 1.position_m.2.: must lie within"),
        ("x_m,y_m,z_m\n", "expected 1 to 64 actuators, got 0"),
        ("x_m,y_m,z_m\n" + "0,0,0\n" * 65, "expected 1 to 64 fins, got more"),
    ],
)
def test_refusals_name_row_and_column(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(LayoutError, match=message):
        read(text, tmp_path)


def test_verb_imports(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("x_m,y_m,z_m,mounting_angle_deg\n0.2,0.1,0,60\n")
    made = tmp_path / "x.yaml"
    assert main(["layout", "import", str(tmp_path / "x.csv"), "-o", str(made), "--name", "mine"]) == 0
    assert finlab.load_layout(made).name == "mine"
