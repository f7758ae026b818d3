"""The README's Python runs as printed, and what it and the other pages name exists."""

import re
import shlex
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BLOCKS = re.findall(r"```(\w*)\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
"""Blocks of code of the README: language and text."""
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
"""A number in printed text, which need not be the same."""
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("checkpoints/**/*.md")]
"""All pages of the tree."""


def test_python_gives_output_of_the_printed_form(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    place = next(i for i, (language, _) in enumerate(BLOCKS) if language == "python")
    program = BLOCKS[place][1]
    printed = BLOCKS[place + 1][1]
    assert len([line for line in program.splitlines() if line.strip()]) <= 8
    monkeypatch.chdir(ROOT)
    exec(compile(program, "README.md", "exec"), {})
    out = capsys.readouterr().out
    assert NUMBER.sub("#", out).split() == NUMBER.sub("#", printed).split()
    # Commands may differ from machine to machine where two are equally good; the error may not.
    assert float(out.split()[-1]) < 0.01


def _headings(page: Path) -> set[str]:
    """The anchors of a page, as GitHub makes them."""
    found = re.findall(r"^#+ (.*)", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in found}


def test_links_and_files_of_all_pages_exist() -> None:
    wrong = []
    for page in PAGES:
        text = page.read_text()
        links = re.findall(r"\]\(([^)#:]*)#?([^):]*)\)", text)
        for link, anchor in (
            () if ROOT / "docs" in page.parents else links
        ):  # `make docs` checks these
            target = page.parent / link if link else page
            if not target.exists() or (anchor and anchor not in _headings(target)):
                wrong.append(f"{page.name}: {link}#{anchor}")
        wrong += [
            f"{page.name}: {path}"
            for path in re.findall(
                r"`((?:finlab|webapp|tests|tools|layouts|examples)/[\w./-]+)`", text
            )
            if page.name != "CHANGELOG.md" and not (ROOT / path).exists()
        ]
    assert wrong == []


def test_make_targets_of_all_pages_exist() -> None:
    targets = set[str]()
    for page in PAGES:
        targets.update(re.findall(r"(?:^|`)make ([a-z-]+)", page.read_text(), re.MULTILINE))
    makefile = (ROOT / "Makefile").read_text()
    gone = {"mutate", "bench", "bench-runtime"}  # which the changelog says
    assert {
        name
        for name in targets - gone
        if not re.search(rf"^{name}\b[^=\n]*:", makefile, re.MULTILINE)
    } == set()


def test_figures_of_pages_are_columns_of_experiments() -> None:
    from tools.figures import experiment_of

    marks = list[tuple[str, str]]()
    for page in PAGES:
        marks += re.findall(r"<!-- figures: (\w+) ?([^>]*) -->", page.read_text())
    assert marks
    for name, keys in marks:
        keys = {key for key in shlex.split(keys) if "=" not in key}
        assert keys <= {column.key for column in experiment_of(name).columns}, name
