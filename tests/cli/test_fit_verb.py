"""`finlab fit fin` at the command line: its bar on a terminal, none elsewhere, and what it refuses."""

import io
import re
from pathlib import Path

import pytest

from finlab.cli import main
from tests.fit.cell import columns_of, commands, measured, soft, write


class Terminal(io.StringIO):
    """A stderr that is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("terminal", [True, False])
def test_a_bar_stands_on_terminals_alone(
    terminal: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command = commands(40)
    data = write(tmp_path / "cell.csv", columns_of(command, measured(soft(), command)))
    stderr = Terminal() if terminal else io.StringIO()
    monkeypatch.setattr("sys.stderr", stderr)
    monkeypatch.setenv("COLUMNS", "100")
    assert main(["fit", "fin", str(data), "-o", str(tmp_path / "fin.csv")]) == 0
    if terminal:
        bar = stderr.getvalue()
        assert "loading" in bar and "fitting the thrust" in bar
        shares = [int(share) for share in re.findall(r"(\d+)%", bar)]
        assert shares == sorted(shares) and len(set(shares)) > 3, "it says how far"
    else:
        assert stderr.getvalue() == ""
    assert "measure next" in capsys.readouterr().out
