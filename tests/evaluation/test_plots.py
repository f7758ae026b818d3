"""Pictures of experiments: drawn by the verb, refused before the work, and true to the rows."""

import sys
from pathlib import Path

import numpy as np
import pytest

from finlab.cli import main
from finlab.evaluation.experiment import load_experiment
from finlab.evaluation.plots import candidates_picture, fins_picture, temperature_picture

SMALL = {
    "temperature": ["--layouts", "2", "--targets", "1", "--candidates", "8", "--temperatures", "0.01,1"],
    "ablation": ["--layouts", "2", "--targets", "1", "--candidates", "8"],
    "wrench": ["--layouts", "3", "--targets", "2", "--methods", "analytic,qp"],
}


@pytest.mark.parametrize("name", SMALL)
def test_the_verb_draws_its_picture(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image = pytest.importorskip("PIL.Image")
    path = tmp_path / "picture.png"
    assert main(["eval", name, *SMALL[name], "--plot", str(path)]) == 0
    with image.open(path) as picture:
        assert min(picture.size) > 500 and len(set(picture.convert("L").resize((90, 60)).tobytes())) > 20


def test_a_picture_shows_the_rows() -> None:
    pytest.importorskip("matplotlib")
    rows = load_experiment("wrench").rows(methods=("qp",), layouts=4, targets=3, by_fins=True)
    total, *parts = rows
    assert total["fins"] is None and sum(row["n"] for row in parts) == total["n"] == 12
    mean = sum(row["n"] * row["err_norm_mean"] for row in parts) / 12
    assert mean == pytest.approx(total["err_norm_mean"])
    axes = fins_picture(rows).axes[0]
    np.testing.assert_allclose(axes.lines[0].get_ydata(), [row["err_norm_median"] for row in parts])
    assert [label.get_text() for label in axes.get_xticklabels()] == [str(row["fins"]) for row in parts]

    rows = load_experiment("ablation").rows(variants=("ours",), layouts=2, targets=1, candidates=8, shown=2)
    raw, refined = (each.get_offsets() for each in candidates_picture(rows).axes[0].collections)
    points = rows[0]["points"]
    np.testing.assert_allclose(raw, [each for point in points for each in point["raw"]])
    assert len(raw) == 16 and len(refined) == 8
    assert refined[:, 0].mean() < raw[:, 0].mean()

    rows = [
        {"temperature": t, "diversity": t, "best_j_mean": 2 * t, "best_j_mean_interval": [t, 3 * t]}
        for t in (1.0, 0.1)
    ]
    left, right = temperature_picture(rows).axes
    assert left.lines[0].get_ydata().tolist() == [0.1, 1.0] and right.lines[0].get_ydata().tolist() == [
        0.2,
        2.0,
    ]


@pytest.mark.parametrize(
    ("file", "message"), [("picture.jpg", "ends in .png"), ("none/picture.png", "in an existing folder")]
)
def test_a_picture_that_cannot_be_is_refused(
    file: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["eval", "wrench", "--plot", str(tmp_path / file)]) == 2
    assert message in capsys.readouterr().err


def test_without_matplotlib_one_sentence_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["eval", "wrench", "--plot", str(tmp_path / "picture.png")]) == 2
    error = capsys.readouterr().err
    assert "matplotlib is not installed" in error and "[plot]" in error and len(error.splitlines()) == 1
