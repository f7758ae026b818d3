"""The loop on board: newest target first, silence leads to rest, and so does every end."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.deploy import serve as serve_module
from finlab.deploy.bundle import Bundle, make_bundle
from finlab.deploy.deployed_robot import DeployedRobot, parse_robot
from finlab.deploy.serve import RECENT_S, Server
from finlab.deploy.transport import MAX_LINE, SIGNALS, Line, StandardStreams, Unsent
from finlab.errors import DataError, FinlabError
from finlab.layout import load_layout
from finlab.layout.layout import Bus

GOOD_REQUEST: dict[str, Any] = {"wrench": [1, 0, 0.5, 0, 0, 0.1]}
"""A request that is answered."""
GOOD_LINE = json.dumps(GOOD_REQUEST).encode() + b"\n"
"""The same as a line of the protocol."""


@pytest.fixture(scope="module")
def robot(bundle: Bundle) -> DeployedRobot:
    """The robot of a bundle."""
    return parse_robot(bundle.files)


@pytest.fixture(scope="module")
def folder(bundle: Bundle, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bundle of robot A, unpacked."""
    path = tmp_path_factory.mktemp("robots") / "A"
    bundle.write(path)
    return path


class Script:
    """A transport that plays requests (None is silence) and keeps what was sent; its clock alone
    moves on, by
    0.3 s with each request."""

    def __init__(self, *requests: Any) -> None:
        self.now = 100.0
        self.requests = list(requests)
        self.sent: list[dict[str, Any]] = []
        self.waits: list[float | None] = []

    def newest(self, timeout: float | None) -> Line | None:
        """The next of the requests, which costs 0.3 s; an exception in their place is raised."""
        self.waits.append(timeout)
        self.now += 0.3
        if not self.requests:
            raise EOFError
        request = self.requests.pop(0)
        if isinstance(request, Exception):
            raise request
        if request is None:
            return None
        text = request if isinstance(request, bytes) else json.dumps(request).encode()
        return Line(text, max(self.now, time.monotonic()))

    def send(self, line: bytes) -> None:
        """Keep a reply, which must be one line of JSON."""
        assert line.endswith(b"}\n")
        self.sent.append(json.loads(line, parse_constant=pytest.fail))


def served(
    robot: DeployedRobot, *requests: Any, watchdog: float | None = 1.0
) -> list[dict[str, Any]]:
    """Replies of a server to requests, until they end."""
    script = Script(*requests)
    Server(robot, watchdog).run(script)
    return script.sent


def test_answers_like_the_library(robot: DeployedRobot) -> None:
    first, end = served(robot, {**GOOD_REQUEST, "id": 7, "lost": ["back_left"]})
    truth = robot.allocate(GOOD_REQUEST["wrench"], lost=["back_left"])
    assert (first["id"], first["status"]) == (7, "ok") and first["fins"] == list(truth.names)
    assert first["command"][2] is None
    np.testing.assert_array_equal(first["command"][0], truth.command[0])
    assert [first[key] for key in ("err_norm", "power")] == [truth.err_norm, truth.power]
    ahead = served(robot, {**GOOD_REQUEST, "reference": [[2, 0, 0.5, 0, 0, 0.1]] * 9})[0]
    assert ahead["wrench"][0] == pytest.approx(2.0, abs=1e-3), "fins will have followed by then"
    assert end["status"] == "neutral" and end["command"][2] is None, (
        "a lost fin gets no command at the end"
    )


