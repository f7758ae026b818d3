"""A whole report at a tiny size; then again from what was kept, killed, and on a full disk."""

import io
import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from finlab.cli import main
from finlab.errors import DataError
from finlab.evaluation.report import jobs, make
from finlab.evaluation.report.jobs import Part, run_parts
from finlab.evaluation.report.make import PAGE, PICTURES, TABLES, make_report

pytest.importorskip("matplotlib")
pytest.importorskip("casadi")

TINY: dict[str, dict[str, Any]] = {
    "wrench": {"split": ("id", "tables"), "methods": ("dual", "qp"), "layouts": 2, "targets": 2},
    "cost": {"split": ("id",), "methods": ("dual",), "layouts": 2, "targets": 1, "starts": 4},
    "latency": {"robots": ("fins-2", "new-fins"), "methods": ("dual", "qp"), "calls": 2, "new": 1},
    "ablation": {"variants": ("ours",), "layouts": 2, "targets": 1, "candidates": 4},
    "proposals": {"split": ("id",), "layouts": 2, "targets": 2, "candidates": (4,)},
    "temperature": {"temperatures": (0.01, 1.0), "layouts": 2, "targets": 1, "candidates": 4},
}
FINLAB = [sys.executable, "-m", "finlab"]
SOME = ["eval", "report", "--quick", "--sections", "temperature", "--processes", "2", "-o"]


@pytest.fixture(scope="module")
def tiny() -> Iterator[None]:
    """Experiments with quick sizes that take a second."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(make, "EXPERIMENTS", dict.fromkeys(TINY))
        for name, sizes in TINY.items():
            module = import_module(f"finlab.evaluation.experiments.{name}")
            patch.setattr(module, "experiment", replace(module.experiment, quick=sizes))
        yield


@pytest.fixture(scope="module")
def folder(tiny: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report")
    make_report(out, size="quick", seed=3, processes=0)
    return out


def without_times(rows: Any) -> Any:
    """Rows without what the machine decides."""
    timed = ("p50_over_dual", "per_s")
    if isinstance(rows, dict):
        return {k: without_times(v) for k, v in rows.items() if not ("_ms" in k or k in timed)}
    return [without_times(row) for row in rows] if isinstance(rows, list) else rows


def test_page_pictures_and_rows_say_the_same(folder: Path) -> None:
    page = (folder / PAGE).read_text("utf-8")
    tables = json.loads((folder / TABLES).read_text("utf-8"))
    assert list(tables) == list(TINY)
    for words in ("How far off are the wrenches", "0.086", "seed 3"):
        assert words in page
    names = {path.name for path in (folder / PICTURES).iterdir()}
    assert names == {"wrench.svg", "cost.svg", "temperature.svg"}
    assert all(f"]({PICTURES}/{name})" in page for name in names)
    for name, rows in tables.items():
        assert rows and f"## {name.capitalize()}" in page
    assert [row["split"] for row in tables["wrench"]] == ["id", "id", "tables", "tables"]


def test_two_reports_of_one_seed_have_the_same_rows(folder: Path, tmp_path: Path) -> None:
    """In another order, and with parts in one run that were parts of another."""
    again = tmp_path / "again"
    for names in (["temperature", "latency"], ["cost"], ["all"]):
        make_report(again, size="quick", seed=3, names=names, processes=0)
    first, second = (json.loads((out / TABLES).read_text("utf-8")) for out in (folder, again))
    assert without_times(first) == without_times(second)


def test_a_part_is_run_once_and_other_code_is_another_part(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = {path: path.stat().st_mtime_ns for path in (folder / "records").iterdir()}
    make_report(folder, size="quick", seed=3, processes=0)
    assert {path: path.stat().st_mtime_ns for path in (folder / "records").iterdir()} == before
    part = Part("temperature", {"temperatures": [1.0], "layouts": 2}, "code")
    assert part.path(folder) != replace(part, source="other code").path(folder)
    assert part.path(folder) != replace(part, options={**part.options, "layouts": 3}).path(folder)


def test_a_damaged_record_is_named(folder: Path, tmp_path: Path) -> None:
    part = Part("temperature", {"temperatures": [1.0]}, "code")
    part.path(tmp_path).write_text('{"rows": [')
    with pytest.raises(DataError, match="temperature-1.0-.*: not a file of rows .*delete it and run again"):
        part.rows(tmp_path)


def test_progress_is_shown_before_the_first_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    seen: list[str] = []
    monkeypatch.setattr(Part, "run", lambda *_: seen.append(shown.getvalue()))
    run_parts([Part("temperature", {"temperatures": [1.0]}, "code")], tmp_path, processes=0)
    assert "0/1" in seen[0] and "temperature-1.0" in seen[0]


def processes_of(group: int) -> list[int]:
    """Processes of a group that have not ended."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, of = path.read_text().rpartition(")")[2].split()[:3]
        except (OSError, ValueError):
            continue
        if int(of) == group and state != "Z":
            found.append(int(path.parent.name))
    return found


@pytest.mark.parametrize("how", [pytest.param(signal.SIGTERM, marks=pytest.mark.exhaustive), signal.SIGKILL])
def test_workers_end_with_their_report(how: signal.Signals, tmp_path: Path) -> None:
    """And the report goes on from what was kept."""
    run = subprocess.Popen([*FINLAB, *SOME, str(tmp_path)], start_new_session=True, stderr=subprocess.DEVNULL)
    records = tmp_path / "records"
    while not (records.is_dir() and list(records.glob("*.json"))):
        assert run.poll() is None
        time.sleep(0.02)
    assert len(processes_of(run.pid)) >= 3
    run.send_signal(how)
    assert run.wait() == -how
    end = time.monotonic() + 30.0
    while processes_of(run.pid) and time.monotonic() < end:
        time.sleep(0.05)
    assert processes_of(run.pid) == []
    assert not [path for path in tmp_path.rglob("*") if path.is_file() and path.suffix != ".json"]


def test_a_full_disk_is_a_sentence_with_the_path(tiny: None, tmp_path: Path) -> None:
    """Files may grow to 4 kB: records fit, the pictures do not."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4000, hard))
    try:
        with pytest.raises(DataError, match=r"pictures/.*svg: cannot be written: File too large"):
            make_report(tmp_path, size="quick", names=["temperature"], processes=0)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(files) == 2 and all(json.loads(path.read_text())["rows"] for path in files)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("-o README.md", "out: expected a folder, got the file README.md"),
        ("-o somewhere --processes 0", "processes: expected a number of at least 1, got 0"),
        ("-o somewhere --sections nothing", "sections: expected all or some of wrench, cost"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: str, message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(jobs.__file__).parents[3])
    assert main(["eval", "report", *arguments.split()]) == 2
    error = capsys.readouterr().err
    assert error.startswith("finlab: error: ") and message in error and error.count("\n") == 1
    assert not os.path.exists("somewhere")
