"""The command as a whole: help, exit codes, and never a traceback for what a user did."""

import copy
import functools
import json
import os
import shlex
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tyro.extras import SubcommandApp

import finlab
from finlab import cli
from finlab.cli import EXAMPLES, _command_line, _verb, examples, main
from finlab.cli.shared_options import with_json_file
from finlab.files.guarded import read_file
from tests.fit.load_cell import columns_of, commands, measured, soft, write
from tests.terminal import refused

FINLAB = [sys.executable, "-m", "finlab"]
"""The command line, as a process of its own."""
WRENCH = ["--wrench", "1", "0", "0.5", "0", "0", "0.1"]
"""Options of a wrench within reach of robot A."""


def verbs(app: SubcommandApp, *words: str) -> Iterator[str]:
    """Every verb and every group of verbs."""
    yield " ".join(words)
    for name, command in app._subcommands.items():
        if isinstance(command.target, SubcommandApp):
            yield from verbs(command.target, *words, name)
        else:
            yield " ".join([*words, name])


@pytest.mark.parametrize("verb", list(verbs(_command_line([]))))
def test_every_verb_has_a_page_of_help_with_an_example(
    verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*verb.split(), "--help"]) == 0
    page = capsys.readouterr().out
    assert page.startswith(f"usage: finlab {verb}".strip())
    assert page.isascii(), "a page of help goes through any pipe"
    assert verb in EXAMPLES or verb.startswith("eval "), "give a new verb its example"
    lines = page.splitlines()
    shown = [line.removeprefix("example: ") for line in lines if line.startswith("example: ")]
    assert lines[-len(shown) :] == [f"example: {line}" for line in shown], "they end the page"
    assert 1 <= len(shown) <= 2 and all(line.startswith(f"finlab {verb}".strip()) for line in shown)


def without_work(run: Callable[..., Any], seen: list[str]) -> Callable[..., None]:
    """A function with the options of a verb's, which does nothing but note that its options were
    read."""

    @functools.wraps(run)
    def noted(*args: Any, **options: Any) -> None:
        seen.append(run.__name__)

    return noted


def still(app: SubcommandApp, seen: list[str]) -> None:
    """Puts functions without work in the place of those of all verbs of a group."""
    for command in app._subcommands.values():
        if isinstance(command.target, SubcommandApp):
            still(command.target, seen)
        else:
            command.target = without_work(command.target, seen)


ALL_EXAMPLES = list[str]()
for _words in verbs(_command_line(["eval", "--help"])):
    ALL_EXAMPLES += examples(_words.split())
"""Lines of the examples that the help pages show."""


@pytest.mark.parametrize("line", list(dict.fromkeys(ALL_EXAMPLES)))
def test_the_options_of_every_example_are_understood(
    line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    program, *argv = shlex.split(line)
    seen: list[str] = []
    verb = copy.deepcopy(_verb(argv[0], argv))
    if isinstance(verb, SubcommandApp):
        still(verb, seen)
    else:
        verb = without_work(verb, seen)
    monkeypatch.setattr(cli, "_verb", lambda name, argv: verb)
    assert program == "finlab" and main(argv) == 0 and len(seen) == 1


@pytest.mark.parametrize(
    "line", [*EXAMPLES["allocate"], *EXAMPLES["layout show"], *EXAMPLES["export"]]
)
def test_quick_examples_run(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(line)[1:]) == 0


def test_versions_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    from finlab.deploy import command

    assert main(["--version"]) == command.main(["--version"]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert shown == [f"finlab {finlab.__version__}", f"finlab-runtime {finlab.__version__}"]


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
    # Of this process alone, so that a busy machine does not count: 0.25 s; numpy alone takes 0.15 s
    # more.
    assert float(seconds) < 1.0


def test_interrupt_exits_with_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("finlab.analysis.score_card", interrupted)
    assert main(["layout", "show", "A"]) == 130  # as shells say: 128 + SIGINT


RUNTIME = [sys.executable, "-m", "finlab.deploy.command"]
"""The command of the robot, `finlab-runtime`, as a process of its own."""


@pytest.mark.parametrize(
    "command", [[*FINLAB, "layout", "show", "A"], [*FINLAB, "--version"], [*RUNTIME, "--help"]]
)
@pytest.mark.parametrize(
    ("output", "reason"),
    [
        (">/dev/full", "No space left on device; write the output to another place"),
        (">&-", "standard output is closed; write the output to another place"),
    ],
)
def test_output_that_cannot_be_written_is_one_sentence(
    command: list[str], output: str, reason: str
) -> None:
    line = f"{' '.join(command)} {output}; echo $? >&2"
    done = subprocess.run(["bash", "-c", line], stderr=subprocess.PIPE, text=True, timeout=30)
    name = "finlab" if command[2] == "finlab" else "finlab-runtime"
    assert done.stderr == f"{name}: error: cannot print: {reason}\n2\n"


@pytest.mark.parametrize("command", [[*FINLAB, "layout", "show", "A"], [*RUNTIME, "--help"]])
@pytest.mark.parametrize("reader", ["true", "head -c 5"])
def test_a_reader_that_ends_early_gets_no_words(command: list[str], reader: str) -> None:
    line = f"{{ sleep 0.2; {' '.join(command)}; echo $? >&2; }} | {reader}"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=30)
    codes = ("141\n",) if reader == "true" else ("141\n", "0\n")  # as it took all in time, or not
    assert done.stderr in codes


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
    assert done.returncode == 141  # as shells say: 128 + SIGPIPE
    assert (tmp_path / "fin.csv").exists()


def test_unwritable_output_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    file.write_text("in the way")
    assert main(["train", "mdn", "--preset", "smoke", "--output", str(file / "below")]) == 2
    err = capsys.readouterr().err
    assert err.startswith("finlab: error: ") and len(err.splitlines()) == 1


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        (["a", "--json"], ["a", "--json", "-"]),
        (["a", "--json", "--b"], ["a", "--json", "-", "--b"]),
        (["a", "--json", "-o", "x"], ["a", "--json", "-", "-o", "x"]),
        (["a", "--json", "-", "b"], ["a", "--json", "-", "b"]),
        (["a", "--json", "x.json"], ["a", "--json", "x.json"]),
        (["a", "--json=x"], ["a", "--json=x"]),
        ([], []),
    ],
)
def test_json_without_a_file_means_stdout(given: list[str], meant: list[str]) -> None:
    assert with_json_file(given) == meant


