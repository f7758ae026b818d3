"""`finlab bench` through `main`: table, page, results, and one sentence for what is wrong."""

import json
import sys
from pathlib import Path

import pytest

from finlab.bench.page import rows_of, summary_blocks
from finlab.bench.problems import Problems
from finlab.bench.results import comparable, read_results, stored_results
from finlab.cli import main
from finlab.errors import DataError
from finlab.evaluation.report.numbers import error
from finlab.evaluation.report.text import to_text

METHODS = Path(__file__).with_name("methods.py")


def test_a_strangers_function_and_program(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page, file = tmp_path / "p.html", tmp_path / "r.json"
    program = f"{sys.executable} -c 'import sys; [print(line, flush=True) for line in sys.stdin]'"
    arguments = [f"{METHODS}:rests", "analytic", "--command", program, "--quick", "--sets", "paper"]
    assert main(["bench", *arguments, "--page", str(page), "--json", str(file)]) == 0
    shown = capsys.readouterr().out
    rows = read_results(file)["methods"]
    assert [row["method"] for row in rows[:2]] == ["methods.py:rests", "analytic"]
    for row in rows:
        assert f"`{row['method']}`" in shown
    assert rows[1]["summary"]["failed"] == 0.0 and rows[2]["summary"]["failed"] == 1.0
    html = page.read_text()
    assert "<svg" in html and "methods.py:rests" in html and 'href="http' not in html and "src=" not in html
    assert html.count("<table") == 5


def test_results_are_plain_and_versioned(tmp_path: Path) -> None:
    file = tmp_path / "r.json"
    assert main(["bench", "analytic", "--quick", "--sets", "tiny", "--json", str(file)]) == 0
    found = read_results(file)
    assert found["command"] == "finlab bench analytic --sets tiny --quick" and found["seed"] == 8821
    assert set(found["machine"]) >= {"processor", "cores", "python"}
    for wrong in ({**found, "version": 2}, {**found, "format": "other"}, [found]):
        file.write_text(json.dumps(wrong))
        with pytest.raises(DataError, match="expected finlab-bench-results of version 1"):
            read_results(file)


@pytest.mark.parametrize("quick", [True, False])
def test_stored_results_belong_to_the_shipped_problems(quick: bool, shipped: Problems) -> None:
    stored = comparable(shipped, quick=quick, together=False)
    assert stored is not None and stored == read_results(stored_results(quick))
    assert comparable(shipped, quick=quick, together=True) is None
    asked = shipped.quick() if quick else shipped
    calls = len(asked.targets.robot) + asked.sequences.best_error.size
    assert {row["summary"]["calls"] for row in stored["methods"]} == {calls}
    search = next(row["summary"] for row in stored["methods"] if row["method"] == "search")
    assert search["failed"] == 0.0 and search["solved"] > 0.99
    shown = to_text(*summary_blocks(rows_of({"methods": stored["methods"][:1]}, stored), stored))
    assert "Not of this run but stored: `search-effort`, `analytic`" in shown.replace("\n", " ")
    assert "stored" not in to_text(*summary_blocks(rows_of(stored, stored), stored))
    assert stored["seed"] == shipped.about["seed"] and stored["command"].startswith("finlab bench ")


def test_documented_figures_are_the_stored_ones() -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "bench.md").read_text()
    for row in read_results(stored_results(quick=False))["methods"]:
        summary = row["summary"]
        solved, turn = f"{100 * summary['solved']:.1f}".removesuffix(".0"), f"{summary['turn']:.3f}"
        line = next(line for line in page.splitlines() if line.startswith(f"| `{row['method']}` | 0 %"))
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        assert cells[2].removesuffix(" %").removesuffix(".0") == solved and cells[8] == turn
        assert cells[3] == error(summary["error"]) and cells[5] == error(summary["beyond"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("nonsense", "expected one of search, mdn"),
        ("search search", "expected different names, got search, search"),
        ("--limit 0", "limit: expected a number of seconds above 0, got 0.0"),
        ("--sets nowhere", "sets: expected some of paper, shipped"),
        ("--problems missing.npz", "missing.npz: cannot be read"),
        ("--problems README.md", "README.md: is no file of problems"),
        ("--page no/such/folder.html", "expected a file in an existing folder"),
        ("README.md:f --sets paper", "README.md"),
        ("--command /no/such/program --sets paper", "/no/such/program: cannot be started"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: str, message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(__file__).resolve().parents[2])
    assert main(["bench", *arguments.split()]) == 2
    error = capsys.readouterr().err
    assert error.startswith("finlab: error: ") and message in error and error.count("\n") == 1
