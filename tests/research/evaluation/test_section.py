"""Sections of a report: pieces that go on after a stop, and know what they depend on."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from finlab.errors import DataError
from finlab.research.evaluation import section, source_hash
from finlab.research.evaluation.document import Column, Row
from finlab.research.evaluation.experiment import EXPERIMENTS, Experiment, load_experiment
from finlab.research.evaluation.section import (
    METHOD_PACKAGES,
    made_section,
    packages_of,
    piece_options,
    read_section,
    rows_of,
    same_figures,
    stale_packages,
)
from finlab.research.evaluation.source_hash import TREE, meaning, package_hashes

runs: list[tuple[str, int]] = []
"""Options of each run of the experiment below, in order."""


def _run(names: tuple[str, ...] = ("a", "b"), size: int = 4) -> Iterator[Row]:
    """A row for each name."""
    for name in names:
        runs.append((name, size))
        yield {"name": name, "size": size, "value": 0.1 * size, "took_ms": time.monotonic()}


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A source tree with one file that the experiment below measures."""
    runs.clear()
    (tmp_path / "law.py").write_text("FORCE = 2.0\n")
    monkeypatch.setattr(source_hash, "TREE", tmp_path)
    return tmp_path


EXPERIMENT = Experiment(
    name="letters",
    question="Which letters are there?",
    columns=(Column("name", "name"),),
    run=_run,
    pieces=("names",),
    measures=("law.py",),
    probe={"size": 1},
)
"""An experiment of two pieces."""


def test_what_is_there_is_not_run_again(tree: Path) -> None:
    first = made_section(EXPERIMENT, {}, tree)
    assert runs == [("a", 1), ("a", 4), ("b", 1), ("b", 4)], "each with its probe"
    assert made_section(EXPERIMENT, {}, tree) == first and len(runs) == 4
    assert [row["name"] for row in rows_of(EXPERIMENT, first)] == ["a", "b"]
    made_section(EXPERIMENT, {"size": 5}, tree)
    assert runs[4:] == [("a", 1), ("a", 5), ("b", 1), ("b", 5)]


def test_a_section_that_was_stopped_goes_on(tree: Path) -> None:
    whole = made_section(EXPERIMENT, {}, tree)
    path = tree / "sections" / "letters.json"
    values = json.loads(path.read_text())
    path.write_text(json.dumps({"pieces": values["pieces"][:1]}))
    runs.clear()
    again = made_section(EXPERIMENT, {}, tree)
    assert runs == [("b", 1), ("b", 4)] and again[0] == whole[0]


def test_words_in_comments_make_nothing_old(tree: Path) -> None:
    pieces = made_section(EXPERIMENT, {}, tree)
    (tree / "law.py").write_text('"""The force."""\n\nFORCE  = 2.0  # newtons\n')
    assert stale_packages(EXPERIMENT, pieces[0]) == []
    (tree / "law.py").write_text("FORCE = 2.5\n")
    assert stale_packages(EXPERIMENT, pieces[0]) == ["law.py"]


def test_a_probe_that_gives_the_same_figures_is_enough(tree: Path) -> None:
    made_section(EXPERIMENT, {}, tree)
    (tree / "law.py").write_text("FORCE = 4.0 / 2.0\n")
    stored = read_section(tree / "sections" / "letters.json")
    assert stale_packages(EXPERIMENT, stored[0]) == ["law.py"]
    runs.clear()
    pieces = made_section(EXPERIMENT, {}, tree)
    assert runs == [("a", 1), ("b", 1)]
    assert all(piece.checked and stale_packages(EXPERIMENT, piece) == [] for piece in pieces)
    assert pieces[0].rows == stored[0].rows


def test_a_probe_that_gives_other_figures_runs_the_piece_again(tree: Path) -> None:
    pieces = made_section(EXPERIMENT, {}, tree)
    path = tree / "sections" / "letters.json"
    values = json.loads(path.read_text())
    values["pieces"][0]["probe"][0]["value"] = 7.0
    path.write_text(json.dumps(values))
    (tree / "law.py").write_text("FORCE = 3.0\n")
    runs.clear()
    again = made_section(EXPERIMENT, {}, tree)
    assert runs == [("a", 1), ("a", 4), ("b", 1)]
    assert again[0].checked == "" and again[0].measured != pieces[0].measured


