"""`finlab layout check|show|capability|optimize`, through `main` in this process."""

import json
import re
from itertools import takewhile
from pathlib import Path

import numpy as np
import pytest

from finlab.analysis.refusal_check import faults
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.layout import load_layout
from tests.analysis.supply_vessel import write_vessel
from tests.terminal import refused


def test_check_accepts_every_shipped_layout(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["layout", "check", *map(str, shipped_layouts().values())]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(shipped_layouts())


def test_check_names_file_and_key_of_each_bad_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = shipped_layouts()["A"].read_text()
    bad = tmp_path / "reversed.yaml"
    bad.write_text(text.replace("amplitude_rad: [0.05, 0.6]", "amplitude_rad: [0.6, 0.05]", 1))
    assert main(["layout", "check", "A", str(bad), "nowhere.yaml"]) == 2
    out, err = capsys.readouterr()
    assert out.splitlines() == ["A: ok, layout A with 4 fins"]
    first, second = err.splitlines()
    assert first.startswith(f"finlab: error: {bad}: actuators[0].limits.amplitude_rad of fin ")
    assert "'nowhere.yaml' is neither a file nor a shipped layout; shipped are A, B, C, D" in second


def table_of_actuators(printed: str) -> dict[str, dict[str, str]]:
    """What `finlab layout show` printed: actuator -> head of a column -> cell."""
    lines = iter(printed.splitlines())
    head = next(line for line in lines if line.startswith("actuator  "))
    titles = re.split(r" {2,}", head)
    rows = takewhile(str.strip, lines)  # up to the empty line below the table
    cells = [dict(zip(titles, re.split(r" {2,}", row), strict=True)) for row in rows]
    return {row["actuator"]: row for row in cells}


@pytest.mark.parametrize(
    ("robot", "actuator", "cells"),
    [
        (
            "A",
            "front_right",
            {
                "type": "fin",
                "x [m]": "0.258",
                "y [m]": "-0.150",
                "z [m]": "0.000",
                "direction": "shaft at -60.0 deg",
            },
        ),
        (
            "turtle_hybrid",
            "front_right",
            {"limits": "A 0.05..0.6 rad, f 0.1..2.1 Hz, any direction, drag"},
        ),
        (
            "turtle_hybrid",
            "lift_left",
            {"direction": "axis (0, 0, 1)", "limits": "-39.91..51.44 N, power_law"},
        ),
    ],
)
def test_show_has_a_row_for_each_actuator(
    robot: str, actuator: str, cells: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["layout", "show", robot]) == 0
    table = table_of_actuators(capsys.readouterr().out)
    assert tuple(table) == load_layout(shipped_layouts()[robot]).names
    assert {title: table[actuator][title] for title in cells} == cells


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["A"], ["4 fins push in 6 of 6 independent directions"]),
        (["no_yaw"], ["Not commanded, free: yaw."]),
        (["torpedo"], ["1 thruster and 4 rudders push in 1 of 3 independent directions",
                       "At rest rudder_top, rudder_bottom, elevator_left, elevator_right give nothing"]),
        (["torpedo", "--flow", "1.5", *"00000"], ["push in 3 of 3 independent directions"]),
        (["D", "--lost", "back"], ["2 fins push in 4 of 6 independent directions", "Lost: back.",
                                     "Out of reach: sway", "Weakest direction: 0.00 N",
                                     "Share of the largest wrench that is left without one fin"]),
    ],
)  # fmt: skip
def test_show_says_what_the_actuators_can_do(
    argv: list[str], words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["layout", "show", *argv]) == 0
    out = capsys.readouterr().out
    assert all(line in out for line in words), out


def test_show_works_from_any_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["layout", "show", "ucat"]) == 0
    assert capsys.readouterr().out.startswith("ucat: ")


