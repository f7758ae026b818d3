"""A function of a stranger as a method, and every method on a robot of one's own; names of
methods."""

import json
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.cli import main
from finlab.errors import AllocationError
from finlab.layout.save import save_layout
from finlab.research.evaluation.experiments.wrench import own_case
from finlab.research.evaluation.method_specs import (
    installed_methods,
    load_method_spec,
    load_method_specs,
)
from tests.terminal import refused

METHODS_SOURCE = """
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
"""A file of a user, with functions that are methods."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """This file."""
    path = tmp_path / "methods.py"
    path.write_text(METHODS_SOURCE)
    return path


def test_a_function_answers_for_one_target_and_for_many(file: Path) -> None:
    layout = finlab.load_layout("A")
    allocator = load_method_spec(f"{file}:turns_on").on(layout)
    first = allocator.allocate(np.zeros(6))
    np.testing.assert_allclose(first.command[:, 2], layout.lower[:, 2] + 0.1)
    again = allocator.allocate(np.zeros(6), previous=first)
    np.testing.assert_allclose(again.command[:, 2], layout.lower[:, 2] + 0.2)
    assert allocator.allocate_batch(np.zeros((3, 6))).command.shape == (3, 4, 3)


def test_the_benchmark_shows_it_beside_finlabs(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
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
    [
        ("wants_more", "got 'weather'"),
        ("none", "holds no function 'none'"),
        ("", "holds no function"),
    ],
)
def test_functions_that_cannot_be_asked(file: Path, name: str, message: str) -> None:
    assert message in refused(["bench", f"{file}:{name}"])


def test_methods_that_cannot_choose_are_left_as_they_are() -> None:
    methods = load_method_specs(["paper", "analytic", "sqp"], objective="effort")
    assert list(methods) == ["paper", "analytic", "sqp"]
    assert vars(methods["sqp"].choice.settings)["objective"] == "effort"


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("dual,fast", "method: expected one of dual, .* got 'fast'"),
        ("dual-32", "method: expected one of dual, .* got 'dual-32'"),
        ("sqp-money", "method: expected one of dual, mdn"),
    ],
)
def test_names_that_are_none(names: str, message: str) -> None:
    with pytest.raises(AllocationError, match=message):
        load_method_specs(names.split(","))


def test_every_method_on_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A pair in a file of one's own."""
    layout = finlab.load_layout("pair")
    path = tmp_path / "mine.yaml"
    file = tmp_path / "rows.json"
    save_layout(layout, path)
    sizes = ["--targets", "4", "--subsample", "1"]
    assert main(["eval", "wrench", str(path), *sizes, "--json", str(file)]) == 0
    rows = json.loads(file.read_text())["rows"]
    assert [row["method"] for row in rows] == installed_methods(layout)
    assert {row["split"] for row in rows} == {
        "layout pair"
    } and "layout pair" in capsys.readouterr().out
    by_name = {row["method"]: row for row in rows}
    assert by_name["dual"]["err_norm_max"] < 1e-4 and by_name["dual"]["n"] == 4
    assert by_name["ipopt"]["n"] == 1


def test_targets_are_seeded_and_within_reach() -> None:
    layout = finlab.load_layout("D")
    case, again, other = (own_case(layout, (), 8, seed) for seed in (3, 3, 4))
    assert np.array_equal(case.targets, again.targets) and not np.array_equal(
        case.targets, other.targets
    )
    # Products of fewer rows may round otherwise.
    np.testing.assert_allclose(
        own_case(layout, (), 3, 3).targets, case.targets[:3], rtol=1e-12, atol=1e-14
    )
    assert finlab.Allocator(layout).allocate_batch(case.targets).reachable.all()


def test_failed_fins_of_a_bundle_stay_out(tmp_path: Path) -> None:
    file = tmp_path / "rows.json"
    bundle = tmp_path / "A"
    assert main(["export", "A", "--lost", "front_left", "-o", str(bundle)]) == 0
    arguments = ["--targets", "3", "--methods", "dual", "--json", str(file)]
    assert main(["eval", "wrench", str(bundle), *arguments]) == 0
    row = json.loads(file.read_text())["rows"][0]
    assert row["success_0.01"] == 1.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("no_such_layout", "layout 'no_such_layout' is neither a file nor a shipped layout"),
        ("A --split ood", "split: a layout has none, got 'ood' beside 'A'"),
        ("A --targets 0", "targets: expected a number of at least 1, got 0"),
        ("A --methods nonsense", "expected one of dual"),
    ],
)
def test_bad_input_is_one_sentence(arguments: str, message: str) -> None:
    assert message in refused(["eval", "wrench", *arguments.split()])
