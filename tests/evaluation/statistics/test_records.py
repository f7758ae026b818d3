"""Records in files, and results that are found again."""

from pathlib import Path

import numpy as np
import pytest

from finlab.errors import DataError
from finlab.evaluation.report.jobs import Store, columns_of_rows, rows_of_columns
from finlab.evaluation.statistics.records import (
    Records,
    columns_of_records,
    join_records,
    load_columns,
    records_of_columns,
    same_targets,
    save_columns,
)


def _records(layout: list[int], target: list[int], error: list[float]) -> Records:
    n = len(layout)
    whole, real = np.array(layout), np.array(error)
    return Records(whole, np.array(target), np.full(n, 4), real, real, real, np.zeros(n, int), real)


def test_a_file_gives_back_what_was_kept(tmp_path: Path) -> None:
    records = _records([0, 0, 1], [0, 1, 0], [1.0, 2.0, 3.0])
    path = tmp_path / "new" / "some.npz"
    save_columns(path, columns_of_records(records) | {"command": np.ones((3, 2))}, {"seed": 7})
    columns, meta = load_columns(path)
    assert meta == {"seed": 7} and columns["command"].shape == (3, 2)
    again = records_of_columns(columns)
    for name, values in columns_of_records(records).items():
        np.testing.assert_array_equal(getattr(again, name), values)
    assert [p.name for p in path.parent.iterdir()] == ["some.npz"]


def test_what_is_no_file_of_records_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "some.npz"
    with pytest.raises(DataError, match="some.npz: not a file of records"):
        load_columns(path)
    path.write_bytes(b"PK\x03\x04 cut off")
    with pytest.raises(DataError, match="delete it and run again"):
        load_columns(path)


def test_the_same_targets_of_two_methods() -> None:
    many = _records([0, 0, 0, 1, 1, 1], [0, 1, 2, 0, 1, 2], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    few = _records([0, 1], [1, 0], [10.0, 30.0])
    ours, theirs = same_targets(many, few)
    assert ours.err_norm.tolist() == [1.0, 3.0] and theirs.err_norm.tolist() == [10.0, 30.0]
    with pytest.raises(DataError, match="share no target"):
        same_targets(few, _records([5], [5], [0.0]))


def test_join_and_select() -> None:
    both = join_records([_records([0], [0], [1.0]), _records([1], [0], [2.0])])
    assert len(both) == 2 and both.select(both.layout == 1).err_norm.tolist() == [2.0]


def test_a_result_is_made_once(tmp_path: Path) -> None:
    store, made = Store(tmp_path), []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return {"values": np.arange(3)}

    first = store.keep("job", {"seed": 0}, make, commit="abc")
    again = store.keep("job", {"seed": 0}, make)
    store.keep("job", {"seed": 1}, make)
    assert len(made) == 2
    np.testing.assert_array_equal(first.columns["values"], again.columns["values"])
    assert again.meta["commit"] == "abc" and again.meta["settings"] == {"seed": 0}
    assert store.has("job", {"seed": 1}) and not store.has("job", {"seed": 2})


def test_rows_travel_as_text() -> None:
    rows = [{"method": "qp", "value": 0.1, "missing": None}, {"method": "sqp"}]
    assert rows_of_columns(columns_of_rows(rows)) == rows
