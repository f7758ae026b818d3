"""`finlab app`: what can go wrong before the first page."""

import socket
import sys

import pytest

from finlab.cli import main


def test_missing_extra_names_the_command_that_installs_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "webapp"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "viser", None)
    assert main(["app"]) == 2
    sentence = "the web app needs 'viser', which is not installed; run: pip install 'finlab-marine[app]'"
    assert capsys.readouterr().err == f"finlab: error: {sentence}\n"


def test_port_in_use_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert main(["app", "--port", str(port)]) == 2
    err = capsys.readouterr().err
    assert err.startswith("finlab: error: ") and str(port) in err and len(err.splitlines()) == 1


@pytest.mark.parametrize("port", ["-1", "70000", "http"])
def test_impossible_port_is_refused(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["app", "--port", port]) == 2
    assert "port" in capsys.readouterr().err


def test_unknown_layout_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["app", "--layout", "nowhere.yaml"]) == 2
    assert "nowhere.yaml" in capsys.readouterr().err