def test_check_and_json_take_any_actuator(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["layout", "check", "turtle_hybrid"]) == 0
    assert (
        capsys.readouterr().out
        == "turtle_hybrid: ok, layout turtle_hybrid with 4 fins and 2 thrusters\n"
    )
    assert main(["layout", "show", "turtle_hybrid", "--lost", "lift_left", "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert (values["counted"], values["lost"]) == ("4 fins and 1 thruster", ["lift_left"])
    assert (values["layout"], values["authority"]["rank"]) == ("turtle_hybrid", 6)
    assert values["axes"][0] == "surge"


def test_optimize_writes_a_better_layout(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "better.yaml"
    arguments = [
        "layout",
        "optimize",
        "A",
        "--fins",
        "front_right",
        "--rounds",
        "1",
        "-o",
        str(output),
    ]
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert "Weakest direction: 11.5 N before, " in out
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
    assert told.startswith("Power for a mission: ") and "\nfront_right " in told
    moved = np.subtract(load_layout(output).fins[0].position, load_layout("A").fins[0].position)
    assert np.abs(moved).max() <= 0.03 + 1e-9


def test_optimize_in_a_box_says_how_far_from_the_best(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "best.yaml"
    numbers = tmp_path / "best.json"
    thrusters = ["front_right", "front_left", "rear_right", "rear_left"]
    box = [
        "--box",
        "-0.2",
        "0.2",
        "-0.2",
        "0.2",
        "-0.06",
        "0.06",
        "--keep-out",
        "-0.1",
        "0.1",
        "-0.1",
        "0.1",
        "-0.04",
        "0.04",
    ]
    search = [
        "--axes",
        "surge",
        "sway",
        "yaw",
        "--rounds",
        "2",
        "--searches",
        "2",
        "--no-mirror",
        "--bound",
    ]
    files = ["-o", str(output), "--json", str(numbers)]
    arguments = ["--actuators", *thrusters, *box, *search, *files]
    assert main(["layout", "optimize", "bluerov2_heavy", *arguments]) == 0
    told = capsys.readouterr().out
    values = json.loads(numbers.read_text())
    bound = values["bound"]["value"]
    assert 0.0 < values["value_before"] < values["value_after"] < bound
    assert values["gap"] == pytest.approx(bound / values["value_after"] - 1.0)
    below = 1.0 - values["value_after"] / bound
    assert f"At most {100.0 * below:.1f} % below the best possible: no layout" in told
    assert values["bound"]["axes"] == ["Fx", "Fy", "Tz"]
    assert list(values["moved"]) == thrusters
    for name, pose in values["moved"].items():
        position = load_layout(output).actuator(name).position
        assert pose["position_m"] == list(position)
        assert np.abs(position).max() <= 0.2 + 1e-9
        assert (np.abs(position) >= np.array([0.1, 0.1, 0.04]) - 1e-9).any()


def test_capability_writes_its_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    layout, ship = write_vessel(tmp_path, retractable=False)
    json_file, csv, plot = (tmp_path / f"polar.{end}" for end in ("json", "csv", "svg"))
    files = ["--json", str(json_file), "--csv", str(csv), "--plot", str(plot)]
    question = ["--standard", "dnv", "--ship", str(ship), "--headings", "4"]
    assert main(["layout", "capability", str(layout), *question, *files]) == 0
    told = capsys.readouterr().out
    assert "DP capability-L1(" in told and "worst without" in told
    values = json.loads(json_file.read_text())
    assert faults(values) == []
    rows = [line.split(",") for line in csv.read_text().splitlines()]
    assert rows[0][:2] == ["heading_deg", "intact"]
    assert [float(row[1]) for row in rows[1:]] == values["values"][0]
    assert plot.read_text().lstrip().startswith("<?xml")


def test_capability_by_a_table_of_loads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loads = tmp_path / "loads.csv"
    loads.write_text("heading_deg,Fx,Tz\n0,-10,0\n90,0,2\n")
    arguments = ["--loads", str(loads), "--json"]
    assert main(["layout", "capability", "catamaran", *arguments]) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["headings_deg"] == [0.0, 90.0]
    assert values["loads"][1] == [[0.0, 0.0, 0.0, 0.0, 0.0, 2.0]]
    # Both azimuths push ahead at most 65.92 N each; the bow thruster cannot.
    assert values["values"][0][0] == pytest.approx(2 * 65.92 / 10.0, rel=1e-6)
    assert faults(values) == []


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        ("check", "expected at least one file"),
        ("capability A --standard dnv", "expected --standard dnv and --ship FILE together"),
        ("capability A --headings 0", "headings: expected 1 to"),
        ("capability A --losses skeg", "expected --standard dnv, too"),
        ("capability A --loads nowhere.csv", "no such file"),
        ("capability A --plot OUT", "expected a file in an existing folder that ends in"),
        ("show A --lost nobody", "has no fin 'nobody'"),
        ("show turtle_hybrid --lost bow", "has no actuator 'bow'"),
        ("optimize A -o OUT --fins nobody", "has no fin 'nobody'"),
        ("optimize A -o OUT --fins front_right --goal beauty", "goal: expected one of"),
        ("optimize A -o OUT --fins front_right --reach -1", "expected --reach from 0 m"),
        ("optimize A -o OUT --fins front_right --turn 200", "--turn from 0 to 180 degrees"),
        (
            "optimize A -o OUT --fins front_right --rounds 0",
            "rounds: expected a number of at least 1",
        ),
        ("optimize A -o OUT --fins front_right --bound", "bound: expected thrusters alone"),
        ("optimize D -o OUT --fins front_right --searches 0", "searches: expected a number"),
        (
            "optimize bluerov2 -o OUT --actuators lift_left --keep-out 0 0 0 1 0 1",
            "keep-out, x: expected two numbers, smaller first, got 0.0 0.0",
        ),
        (
            "optimize bluerov2 -o OUT --actuators lift_left --box 1 0 0 1 0 1",
            "bounds of x: expected two numbers, smaller first",
        ),
        (
            "optimize A -o no/where.yaml --fins front_right",
            "output: expected a file in an existing folder",
        ),
    ],
)
def test_wrong_questions(argv: str, message: str, tmp_path: Path) -> None:
    output = tmp_path / "never.yaml"
    assert message in refused(["layout", *argv.replace("OUT", str(output)).split()])
    assert not output.exists()
