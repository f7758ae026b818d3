"""CSV files of swims: what is read, and one sentence for whatever is wrong with them."""

import csv
from pathlib import Path

import numpy as np
import pytest

from finlab.errors import DataError
from finlab.layout import Layout, load_layout
from finlab.swim.identification.swim import read_swim, smoothed
from tests.swim.identification.swims import write_csv

N_STEPS = 400
"""Length of a swim."""


@pytest.fixture(scope="module")
def pair() -> Layout:
    """Two fins."""
    return load_layout("pair")


@pytest.fixture(scope="module")
def made() -> tuple[np.ndarray, np.ndarray]:
    """Commands and measurements of a made-up swim."""
    rng = np.random.default_rng(0)
    command = np.tile([0.4, 1.0, 0.3], (N_STEPS, 2, 1)) + 0.01 * rng.standard_normal(
        (N_STEPS, 2, 3)
    )
    return command, 0.1 * rng.standard_normal((N_STEPS, 12)).cumsum(axis=0) / 10.0


Rows = list[list[str]]
"""Cells of a file of CSV."""


@pytest.fixture
def rows(pair: Layout, made: tuple[np.ndarray, np.ndarray], tmp_path: Path) -> Rows:
    """Cells of a good file."""
    write_csv(tmp_path / "whole.csv", pair, *made)
    with (tmp_path / "whole.csv").open(newline="") as file:
        return list(csv.reader(file))


def read(rows: Rows, layout: Layout, tmp_path: Path) -> object:
    """Read cells as a file of a swim."""
    with (tmp_path / "swim.csv").open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    return read_swim(tmp_path / "swim.csv", layout)


def test_columns_in_any_order_with_units_and_strangers(
    rows: Rows, pair: Layout, tmp_path: Path, made: tuple[np.ndarray, np.ndarray]
) -> None:
    plain = read(rows, pair, tmp_path)
    turned = [row[::-1] + ["7"] for row in rows]
    turned[0][-1] = "battery [V]"
    at = turned[0].index("yaw")
    turned[0][at] = "yaw [deg]"
    for row in turned[1:]:
        row[at] = repr(float(np.degrees(float(row[at]))))
    again = read(turned, pair, tmp_path)
    np.testing.assert_allclose(again.measured, plain.measured, atol=1e-9)
    np.testing.assert_allclose(plain.measured[1:], made[1][1 : N_STEPS - 1], atol=1e-6)
    np.testing.assert_array_equal(again.motion, plain.motion)


def test_what_is_empty_or_held_is_not_new(rows: Rows, pair: Layout, tmp_path: Path) -> None:
    u = rows[0].index("u")
    v = rows[0].index("v")
    for k, row in enumerate(rows[1:]):
        if k % 2:
            row[u] = ""
            row[v] = rows[k][v]
    swim = read(rows, pair, tmp_path)
    known = np.isfinite(swim.measured)
    assert known[::2, 6].all() and not known[1::2, 6].any()
    np.testing.assert_array_equal(known[:, 7], known[:, 6])
    full = smoothed(swim.measured)
    assert np.isfinite(full).all()


def test_a_fin_without_commands_was_lost(rows: Rows, pair: Layout, tmp_path: Path) -> None:
    for row in rows[200:]:
        row[-3:] = ["", "", ""]
    swim = read(rows, pair, tmp_path)
    assert np.isnan(swim.motion[200:, :, 1]).all() and (swim.motion[150:199, :, 1, 0] > 0.2).all()


def _set(rows: Rows, line: int, name: str, value: str) -> None:
    """Write a cell by its line, counted from one, and its column."""
    rows[line - 1][rows[0].index(name)] = value


def test_time_must_rise_without_gaps(rows: Rows, pair: Layout, tmp_path: Path) -> None:
    _set(rows, 50, "t", "0.5")
    with pytest.raises(
        DataError, match="swim.csv line 50, column t: 0.5 s after 4.7 s, expected times that rise"
    ):
        read(rows, pair, tmp_path)


@pytest.mark.parametrize("column", ["u", "roll"])
def test_constant_columns_are_refused(
    rows: Rows, pair: Layout, tmp_path: Path, column: str
) -> None:
    for line in range(2, len(rows) + 1):
        _set(rows, line, column, "0.25")
    with pytest.raises(
        DataError, match=f"column {column} is 0.25 throughout; is the sensor connected"
    ):
        read(rows, pair, tmp_path)


