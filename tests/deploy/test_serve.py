"""The loop on board: newest target first, deadlines kept, silence leads to rest."""

import io
import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.allocation import Allocation
from finlab.deploy.bundle import Bundle
from finlab.deploy.robot import Robot, parse_robot
from finlab.deploy.serve import MAX_LINE, RECENT_S, Server, Timing
from finlab.deploy.transport import LoopbackUdp, StandardStreams
from finlab.errors import FinlabError

GOOD = {"wrench": [1, 0, 0.5, 0, 0, 0.1]}


@pytest.fixture(scope="module")
def robot(bundle: Bundle) -> Robot:
    return parse_robot(bundle.files)


class Script:
    """A transport that plays requests (None is silence) and keeps what was sent."""

    def __init__(self, *requests: Any) -> None:
        self.requests = list(requests)
        self.sent: list[dict[str, Any]] = []
        self.waits: list[float | None] = []

    def newest(self, timeout: float | None) -> bytes | None:
        self.waits.append(timeout)
        if not self.requests:
            raise EOFError
        request = self.requests.pop(0)
        if request is None:
            time.sleep(timeout or 0.0)
            return None
        return request if isinstance(request, bytes) else json.dumps(request).encode()

    def send(self, line: bytes) -> None:
        self.sent.append(json.loads(line))


def served(robot: Robot, *requests: Any, timing: Timing | None = None) -> Script:
    script = Script(*requests)
    Server(robot, timing or Timing()).run(script)
    return script


def test_answers_like_the_library(robot: Robot) -> None:
    first, end = served(robot, {**GOOD, "id": 7, "failed": ["back_left"]}).sent
    truth = robot.allocate(GOOD["wrench"], failed=["back_left"])
    assert (first["id"], first["status"]) == (7, "ok") and first["fins"] == list(truth.fins)
    assert first["command"][2] is None
    np.testing.assert_array_equal(first["command"][0], truth.command[0])
    assert [first[key] for key in ("err_norm", "energy", "power")] == [
        truth.err_norm,
        truth.energy,
        truth.power,
    ]
    ahead = served(robot, {**GOOD, "reference": [[2, 0, 0.5, 0, 0, 0.1]] * 9}).sent[0]
    assert ahead["wrench"][0] == pytest.approx(2.0, abs=1e-3), "fins will have followed by then"
    assert end["status"] == "neutral" and end["command"][2] is None, "a lost fin gets no command at the end"


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        (b"nonsense", "expected one JSON object"),
        (b"[" * 60_000, "expected one JSON object"),
        (b"x" * 70_000, "longer than 65536 bytes"),
        ({"wrench": [1, 2]}, "expected six numbers"),
        ({"force": [1, 2]}, "expected {.wrench.:"),
        ({**GOOD, "speed": 3}, "unknown key 'speed'"),
        ({**GOOD, "failed": "back_left"}, "failed: expected a list of fin names"),
        ({**GOOD, "failed": ["nobody"]}, "no fin 'nobody'"),
        ({**GOOD, "policy": "hope"}, "policy: expected one of"),
        ({**GOOD, "policy": 3}, "policy: expected a name"),
        ({**GOOD, "reference": [1, 0, 0, 0, 0, 0]}, r"reference: expected an array of shape \(N, 6\)"),
        ({"wrench": [float("nan")] * 6}, "Fx must be finite"),
    ],
)
def test_bad_requests_get_one_sentence_and_no_commands(request_: Any, message: str, robot: Robot) -> None:
    reply = served(robot, request_).sent[0]
    assert reply["status"] == "error" and "command" not in reply
    with pytest.raises(FinlabError, match=message):
        raise FinlabError(reply["error"])


def test_silence_leads_to_rest_and_nonsense_is_silence(robot: Robot) -> None:
    script = served(robot, GOOD, b"nonsense", b"nonsense", None, timing=Timing(watchdog=0.2))
    assert [reply["status"] for reply in script.sent] == ["ok", "error", "error", "neutral", "neutral"]
    waits = [wait for wait in script.waits[1:4] if wait is not None]
    assert waits == sorted(waits, reverse=True) and waits[0] <= 0.2, "nonsense does not feed the watchdog"
    rest = np.array(script.sent[3]["command"])
    np.testing.assert_array_equal(rest, robot.neutral())


class Slow(Robot):
    """A robot whose computer is busy."""

    def __init__(self, robot: Robot, delay: float) -> None:
        super().__init__(robot.graph, robot.allocator)
        vars(self)["delay"] = delay

    def allocate(self, *args: Any, **options: Any) -> Allocation:
        time.sleep(vars(self)["delay"])
        return super().allocate(*args, **options)


