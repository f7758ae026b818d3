"""`finlab bench` through `main`: table, results, progress, and one sentence for what is wrong."""

import json
from pathlib import Path

import pytest

from finlab.bench.problems import Problems
from finlab.bench.results import stored
from finlab.bench.table import text
from finlab.cli import main
from tests.terminal import first_shown

METHODS = Path(__file__).with_name("methods.py")
ROOT = Path(__file__).resolve().parents[2]


def test_a_strangers_function(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "r.json"
    arguments = [f"{METHODS}:rests", "analytic", f"{METHODS}:raises", "--quick", "--sets", "paper"]
    assert main(["bench", *arguments, "--limit", "30", "--json", str(file)]) == 0
    shown = capsys.readouterr().out
    found = json.loads(file.read_text())
    assert (found["format"], found["version"], found["seed"]) == ("finlab-bench-results", 2, 8821)
    assert found["command"].startswith("finlab bench ") and found["command"].endswith(
        "--sets paper --quick --limit 30"
    )
    rows = found["methods"]
    assert [row["method"] for row in rows[:2]] == ["methods.py:rests", "analytic"]
    assert all(f"\n{row['method']} " in shown for row in rows)
    assert rows[1]["summary"]["failed"] == 0.0 and rows[2]["summary"]["failed"] == 1.0
    assert f"{rows[2]['summary']['calls']} calls failed (exception): RuntimeError: no idea" in shown


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux")
def test_a_full_disk_does_not_cost_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "analytic", "--quick", "--sets", "tiny", "--json", "/dev/full"]) == 2
    shown = capsys.readouterr()
    assert "analytic" in shown.out and "p99 [ms]" in shown.out
    assert shown.err == "finlab: error: /dev/full: cannot be written: No space left on device\n"
    assert not Path("/dev/full").is_file()


def test_progress_is_shown_at_once() -> None:
    shown, spent = first_shown("bench", "analytic", "--quick", "--sets", "paper")
    assert "bench" in shown
    assert spent < 1.5, "the processor's time until a bar is there [s]"


def test_stored_results_belong_to_the_shipped_problems(shipped: Problems) -> None:
    for quick in (True, False):
        found = stored(shipped, quick=quick)
        assert found is not None and found["quick"] == quick
        asked = shipped.quick() if quick else shipped
        calls = len(asked.targets.robot) + asked.sequences.best_error.size
        assert {row["summary"]["calls"] for row in found["methods"]} == {calls}
        search = next(row["summary"] for row in found["methods"] if row["method"] == "dual")
        assert search["failed"] == 0.0 and search["solved"] > 0.99
        assert "Stored, not of this run: " in text({"methods": found["methods"][:1]}, found)
        assert "Stored" not in text(found, found)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("nonsense", "expected one of dual, mdn"),
        ("dual dual", "expected different names, got dual, dual"),
        ("--limit 0", "limit: expected a number of seconds above 0, got 0.0"),
        ("--sets nowhere", "sets: expected some of paper, shipped"),
        ("README.md:f --sets paper", "README.md"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: str, message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    assert main(["bench", *arguments.split()]) == 2
    error = capsys.readouterr().err
    assert error.startswith("finlab: error: ") and message in error and error.count("\n") == 1
