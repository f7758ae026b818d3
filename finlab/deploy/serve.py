"""`finlab-runtime serve`: targets in, commands out, as lines of JSON; safe when no targets come any more.

A request is `{"wrench": [Fx, Fy, Fz, Tx, Ty, Tz]}`, with `id`, `failed`, `policy`, `reference`, the
wrenches that are expected at the next ticks of 0.1 s, and `flow`, the velocity of the body relative to the
water [m/s, rad/s], if wanted. Each answer says in `status` what it is:

=========  ============================================================================================
status     meaning
=========  ============================================================================================
`ok`       commands for the newest target
`late`     the deadline passed; the last commands that were sent, or neutral ones, are repeated
`neutral`  no target for longer than the watchdog allows; the fins are commanded to rest
`error`    the request was not understood; `error` holds one sentence and there are no commands
=========  ============================================================================================

From one answer to the next, commands change no faster than the servos' rates allow in a tick of 0.1 s.
Only the newest request counts: those that waited behind it are skipped, since a robot wants the present, not
the past. A late answer is thrown away. However the service ends, a neutral command is the last that it sends.
"""

import json
import time
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor, wait
from concurrent.futures import TimeoutError as TooLate
from dataclasses import dataclass
from typing import Any

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.deploy.record import command_record
from finlab.deploy.request import Request, parse_request
from finlab.deploy.robot import DeployedRobot
from finlab.deploy.transport import StandardStreams, Unsent
from finlab.errors import FinlabError
from finlab.physics import plant_of

RECENT_S = 0.5
"""Age [s] up to which the last commands bind the next ones by the servos' rates."""


@dataclass(frozen=True)
class Timing:
    """When to wait no longer."""

    deadline: float | None = None
    """Longest time for an answer [s]; None to wait for it however long it takes."""
    watchdog: float | None = 1.0
    """Longest silence before the fins rest [s]; None to keep the last commands for ever."""


class Server:
    """Answers requests until they end."""

    def __init__(self, robot: DeployedRobot, timing: Timing) -> None:
        self._robot, self._timing = robot, timing
        self._worker = ThreadPoolExecutor(1)
        self._sent: Array | None = None  # the last commands, None while the fins rest
        self._sent_at = 0.0
        self._failed: tuple[str, ...] = ()
        self._busy: Future[Allocation] | None = None

    def run(self, transport: StandardStreams) -> None:
        """Serve until the requests end or a signal asks to stop; then the fins rest.

        Raises:
            Unsent: answers are no longer taken.
        """
        try:
            self._loop(transport)
        except EOFError:
            transport.send(_line(self._rest()))
        except Unsent:
            raise
        except BaseException:  # an unforeseen error is raised after the fins rest
            transport.send(_line(self._rest()))
            raise
        finally:
            self._worker.shutdown(wait=False, cancel_futures=True)

    def _loop(self, transport: StandardStreams) -> None:
        fresh = time.monotonic()  # when the last good target came
        while True:
            patience = self._timing.watchdog
            if patience is not None:
                patience = max(patience - (time.monotonic() - fresh), 0.0)
            line = transport.newest(patience)
            reply = self._rest() if line is None else self.answer(line)
            if reply["status"] != "error":  # an invalid request does not keep the fins beating
                fresh = time.monotonic()
            transport.send(_line(reply))

    def answer(self, line: bytes) -> dict[str, Any]:
        """The answer to one request, as plain values."""
        start = time.perf_counter()
        name: Any = None
        try:
            request = parse_request(line)
            name = request.id
            self._failed = tuple(request.failed)
            answer = self._solve(request, start)
        except TooLate:
            neutral = self._neutral()
            held = neutral if self._sent is None else np.where(np.isnan(neutral), np.nan, self._sent)
            return self._reply(name, "late", held)
        except FinlabError as error:
            return {"id": name, "status": "error", "error": str(error)}
        reply = self._reply(name, "ok", answer.command, answer.forces) | {
            "wrench": answer.wrench.tolist(),
            "unallocated": answer.unallocated.tolist(),
            "err_norm": answer.err_norm,
            "effort": answer.effort,
            "power": answer.power,
            "solve_ms": answer.solve_ms,
        }
        self._sent, self._sent_at = answer.command, time.monotonic()
        return reply

    def _solve(self, request: Request, start: float) -> Allocation:
        """The robot's answer, or `TooLate` when the deadline passes first."""
        fresh = time.monotonic() - self._sent_at < RECENT_S
        previous = self._sent if fresh else None

        def work() -> Allocation:
            return self._robot.allocate(
                request.wrench,
                failed=self._failed,
                previous=previous,
                reference=request.reference,
                policy=request.policy,
                flow=request.flow,
            )

        if self._timing.deadline is None:
            return work()
        if self._busy is not None:
            # What came too late for its own target is of no use to this one, but must end first.
            wait([self._busy], max(self._timing.deadline - (time.perf_counter() - start), 0.0))
            if not self._busy.done():
                raise TooLate
        self._busy = self._worker.submit(work)
        return self._busy.result(max(self._timing.deadline - (time.perf_counter() - start), 0.0))

    def _rest(self) -> dict[str, Any]:
        command, self._sent = self._neutral(), None
        return self._reply(None, "neutral", command)

    def _neutral(self) -> Array:
        known = [name for name in self._failed if name in self._robot.layout.names]
        return self._robot.neutral(known, self._sent)

    def _reply(self, name: Any, status: str, command: Array, forces: Array | None = None) -> dict[str, Any]:
        """Commands (n, 3), and the forces (n, 3) [N], body frame, that they give; at rest where not told."""
        layout = self._robot.layout
        forces = plant_of(layout).fin_forces(command) if forces is None else forces
        return {"id": name, "status": status, **command_record(layout, command, forces)}


def _line(reply: Mapping[str, Any]) -> bytes:
    return json.dumps(reply, allow_nan=False).encode() + b"\n"
