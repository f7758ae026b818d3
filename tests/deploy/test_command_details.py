"""What the command on the robot prints, the deadline's arithmetic, and files that do not depend on order."""

import json
import os
from concurrent.futures import Future
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finlab.deploy import serve as serve_module
from finlab.deploy.bundle import Bundle
from finlab.deploy.command import main
from finlab.deploy.robot import Robot, parse_robot
from finlab.deploy.self_check import N_WARM, Finding, answer_times
from finlab.deploy.serve import MAX_LINE, Server, Timing

WRENCH = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]


@pytest.fixture(scope="module")
def robot(bundle: Bundle) -> Robot:
    return parse_robot(bundle.files)


@pytest.fixture
def on_board(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> Robot:
    """The command finds this robot in any bundle."""
    monkeypatch.setattr("finlab.deploy.robot.load_robot", lambda *_: robot)
    return robot


@pytest.mark.parametrize(("asked", "answered"), [("-3", 1), ("0", 1), ("1", 1), ("2", 2), ("5", 5)])
def test_speed_answers_as_many_targets_as_asked_and_at_least_one(
    asked: str, answered: int, on_board: Robot, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    counts: list[int] = []

    def times(allocate: Any, targets: np.ndarray) -> tuple[float, float]:
        counts.append(len(targets))
        return 1.234, 56.789

    monkeypatch.setattr("finlab.deploy.self_check.answer_times", times)
    assert main(["speed", "bundle", f"--targets={asked}"]) == 0
    assert counts == [answered]
    assert capsys.readouterr().out.startswith(
        f"{on_board.allocator.name}, 4 fins: p50 1.23 ms, p99 56.79 ms, ready after "
    )


def test_speed_asks_2000_targets_and_says_how_soon_the_robot_was_ready(
    on_board: Robot, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """The clock stands at 5 s as the command starts and at 5.25 s after the first answer."""
    clock, counts = iter([5.0, 5.25]), []

    def times(allocate: Any, targets: np.ndarray) -> tuple[float, float]:
        counts.append(len(targets))
        return 1.0, 2.0

    monkeypatch.setattr("finlab.deploy.self_check.answer_times", times)
    monkeypatch.setattr("finlab.deploy.self_check.peak_memory", lambda: 123.4)
    monkeypatch.setattr(Robot, "allocate", lambda *_: None)
    monkeypatch.setattr("finlab.deploy.command.time", SimpleNamespace(perf_counter=lambda: next(clock)))
    assert main(["speed", "bundle"]) == 0
    assert counts == [2000]
    assert capsys.readouterr().out.endswith(", ready after 0.25 s, peak memory 123 MB\n")


def test_times_are_percentiles_in_milliseconds(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, asked = [0.0], []

    def allocate(target: np.ndarray) -> None:
        asked.append(target[0])
        clock[0] += target[0] / 1e3

    monkeypatch.setattr("time.perf_counter", lambda: clock[0])
    p50, p99 = answer_times(allocate, np.arange(1.0, 102.0)[:, None])
    assert (p50, p99) == pytest.approx((51.0, 100.0))
    assert asked == [*range(1, N_WARM + 1), *range(1, 102)]


@pytest.mark.parametrize(("good", "code"), [(True, 0), (False, 1)])
def test_check_prints_each_finding(
    good: bool, code: int, on_board: Robot, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    findings = [Finding("first", 0.5, 1.0), Finding("second", 0.5 if good else 1.5, 1.0)]
    monkeypatch.setattr("finlab.deploy.self_check.self_check", lambda _: findings)
    assert main(["check", "some.zip"]) == code
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("some.zip: A, 4 fins, method search, ready in ")
    assert lines[1] == "  ok     first: 0.5, allowed 1"
    assert lines[2] == ("  ok     second: 0.5, allowed 1" if good else "  FAILED second: 1.5, allowed 1")
    assert lines[3].startswith("this computer answers" if good else "do not use this bundle here")


def test_allocate_prints_a_table_or_one_object(on_board: Robot, capsys: Any) -> None:
    question = ["allocate", "bundle", "--wrench", *map(str, WRENCH), "--failed", "back_left"]
    truth = on_board.allocate(WRENCH, failed=["back_left"])
    assert main([*question, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["failed"] == ["back_left"] and shown["target"] == WRENCH
    lost = shown["fins"].index("back_left")
    assert shown["command"][lost] is None
    kept = [row for row in shown["command"] if row is not None]
    assert np.array(kept) == pytest.approx(np.delete(truth.command, lost, axis=0))
    assert shown["err_norm"] == pytest.approx(truth.err_norm)
    assert shown["sigma"] == truth.sigma.tolist() and shown["judged_by"] == "plant"
    assert main(question) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "fin          A [rad]  f [Hz]  zero direction [rad]"
    assert lines[1 + lost] == "back_left    failed"
    a, f, d = truth.command[0]
    assert lines[1] == f"front_right  {a:7.3f}  {f:6.3f}  {d:20.3f}"


def test_below_the_table_stand_its_figures_and_each_note(
    on_board: Robot, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    told = replace(on_board.allocate(WRENCH, policy="direction", seed=3), notes=("first note", "second note"))
    asked: list[Any] = []

    def answer(_: Robot, *arguments: Any, **options: Any) -> Any:
        asked.append((*arguments, options))
        return told

    monkeypatch.setattr(Robot, "allocate", answer)
    line = ["allocate", "bundle", "--wrench", *map(str, WRENCH), "--policy=direction", "--seed=3"]
    assert main(line) == 0
    assert asked == [(WRENCH, {"failed": [], "policy": "direction", "seed": 3})]
    lines = capsys.readouterr().out.splitlines()
    assert lines[5].startswith(f"err_norm {told.err_norm:.2e}   power {told.power:.3f} W   energy ")
    assert lines[6:] == ["first note", "second note"]


def test_one_core_is_enough_unless_somebody_says_otherwise(
    on_board: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    monkeypatch.setattr("finlab.deploy.self_check.self_check", lambda _: [])
    for chosen in names:
        for name in names:
            monkeypatch.delenv(name, raising=False)
        monkeypatch.setenv(chosen, "7")
        assert main(["check", "bundle"]) == 0
        assert {name: os.environ[name] for name in names} == {**dict.fromkeys(names, "1"), chosen: "7"}


@pytest.mark.parametrize(
    ("text", "code"), [("0", 2), ("-1", 2), ("1e6", 2), ("nan", 2), ("0.001", 0), ("999999", 0)]
)
def test_deadlines_are_positive_and_finite(
    text: str, code: int, on_board: Robot, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    timings: list[Timing] = []

    class Spy(Server):
        def __init__(self, robot: Robot, timing: Timing) -> None:
            timings.append(timing)

        def run(self, transport: Any) -> None:
            pass

    monkeypatch.setattr(serve_module, "Server", Spy)
    monkeypatch.setattr("finlab.deploy.transport.StandardStreams", lambda *_: None)
    monkeypatch.setattr("sys.stdin", type("Pipe", (), {"buffer": None}))
    arguments = ["serve", "bundle", f"--deadline-ms={text}", "--watchdog-s=0"]
    if code:
        with pytest.raises(SystemExit) as stopped:
            main(arguments)
        assert stopped.value.code == code and not timings
        return
    assert main(arguments) == 0
    assert timings == [Timing(float(text) / 1e3, None)]
    assert main(["serve", "bundle"]) == 0
    assert timings[1] == Timing(None, 1.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "the following arguments are required: check|allocate|serve|speed"),
        (["fly", "bundle"], "invalid choice: 'fly'"),
        (["check"], "the following arguments are required: BUNDLE"),
        (["allocate", "bundle"], "the following arguments are required: --wrench"),
        (["allocate", "bundle", "--wrench", "1"], "--wrench: expected 6 arguments"),
        (["allocate", "bundle", "--wrench", *"123456", "--policy=hope"], "invalid choice: 'hope'"),
        (["serve", "bundle", "--udp=here"], "--udp: invalid int value: 'here'"),
    ],
)
def test_a_wrong_call_ends_with_usage_and_2(arguments: list[str], message: str, capsys: Any) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    told = capsys.readouterr().err
    assert stopped.value.code == 2 and told.startswith("usage: finlab-runtime ") and message in told


@pytest.mark.parametrize(("stopped", "code"), [(KeyboardInterrupt, 130), (BrokenPipeError, 141)])
def test_an_end_from_outside_has_the_shells_code(
    stopped: type[BaseException], code: int, monkeypatch: pytest.MonkeyPatch, capfd: Any
) -> None:
    """128 plus the signal: 2 for Ctrl-C, 13 for a pipe that nobody reads."""

    def load(*_: Any) -> Robot:
        raise stopped

    monkeypatch.setattr("finlab.deploy.robot.load_robot", load)
    assert main(["check", "bundle"]) == code
    assert capfd.readouterr().err == ""


class Busy(Future[Any]):
    """Work that never ends, and how long it is waited for."""

    def __init__(self) -> None:
        super().__init__()
        self.waited: list[float | None] = []

    def result(self, timeout: float | None = None) -> Any:
        self.waited.append(timeout)
        raise serve_module.TooLate


def test_waiting_ends_at_the_deadline(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 2 s, 0.5 s go by before the other target is waited for, and as many after it."""
    clock, waits, work = iter(np.arange(0.0, 10.0, 0.5)), [], Busy()
    server = Server(robot, Timing(deadline=2.0))
    monkeypatch.setattr("finlab.deploy.serve.time.perf_counter", lambda: float(next(clock)))
    monkeypatch.setattr(server._worker, "submit", lambda _: work)
    monkeypatch.setattr(serve_module, "wait", lambda _, timeout: waits.append(timeout))
    line = json.dumps({"wrench": WRENCH}).encode()
    assert server.answer(line)["status"] == "late"  # asks the clock at 0 and 0.5
    assert work.waited == [1.5] and waits == []
    assert server.answer(line)["status"] == "late"  # at 1 and 1.5: the first is still busy
    assert work.waited == [1.5] and waits == [1.5]
    work.set_result(None)
    assert server.answer(line)["status"] == "late"  # at 2, 2.5 and 3
    assert work.waited == [1.5, 1.0] and waits == [1.5, 1.5]
    clock = iter([0.0, 5.0, 9.0])  # past the deadline nothing is waited for
    assert server.answer(line)["status"] == "late"
    assert work.waited[-1] == 0.0 and waits[-1] == 0.0


class Clock:
    """Time that only the transport lets pass: 0.3 s before each request."""

    def __init__(self, *requests: bytes | None) -> None:
        self.now, self.requests = 100.0, list(requests)
        self.waits: list[float | None] = []
        self.sent: list[str] = []

    def newest(self, timeout: float | None) -> bytes | None:
        self.waits.append(timeout)
        self.now += 0.3
        if not self.requests:
            raise EOFError
        return self.requests.pop(0)

    def send(self, line: bytes) -> None:
        assert line.endswith(b"}\n")
        self.sent.append(json.loads(line)["status"])


def test_only_good_targets_and_rest_wind_up_the_watchdog(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    good, bad = json.dumps({"wrench": WRENCH}).encode(), b"nonsense"
    clock = Clock(good, bad, bad, good, bad, bad, bad, bad, None)
    monkeypatch.setattr("finlab.deploy.serve.time.monotonic", lambda: clock.now)
    Server(robot, Timing(watchdog=1.0)).run(clock)
    assert clock.sent == ["ok", *["error"] * 2, "ok", *["error"] * 4, "neutral", "neutral"]
    assert clock.waits == pytest.approx([1.0, 1.0, 0.7, 0.4, 1.0, 0.7, 0.4, 0.1, 0.0, 1.0])
    clock = Clock(good, bad)
    Server(robot, Timing(watchdog=None)).run(clock)
    assert clock.waits == [None] * 3


def test_rest_forgets_the_last_commands_and_keeps_lost_fins(robot: Robot) -> None:
    server = Server(robot, Timing())
    lost = robot.layout.names[1]
    assert server.answer(json.dumps({"wrench": WRENCH, "failed": [lost]}).encode())["status"] == "ok"
    assert server._sent is not None
    rest = server._rest()
    assert server._sent is None and rest["id"] is None and rest["fins"] == list(robot.layout.names)
    assert [row is None for row in rest["command"]] == [name == lost for name in robot.layout.names]


def test_the_longest_request_that_is_read(robot: Robot) -> None:
    line = json.dumps({"wrench": WRENCH}).encode()
    server = Server(robot, Timing())
    assert server.answer(line.ljust(MAX_LINE))["status"] == "ok"
    assert server.answer(line.ljust(MAX_LINE + 1))["error"] == "request: longer than 65536 bytes"
