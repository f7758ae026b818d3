"""The page of the default method names every number that was set by hand, with its reason."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROW = re.compile(r"^\| `(\w+)` \| ([^|]+) \| `([^`|]+)` \| ([^|]+) \|$", re.MULTILINE)
FILES = [
    ROOT / "finlab/precision.py",
    ROOT / "finlab/allocation/levenberg_marquardt.py",
    *sorted((ROOT / "finlab/allocation/dual").glob("*.py")),
    *(
        ROOT / "finlab/actuators" / f"{name}.py"
        for name in ("response", "fin/fin_response", "thruster", "azimuth")
    ),
    *(ROOT / "finlab/actuators" / f"{name}.py" for name in ("rudder", "thrust_power", "registry")),
]


def numbers(path: Path) -> dict[str, object]:
    """The public constants of a file that are numbers, or tuples of them."""
    found = {}
    for line in ast.parse(path.read_text()).body:
        if not (isinstance(line, ast.Assign) and isinstance(line.targets[0], ast.Name)):
            continue
        name = line.targets[0].id
        if name.isupper() and not name.startswith("_"):
            try:
                found[name] = ast.literal_eval(line.value)
            except ValueError:
                continue
    return found


def test_the_page_has_every_number_with_a_reason() -> None:
    rows = ROW.findall((ROOT / "docs" / "method.md").read_text())
    told = {(where, name): ast.literal_eval(value) for name, value, where, _ in rows}
    known = {
        (str(path.relative_to(ROOT)), name): value for path in FILES for name, value in numbers(path).items()
    }
    assert told == known
    assert len(rows) == len(told) <= 30
    assert all(len(reason.split()) > 3 for *_, reason in rows)
