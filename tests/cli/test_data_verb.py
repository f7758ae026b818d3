"""`finlab data generate|verify`."""

from pathlib import Path

import pytest

from finlab.cli import main


def test_generates_and_verifies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = str(tmp_path / "set")
    command = ["data", "generate", "-o", folder, "--layouts", "3", "--commands-per-layout", "50"]
    assert main(command) == 0
    assert "150 samples made" in capsys.readouterr().out
    assert main(command) == 0
    assert ": 0 samples made" in capsys.readouterr().out
    assert main(["data", "verify", folder]) == 0
    assert capsys.readouterr().out == f"{folder}: 150 samples, all checksums fit\n"


@pytest.mark.parametrize(
    ("flag", "value", "expected"),
    [("--layouts", "0", "expected 1 to"), ("--seed", "-1", "seed of at least 0")],
)
def test_refuses_bad_numbers(
    flag: str, value: str, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["data", "generate", "-o", str(tmp_path / "set"), flag, value]) == 2
    assert expected in capsys.readouterr().err


def test_verify_wants_a_data_set(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["data", "verify", str(tmp_path)]) == 2
    assert str(tmp_path) in capsys.readouterr().err
