"""Force tables inside the zip archive of a bundle."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from finlab.bundle_files import CHECKSUMS, archive_around, checksums, table_name
from finlab.errors import DataError
from finlab.layout import FinModelSpec
from finlab.physics import make_law, write_table

GRID = np.linspace(0.0, 0.6, 5), np.linspace(0.0, 2.1, 6), np.linspace(-np.pi, np.pi, 9)


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "fin.csv"
    write_table(path, make_law(FinModelSpec("soft", (("e", 0.2),))), *GRID)
    return path


def spec(path: Path) -> FinModelSpec:
    return FinModelSpec("table", (("path", str(path)),))


def test_tables_are_read_out_of_an_archive(table: Path, tmp_path: Path) -> None:
    content = table.read_bytes()
    needed = {"robot.json": b"", "bundle.json": b'{"version": 8}'}
    files = {**needed, table_name(content): content}
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as archive:
        for name, part in {**files, CHECKSUMS: checksums(files)}.items():
            archive.writestr(name, part)
    inside = tmp_path / "x.zip" / table_name(content)
    assert archive_around(inside) == str(tmp_path / "x.zip") and archive_around(table) is None
    assert archive_around(tmp_path / "y.zip" / table_name(content)) is None, "there is no such archive"
    assert archive_around(tmp_path / "x.zip" / "other" / "x.csv") is None
    command = np.array([[0.4, 1.1, 0.3]])
    np.testing.assert_array_equal(make_law(spec(inside)).force(command), make_law(spec(table)).force(command))
    with pytest.raises(DataError, match="no such file, expected a CSV table"):
        make_law(spec(inside.with_name("0" * 64 + ".csv")))
