"""`finlab layout optimize` and the score card of `layout show`, through `main` in this process."""

import json
from pathlib import Path

import numpy as np
import pytest

from finlab.cli import main
from finlab.layout import load_layout


def test_optimize_writes_a_better_layout(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "better.yaml"
    arguments = ["layout", "optimize", "A", "--fins", "front_right", "--rounds", "1", "-o", str(output)]
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert "weakest_direction: 11.54 -> " in out
    assert out.endswith(f"{output}: written.\n")
    assert err == ""  # no progress bar outside of a terminal
    assert load_layout(output).names == load_layout("layouts/A.yaml").names
    assert main(["layout", "check", str(output)]) == 0


def test_optimize_within_reach(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "better.json"
    box = ["--reach", "0.03"]
    mission = ["--goal", "mission_power", "--wrench", "1", "0", "0", "0", "0", "0"]
    mission += ["--wrench", "0", "0", "1", "0", "0", "0"]
    arguments = ["--fins", "front_right", "--rounds", "1", "--seed", "2", "--no-mirror"]
    assert main(["layout", "optimize", "A", *arguments, *box, *mission, "-o", str(output)]) == 0
    told = capsys.readouterr().out
    assert told.startswith("mission_power: ") and "\nfront_right " in told
    moved = np.subtract(load_layout(output).fins[0].position, load_layout("A").fins[0].position)
    assert np.abs(moved).max() <= 0.03 + 1e-9


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--fins", "nobody"], "has no fin 'nobody'"),
        (["--fins", "front_right", "--goal", "beauty"], "goal: expected one of"),
        (["--fins", "front_right", "--reach", "-1"], "expected --reach from 0 m"),
        (["--fins", "front_right", "--turn", "200"], "--turn from 0 to 180 degrees"),
        (["--fins", "front_right", "--rounds", "0"], "rounds: expected a number of at least 1"),
    ],
)
def test_wrong_questions(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "never.yaml"
    assert main(["layout", "optimize", "A", *arguments, "-o", str(output)]) == 2
    assert message in capsys.readouterr().err
    assert not output.exists()


def test_a_folder_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["layout", "optimize", "A", "--fins", "front_right", "-o", "no/where.yaml"]) == 2
    assert "output: expected a file in an existing folder" in capsys.readouterr().err


def test_show_prints_the_score_card(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["layout", "show", "D", "--failed", "back"]) == 0
    out = capsys.readouterr().out
    assert "2 fins push in 4 of 6 independent directions." in out
    assert "Failed: back." in out
    assert "Out of reach: sway" in out
    assert "Weakest direction: 0.00 N" in out
    assert "Share of the largest wrench that is left without one fin" in out


def test_show_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["layout", "show", "pair", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["layout"] == "pair"
    assert record["authority"]["rank"] == 4
    assert record["axes"][0] == "surge"


def test_show_of_an_unknown_failed_fin(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["layout", "show", "A", "--failed", "nobody"]) == 2
    assert "has no fin 'nobody'" in capsys.readouterr().err
