#!/usr/bin/env python3
"""Measures the processor time that a step of a slider costs the app, beside that of an answer.

    python tools/slider.py

A process of its own stands for the browser: it moves a slider as a page does, and hears what comes.
Times are of all threads of the app's process, less what it takes while nothing happens.
"""

import asyncio
import gc
import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from statistics import median
from typing import Any, NamedTuple

import msgspec
import numpy as np
import viser
import zstandard
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from finlab.layout import Layout, load_layout
from finlab.physics import plant_of
from webapp.app import App
from webapp.session import Session
from webapp.tasks.solver import Solver
from webapp.viser_internals import start_server, stop_server

PAGE_S = 0.06
"""Time between two steps of a slider that is dragged; a page sends at most one in 50 ms [s]."""
REST_S = 0.9
"""Time after a step in which all is answered that follows it [s]."""
STEPS = 20
"""Steps of a drag."""
QUIET_S = 1.5
"""After so long without a message a page has opened [s]."""
DIGITS = 4
"""Digits behind the point to which a page rounds what a slider says."""
HEAD = 16
"""Bytes before what is compressed: its size as plain and as compressed bytes, eight each."""


class Case(NamedTuple):
    """A page whose slider is moved."""

    robot: str
    """Name of a shipped layout."""
    drawer: str = "folded"
    """Tab of the drawer that is open, or `folded`."""
    first: float = 1.3
    """Surge force from which it is moved [N]."""
    step: float = 0.02
    """How far it is moved in a step [N]."""
    speed: float = 0.0
    """Speed through the water [m/s]."""


CASES = (
    Case("ucat"),
    Case("ucat", "Candidates"),
    Case("bluerov2_heavy", first=10.0, step=0.4),
    Case("torpedo", first=5.0, step=0.1, speed=1.5),
)


@dataclass(frozen=True)
class StepCost:
    """What a step of one page costs."""

    answer_ms: float
    """Processor time of `allocate` and `err_norm` in a loop: the least of several repeats, median
    over targets [ms]."""
    pinv_ms: float
    """The same of one line of numpy, `clip(pinv @ w)` [ms]."""
    drag_ms: float
    """Processor time of a step of a slider that is dragged, median over drags [ms]."""
    rest_ms: float
    """The same of a single step, with all that is worked out and written once the slider rests
    [ms]."""
    key_ms: float
    """Time on the wall from a step until its answer has come to the browser [ms]."""
    opening_ms: float
    """Processor time of opening the page [ms]."""
    messages: int
    """To the browser, in a single step."""
    size: int
    """Of these messages [bytes]."""


def step_cost(case: Case, drags: int = 5, singles: int = 8) -> StepCost:
    """Opens a page, moves its slider, and returns what a step costs."""
    layout = load_layout(case.robot)
    server = start_server()
    solver = Solver()
    start = time.process_time()
    app = App(server, solver, layout)
    with _hand(server.get_port()) as hand:
        opening_s = time.process_time() - start
        view = next(iter(app.views.values()))
        _on_loop(server, lambda: view.do(lambda: _prepare(view.session, case)))
        time.sleep(QUIET_S)
        gc.collect()
        gc.freeze()
        idle = _idle_share()
        moves = np.arange(STEPS) * case.step

        def processor_ms(values: Sequence[float], pause_s: float) -> tuple[float, dict[str, Any]]:
            """Processor time of each of some steps [ms], and what the browser heard."""
            began_s = time.monotonic()
            used_s = time.process_time()
            heard = hand([pause_s, *values])
            used_s = time.process_time() - used_s
            used_s -= idle * (time.monotonic() - began_s)
            return 1e3 * used_s / len(values), heard

        single = [processor_ms([case.first + k * case.step], REST_S) for k in range(singles)]
        dragged = []
        for k in range(drags):
            there = case.first + (1.0 + 0.003 * k) * moves
            dragged.append(processor_ms((there if k % 2 else there[::-1]).tolist(), PAGE_S))
            time.sleep(REST_S)
        allocator = solver.allocator(view.session.state)
        flow = view.session.state.flow
        targets = np.array(view.session.state.target) + np.outer(moves, np.eye(6)[0])
    app.stop()
    stop_server(server)
    return StepCost(
        answer_ms=_least_ms(lambda target: allocator.allocate(target, flow=flow).err_norm, targets),
        pinv_ms=_least_ms(_pseudo_inverse(layout), targets),
        drag_ms=median(used for used, _ in dragged),
        rest_ms=median(used for used, _ in single),
        key_ms=median(key for _, heard in single for key in heard["keys_ms"]),
        opening_ms=1e3 * opening_s,
        messages=single[-1][1]["messages"],
        size=single[-1][1]["size"],
    )


def _prepare(session: Session, case: Case) -> None:
    """Brings the page of a case to where its slider is moved."""
    if case.drawer != "folded":
        session.show_drawer(case.drawer)
    if session.desk.folded != (case.drawer == "folded"):
        session.fold_drawer()
    if case.speed:
        session.set_speed(case.speed)


def _on_loop(server: viser.ViserServer, act: Callable[[], None]) -> None:
    """Calls something on the server's loop."""

    async def run() -> None:
        act()

    asyncio.run_coroutine_threadsafe(run(), server.get_event_loop()).result(30.0)


def _idle_share() -> float:
    """Processor time that the process takes while nothing happens, per time on the wall."""
    used_s = time.process_time()
    time.sleep(1.0)
    return time.process_time() - used_s


