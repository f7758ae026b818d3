"""`finlab allocate`: the JSON contract, the table, and bad input of every kind."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from finlab.cli import main
from finlab.layout import Uncertainty, load_layout, save_layout
from finlab.layout.layout import Bus
from tests.layout.test_file import HOSTILE_FILES
from tests.terminal import refused

WRENCH = ["--wrench", "1", "0", "-0.5", "0", "0", "1e-1"]
"""Options of a wrench within reach of robot A."""
KEYS = [
    *("actuators", "fins", "command", "lost", "target", "flow", "wrench_expected"),
    *("wrench_plant", "unallocated", "err_norm", "expected_error", "expected_miss", "effort"),
    *(
        "power",
        "bound",
        "calm_power",
        "scale",
        "solve_ms",
        "method",
        "checkpoint",
        "reachable",
        "share",
    ),
    *("binding", "unknown_fins", "notes"),
]
"""Keys of the JSON, in order."""


def refuse_constant(name: str) -> float:
    """`parse_constant` of `json.loads`: NaN and Infinity are not JSON."""
    raise AssertionError(f"{name} is not JSON")


@pytest.fixture
def allocate(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Runs `finlab allocate` and returns exit code, stdout and stderr."""

    def run(*argv: str) -> tuple[int, str, str]:
        code = main(["allocate", *argv])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


def answer(run: tuple[int, str, str]) -> dict[str, Any]:
    """The JSON that a run of the verb, which must have succeeded, has printed."""
    code, out, err = run
    assert code == 0, err
    result: dict[str, Any] = json.loads(out, parse_constant=refuse_constant)
    return result


def test_json_has_the_keys_of_the_contract(allocate: Callable[..., tuple[int, str, str]]) -> None:
    result = answer(allocate("A", *WRENCH, "--json"))
    assert list(result) == KEYS
    assert result["fins"] == ["front_right", "front_left", "back_left", "back_right"]
    assert result["lost"] == []
    assert [len(row) for row in result["command"]] == [3, 3, 3, 3]
    assert result["target"] == [1.0, 0.0, -0.5, 0.0, 0.0, 0.1]
    assert result["method"] == "dual" and result["checkpoint"] is None
    for told, row in zip(result["actuators"], result["command"], strict=True):
        assert told["type"] == "fin" and len(told["force_n"]) == 3
        assert list(told["command"]) == ["amplitude_rad", "frequency_hz", "zero_direction_rad"]
        assert list(told["command"].values()) == row
    gap = [t - w for t, w in zip(result["target"], result["wrench_plant"], strict=True)]
    assert result["unallocated"] == pytest.approx(gap)
    scaled = sum((g / s) ** 2 for g, s in zip(gap, result["scale"], strict=True)) ** 0.5
    assert result["err_norm"] == pytest.approx(scaled)


def test_a_budget_binds(allocate: Callable[..., tuple[int, str, str]]) -> None:
    full = answer(allocate("A", *WRENCH, "--json"))
    flags = ("--power", str(0.5 * full["power"]), "--policy", "direction")
    result = answer(allocate("A", *WRENCH, *flags, "--json"))
    assert result["power"] == pytest.approx(0.5 * full["power"], rel=1e-6)
    assert result["binding"] == ["power"] and not result["reachable"]
    assert 0.5 < result["share"] < 1.0


