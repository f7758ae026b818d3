"""`finlab train mdn`, then an allocation with the result; what `finlab fit fin` says on a
terminal."""

import io
import json
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from finlab.cli import main
from tests.fit.load_cell import columns_of, commands, measured, soft, write
from tests.terminal import refused

WITHOUT_TORCH = """
import sys

class Nowhere:
    def find_spec(self, name, *_):
        if name == "torch":
            raise ModuleNotFoundError("No module named 'torch'", name=name)

sys.meta_path.insert(0, Nowhere())
from finlab.cli import main
sys.exit(main(sys.argv[1:]))
"""
"""A command line on a machine where PyTorch is not installed."""
SMOKE = ["--preset", "smoke", "--steps", "3"]
"""Options of a training of three steps."""


def test_trains_the_network_over_forces_and_allocates_with_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(tmp_path / "mine")
    assert main(["train", "mdn", "-o", folder, *SMOKE]) == 0
    assert f"{folder}: checkpoint mine, preset smoke, sha256 " in capsys.readouterr().out
    command = [
        "allocate",
        "A",
        "--wrench",
        "1",
        "0",
        "0",
        "0",
        "0",
        "0",
        "--checkpoint",
        folder,
        "--json",
    ]
    assert main([*command, "--method", "mdn"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["checkpoint"] == "mine" and answer["err_norm"] < 1e-4


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (
            ["mdn", "--preset", "paper"],
            "preset: expected one of default, shipped, smoke, got 'paper'",
        ),
        (["mdn", "--minutes", "0"], "minutes: expected a number of at least 1, got 0"),
        (["mdn", "--steps", "0"], "steps: expected a number of at least 1, got 0"),
    ],
)
def test_refuses_in_one_sentence(argv: list[str], message: str, tmp_path: Path) -> None:
    assert message in refused(["train", argv[0], "-o", str(tmp_path / "out"), *argv[1:]])


def test_says_what_to_install_where_torch_is_missing(tmp_path: Path) -> None:
    command = [sys.executable, "-c", WITHOUT_TORCH, "train", "mdn", "-o", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and done.stdout == ""
    assert (
        done.stderr
        == "finlab: error: torch is not installed; run: pip install 'finlab-marine[train]'\n"
    )


def test_a_full_disk_is_one_sentence_with_the_path(tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-m", "finlab", "train", "mdn", "-o", str(out), *SMOKE]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=120,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000)),
    )
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert f"{out}/" in done.stderr and "cannot be written: File too large" in done.stderr
    assert not list(out.rglob("*.part"))


class Terminal(io.StringIO):
    """A stderr that is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("terminal", [True, False])
def test_steps_are_told_on_terminals_alone(
    terminal: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = commands(40)
    data = write(tmp_path / "cell.csv", columns_of(command, measured(soft(), command)))
    stderr = Terminal() if terminal else io.StringIO()
    monkeypatch.setattr("sys.stderr", stderr)
    assert main(["fit", "fin", str(data), "-o", str(tmp_path / "fin.csv")]) == 0
    if terminal:
        assert "fitting the thrust" in stderr.getvalue()
    else:
        assert stderr.getvalue() == ""
    assert "cross-validated error" in capsys.readouterr().out