def _least_ms(ask: Callable[[Any], Any], targets: Any, repeats: int = 7) -> float:
    """Processor time of a question [ms]: the least of some repeats, median over targets."""
    least = []
    for target in targets:
        times = []
        for _ in range(repeats):
            start_ns = time.thread_time_ns()
            ask(target)
            times.append(time.thread_time_ns() - start_ns)
        least.append(1e-6 * min(times))
    return median(least)


def _pseudo_inverse(layout: Layout) -> Callable[[Any], Any]:
    """One line of numpy that answers without limits but those of the forces."""
    plant = plant_of(layout)
    B = np.concatenate(list(plant.effectiveness), axis=0).T
    pinv = np.linalg.pinv(B)
    most = np.ones(len(pinv))
    return lambda target: np.clip(pinv @ target, -most, most)


@contextmanager
def _hand(port: int) -> Iterator[Callable[[list[float]], dict[str, Any]]]:
    """A browser in a process of its own, whose page has opened; a function that moves the slider to
    some values, after a pause each, and returns what was heard."""
    command = [sys.executable, __file__, "--hand", str(port)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as browser:
        assert browser.stdin is not None and browser.stdout is not None
        told = browser.stdin
        heard = browser.stdout
        heard.readline()

        def move(values: list[float]) -> dict[str, Any]:
            told.write(f"{json.dumps(values)}\n")
            told.flush()
            answer: dict[str, Any] = json.loads(heard.readline())
            return answer

        yield move
        browser.kill()


class Hand:
    """What a browser without pictures does: it opens a page, moves a slider, and listens."""

    def __init__(self, port: int, label: str = "Fx [N]") -> None:
        """Connect; `label` is that of the slider."""
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        self._socket = connect(f"ws://127.0.0.1:{port}", subprotocols=[protocol], max_size=None)
        self._label = label
        self._slider = ""
        self._last_s = time.monotonic()
        """When the last message came."""
        self._key_s: float | None = None
        """When the answer to the last step came; None until it does."""
        self._heard = 0
        self._size = 0
        self._send(
            type="ViewerCameraMessage",
            wxyz=(1.0, 0.0, 0.0, 0.0),
            position=(1.0, 1.0, 1.0),
            fov=1.0,
            near=0.1,
            far=100.0,
            image_height=860,
            image_width=1400,
            look_at=(0.0, 0.0, 0.0),
            up_direction=(0.0, 0.0, 1.0),
        )
        threading.Thread(target=self._listen, daemon=True).start()

    def serve(self) -> None:
        """Say that the page has opened, and then move the slider as each line of the standard input
        says: a pause [s], and values."""
        while not self._slider or time.monotonic() - self._last_s < QUIET_S:
            time.sleep(0.05)
        print("opened", flush=True)
        for line in sys.stdin:
            pause_s, *values = json.loads(line)
            print(json.dumps(self._move(values, pause_s)), flush=True)

    def _move(self, values: list[float], pause_s: float) -> dict[str, Any]:
        """Moves the slider; what was heard meanwhile."""
        self._heard = self._size = 0
        keys_ms = []
        for value in values:
            self._key_s = None
            began_s = time.monotonic()
            updates = {"value": round(value, DIGITS)}
            self._send(type="GuiUpdateMessage", uuid=self._slider, updates=updates)
            time.sleep(pause_s)
            if self._key_s is not None:
                keys_ms.append(1e3 * (self._key_s - began_s))
        return {"messages": self._heard, "size": self._size, "keys_ms": keys_ms}

    def _send(self, **message: Any) -> None:
        self._socket.send(msgspec.msgpack.encode(message))

    def _listen(self) -> None:
        for frame in self._socket:
            assert isinstance(frame, bytes)
            self._last_s = time.monotonic()
            self._size += len(frame)
            packed = int.from_bytes(frame[8:HEAD], "little")
            plain = zstandard.ZstdDecompressor().decompress(frame[HEAD : HEAD + packed])
            for message in msgspec.msgpack.decode(plain)["messages"]:
                self._heard += 1
                self._hear(message)

    def _hear(self, message: dict[str, Any]) -> None:
        kind = message["type"]
        if kind == "LocalStorageGetItemRequestMessage":
            answer = {"value": None, "error": None, "request_uuid": message["request_uuid"]}
            self._send(type="LocalStorageGetItemResponseMessage", **answer)
        elif kind == "GuiSliderMessage" and message["props"]["label"] == self._label:
            self._slider = message["uuid"]
        elif kind == "GuiUpdateMessage" and self._key_s is None:
            content = str(message["updates"].get("content", ""))
            if "class='err'" in content:
                self._key_s = self._last_s


def main() -> None:
    """Print a row for each case."""
    print(
        "page                       answer   dragged      x   till rest      x   key to answer  "
        "messages  bytes"
    )
    for case in CASES:
        cost = step_cost(case)
        name = f"{case.robot}, {case.drawer}"
        print(
            f"{name:26} {1e3 * cost.answer_ms:4.0f} us {cost.drag_ms:6.2f} ms "
            f"{cost.drag_ms / cost.answer_ms:6.1f} {cost.rest_ms:8.2f} ms "
            f"{cost.rest_ms / cost.answer_ms:6.1f} {cost.key_ms:12.1f} ms {cost.messages:9d} "
            f"{cost.size:6d}",
            flush=True,
        )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--hand"]:
        Hand(int(sys.argv[2])).serve()
    else:
        main()