def test_a_bus_of_the_layout_has_a_budget_by_name(
    allocate: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    layout = load_layout("bluerov2_heavy")
    names = tuple(name for name in layout.names if "rear" in name)
    path = tmp_path / "bus.yaml"
    save_layout(replace(layout, buses=(Bus("rear", 500.0, names),)), path)
    words = (str(path), "--wrench", "60", "20", "10", "0", "0", "4")
    result = answer(allocate(*words, "--power", "rear=20", "--json"))
    assert "bus rear" in result["binding"] and not result["reachable"]
    assert answer(allocate(*words, "--power", "inf", "--json"))["reachable"]
    for flags, said in (
        (("--power", "front=20"), "has rear, got bus 'front'"),
        (("--power", "much"), "expected watts such as 216"),
        (("--power", "20", "--power", "rear=20"), "not both"),
        (("--power", "rear=20", "--power", "rear=30"), "has two numbers"),
    ):
        code, _, error = allocate(*words, *flags)
        assert code != 0 and said in error


def test_failed_fins_have_no_command(allocate: Callable[..., tuple[int, str, str]]) -> None:
    flags = ["--lost", "front_right", "--lost", "back_left"]
    result = answer(allocate("A", *WRENCH, *flags, "--json"))
    assert result["lost"] == ["front_right", "back_left"]
    assert [row is None for row in result["command"]] == [True, False, True, False]


@pytest.mark.parametrize("method", ["dual", "analytic"])
def test_same_seed_same_answer(method: str, allocate: Callable[..., tuple[int, str, str]]) -> None:
    flags = ["--method", method, "--seed", "3", "--json"]
    first, second = (answer(allocate("A", *WRENCH, *flags)) for _ in range(2))
    assert first["command"] == second["command"]
    assert first["method"] == method and first["wrench_expected"] is None


def test_table_for_people(allocate: Callable[..., tuple[int, str, str]]) -> None:
    code, out, _ = allocate("A", *WRENCH, "--lost", "front_left")
    assert code == 0
    lines = out.splitlines()
    assert lines[0].split() == ["actuator", "type", "command", "force", "[N]"]
    assert lines[2].split() == ["front_left", "fin", "lost"]
    labels = [line.split()[0] for line in lines if line]
    assert labels[5:10] == ["Fx", "asked", "delivered", "missing", "err_norm"]
    assert "1.000   0.000  -0.500     0.000     0.000     0.100" in out
    assert re.search(
        r"err_norm \S+   power \d+\.\d{3} W   effort \d+\.\d{3}   .* ms   method dual\n", out
    )


def test_says_in_words_what_is_not_reached(allocate: Callable[..., tuple[int, str, str]]) -> None:
    code, out, _ = allocate(
        "A", "--wrench", "500", "0", "0", "0", "0", "0", "--policy", "direction"
    )
    assert code == 0
    assert "not reached: " in out.splitlines()[-1]
    assert "% of the wrench is delivered" in out.splitlines()[-1]


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["A", "--wrench", "nan", "0", "0", "0", "0", "0"], "wrench: Fx must be a number"),
        (
            ["A", "--wrench", "0", "0", "0", "0", "0", "-inf"],
            "wrench: Tz must be a number of at most",
        ),
        (
            ["A", "--wrench", "1e300", "0", "0", "0", "0", "0"],
            "wrench: Fx must be a number of at most",
        ),
        (["A", "--wrench", "1", "0", "0"], "Expected 6 values"),
        (["A", "--wrench", "1", "0", "0", "0", "0", "0", "0"], "Unrecognized options: 0"),
        (["A", "--wrench", "1", "0", "0", "0", "0", "up"], "Error parsing --wrench"),
        (["A"], "--wrench"),
        (["A", *WRENCH, "--lost", "nobody"], "has no fin 'nobody', it has front_right"),
        (["pair", *WRENCH, "--lost", "left", "--lost", "right"], "has no fin left"),
        (["A", *WRENCH, "--method", "magic"], "method: expected one of dual, mdn, paper"),
        (["A", *WRENCH, "--policy", "hope"], "closest, direction, priority"),
        (["A", *WRENCH, "--method", "mdn", "--checkpoint", "no/"], "no: no such checkpoint folder"),
        (["A", *WRENCH, "--seed", "x"], "--seed"),
        (["missing.yaml", *WRENCH], "neither a file nor a shipped layout"),
        ([".", *WRENCH], "is a folder"),
        (["x" * 5000, *WRENCH], "cannot be a path: File name too long"),
        (["", *WRENCH], "is a folder"),
    ],
)
def test_bad_arguments_are_one_plain_message(
    argv: list[str], message: str, allocate: Callable[..., tuple[int, str, str]]
) -> None:
    code, out, err = allocate(*argv)
    assert code == 2 and out == ""
    assert message in " ".join(err.replace("│", " ").split())


@pytest.mark.parametrize("name", ["bomb", "python", "binary", "big", "many", "empty"])
def test_hostile_files_end_in_one_sentence(
    name: str,
    allocate: Callable[..., tuple[int, str, str]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    content, _ = HOSTILE_FILES[name]
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "hostile.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    code, out, err = allocate(str(path), *WRENCH)
    assert code == 2 and out == ""
    assert err.startswith(f"finlab: error: {path}: ")
    assert len(err.splitlines()) == 1 and len(err) < 600
    assert not (tmp_path / "pwned").exists()


def test_whole_program(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "finlab", "allocate", "A", "--json"]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}

    def run(*argv: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*command, *argv],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            timeout=60,
        )

    good = run(*WRENCH)
    assert (good.returncode, good.stderr) == (0, "")
    assert list(json.loads(good.stdout)) == KEYS
    bad = run("--wrench", "nan", "0", "0", "0", "0", "0")
    assert (bad.returncode, bad.stdout) == (2, "")
    assert bad.stderr.startswith("finlab: error: ") and "Traceback" not in bad.stderr


def test_a_fin_that_is_stuck_keeps_its_direction(
    allocate: Callable[..., tuple[int, str, str]],
) -> None:
    stuck = answer(allocate("A", *WRENCH, "--json", "--stuck", "front_left=30"))
    assert stuck["command"][1][2] == pytest.approx(0.5235987755982988)


def test_a_bound_is_told_on_request(capsys: pytest.CaptureFixture[str]) -> None:
    wrench = ["--wrench", "1", "0", "0.5", "0", "0", "0.1"]
    assert main(["allocate", "A", *wrench, "--bound", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert 0.98 * answer["power"] <= answer["bound"] <= answer["power"]
    assert main(["allocate", "A", *wrench, "--bound"]) == 0
    assert f"no exact answer takes less than {answer['bound']:.4g} W" in capsys.readouterr().out
    error = refused(["allocate", "A", *wrench, "--bound", "--method", "qp"])
    assert "bound: method 'qp' proves none" in error


def test_robust_is_an_option(allocate: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    path = tmp_path / "unsure.yaml"
    save_layout(load_layout("A").replace_actuator("front_left", uncertainty=Uncertainty(0.3)), path)
    _, plain, _ = allocate(str(path), *WRENCH, "--json")
    _, sure, _ = allocate(str(path), *WRENCH, "--robust", "3", "--json")
    first = json.loads(plain)
    second = json.loads(sure)
    assert second["expected_error"] < first["expected_error"] and second["power"] > first["power"]
    assert "measure front_left next" in first["notes"][-1] and second["bound"] is None