def test_deadline_repeats_what_was_sent_last(robot: Robot) -> None:
    slow = Slow(robot, 0.0)
    server = Server(slow, Timing(deadline=0.15))
    line = json.dumps(GOOD).encode()
    assert server.answer(line)["status"] == "ok"
    sent = server.answer(line)["command"]
    vars(slow)["delay"] = 0.4
    start = time.perf_counter()
    late = server.answer(json.dumps({"wrench": [0, 0, 2, 0, 0, 0], "id": 1}).encode())
    assert time.perf_counter() - start < 0.3
    assert late["status"] == "late" and late["command"] == sent
    assert server.answer(line)["status"] == "late", "the computer is still busy with the other target"
    vars(slow)["delay"] = 0.0
    time.sleep(0.6)
    assert server.answer(line)["status"] == "ok"


def test_first_answer_too_late_is_neutral(robot: Robot) -> None:
    late = Server(Slow(robot, 0.3), Timing(deadline=0.01)).answer(json.dumps(GOOD).encode())
    assert late["status"] == "late"
    np.testing.assert_array_equal(np.array(late["command"]), robot.neutral())


def test_commands_change_no_faster_than_servos_do(robot: Robot) -> None:
    wrenches = [[1, 0, 0.5, 0, 0, 0.1], [-1, 0.1, 0.5, 0, 0, 0.1]]
    replies = served(robot, *({"wrench": w} for w in wrenches)).sent
    before = np.array(replies[0]["command"])
    truth = robot.allocate(wrenches[1], previous=before)
    assert truth.err_norm > 0.1  # forwards and backwards are ticks apart
    np.testing.assert_allclose(np.array(replies[1]["command"]), truth.command, atol=1e-9)


def test_commands_of_long_ago_bind_no_more(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    server = Server(robot, Timing())
    forwards, backwards = (json.dumps({"wrench": [x, 0, 0.5, 0, 0, 0]}).encode() for x in (1, -1))
    server.answer(forwards)
    assert server.answer(backwards)["err_norm"] > 0.1
    later = time.monotonic() + RECENT_S
    monkeypatch.setattr(time, "monotonic", lambda: later)
    assert server.answer(backwards)["err_norm"] < 1e-5


def test_streams_keep_only_the_newest_request() -> None:
    sink = io.BytesIO()
    streams = StandardStreams(io.BytesIO(b"one\n\ntwo\nthree\n"), sink)
    time.sleep(0.2)
    assert streams.newest(1.0) == b"three\n"
    with pytest.raises(EOFError):
        streams.newest(1.0)
    streams.send(b"answer\n")
    assert sink.getvalue() == b"answer\n"


def test_streams_read_no_more_of_a_line_than_it_takes_to_refuse_it() -> None:
    class Endless(io.BytesIO):
        """Remembers how much was asked for at once."""

        asked: list[Any] = []

        def readline(self, size: int | None = -1, /) -> bytes:
            self.asked.append(size)
            return super().readline(size)

    source = Endless(b"x" * (MAX_LINE + 1))
    streams = StandardStreams(source, io.BytesIO())
    line = streams.newest(5.0)
    assert line is not None and len(line) == MAX_LINE + 1
    with pytest.raises(EOFError):
        streams.newest(5.0)
    assert source.asked == [MAX_LINE + 1] * 2


def test_silence_on_open_streams_is_told_after_the_timeout() -> None:
    reader, writer = os.pipe()
    with open(reader, "rb") as source, open(writer, "wb") as end:
        streams = StandardStreams(source, io.BytesIO())
        assert streams.newest(0.0) is None and streams.newest(0.05) is None
        end.write(b"\n  \nlate\n")
        end.flush()
        assert streams.newest(5.0) == b"late\n"
        assert streams.newest(0.05) is None
        end.close()
        with pytest.raises(EOFError):
            streams.newest(5.0)


def test_datagrams_on_this_machine_only() -> None:
    transport = LoopbackUdp(0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(5)
        transport.send(b"to nobody")
        assert transport.newest(0.0) is None and transport.newest(0.01) is None
        for line in (b"one", b"two"):
            client.sendto(line, ("127.0.0.1", transport.port))
        time.sleep(0.05)
        assert transport.newest(1.0) == b"two"
        transport.send(b"answer")
        assert client.recv(100) == b"answer"
    with pytest.raises(FinlabError, match="cannot listen on 127.0.0.1"):
        LoopbackUdp(transport.port)


def test_command_serves_over_pipes(bundle: Bundle, tmp_path: Path) -> None:
    bundle.write(tmp_path)
    command = [sys.executable, "-m", "finlab.deploy.command", "serve", str(tmp_path), "--watchdog-s", "0"]
    done = subprocess.run(
        command, input=json.dumps(GOOD).encode() + b"\n", capture_output=True, timeout=120, check=True
    )
    assert [json.loads(line)["status"] for line in done.stdout.splitlines()] == ["ok", "neutral"]


def test_an_answer_that_is_no_number_is_an_error(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    healthy = type(robot.allocator)._solve

    def broken(self: Any, *arguments: Any, **options: Any) -> Any:
        solution = healthy(self, *arguments, **options)
        return solution._replace(command=solution.command * np.nan)

    monkeypatch.setattr(type(robot.allocator), "_solve", broken)
    reply = served(robot, GOOD).sent[0]
    assert reply["status"] == "error" and "answers with NaN" in reply["error"] and "command" not in reply
