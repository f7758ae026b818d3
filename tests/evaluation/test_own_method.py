"""A function of a stranger as a method: it is scored like any other, and what goes wrong is one sentence."""

import json
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.cli import main
from finlab.evaluation.method_specs import load_method_spec

SOURCE = """
import numpy as np
def rests(layout, targets):
    print("an answer?")
    return np.tile(layout.lower, (len(targets), 1, 1))
def turns_on(targets, layout, previous):
    first = layout.lower if previous is None else previous
    return np.tile(np.asarray(first) + [0.0, 0.0, 0.1], (len(targets), 1, 1))
def raises(targets):
    raise RuntimeError("no idea")
def is_empty(targets):
    return []
def says_nan(layout, targets):
    return np.nan * rests(layout, targets)
def leaves(layout, targets):
    return rests(layout, targets) + [9.0, 0.0, 0.0]
def wants_more(targets, weather):
    return targets
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "methods.py"
    path.write_text(SOURCE)
    return path


def test_a_function_answers_for_one_target_and_for_many(file: Path) -> None:
    layout = finlab.load_layout("A")
    allocator = load_method_spec(f"{file}:turns_on").on(layout)
    first = allocator.allocate(np.zeros(6))
    np.testing.assert_allclose(first.command[:, 2], layout.lower[:, 2] + 0.1)
    again = allocator.allocate(np.zeros(6), previous=first)
    np.testing.assert_allclose(again.command[:, 2], layout.lower[:, 2] + 0.2)
    assert allocator.allocate_batch(np.zeros((3, 6))).command.shape == (3, 4, 3)


def test_the_benchmark_shows_it_beside_finlabs(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["bench", f"{file}:rests", "dual", "--quick", "--splits", "id", "--json"]
    assert main(asked) == 0
    rows = json.loads(capsys.readouterr().out.splitlines()[-1])["rows"]
    assert [row["method"] for row in rows] == ["methods.py:rests", "dual"]
    assert rows[0]["success_0.01"] < 0.5 and rows[1]["success_0.01"] == 1.0


@pytest.mark.parametrize(
    ("function", "message"),
    [
        ("raises", "methods.py:raises: layout 'A': RuntimeError: no idea"),
        ("is_empty", "expected finite commands of shape (1, 4, 3), got shape (0,)"),
        ("says_nan", "expected finite commands"),
        ("leaves", "out of its limits"),
    ],
)
def test_wrong_answers_are_told(file: Path, function: str, message: str) -> None:
    allocator = load_method_spec(f"{file}:{function}").on(finlab.load_layout("A"))
    with pytest.raises(finlab.FinlabError) as caught:
        allocator.allocate(np.zeros(6))
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("name", "message"),
    [("wants_more", "got 'weather'"), ("none", "holds no function 'none'"), ("", "holds no function")],
)
def test_functions_that_cannot_be_asked(
    file: Path, name: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", f"{file}:{name}"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("finlab: error: ") and message in error and error.count("\n") == 1
