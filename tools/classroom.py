#!/usr/bin/env python3
"""Measures a class on one server: pages that work by themselves, and some that follow another one.

    python tools/classroom.py [PAGES [FOLLOWERS]]

Each page is a connection that speaks the viewer's protocol, without pictures: processes of their
own stand for the browsers. Every page that works moves a slider as its user would; the time is
that from the key until its own answer has come, and for a page that follows until that of the page
which it follows has.
"""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from finlab.layout import load_layout
from tools.slider import Hand
from webapp.app import App
from webapp.tasks.solver import Solver
from webapp.viser_internals import start_server, stop_server

PAGES = 20
"""Pages of a class."""
FOLLOWERS = 2
"""Pages among them that follow the first one."""
KEYS = 6
"""Keys that each page is given."""
PAUSE_S = 1.0
"""Time between two keys of one page: a student reads what comes [s]."""
PATIENCE_S = 60.0
"""How long an answer may take [s]."""
ROBOTS = ("ucat", "B", "octo", "bluerov2_heavy", "turtle_hybrid")
"""Robots of the pages, one after the other."""


class ClassCost(NamedTuple):
    """Times of a class [ms]."""

    own: Sequence[float]
    """From a key until its page has the answer."""
    followed: Sequence[float]
    """From a key of the followed page until a following one has its answer."""
    own_states: int
    """Pages that hold what their own user asked for at the end."""
    messages_per_s: float
    """Messages from one page [1/s]."""


class Student(Hand):
    """A page of a class."""

    def __init__(self, port: int) -> None:
        """Connect."""
        self.answers: list[tuple[float, str]] = []
        """When an answer came, by the monotonic clock [s], and its words."""
        self.box = ""
        self._word = 0
        super().__init__(port)

    @property
    def is_ready(self) -> bool:
        """Whether the page has opened, and rests."""
        return bool(self._slider and self.box) and time.monotonic() - self._last_s > 1.0

    def tell(self, kind: str, key: str) -> None:
        """A word of the page's markup is pressed."""
        self._word += 1
        value = json.dumps([[self._word, kind, key, ""]])
        self._send(type="GuiUpdateMessage", uuid=self.box, updates={"value": value})

    def move(self, value: float) -> float:
        """Moves the slider; the time [s]."""
        now = time.monotonic()
        self._send(type="GuiUpdateMessage", uuid=self._slider, updates={"value": value})
        return now

    def _hear(self, message: dict[str, Any]) -> None:
        super()._hear(message)
        kind = message["type"]
        if kind == "GuiTextMessage" and message["props"]["label"] == "presses":
            self.box = message["uuid"]
        content = str(message.get("updates", {}).get("content", ""))
        if "class='bars'" in content or "class=&#39;bars" in content:
            self.answers.append((self._last_s, content))


def class_cost(pages: int = PAGES, followers: int = FOLLOWERS, keys: int = KEYS) -> ClassCost:
    """Opens a class, gives each page its keys, and returns what they took."""
    server = start_server()
    app = App(server, Solver(), load_layout(ROBOTS[0]))
    command = [sys.executable, __file__, "--pages", str(server.get_port())]
    command += [str(pages), str(followers), str(keys)]
    with ExitStack() as stack:
        process = stack.enter_context(
            subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        )
        assert process.stdin is not None and process.stdout is not None
        process.stdout.readline()  # all have opened
        views = list(app.views.values())
        teacher = views[0]
        code = _on_loop(server, teacher.page.following.let_follow)
        for k, view in enumerate(views):
            layout = load_layout(ROBOTS[k % len(ROBOTS)])
            _on_loop(server, lambda v=view, x=layout: v.do(lambda: v.session.open_layout(x)))
        process.stdin.write(f"{code}\n")
        process.stdin.flush()
        heard = json.loads(process.stdout.readline())
        states = {view.session.state.target[0] for view in app.views.values()}
        process.kill()
    app.stop()
    stop_server(server)
    return ClassCost(heard["own"], heard["followed"], len(states), heard["rate"])


def _on_loop(server: Any, act: Any) -> Any:
    """Calls something on the server's loop."""
    import asyncio

    async def run() -> Any:
        return act()

    return asyncio.run_coroutine_threadsafe(run(), server.get_event_loop()).result(30.0)


def _be_pages(port: int, pages: int, followers: int, keys: int) -> None:
    """Stands for all browsers of a class."""
    students = []
    for _ in range(pages):
        students.append(Student(port))
        _wait(lambda: bool(students[-1].box), PATIENCE_S)
    _wait(lambda: all(student.is_ready for student in students), PATIENCE_S)
    print("opened", flush=True)
    code = sys.stdin.readline().strip()
    time.sleep(3.0)
    followed = students[1 : 1 + followers]
    workers = [students[0], *students[1 + followers :]]
    for student in followed:
        student.tell("follow", code)
    time.sleep(3.0)
    times: dict[str, list[float]] = {"own": [], "followed": []}
    threads = []
    for place, student in enumerate(workers):
        watching = followed if place == 0 else []
        arguments = (student, watching, place, keys, times)
        threads.append(threading.Thread(target=_work, args=arguments))
    began_s = time.monotonic()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    rate = keys / (time.monotonic() - began_s)
    print(json.dumps({**times, "rate": rate}), flush=True)
    time.sleep(PATIENCE_S)


def _work(
    student: Student, watching: list[Student], place: int, keys: int, times: dict[str, list[float]]
) -> None:
    """Moves the slider of one page, and waits for what comes of it, there and where it is
    followed."""
    time.sleep(PAUSE_S * place / PAGES)
    for k in range(keys):
        value = round(0.5 + 0.01 * place + 0.1 * k, 4)
        shown = f"{value:+.2f}"
        pressed_s = student.move(value)
        for key, pages in (("own", [student]), ("followed", watching)):
            for page in pages:
                came_s = _answer_s(page, shown, pressed_s)
                times[key].append(1e3 * (came_s - pressed_s))
        time.sleep(max(0.0, pressed_s + PAUSE_S - time.monotonic()))


def _answer_s(page: Student, shown: str, since_s: float) -> float:
    """When the page had the answer to a force [s]."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        for came_s, content in reversed(page.answers):
            if came_s >= since_s and content.count(shown) >= 2:  # asked and delivered
                return came_s
        time.sleep(0.002)
    raise SystemExit(f"no answer of {shown} came in {PATIENCE_S:.0f} s")


def _wait(condition: Any, seconds: float) -> None:
    """Waits until something is so."""
    end_s = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end_s:
            raise SystemExit("the pages did not open in time")
        time.sleep(0.02)


def main(words: Sequence[str]) -> None:
    """Print the times of a class."""
    pages, followers = (*map(int, words), PAGES, FOLLOWERS)[:2] if words else (PAGES, FOLLOWERS)
    cost = class_cost(pages, followers)
    for name, values in (("key to answer", cost.own), ("followed", cost.followed)):
        p50, p90, most = (float(np.percentile(values, q)) for q in (50, 90, 100))
        print(f"{name:14} p50 {p50:5.0f} ms   p90 {p90:5.0f} ms   most {most:5.0f} ms")
    words = f"{pages} pages, {followers} of them follow"
    print(f"{words}; {cost.own_states} different wrenches at the end")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--pages"]:
        _be_pages(*map(int, sys.argv[2:6]))
    else:
        main(sys.argv[1:])
