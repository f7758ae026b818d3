"""The command as a whole: help, exit codes, and never a traceback for what a user did."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from finlab.cli import main
from tests.fit.cell import columns_of, commands, measured, soft, write

FINLAB = [sys.executable, "-m", "finlab"]


@pytest.mark.parametrize(
    "argv",
    [
        [],
        ["allocate"],
        ["layout"],
        ["layout", "show"],
        ["data", "generate"],
        ["train", "surrogate"],
        ["train", "allocator"],
        ["export"],
        ["app"],
    ],
    ids=" ".join,
)
def test_every_verb_has_help(argv: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*argv, "--help"]) == 0
    assert "usage: finlab" in capsys.readouterr().out


@pytest.mark.parametrize(
    "argv", [[], ["nonsense"], ["layout"], ["allocate", "A", "--bogus"], ["layout", "show"]]
)
def test_wrong_usage_exits_with_2(argv: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(argv) == 2
    assert capsys.readouterr().err.strip()


def test_help_is_fast_and_loads_nothing_heavy() -> None:
    code = (
        "import sys, time\n"
        "from finlab.cli import main\n"
        "assert main(['--help']) == 0\n"
        "print(sorted({'torch', 'numpy', 'scipy', 'matplotlib', 'yaml'} & set(sys.modules)))\n"
        "print(time.process_time())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    heavy, seconds = done.stdout.splitlines()[-2:]
    assert heavy == "[]"
    # Of this process alone, so that a busy machine does not count: 0.25 s; numpy alone takes 0.15 s more.
    assert float(seconds) < 1.0


def test_interrupt_exits_with_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("finlab.cli.layout.layout_text", interrupted)
    assert main(["layout", "show", "A"]) == 130


def test_reader_that_went_away_is_no_error_message() -> None:
    read_end, write_end = os.pipe()
    os.close(read_end)
    command = [*FINLAB, "layout", "show", "A"]
    done = subprocess.run(command, stdout=write_end, stderr=subprocess.PIPE, text=True, timeout=30)
    os.close(write_end)
    assert (done.returncode, done.stderr) == (141, "")


def test_files_are_written_before_anything_is_printed(tmp_path: Path) -> None:
    cell = write(tmp_path / "cell.csv", columns_of(commands(60), measured(soft(), commands(60))))
    read_end, write_end = os.pipe()
    os.close(read_end)
    command = [*FINLAB, "fit", "fin", str(cell), "-o", str(tmp_path / "fin.csv")]
    unbuffered = os.environ | {"PYTHONUNBUFFERED": "1"}
    done = subprocess.run(
        command, stdout=write_end, stderr=subprocess.PIPE, text=True, timeout=60, env=unbuffered
    )
    os.close(write_end)
    assert (done.returncode, done.stderr) == (141, "")
    assert (tmp_path / "fin.csv").exists() and "</html>" in (tmp_path / "fin.html").read_text()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux's always-full device")
def test_full_disk_under_stdout_is_one_sentence() -> None:
    with open("/dev/full", "w") as full:
        command = [*FINLAB, "layout", "show", "A"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=30)
    assert (done.returncode, done.stderr) == (2, "finlab: error: cannot print: No space left on device\n")


def test_unwritable_output_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "file"
    file.write_text("in the way")
    assert main(["train", "surrogate", "--preset", "smoke", "--output", str(file / "below")]) == 2
    err = capsys.readouterr().err
    assert err.startswith("finlab: error: ") and len(err.splitlines()) == 1
