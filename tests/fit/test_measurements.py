"""Files of a load cell: units, conventions, and a sentence for whatever is wrong with them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from finlab.arrays import Array
from finlab.errors import DataError
from finlab.fit.measurements import Measurements, read_measurements
from tests.fit.load_cell import columns_of, commands, measured, soft, write

Columns = dict[str, Array]
"""Columns of a file by their names."""


@pytest.fixture
def columns() -> Columns:
    """Columns of forty measurements of a soft fin."""
    command = commands(40)
    return columns_of(command, measured(soft(d=0.1), command))


def read(tmp_path: Path, columns: Columns) -> Measurements:
    """Measurements of a file with some columns."""
    return read_measurements([write(tmp_path / "cell.csv", columns)])


def test_a_plain_file_is_read_as_it_stands(tmp_path: Path, columns: Columns) -> None:
    measurements = read(tmp_path, columns)
    np.testing.assert_allclose(measurements.command[:, 2], columns["phi"], rtol=1e-7)
    np.testing.assert_allclose(measurements.force[:, 1], columns["Fy"], rtol=1e-7)
    assert (
        measurements.sources[3] == "cell.csv line 5"
        and measurements.notes == ()
        and measurements.has_directions
    )


def renamed(columns: Columns, name: str, header: str, factor: float) -> Columns:
    """With one column in another unit, which its header names."""
    return {k if k != name else header: v if k != name else factor * v for k, v in columns.items()}


@pytest.mark.parametrize(
    ("name", "header", "factor"),
    [
        ("A", "A [deg]", 180.0 / np.pi),
        ("A", "stroke [deg]", 360.0 / np.pi),
        ("phi", "phi_deg", 180.0 / np.pi),
        ("f", "f (rpm)", 60.0),
        ("Fy", "Fy [mN]", 1e3),
    ],
)
def test_units_stand_in_the_header(
    tmp_path: Path, columns: Columns, name: str, header: str, factor: float
) -> None:
    plain = read(tmp_path, columns)
    measurements = read(tmp_path, renamed(columns, name, header, factor))
    np.testing.assert_allclose(measurements.command, plain.command, rtol=1e-6)
    np.testing.assert_allclose(measurements.force, plain.force, rtol=1e-6, atol=1e-12)


def test_one_zero_direction_is_filled_by_symmetry_and_said(
    tmp_path: Path, columns: Columns
) -> None:
    without = {k: v for k, v in columns.items() if k not in ("phi", "Fx")}
    measurements = read(tmp_path, without)
    assert (
        not measurements.has_directions
        and "symmetry" in measurements.notes[0]
        and "along the shaft" in measurements.notes[1]
    )
    assert not read(tmp_path, columns | {"phi": 0.0 * columns["phi"] + 0.3}).has_directions


def with_empty_cell(columns: Columns, tmp_path: Path) -> Path:
    """A file one cell of which is empty."""
    path = write(tmp_path / "bad.csv", columns)
    lines = path.read_text().splitlines()
    lines[4] = ",".join(["0.3", "", *lines[4].split(",")[2:]])
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda c: {k: v[:12] for k, v in c.items()}, "12 samples, expected at least 20"),
        (lambda c: c | {"A": 0.0 * c["A"] + 0.4}, "column A has the one value 0.4 rad"),
        (lambda c: c | {"f": 0.0 * c["f"] + 1.0}, "column f has the one value 1 Hz"),
        (lambda c: c | {"Fz": 0.0 * c["Fz"] + 0.2}, "column Fz is 0.2 throughout"),
        (lambda c: c | {"Fy": 0.0 * c["Fy"], "Fz": 0.0 * c["Fz"]}, "0 throughout; such a fin drives nothing"),
        (lambda c: c | {"Fy": np.where(np.arange(40) == 7, np.nan, c["Fy"])}, "line 9, column Fy, holds"),
        (lambda c: c | {"Fx": 0.0 * c["Fx"] + 0.3}, "column Fx is 0.3 throughout; is the sensor connected"),
        (lambda c: c | {"P": 0.0 * c["Fx"] + 3.0}, "column P is 3 throughout; is the sensor connected"),
        (lambda c: c | {"phi": 0.0 * c["Fx"], "Fy": 0.0 * c["Fy"] + 2.0}, "column Fy is 2 throughout"),
        (lambda c: {k: v for k, v in c.items() if k != "Fz"}, "column Fz is missing"),
        (lambda c: {k: v for k, v in c.items() if k != "A"}, "column A is missing"),
        (lambda c: c | {"amplitude": 2.0 * c["A"]}, "two columns stand for A"),
        (lambda c: c | {"A": -c["A"]}, "half amplitudes from -0"),
        (lambda c: c | {"f": 2000.0 * c["f"]}, "expected 0 to 20"),
        (lambda c: c | {"A": np.degrees(c["A"])}, r"header, `A \[deg\]`"),
        (lambda c: c | {"phi": np.degrees(c["phi"])}, r"header, `phi \[deg\]`"),
        (lambda c: c | {"P": -c["A"]}, "expected the mean power that drives the fin"),
    ],
)  # fmt: skip
def test_bad_files_get_a_sentence(
    tmp_path: Path, columns: Columns, change: Callable[[Columns], Columns], sentence: str
) -> None:
    with pytest.raises(DataError, match=sentence) as raised:
        read(tmp_path, change(columns))
    assert "cell.csv" in str(raised.value)


def test_a_gap_a_short_line_and_no_file(tmp_path: Path, columns: Columns) -> None:
    with pytest.raises(DataError, match="line 5, column f, is empty; leave no gaps"):
        read_measurements([with_empty_cell(columns, tmp_path)])
    path = write(tmp_path / "short.csv", columns)
    path.write_text(path.read_text() + "1,2\n")
    with pytest.raises(DataError, match="line 42 has 2 values, the header has 6"):
        read_measurements([path])
    with pytest.raises(DataError, match=r"nowhere\.csv: no such file"):
        read_measurements([tmp_path / "nowhere.csv"])
    with pytest.raises(DataError, match="at least one CSV file"):
        read_measurements([])
    with pytest.raises(DataError, match=r"/dev/zero: is not a regular file"):
        read_measurements(["/dev/zero"])
    with (tmp_path / "huge.csv").open("wb") as file:
        file.truncate(10_000_000_000)  # sparse: it takes no room
    with pytest.raises(DataError, match=r"huge\.csv: is larger than 200,000,000 bytes"):
        read_measurements([tmp_path / "huge.csv"])
