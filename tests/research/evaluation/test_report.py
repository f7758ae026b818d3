"""A whole report at a tiny size and on a full disk; its writers, and pictures of experiments."""

import json
import os
import re
import resource
import shlex
import shutil
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.cli import main
from finlab.errors import DataError
from finlab.research.evaluation import report_page
from finlab.research.evaluation.document import FORMATS, Column, ReportTable, to_markdown, to_text
from finlab.research.evaluation.experiment import EXPERIMENTS, load_experiment
from finlab.research.evaluation.plots import candidates_picture, fins_picture, temperature_picture
from finlab.research.evaluation.report_page import PAGE_FILE, ROWS_FILE, make_report
from finlab.research.evaluation.section import read_section, stale_packages
from tests.terminal import refused

TINY_SIZES: dict[str, dict[str, Any]] = {
    "wrench": {"split": ("id", "ood"), "methods": ("dual", "qp"), "layouts": 2, "targets": 2},
    "latency": {"robots": ("fins-2",), "methods": ("dual", "qp"), "calls": 2},
    "ablation": {"variants": ("ours",), "layouts": 2, "targets": 1, "candidates": 4},
    "temperature": {"temperatures": (0.01, 1.0), "layouts": 2, "targets": 1, "candidates": 4},
}
"""Experiment -> sizes at which it takes seconds."""


@pytest.fixture(scope="module")
def tiny() -> Iterator[None]:
    """Experiments with quick sizes that take a second."""
    pytest.importorskip("casadi")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report_page, "EXPERIMENTS", dict.fromkeys(TINY_SIZES))
        for name, sizes in TINY_SIZES.items():
            module = import_module(f"finlab.research.evaluation.experiments.{name}")
            tiny = replace(module.experiment, quick=sizes, probe={})
            patch.setattr(module, "experiment", tiny)
        yield