@pytest.mark.parametrize("id_", [None, 0, -1.5, "a", [1, "x"], {"of": [None, True]}])
def test_an_id_of_any_kind_comes_back(id_: Any, robot: DeployedRobot) -> None:
    assert served(robot, {**GOOD_REQUEST, "id": id_})[0]["id"] == id_


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        (b"nonsense", "request: is not valid JSON"),
        (b"[" * 60_000, "request: is nested too deeply"),
        (b"x" * 70_000, "longer than 65536 bytes"),
        (GOOD_LINE.strip().ljust(MAX_LINE + 1), "longer than 65536 bytes"),
        ({"wrench": [1, 2]}, "expected six numbers"),
        ({"wrench": [True, 0, 0, 0, 0, 0]}, "wrench: expected six numbers"),
        ({"wrench": [1, 0, "1", 0, 0, 0]}, "wrench: expected six numbers"),
        ({"wrench": "1"}, "wrench: expected six numbers"),
        ({**GOOD_REQUEST, "flow": [1, 0, 0, 0, 0, False]}, "flow: expected six numbers"),
        ({**GOOD_REQUEST, "reference": [["1", 0, 0, 0, 0, 0]]}, "reference: expected an array"),
        ({"force": [1, 2]}, "force: unknown key, expected one of wrench, id"),
        ({**GOOD_REQUEST, "speed": 3}, "request: speed: unknown key"),
        ({**GOOD_REQUEST, "lost": "back_left"}, "lost: expected a list, got 'back_left'"),
        ({**GOOD_REQUEST, "lost": ["nobody"]}, "no fin 'nobody'"),
        ({**GOOD_REQUEST, "policy": "hope"}, "policy: expected one of"),
        ({**GOOD_REQUEST, "policy": 3}, "policy: expected text, got 3"),
        ({**GOOD_REQUEST, "flow": [1, 0, 0]}, "flow: expected six numbers"),
        (
            {**GOOD_REQUEST, "reference": [1, 0, 0, 0, 0, 0]},
            r"reference: expected an array of shape \(N, 6\)",
        ),
        ({**GOOD_REQUEST, "id": "x" * 1000}, "id: longer than 1000 characters"),
        ({**GOOD_REQUEST, "id": float("nan")}, "holds NaN, expected a finite number"),
        ({**GOOD_REQUEST, "id": [float("-inf")]}, "holds -Infinity, expected a finite"),
        (GOOD_LINE.replace(b"}", b', "id": 1e999}'), "holds 1e999, expected a finite"),
        ({"wrench": [float("nan")] * 6}, "holds NaN, expected a finite number"),
        ({"wrench": [10**400, 0, 0, 0, 0, 0]}, "a number of 401 digits"),
    ],
)
def test_bad_requests_get_one_sentence_and_no_commands(
    request_: Any, message: str, robot: DeployedRobot
) -> None:
    reply = served(robot, request_)[0]
    assert reply["status"] == "error" and "command" not in reply
    with pytest.raises(FinlabError, match=message):
        raise FinlabError(reply["error"])


@pytest.mark.parametrize(
    ("request_", "name"),
    [
        ({"wrench": [1, 2], "id": 7}, 7),
        ({"wrench": [1, 0, 0, 0, 0, 0], "id": "a", "speed": 3}, "a"),
        ({"id": [1, {"k": None}]}, [1, {"k": None}]),
        ({**GOOD_REQUEST, "id": 8, "lost": "back_left"}, 8),
        ({**GOOD_REQUEST, "id": 9, "policy": 3}, 9),
        ({**GOOD_REQUEST, "id": "x" * 1000}, None),
        (b'{"id": 7, "wrench": ', None),
        (b"[7]", None),
    ],
)
def test_a_refused_request_gets_its_id_back(request_: Any, name: Any, robot: DeployedRobot) -> None:
    """Where it can be read, and is short enough to be sent."""
    reply = served(robot, request_)[0]
    assert reply["status"] == "error" and reply["id"] == name