@pytest.mark.parametrize(
    "argv",
    [
        ["allocate", "A", *WRENCH],
        ["layout", "show", "A"],
        ["eval", "wrench", "--layouts", "1", "--targets", "1", "--methods", "analytic"],
    ],
)
def test_every_verb_prints_one_object_or_writes_it(
    argv: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*argv, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert main([*argv, "--json", str(tmp_path / "x.json")]) == 0
    assert keys(json.loads((tmp_path / "x.json").read_text())) == keys(shown)
    with pytest.raises(ValueError, match="Expecting value"):
        json.loads(capsys.readouterr().out)  # the table
    assert "json: expected a file in an existing folder" in refused(
        [*argv, "--json", str(tmp_path)]
    )


def keys(value: Any) -> Any:
    """A JSON value without its numbers, which times make differ."""
    if isinstance(value, dict):
        return {key: keys(part) for key, part in value.items()}
    return type(value)


@pytest.mark.parametrize(
    "line",
    [
        *(
            "eval wrench R",
            "eval faults R",
            "eval velocity --layouts R",
            "eval trajectory --layouts R",
        ),
        *(
            "eval faults --trajectory T",
            "eval trajectory --trajectory T",
            "simulate A --trajectory T",
        ),
        *("simulate R", "app --layout R"),
    ],
)
def test_named_files_are_read_in_the_process_with_limits(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = os.getpid()
    places = {"R": tmp_path / "a.yaml", "T": tmp_path / "a.csv"}

    def elsewhere(path: Any, *rest: Any) -> bytes:
        assert os.getpid() != own or Path(path) not in places.values(), "read in this process"
        return read_file(path, *rest)

    for place in places.values():
        place.write_text("t,x: [", encoding="utf-8")
    for module in ("finlab.files.guarded", "finlab.files.csv_table"):
        monkeypatch.setattr(f"{module}.read_file", elsewhere)
    assert f"error: {tmp_path}/a." in refused(
        [str(places.get(word, word)) for word in line.split()]
    )


def test_missing_extra_names_the_command_that_installs_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "webapp"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "viser", None)
    assert main(["app"]) == 2
    sentence = (
        "the web app needs 'viser', which is not installed; run: pip install 'finlab-marine[app]'"
    )
    assert capsys.readouterr().err == f"finlab: error: {sentence}\n"


def test_port_in_use_is_one_sentence() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert str(port) in refused(["app", "--port", str(port)])


@pytest.mark.parametrize("port", ["-1", "70000", "http"])
def test_impossible_port_is_refused(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["app", "--port", port]) == 2
    assert "port" in capsys.readouterr().err


def test_unknown_layout_is_refused() -> None:
    assert "nowhere.yaml" in refused(["app", "--layout", "nowhere.yaml"])