@pytest.fixture(scope="module")
def folder(tiny: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report at these sizes."""
    out = tmp_path_factory.mktemp("report")
    make_report(out, size="quick", seed=3)
    return out


def without_times(rows: Any) -> Any:
    """Rows without what the machine decides."""
    timed = ("p50_over_dual",)
    if isinstance(rows, dict):
        return {k: without_times(v) for k, v in rows.items() if not ("_ms" in k or k in timed)}
    return [without_times(row) for row in rows] if isinstance(rows, list) else rows


COMMAND = r"^The command `finlab (.*)` prints the table\. Made at (?:commit [0-9a-f]{12}|version)"
"""What stands below each table: the command and where it was run."""


def test_page_and_rows_say_the_same(folder: Path) -> None:
    page = (folder / PAGE_FILE).read_text("utf-8")
    tables = json.loads((folder / ROWS_FILE).read_text("utf-8"))
    assert list(tables) == list(TINY_SIZES)
    for words in ("How far off are the wrenches", "0.086", "seed 3"):
        assert words in page
    for name, rows in tables.items():
        assert rows and f"## {name.capitalize()}" in page
    assert [row["split"] for row in tables["wrench"]] == ["id", "id", "ood", "ood"]


def test_each_table_has_the_command_that_makes_it_again(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    commands = re.findall(COMMAND, page_of(folder), re.M)
    assert [command.split()[1] for command in commands] == list(TINY_SIZES)
    tables = json.loads((folder / ROWS_FILE).read_text("utf-8"))
    for name, command in zip(TINY_SIZES, commands, strict=True):
        assert main([*shlex.split(command), "--json"]) == 0
        rows = json.loads(capsys.readouterr().out)["rows"]
        assert without_times(rows) == without_times(tables[name])


def test_the_stored_report_has_all_experiments_and_no_other() -> None:
    """Each with a command whose options there are, and the commit that it was made at."""
    text = page_of(STORED)
    sections = re.findall(r"^## (\w+)$(.*?)(?=^## )", text, re.M | re.S)
    assert [name.lower() for name, _ in sections] == list(EXPERIMENTS)
    for name, section in sections:
        ((command, commits),) = re.findall(
            r"^The command `finlab eval (.*)` prints the table\. Made at (.*?) on ", section, re.M
        )
        verb, *words = shlex.split(command)
        experiment = load_experiment(name.lower())
        known = {option.replace("_", "-") for option in experiment.options()}
        assert verb in (name.lower(), experiment.program.removeprefix("finlab eval "))
        assert re.fullmatch("commit [0-9a-f]{12}(, commit [0-9a-f]{12})*", commits), (
            "of a tree without changes"
        )
        assert {word[2:].removeprefix("no-") for word in words if word.startswith("--")} <= known


STORED = Path(report_page.__file__).parents[3] / "docs" / "report"
"""The report in the documentation."""


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_no_stored_section_is_older_than_what_it_measures(name: str) -> None:
    """`finlab eval report -o docs/report` makes anew what is, and checks the rest by its probe."""
    experiment = load_experiment(name)
    pieces = read_section(STORED / "sections" / f"{name}.json")
    assert pieces
    stale = {package for piece in pieces for package in stale_packages(experiment, piece)}
    assert not stale, f"finlab eval report -o docs/report --sections {name}"


def page_of(folder: Path) -> str:
    """The page of a report."""
    return (folder / PAGE_FILE).read_text("utf-8")


def test_two_reports_of_one_seed_have_the_same_rows(folder: Path, tmp_path: Path) -> None:
    """Of some sections, too."""
    page = make_report(tmp_path, size="quick", seed=3, names=["temperature", "latency"])
    first, second = (json.loads((out / ROWS_FILE).read_text("utf-8")) for out in (folder, tmp_path))
    assert list(second) == ["latency", "temperature"]
    assert without_times(second) == without_times({name: first[name] for name in second})
    assert "--sections latency,temperature --seed 3" in page.read_text("utf-8")


def test_sections_that_are_not_asked_for_stand_as_they_are_kept(
    folder: Path, tmp_path: Path
) -> None:
    shutil.copytree(folder, tmp_path / "report")
    make_report(tmp_path / "report", size="quick", seed=3, names=["temperature"])
    first, second = (
        json.loads((out / ROWS_FILE).read_text("utf-8")) for out in (folder, tmp_path / "report")
    )
    assert list(first) == list(second)
    assert without_times(first) == without_times(second)
    commands = [re.findall(COMMAND, page_of(out), re.M) for out in (folder, tmp_path / "report")]
    assert commands[0] == commands[1] and len(commands[0]) == len(TINY_SIZES)
    assert "earlier runs left them, at the sizes of their own commands: wrench, latency" in page_of(
        tmp_path / "report"
    )


def test_each_printed_figure_has_a_verdict(folder: Path) -> None:
    page = page_of(folder)
    assert "| id, ours: mean error | 0.086 |" in page
    for heading in ("Wrench: beside the paper", "Ablation: beside the paper"):
        table = page.split(f"### {heading}")[1].split("\n\n")[1].splitlines()[2:]
        words = [line.split("|")[4].strip() for line in table]
        assert words and set(words) <= {"reproduced", "not", "cannot be decided"}
        assert all(line.split("|")[5].strip().endswith(".") for line in table)


def test_a_full_disk_is_a_sentence_with_the_path(tiny: None, tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, hard))
    try:
        with pytest.raises(DataError, match=r"cannot be written: File too large"):
            make_report(tmp_path, size="quick", names=["temperature"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("-o README.md", "output: expected a folder, got the file README.md"),
        ("-o somewhere --sections nothing", "sections: expected some of all, wrench, "),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(report_page.__file__).parents[3])
    assert message in refused(["eval", "report", *arguments.split()])
    assert not os.path.exists("somewhere")


COLUMNS = (Column("name", "method"), Column("value", "error <", "error", "ends"))
"""Columns of a table, with a target and an interval."""
ROWS: list[dict[str, Any]] = [
    {"name": "`ours`", "value": 0.00029, "ends": [0.0002, 0.0004], "_kind": "ours"},
    {"name": "theirs"},
]
"""Rows of this table, one of which has no value."""


BLOCKS = (
    "# A title & more",
    "One **line**.",
    "## First section",
    ReportTable(COLUMNS, ROWS),
    "- one\n- two",
)
"""A report: lines and tables."""


def test_markdown() -> None:
    text = to_markdown(*BLOCKS)
    assert text.startswith("# A title & more\n\nOne **line**.")
    assert (
        "| method | error < |\n| --- | ---: |\n| **`ours`** | 0.00029 (0.00020 – 0.00040) |" in text
    )


def test_text_has_words_and_tables() -> None:
    text = to_text(*BLOCKS)
    assert "One **line**.\n\nFirst section\n\nmethod" in text and "\n- one\n- two" in text
    assert (
        "method                      error <\nours    0.00029 (0.00020 – 0.00040)\ntheirs\n" in text
    )


@pytest.mark.parametrize(
    ("name", "value", "shown"),
    [
        *(
            ("error", v, s)
            for v, s in ((0.0, "0"), (2.9e-4, "0.00029"), (3.1e-13, "3.1e-13"), (1.84, "1.8"))
        ),
        *(("three", v, s) for v, s in ((2.857, "2.86"), (178.4, "178"), (0.0, "0"))),
        *(
            ("share", v, s)
            for v, s in ((1.0, "100 %"), (0.9997, "99.97 %"), (0.488, "48.8 %"), (0.0, "0.0 %"))
        ),
        ("count", 100_000, "100,000"),
        ("ratio", 1.0021, "1.002"),
        ("metres", 0.1335, "0.1335"),
    ],
)
def test_numbers(name: str, value: float, shown: str) -> None:
    assert FORMATS[name](value) == shown


SMALL_RUNS = {
    "temperature": [
        "--layouts",
        "2",
        "--targets",
        "1",
        "--candidates",
        "8",
        "--temperatures",
        "0.01,1",
    ],
    "ablation": ["--layouts", "2", "--targets", "1", "--candidates", "8"],
    "wrench": ["--layouts", "3", "--targets", "2", "--methods", "analytic,qp"],
}
"""Experiment -> options with which its picture is drawn soon."""


@pytest.mark.parametrize("name", SMALL_RUNS)
def test_the_verb_draws_its_picture(name: str, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    path = tmp_path / "picture.png"
    assert main(["eval", name, *SMALL_RUNS[name], "--plot", str(path)]) == 0
    with image.open(path) as picture:
        assert (
            min(picture.size) > 500
            and len(set(picture.convert("L").resize((90, 60)).tobytes())) > 20
        )


@pytest.mark.parametrize("name", ["ablation", "wrench"])
def test_a_picture_changes_no_table(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What it needs beside the table is neither printed nor in the rows."""
    tables = []
    for plot in ([], ["--plot", str(tmp_path / "picture.svg")]):
        file = tmp_path / "rows.json"
        assert main(["eval", name, *SMALL_RUNS[name], *plot, "--json", str(file)]) == 0
        rows = json.loads(file.read_text())["rows"]
        for row in rows:
            row.pop("points", None)
        tables.append((len(capsys.readouterr().out.splitlines()), without_times(rows)))
    assert tables[0] == tables[1]
    assert main(["eval", "wrench", *SMALL_RUNS["wrench"], "--by-fins", *plot]) == 0
    assert len(capsys.readouterr().out.splitlines()) > tables[0][0] or name == "ablation"


def test_a_picture_shows_the_rows() -> None:
    pytest.importorskip("matplotlib")
    rows = load_experiment("wrench").rows(methods=("qp",), layouts=4, targets=3, by_fins=True)
    total, *parts = rows
    assert total["fins"] is None and sum(row["n"] for row in parts) == total["n"] == 12
    mean = sum(row["n"] * row["err_norm_mean"] for row in parts) / 12
    assert mean == pytest.approx(total["err_norm_mean"])
    axes = fins_picture(rows).axes[0]
    np.testing.assert_allclose(axes.lines[0].get_ydata(), [row["err_norm_median"] for row in parts])
    assert [label.get_text() for label in axes.get_xticklabels()] == [
        str(row["fins"]) for row in parts
    ]

    rows = load_experiment("ablation").rows(
        variants=("ours",), layouts=2, targets=1, candidates=8, shown=2
    )
    raw, refined = (each.get_offsets() for each in candidates_picture(rows).axes[0].collections)
    points = rows[0]["points"]
    np.testing.assert_allclose(raw, np.concatenate([point["raw"] for point in points]))
    assert len(raw) == 16 and len(refined) == 8
    assert refined[:, 0].mean() < raw[:, 0].mean()

    rows = [
        {"temperature": t, "diversity": t, "best_j_mean": 2 * t, "best_j_mean_interval": [t, 3 * t]}
        for t in (1.0, 0.1)
    ]
    left, right = temperature_picture(rows).axes
    assert left.lines[0].get_ydata().tolist() == [0.1, 1.0] and right.lines[
        0
    ].get_ydata().tolist() == [0.2, 2.0]


@pytest.mark.parametrize(
    ("file", "message"),
    [("picture.jpg", "ends in .png"), ("none/picture.png", "in an existing folder")],
)
def test_a_picture_that_cannot_be_is_refused(file: str, message: str, tmp_path: Path) -> None:
    assert message in refused(["eval", "wrench", "--plot", str(tmp_path / file)])


def test_without_matplotlib_one_sentence_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    error = refused(["eval", "wrench", "--plot", str(tmp_path / "picture.png")])
    assert "matplotlib is not installed" in error and "[plot]" in error
