"""`finlab eval wrench LAYOUT`: every method on a user's own robot."""

import json
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.cli import main
from finlab.evaluation.experiments.wrench import own_case
from finlab.evaluation.method_specs import installed_methods
from finlab.layout.file import save_layout


def test_every_method_on_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A pair in a file of one's own."""
    layout = finlab.load_layout("pair")
    path, file = tmp_path / "mine.yaml", tmp_path / "rows.json"
    save_layout(layout, path)
    sizes = ["--targets", "4", "--subsample", "1"]
    assert main(["eval", "wrench", str(path), *sizes, "--json", str(file)]) == 0
    rows = json.loads(file.read_text())["rows"]
    assert [row["method"] for row in rows] == installed_methods(layout)
    assert {row["split"] for row in rows} == {"layout pair"} and "layout pair" in capsys.readouterr().out
    by_name = {row["method"]: row for row in rows}
    assert by_name["dual"]["err_norm_max"] < 1e-4 and by_name["dual"]["n"] == 4
    assert by_name["ipopt"]["n"] == 1


def test_targets_are_seeded_and_within_reach() -> None:
    layout = finlab.load_layout("D")
    case, again, other = (own_case(layout, (), 8, seed) for seed in (3, 3, 4))
    assert np.array_equal(case.targets, again.targets) and not np.array_equal(case.targets, other.targets)
    # Products of fewer rows may round otherwise.
    np.testing.assert_allclose(own_case(layout, (), 3, 3).targets, case.targets[:3], rtol=1e-12, atol=1e-14)
    assert finlab.Allocator(layout).allocate_batch(case.targets).reachable.all()


def test_failed_fins_of_a_bundle_stay_out(tmp_path: Path) -> None:
    file, bundle = tmp_path / "rows.json", tmp_path / "A"
    assert main(["export", "A", "--failed", "front_left", "-o", str(bundle)]) == 0
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
def test_bad_input_is_one_sentence(arguments: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", "wrench", *arguments.split()]) == 2
    error = capsys.readouterr().err
    assert error.startswith("finlab: error: ") and message in error and error.count("\n") == 1