def test_without_a_probe_the_piece_is_run_again(tree: Path) -> None:
    without = replace(EXPERIMENT, probe={})
    made_section(without, {}, tree)
    (tree / "law.py").write_text("FORCE = 3.0\n")
    made_section(without, {}, tree)
    assert runs == [("a", 4), ("b", 4)] * 2


def test_a_damaged_section_is_one_sentence(tree: Path) -> None:
    made_section(EXPERIMENT, {}, tree)
    path = tree / "sections" / "letters.json"
    for text in ("{", '{"pieces": [{"rows": []}]}', "[]"):
        path.write_text(text)
        with pytest.raises(DataError, match=r"letters\.json"):
            made_section(EXPERIMENT, {}, tree)


@pytest.mark.parametrize(
    ("first", "second", "same"),
    [
        ([{"x": 1.0}], [{"x": 1.0 + 1e-9}], True),
        ([{"x": 1.0}], [{"x": 1.001}], False),
        ([{"x": 1.0, "solve_ms": 3.0}], [{"x": 1.0, "solve_ms": 9.0}], True),
        ([{"x": 1.0, "solve_ms_p50": 3.0}], [{"x": 1.0, "solve_ms_p50": 9.0}], True),
        ([{"x": [1.0, 2.0]}], [{"x": [1.0, 2.1]}], False),
        ([{"x": 1.0}], [{"x": 1.0}, {"x": 1.0}], False),
        ([{"name": "a"}], [{"name": "b"}], False),
        ([{"x": None}], [{"x": None}], True),
        ([{"x": 1.0}], [{"y": 1.0}], False),
    ],
)
def test_figures_are_compared_without_times(first: Any, second: Any, same: bool) -> None:
    assert same_figures(first, second) is same


def test_what_an_experiment_measures_is_there() -> None:
    for name in EXPERIMENTS:
        experiment = load_experiment(name)
        assert experiment.measures, name
        for size in ("quick", "usual", "full"):
            for options in piece_options(experiment, experiment.size(size)):
                for package in packages_of(experiment, options):
                    assert (TREE / package).exists(), f"{name}: {package}"
    for packages in METHOD_PACKAGES.values():
        assert all((TREE / package).exists() for package in packages)


def test_a_change_of_a_sign_is_seen_in_both_languages(tmp_path: Path) -> None:
    for name, text, other in (
        ("a.py", 'def f(x):\n    """Twice."""\n    return 2 * x  # twice\n', "return 3 * x"),
        ("a.c", "/* Twice. */ int f(int x) { return 2 * x; } // twice\n", "return 3 * x"),
    ):
        file = tmp_path / name
        file.write_text(text)
        plain = meaning(file)
        assert b"wice" not in plain and b"return 2 * x" in plain
        file.write_text(text.replace("return 2 * x", other))
        assert meaning(file) != plain
        file.write_text(text.replace("wice", "hrice"))
        assert meaning(file) == plain


def test_a_string_that_is_used_counts(tmp_path: Path) -> None:
    file = tmp_path / "a.py"
    file.write_text('NAME = "# no comment"\n')
    assert b"# no comment" in meaning(file)


def test_training_does_not_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source_hash, "TREE", tmp_path)
    (tmp_path / "p" / "training").mkdir(parents=True)
    (tmp_path / "p" / "net.py").write_text("x = 1\n")
    before = package_hashes(["p"])
    (tmp_path / "p" / "training" / "loop.py").write_text("y = 1\n")
    assert package_hashes(["p"]) == before
    (tmp_path / "p" / "net.py").write_text("x = 2\n")
    assert package_hashes(["p"]) != before


def test_a_report_that_is_killed_goes_on(tmp_path: Path) -> None:
    """Pieces that were done when it was killed are those of the report that follows."""
    out = tmp_path / "report"
    command = [sys.executable, "-m", "finlab", "eval", "report", "-o", str(out)]
    command += ["--quick", "--sections", "wrench"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    path = out / section.FOLDER / "wrench.json"
    while process.poll() is None and not path.exists():
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    done = read_section(path)
    assert done and not list(out.rglob("*.part"))
    environment = dict(os.environ, OMP_NUM_THREADS="1")
    subprocess.run(command, check=True, capture_output=True, env=environment)
    whole = read_section(path)
    assert len(whole) == 8 and whole[: len(done)] == done
