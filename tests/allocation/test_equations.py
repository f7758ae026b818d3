"""Comments of the core and of the allocation cite equations of docs/theory/method.md that are
there."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CITED = re.compile(r"\bEqs?\. (?P<first>\d+)(?: (?P<word>to|and) (?P<last>\d+))?")
"""`Eq. 8`, `Eqs. 6 to 10`; equations of papers are cited in brackets, `Eq. (1)`."""


def numbers_of_page() -> list[int]:
    """Numbers of the equations of docs/theory/method.md, in the order in which they stand there."""
    page = (ROOT / "docs" / "theory" / "method.md").read_text()
    return [int(number) for number in re.findall(r"\\tag\{(\d+)\}", page)]


def test_equations_are_numbered_in_the_order_of_the_page() -> None:
    numbers = numbers_of_page()
    assert numbers == list(range(1, len(numbers) + 1)) and len(numbers) >= 14


def test_no_equation_stands_within_a_sentence() -> None:
    page = (ROOT / "docs" / "theory" / "method.md").read_text()
    lines = page.splitlines()
    for before, line, after in zip(lines, lines[1:], lines[2:], strict=False):
        if line.startswith("$$"):
            assert (before, after) == ("", ""), line
            assert line.endswith("$$"), line


def citations() -> dict[str, set[int]]:
    """The numbers that comments of the core and of the allocation cite, by `file: citation`."""
    cited: dict[str, set[int]] = {}
    for room in ("core", "allocation"):
        for path in sorted((ROOT / "finlab" / room).rglob("*")):
            if path.suffix not in (".py", ".c", ".h"):
                continue
            for match in CITED.finditer(path.read_text(encoding="utf-8")):
                first = int(match["first"])
                last = int(match["last"] or first)
                numbers = {first, last}
                if match["word"] == "to":
                    numbers = set(range(first, last + 1))
                cited[f"{path.relative_to(ROOT)}: {match.group()}"] = numbers
    return cited


def test_cited_equations_exist() -> None:
    numbers_on_page = set(numbers_of_page())
    wrong = [place for place, numbers in citations().items() if not numbers <= numbers_on_page]
    assert wrong == []


def test_every_equation_of_the_page_is_cited_in_code() -> None:
    cited = set().union(*citations().values())
    assert set(numbers_of_page()) - cited == set()