def test_only_good_targets_and_rest_wind_up_the_watchdog(
    robot: DeployedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = Script(GOOD_REQUEST, b"nonsense", b"nonsense", GOOD_REQUEST, *[b"nonsense"] * 4, None)
    monkeypatch.setattr("finlab.deploy.serve.time.monotonic", lambda: script.now)
    Server(robot, 1.0).run(script)
    status = [reply["status"] for reply in script.sent]
    assert status == [
        "ok",
        *["error"] * 2,
        "ok",
        *["error"] * 3,
        "neutral",
        "error",
        *["neutral"] * 2,
    ]
    assert script.waits == pytest.approx([1.0, 1.0, 0.7, 0.4, 1.0, 0.7, 0.4, 0.1, 1.0, 1.0])
    np.testing.assert_array_equal(np.array(script.sent[-1]["command"]), robot.neutral())
    script = Script(GOOD_REQUEST, b"nonsense")
    Server(robot, None).run(script)
    assert script.waits == [None] * 3


def test_the_fins_rest_before_an_error_that_nobody_foresaw_is_told(robot: DeployedRobot) -> None:
    script = Script(GOOD_REQUEST, ZeroDivisionError("a fault of ours"))
    with pytest.raises(ZeroDivisionError, match="a fault of ours"):
        Server(robot).run(script)
    assert [reply["status"] for reply in script.sent] == ["ok", "neutral"]


def test_commands_change_no_faster_than_servos_do(
    robot: DeployedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr(serve_module.time, "monotonic", lambda: now[0])
    server = Server(robot)
    forwards, backwards = (json.dumps({"wrench": [x, 0, 0.5, 0, 0, 0]}).encode() for x in (1, -1))
    before = np.array(server.answers(forwards)[0]["command"])
    truth = robot.allocate([-1, 0, 0.5, 0, 0, 0], previous=before)
    assert truth.err_norm > 0.05, "forwards and backwards are ticks apart"
    np.testing.assert_allclose(
        np.array(server.answers(backwards)[0]["command"]), truth.command, atol=1e-9
    )
    now[0] += RECENT_S
    assert server.answers(forwards)[0]["err_norm"] < 1e-5, "commands of long ago bind no more"


def test_thrusters_and_rudders_rest_in_their_own_words() -> None:
    script = Script(None)
    Server(DeployedRobot(Allocator(load_layout("turtle_hybrid")), ("lift_right",))).run(script)  # type: ignore[arg-type]
    assert [reply["status"] for reply in script.sent] == ["neutral", "neutral"]
    told = {part["name"]: part for part in script.sent[0]["actuators"]}
    assert tuple(told) == load_layout("turtle_hybrid").names and "command" not in script.sent[0]
    assert told["lift_left"] == {
        "name": "lift_left",
        "type": "thruster",
        "force_n": 0.0,
        "command": {"force_n": 0.0},
    }
    assert told["lift_right"]["command"] is None
    assert told["front_left"]["command"]["frequency_hz"] == 0.1


def test_an_answer_that_is_no_number_is_an_error(
    robot: DeployedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    healthy = type(robot.allocator).allocate

    def broken(self: Any, *arguments: Any, **options: Any) -> Any:
        answer = healthy(self, *arguments, **options)
        return answer.with_command(answer.command * np.nan)

    monkeypatch.setattr(type(robot.allocator), "allocate", broken)
    rest, reply = served(robot, GOOD_REQUEST)[:2]
    assert rest["status"] == "neutral" and "command" not in reply
    assert reply["status"] == "error" and "answers with NaN" in reply["error"]


@pytest.mark.parametrize(
    "fault", [IndexError("of ours"), MemoryError(), RecursionError(), DataError("gone")]
)
def test_after_a_fault_in_a_solve_the_robot_rests_and_the_next_request_is_answered(
    fault: Exception, robot: DeployedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    healthy = type(robot.allocator).allocate

    def broken(self: Any, wrench: Any, **options: Any) -> Any:
        if wrench[0] > 5.0:
            raise fault
        return healthy(self, wrench, **options)

    monkeypatch.setattr(type(robot.allocator), "allocate", broken)
    lost = {"lost": ["back_left"]}
    sent = served(
        robot, GOOD_REQUEST | lost, {"wrench": [9, 0, 0, 0, 0, 0], "id": 3}, GOOD_REQUEST | lost
    )
    assert [reply["status"] for reply in sent] == ["ok", "neutral", "error", "ok", "neutral"]
    assert sent[2]["id"] == 3 and type(fault).__name__ in sent[2]["error"]
    assert sent[1]["command"][2] is None and sent[3]["command"][2] is None


@pytest.mark.parametrize(
    "refused", [{"policy": "hope"}, {"wrench": [1, 2]}, {"flow": [1]}, {"wrench": [None] * 6}]
)
def test_a_refused_request_does_not_decide_which_fins_beat(
    refused: dict[str, Any], robot: DeployedRobot
) -> None:
    lost = {"lost": ["back_left"]}
    for first, second in (
        (GOOD_REQUEST | lost, GOOD_REQUEST | refused),
        (GOOD_REQUEST, GOOD_REQUEST | lost | refused),
    ):
        good, error, end = served(robot, first, second)
        assert error["status"] == "error" and end["status"] == "neutral"
        assert [row is None for row in end["command"]] == [row is None for row in good["command"]]


def test_axes_that_are_not_commanded_are_null(robot: DeployedRobot) -> None:
    reply = served(robot, {"wrench": [0.5, 9, 0.5, 0, 0, 0], "free": ["Fy", "Tx", "Ty"]})[0]
    assert reply["target"] == [0.5, None, 0.5, None, None, 0.0]
    assert reply["err_norm"] < 1e-6 and reply["unallocated"][1] == 0.0
    refused = served(robot, {"wrench": [0.5, None, 0.5, 0, 0, 0]})[0]
    assert refused["status"] == "error" and 'free=("Fy",)' in refused["error"]


def test_a_request_may_limit_the_power_of_a_bus() -> None:
    layout = load_layout("bluerov2_heavy")
    buses = (Bus("front", 500.0, layout.names[:2]), Bus("rear", 500.0, layout.names[2:4]))
    robot = parse_robot(make_bundle(Allocator(replace(layout, buses=buses))).files)
    request = {"wrench": [60, 20, 10, 0, 0, 4], "policy": "direction", "power": {"rear": 20}}
    reply = served(robot, request)[0]
    known = robot.allocate(request["wrench"], policy="direction", power={"rear": 20.0})
    assert "bus rear" in known.binding
    assert reply["power"] == pytest.approx(known.power, rel=1e-9)
    refused = served(robot, {**request, "power": {"aft": 20}})[0]
    assert "has front, rear, got bus 'aft'" in json.dumps(refused)


def test_a_request_may_limit_the_power(robot: DeployedRobot) -> None:
    request = {"wrench": [2.0, 0, 1.0, 0, 0, 0], "policy": "direction"}
    watts = 0.5 * robot.allocate(request["wrench"], policy="direction").power
    reply = served(robot, {**request, "power": watts})[0]
    assert reply["status"] == "ok" and reply["err_norm"] > 1e-3
    assert reply["power"] == pytest.approx(watts, rel=1e-6)
    refused = served(robot, {**request, "power": -1})[0]
    assert refused["status"] == "error" and "expected watts above 0" in refused["error"]


def test_what_waited_longer_than_the_watchdog_allows_is_dropped(
    robot: DeployedRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before a solve, and after one in which the process paused; after silence, rest comes
    first."""
    now = [100.0]
    monkeypatch.setattr(serve_module.time, "monotonic", lambda: now[0])
    answer = Server.answers

    def paused(self: Server, line: bytes) -> list[dict[str, Any]]:
        replies = answer(self, line)
        now[0] += 4.0 * (b"slow" in line)
        return replies

    monkeypatch.setattr(Server, "answers", paused)

    class Late(Script):
        """Requests that have waited for some time, each after a silence."""

        def newest(self, timeout: float | None) -> Line | None:
            if not self.requests:
                raise EOFError
            age, silence, name = self.requests.pop(0)
            now[0] += silence
            return Line(json.dumps(GOOD_REQUEST | {"id": name}).encode(), now[0] - age)

    script = Late(
        (0.0, 0.1, "a"), (3.9, 4.0, "old"), (0.0, 0.1, "b"), (0.0, 0.1, "slow"), (0.0, 0.1, "c")
    )
    Server(robot, 1.0).run(script)
    told = [(reply["status"], reply["id"]) for reply in script.sent]
    rest = ("neutral", None)
    assert told == [("ok", "a"), rest, ("ok", "b"), rest, ("ok", "c"), rest]


@pytest.fixture
def streams() -> Iterator[StandardStreams]:
    """Standard streams with their signal handlers; those of before come back at the end."""
    before = {number: signal.getsignal(number) for number in (*SIGNALS, signal.SIGALRM)}
    yield StandardStreams()
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def requests(streams: StandardStreams) -> Iterator[int]:
    """Where requests to the streams are written, whose answers nobody reads."""
    source, end = os.pipe()
    streams.open(source, os.open("/dev/null", os.O_WRONLY))
    yield end
    os.close(end)


def text(line: Line | None) -> bytes:
    """The text of a line; empty where there is none."""
    return b"" if line is None else line.text


def test_streams_keep_only_the_newest_request(streams: StandardStreams) -> None:
    source, requests = os.pipe()
    answers, sink = os.pipe()
    streams.open(source, sink)
    assert streams.newest(0.0) is None and streams.newest(0.02) is None
    os.write(requests, b"one\n\ntwo\nthree\n   \n")
    assert text(streams.newest(1.0)) == b"three"
    streams.send(b"answer\n")
    assert os.read(answers, 100) == b"answer\n"
    os.write(requests, b"begun")
    assert streams.newest(0.02) is None
    os.write(requests, b" and ended\n" + b"x" * 9_000 + b"\nthe last")
    assert text(streams.newest(1.0)) == b"x" * 9_000
    os.close(requests)
    assert text(streams.newest(None)) == b"the last", "the end of a line may be missing"
    with pytest.raises(EOFError):
        streams.newest(None)
    os.close(answers)
    with pytest.raises(Unsent, match="Broken pipe; the neutral command was not sent"):
        streams.send(b"to nobody\n")


def test_a_line_without_end_takes_no_memory_and_no_time(
    streams: StandardStreams, requests: int
) -> None:
    for _ in range(100):
        os.write(requests, bytes(MAX_LINE))
    assert streams.newest(0.1) is None
    os.write(requests, b"\n")
    assert len(text(streams.newest(10.0))) == MAX_LINE + 1, "enough to refuse it"


def test_a_line_is_as_old_as_its_first_byte_may_be(streams: StandardStreams) -> None:
    source, requests = os.pipe()
    sink = os.open("/dev/null", os.O_WRONLY)
    begin = time.monotonic()
    streams.open(source, sink)
    os.write(requests, b"be")
    time.sleep(0.2)
    os.write(requests, b"gun\n")
    first = streams.newest(1.0)
    assert first is not None and begin <= first.since < begin + 0.15
    time.sleep(0.1)
    before = time.monotonic()
    os.write(requests, b"new\n")
    second = streams.newest(1.0)
    assert second is not None and before - 0.1 < second.since <= time.monotonic()
    os.close(requests)


def test_requests_that_nobody_takes_need_no_memory(requests: int) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(2_000):
        os.write(requests, b"x" * 60_000 + b"\n")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 30_000, "kB, of 120 MB"


def test_a_signal_ends_waiting_and_sending(
    streams: StandardStreams, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("finlab.deploy.transport.SEND_TIMEOUT_S", 0.05)
    source, requests = os.pipe()
    _, sink = os.pipe()
    os.write(requests, GOOD_LINE)
    streams.open(source, sink)
    signal.raise_signal(signal.SIGTERM)
    with pytest.raises(EOFError):
        streams.newest(None)
    with pytest.raises(Unsent, match="its reader took nothing for 0.05 s"):
        streams.send(b"x" * 1_000_000)


def started(folder: Path, *options: str, **streams: Any) -> subprocess.Popen[bytes]:
    """A server as a process of its own."""
    command = [sys.executable, "-m", "finlab.deploy.command", "serve", str(folder), *options]
    return subprocess.Popen(
        command, **{"stdin": subprocess.PIPE, "stderr": subprocess.PIPE, **streams}
    )


def pipe(end: IO[bytes] | None) -> IO[bytes]:
    """A stream of a process that was asked for."""
    assert end is not None
    return end


def answering(folder: Path, *options: str) -> subprocess.Popen[bytes]:
    """A service that has answered a request."""
    service = started(folder, *options, stdout=subprocess.PIPE)
    pipe(service.stdin).write(GOOD_LINE)
    pipe(service.stdin).flush()
    assert json.loads(pipe(service.stdout).readline())["status"] == "ok"
    return service


def ended(service: subprocess.Popen[bytes]) -> tuple[list[str], str]:
    """The status of each line that was still to be read, and what was said on stderr."""
    out, told = service.communicate(timeout=60)
    return [json.loads(line)["status"] for line in out.splitlines()], told.decode()


def test_after_a_pause_of_the_process_the_first_line_is_rest(folder: Path) -> None:
    """A feeder goes on meanwhile, and its targets of that time are not followed."""
    service = started(folder, "--watchdog-s=0.5", stdout=subprocess.PIPE)
    feed = pipe(service.stdin)
    out = pipe(service.stdout)
    for paused in (False, True):
        for i in range(15):
            feed.write(json.dumps(GOOD_REQUEST | {"id": [paused, i]}).encode() + b"\n")
            feed.flush()
            while not paused:
                reply = json.loads(out.readline())
                if reply["id"] == [False, i]:
                    break
                assert reply["status"] == "neutral"
            time.sleep(0.07 * paused)
        service.send_signal(signal.SIGCONT if paused else signal.SIGSTOP)
    reply = json.loads(out.readline())
    assert reply["status"] == "neutral"
    # What comes before the service has read the old lines counts as old as they are: ask again.
    while reply["status"] == "neutral":
        feed.write(json.dumps(GOOD_REQUEST | {"id": "new"}).encode() + b"\n")
        feed.flush()
        reply = json.loads(out.readline())
    assert reply["id"] == "new"
    feed.close()
    service.wait(60)


@pytest.fixture
def hangup_ends() -> Iterator[None]:
    """SIGHUP as it is by default, which the service inherits, also where the tests run by nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.usefixtures("hangup_ends")
@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("part", [b"", b'{"wrench": [1, '])
def test_the_fins_rest_once_when_told_to_stop(
    number: signal.Signals, part: bytes, folder: Path
) -> None:
    service = answering(folder, "--no-watchdog")
    pipe(service.stdin).write(part)
    pipe(service.stdin).flush()
    service.send_signal(number)
    service.wait(60)
    assert ended(service) == (["neutral"], "") and service.returncode == 0


@pytest.mark.parametrize(("part", "status"), [(b"", ["neutral"]), (b'{"wr', ["error", "neutral"])])
def test_the_fins_rest_once_when_the_requests_end(
    part: bytes, status: list[str], folder: Path
) -> None:
    service = answering(folder)
    pipe(service.stdin).write(part)
    assert ended(service) == (status, "") and service.returncode == 0


def test_a_reader_that_ends_is_noticed_at_the_next_answer(folder: Path) -> None:
    service = answering(folder, "--watchdog-s=0.2")
    pipe(service.stdout).close()
    assert service.wait(60) == 2
    told = pipe(service.stderr).read().decode()
    assert told.startswith("finlab-runtime: error: standard output: Broken pipe;")
    assert told.count("\n") == 1


@pytest.mark.parametrize(("closed", "full"), [("0<&-", ""), ("1>&-", ""), ("", "1>/dev/full")])
def test_without_streams_it_ends_with_a_sentence(closed: str, full: str, folder: Path) -> None:
    command = f"exec {sys.executable} -m finlab.deploy.command serve {folder} {closed} {full}"
    done = subprocess.run(["sh", "-c", command], input=GOOD_LINE, capture_output=True, timeout=60)
    told = done.stderr.decode()
    assert done.returncode == 2 and told.count("\n") == 1
    assert told.startswith("finlab-runtime: error: ") and "standard " in told


@pytest.mark.parametrize(
    "option",
    [f"--watchdog-s={text}" for text in ("nan", "-1", "inf", "0", "1e-9", "1e9", "soon", "")],
)
def test_times_are_finite_and_above_zero(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    from finlab.deploy.command import main

    assert main(["serve", "bundle", option]) == 2
    name, text = option.split("=")
    error = capsys.readouterr().err
    assert f"argument {name}: expected a number from" in error
    assert error.endswith(f"got {text!r}\n")
