"""The README's Python runs as printed, its output has the printed form, and what it names exists."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BLOCKS = re.findall(r"```(\w*)\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")


def test_python_gives_output_of_the_printed_form(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    place = next(i for i, (language, _) in enumerate(BLOCKS) if language == "python")
    program, printed = BLOCKS[place][1], BLOCKS[place + 1][1]
    assert len([line for line in program.splitlines() if line.strip()]) <= 8
    monkeypatch.chdir(ROOT)
    exec(compile(program, "README.md", "exec"), {})
    out = capsys.readouterr().out
    assert NUMBER.sub("#", out).split() == NUMBER.sub("#", printed).split()
    # Commands may differ from machine to machine where two are equally good; the error may not.
    assert float(out.split()[-1]) < 0.01


def test_files_and_pictures_it_names_exist() -> None:
    links = re.findall(r"\]\(([^)#:]+)\)", (ROOT / "README.md").read_text())
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_make_targets_it_names_exist() -> None:
    targets = re.findall(r"\bmake ([a-z-]+)", (ROOT / "README.md").read_text())
    makefile = (ROOT / "Makefile").read_text()
    assert {"app", "test", "bench"} <= set(targets)
    for target in targets:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
