"""`finlab fit fin` at the command line: what it does is said on a terminal, and nowhere else."""

import io
from pathlib import Path

import pytest

from finlab.cli import main
from tests.fit.cell import columns_of, commands, measured, soft, write


class Terminal(io.StringIO):
    """A stderr that is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("terminal", [True, False])
def test_steps_are_told_on_terminals_alone(
    terminal: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
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
