"""Records in files, and results that are found again."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from finlab.errors import DataError
from finlab.evaluation.report.jobs import Job, columns_of_rows, rows_of_columns, run_jobs
from finlab.evaluation.statistics.records import (
    Columns,
    Records,
    columns_of_records,
    join_records,
    load_columns,
    records_of_columns,
    save_columns,
)


def _records(layout: list[int], target: list[int], error: list[float]) -> Records:
    n = len(layout)
    whole, real = np.array(layout), np.array(error)
    return Records(whole, np.array(target), np.full(n, 4), real, real, real, real, np.zeros(n, int), real)


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


def test_join_and_select() -> None:
    both = join_records([_records([0], [0], [1.0]), _records([1], [0], [2.0])])
    assert len(both) == 2 and both.select(both.layout == 1).err_norm.tolist() == [2.0]


MADE: list[int] = []


def _work(*, seed: int, checkpoint: str) -> Columns:
    MADE.append(seed)
    return {"values": np.arange(3)}


def test_a_result_is_made_once(tmp_path: Path) -> None:
    MADE.clear()
    jobs = [Job("job", _work, {"seed": seed}, "print", {"checkpoint": "here"}) for seed in (0, 1, 2)]
    run_jobs(jobs[:1], tmp_path, commit="abc", processes=0)
    run_jobs(jobs[:2], tmp_path, commit="def", processes=0)
    assert MADE == [0, 1]
    (columns, made), (_, later) = (job.result(tmp_path) for job in jobs[:2])
    np.testing.assert_array_equal(columns["values"], np.arange(3))
    assert (made["commit"], later["commit"]) == ("abc", "def")
    assert made["settings"] == {"work": "_work", "prints": "print", "seed": 0}
    assert [job.done(tmp_path) for job in jobs] == [True, True, False]


def test_what_measures_time_runs_last_and_other_weights_are_other_work(tmp_path: Path) -> None:
    MADE.clear()
    timed = Job("timed", _work, {"seed": 1}, "print", {"checkpoint": "here"}, alone=True)
    job = Job("job", _work, {"seed": 2}, "print", {"checkpoint": "here"})
    run_jobs([timed, job], tmp_path, commit="abc", processes=0)
    assert MADE == [2, 1]
    assert not replace(job, prints="other").done(tmp_path)
    assert replace(job, context={"checkpoint": "there"}).done(tmp_path)


def _count_threads() -> Columns:
    return {"threads": np.array([pool["num_threads"] for pool in threadpool_info()])}


def test_a_part_runs_on_one_thread(tmp_path: Path) -> None:
    job = Job("threads", _count_threads, {}, "print", alone=True)
    with threadpool_limits(2):
        assert _count_threads()["threads"].max() == 2
        run_jobs([job], tmp_path, commit="abc")
        assert _count_threads()["threads"].max() == 2
    assert job.result(tmp_path)[0]["threads"].max() == 1


def test_rows_travel_as_text() -> None:
    rows = [{"method": "qp", "value": 0.1, "missing": None}, {"method": "sqp"}]
    assert rows_of_columns(columns_of_rows(rows)) == rows
