"""`finlab-runtime serve`: targets in, commands out, as lines of JSON; safe when targets stop.

A request is `{"wrench": [Fx, Fy, Fz, Tx, Ty, Tz]}`, with `id`, `lost` (names of actuators), `free`
(names of axes that may take any wrench), `policy`, `reference`, the wrenches that are expected at
the next ticks, `flow`, the velocity of the body relative to the water [m/s, rad/s], and `power`,
the most that all actuators may take together [W], if wanted.
Each answer says in `status` what it is, and has the `id` of its request, a refused one's too:

=========  ===================================================================================
status     meaning
=========  ===================================================================================
`ok`       commands for the newest target
`neutral`  no target for longer than the watchdog allows; the fins are commanded to rest
`error`    the request was refused, which changes nothing, or could not be answered, and the
           line before is `neutral`; `error` holds one sentence and there are no commands
=========  ===================================================================================

From one answer to the next, commands change no faster than the drives' rates allow in a tick.
Only the newest request counts: those that waited behind it are skipped, since a robot wants the
present, not the past; one that is older than the watchdog allows, as after a pause of the process,
is dropped. However the service ends, a neutral command is the last that it sends.
"""

import json
import math
import time
from collections.abc import Mapping
from typing import Any

from msgspec import Struct

from finlab.allocation import Allocation
from finlab.allocation.report import command_record, plain_target
from finlab.arrays import Array
from finlab.deploy.command_stream import REFUSED, CommandStream, unanswered
from finlab.deploy.deployed_robot import DeployedRobot
from finlab.deploy.transport import MAX_LINE, StandardStreams, Unsent
from finlab.errors import CommandError
from finlab.files import parse_json
from finlab.files.guarded import decoded
from finlab.files.schema import checked
from finlab.physics import plant_of

RECENT_S = 0.5
"""Age up to which the last commands limit the next ones by the drives' rates [s]."""
MAX_ID = 1_000
"""Longest `id`, as JSON [characters]."""


class Request(Struct, forbid_unknown_fields=True):
    """The content of a request. The allocator checks its arrays."""

    wrench: Any
    id: Any = None
    lost: list[str] = []
    free: list[str] = []
    policy: str = "closest"
    reference: Any = None
    flow: Any = None
    power: Any = None


def parse_values(line: bytes) -> Any:
    """Returns the plain values of a line. Raises CommandError: it is no JSON, or too long."""
    if len(line) > MAX_LINE:
        raise CommandError(f"request: longer than {MAX_LINE} bytes")
    return parse_json(decoded(line, "request", "JSON", CommandError), "request", CommandError)


def id_of(values: Any) -> Any:
    """Returns the `id` in the values of a request, which may be refused; None where it has none.
    Raises CommandError: it is too long to be sent back."""
    name = values.get("id") if isinstance(values, dict) else None
    if len(json.dumps(name)) > MAX_ID:
        raise CommandError(f"id: longer than {MAX_ID} characters")
    return name


class Server:
    """Answers requests until they end."""

    def __init__(self, robot: DeployedRobot, watchdog: float | None = 1.0) -> None:
        """Takes the robot, and the longest silence before its fins rest [s]; without one they never
        do."""
        self._stream = CommandStream(robot)
        self._watchdog = watchdog
        self._sent_at = 0.0

    def run(self, transport: StandardStreams) -> None:
        """Serve until the requests end or a signal asks to stop; then the fins rest. Raises Unsent:
        answers are no longer taken."""
        try:
            self._loop(transport)
        except EOFError:
            transport.send(_line(self._rest_reply()))
        except Unsent:
            raise
        except BaseException:  # an unforeseen error is raised after the fins rest
            transport.send(_line(self._rest_reply()))
            raise

    def _loop(self, transport: StandardStreams) -> None:
        """Answers requests until they end; rests the robot where none comes in time."""
        fresh = time.monotonic()  # when the last good target arrived
        while True:
            patience = self._watchdog
            if patience is not None:
                patience = max(patience - (time.monotonic() - fresh), 0.0)
            line = transport.newest(patience)
            if line is None or self._is_late(fresh, line.since):
                transport.send(_line(self._rest_reply()))
                fresh = time.monotonic()
            if line is None or self._is_late(line.since, time.monotonic()):
                continue
            replies = self.answers(line.text)
            if replies[-1]["status"] == "ok":  # an invalid request does not keep the fins beating
                now = time.monotonic()
                if self._is_late(line.since, now):  # the process paused while it solved
                    replies = [self._rest_reply()]
                fresh = now
            for reply in replies:
                transport.send(_line(reply))

    def _is_late(self, since: float, now: float) -> bool:
        """Whether more time than the watchdog allows lies between two times [s]."""
        return now - since > (math.inf if self._watchdog is None else self._watchdog)

    def answers(self, line: bytes) -> list[dict[str, Any]]:
        """Returns the replies to one request as plain values.

        It is one reply; where a valid request could not be answered, the neutral command comes
        before the error.
        """
        name: Any = None
        fresh = time.monotonic() - self._sent_at < RECENT_S
        try:
            values = parse_values(line)
            name = id_of(values)
            request = checked(values, Request, CommandError, "request")
            answer = self._stream.answer(
                request.wrench,
                lost=request.lost,
                follows=fresh,
                free=request.free,
                reference=request.reference,
                policy=request.policy,
                flow=request.flow,
                power=request.power,
            )
            reply = self._reply(name, "ok", answer.command, answer.forces) | _answer_record(answer)
            _line(reply)
        except REFUSED as error:
            return [_error(name, str(error))]
        except Exception as error:  # the robot goes on, whatever is wrong
            return [self._rest_reply(), _error(name, unanswered(error))]
        self._stream.note(answer, request.lost)
        self._sent_at = time.monotonic()
        return [reply]

    def _rest_reply(self) -> dict[str, Any]:
        neutral = self._stream.neutral()
        if self._stream.last is not None:  # what follows begins at rest
            self._stream.note(neutral)
            self._sent_at = time.monotonic()
        return self._reply(None, "neutral", neutral)

    def _reply(
        self, name: Any, status: str, command: Array, forces: Array | None = None
    ) -> dict[str, Any]:
        """Commands (n, 3), and the forces (n, 3) [N], body frame, that they give; at rest where not
        told."""
        layout = self._stream.robot.layout
        forces = plant_of(layout).body_forces(command) if forces is None else forces
        return {"id": name, "status": status, **command_record(layout, command, forces)}


def _answer_record(answer: Allocation) -> dict[str, Any]:
    return {
        "target": plain_target(answer.target),
        "wrench": answer.wrench.tolist(),
        "unallocated": answer.unallocated.tolist(),
        "err_norm": answer.err_norm,
        "expected_error": answer.expected_error,
        "effort": answer.effort,
        "power": answer.power,
        "solve_ms": answer.solve_ms,
    }


def _error(name: Any, sentence: str) -> dict[str, Any]:
    return {"id": name, "status": "error", "error": sentence}


def _line(reply: Mapping[str, Any]) -> bytes:
    return json.dumps(reply, allow_nan=False).encode() + b"\n"