@pytest.mark.parametrize(
    ("missing", "why"),
    [
        (("t",), "column t is missing"),
        (("bow.f",), "column bow.f is missing"),
        (("x", "u"), "column x or u is missing"),
        (("yaw", "r"), "column yaw or r is missing"),
    ],
)
def test_missing_columns_are_named(
    rows: Rows, pair: Layout, tmp_path: Path, missing: tuple[str, ...], why: str
) -> None:
    layout = pair.replace_actuator(pair.names[0], name="bow")
    rows[0] = [name.replace(f"{pair.names[0]}.", "bow.") for name in rows[0]]
    keep = [k for k, name in enumerate(rows[0]) if name not in missing]
    with pytest.raises(DataError, match=why):
        read([[row[k] for k in keep] for row in rows], layout, tmp_path)


@pytest.mark.parametrize(
    ("column", "value", "why"),
    [
        ("w", "wet", "line 70, column w, holds 'wet', which is not a number"),
        ("w", "inf", "line 70, column w, holds 'inf'"),
        ("t", "", "line 70, column t: nan s after"),
        ("FIN.A", "45", "line 70, column FIN.A, holds 45, expected half amplitudes in rad"),
        ("FIN.f", "-1", "line 70, column FIN.f, holds -1, expected Hz"),
        ("FIN.phi", "", "line 70: of FIN.A, FIN.f, FIN.phi some are empty"),
    ],
)
def test_cells_that_cannot_be_are_told_with_line_and_column(
    rows: Rows, pair: Layout, tmp_path: Path, column: str, value: str, why: str
) -> None:
    fin = pair.names[0]
    _set(rows, 70, column.replace("FIN", fin), value)
    with pytest.raises(DataError, match=why.replace("FIN", fin)):
        read(rows, pair, tmp_path)


def test_other_files_are_refused(rows: Rows, pair: Layout, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"none.csv: no such file"):
        read_swim(tmp_path / "none.csv", pair)
    (tmp_path / "log.npz").write_bytes(b"nothing")
    with pytest.raises(DataError, match="expected a swim log written by finlab simulate"):
        read_swim(tmp_path / "log.npz", pair)
    rows[9].append("1")
    with pytest.raises(DataError, match=r"line 10 has 20 values, the header has 19"):
        read(rows, pair, tmp_path)
    rows[9].pop()
    rows[0][2] = "x"
    with pytest.raises(DataError, match="two columns stand for x"):
        read(rows, pair, tmp_path)


def test_logs_of_another_robot_are_refused(pair: Layout, tmp_path: Path) -> None:
    from finlab.swim.simulation.excite import excitation

    excitation(pair, 30.0).run().save(tmp_path / "log.npz")
    with pytest.raises(DataError, match="is of a robot with the actuators"):
        read_swim(tmp_path / "log.npz", load_layout("A"))
    assert len(read_swim(tmp_path / "log.npz", pair)) == 300


def test_thrusters_and_azimuths_are_commanded_by_force_and_angle(
    rows: Rows, tmp_path: Path
) -> None:
    layout = load_layout("catamaran")
    left, right, bow = layout.names
    parts = [
        f"{left}.angle [deg]",
        f"{left}.force [N]",
        f"{right}.angle",
        f"{right}.force",
        f"{bow}.force",
    ]
    made = [rows[0][:13] + parts] + [row[:13] + ["90", "20", "0", "5", "-3"] for row in rows[1:]]
    for row in made[200:]:
        row[-1] = ""
    swim = read(made, layout, tmp_path)
    np.testing.assert_allclose(
        swim.motion[190, -1], [[np.pi / 2, 20, 0], [0, 5, 0], [-3, 0, 0]], atol=1e-3
    )
    assert np.isnan(swim.motion[200:, :, 2]).all() and np.isfinite(swim.motion[:, :, :2]).all()
    made[50][-2] = "500"
    with pytest.raises(
        DataError, match=f"line 51, column {right}.force, holds 500, expected N from"
    ):
        read(made, layout, tmp_path)
