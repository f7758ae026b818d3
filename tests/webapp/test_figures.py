"""No figure on a page is one that nobody can read, whatever the robot and the wrench."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import viser

from finlab.assets import shipped_layouts
from finlab.layout import Layout, load_layout
from tests.webapp.stand_in import SilentClient, until
from tests.webapp.test_app import on_loop
from webapp.app import App
from webapp.markup.plot import cost_axis
from webapp.session import Session
from webapp.session.looking import DRAWERS, TASKS
from webapp.tasks.solver import Solver
from webapp.view import View

UNREADABLE = {
    "a power of ten": re.compile(r"\d(?:\.\d+)?e[+-]\d+\s*(?:%|N|W|m|kg|°|s)"),
    "a rounding error": re.compile(r"(?<!≤ )(?<![\d.])\d(?:\.\d+)?e[-−]1\d"),
    "two signs": re.compile(r"[+±][-−]\d"),
    "a zero with a sign": re.compile(r"[-−+]0(?:\.0+)?(?![\d.])(?! ?°)"),
    "no number": re.compile(r"\b(?:nan|inf)\b"),
}
"""What is wrong with a figure -> where that is seen in a text."""
TAG = re.compile(
    r"<style>.*?</style>|<svg.*?</svg>|<pre class=.command.*?</pre>|<[^>]*>", re.DOTALL
)
"""Markup that is no text, or is one for a command line; what is drawn has a test of its own."""


def unreadable(text: str) -> list[str]:
    """What nobody can read in a text, with its surroundings."""
    found = []
    for word, pattern in UNREADABLE.items():
        for match in pattern.finditer(text):
            start, end = match.span()
            found.append(f"{word}: …{text[max(start - 40, 0) : end + 20]}…")
    return found


@pytest.mark.parametrize(
    "text",
    ["1e+02 %", "least power 5.50e-14 W", "±-4.19e-13 N", "-0.000 m", "−0.0 N", "+0.00", "nan N"],
)
def test_what_cannot_be_read_is_found(text: str) -> None:
    assert unreadable(text)


def test_what_can_be_read_is_left_alone() -> None:
    assert unreadable("error ≤ 1e−9, 0.000, 1.2 kN, −0.5 N, +0.25, 10 % of 20.0 W") == []


@pytest.fixture(scope="module")
def server() -> Iterator[viser.ViserServer]:
    """A real server without a page."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


@pytest.fixture(scope="module")
def view(server: viser.ViserServer) -> Iterator[View]:
    """A page of the app without a browser, with the methods that are shipped."""
    app = App(server, Solver(), load_layout(shipped_layouts()["ucat"]))
    client: Any = SilentClient(server)
    loop = server.get_event_loop()
    session = Session(load_layout(shipped_layouts()["ucat"]))
    view = on_loop(server, lambda: View(client, session, app._solver, app._pools, loop))
    yield view
    view.close()
    app.stop()


def texts(server: viser.ViserServer) -> Iterator[str]:
    """Texts of all widgets and labels that are there."""
    handles: list[Any] = []
    for container in server.gui._container_handle_from_uuid.values():
        handles += container._children.values()
    for handle in handles:
        for key in ("content", "label", "hint"):
            value = getattr(handle._impl.props, key, None)
            if isinstance(value, str):
                hints = " ".join(re.findall(r"(?:title|aria-label)='([^']*)'", value))
                yield f"{TAG.sub(' ', value)} {hints}"
    for handle in server.scene._handle_from_node_name.values():
        if isinstance(handle, viser.LabelHandle):
            yield handle.text


def thirty(newtons: float) -> Layout:
    """Thirty thrusters of long names that give at most a force [N] each."""
    octo = load_layout(shipped_layouts()["bluerov2_heavy"])
    first = octo.actuators
    actuators = []
    for k in range(30):
        x, y, z = first[k % 8].position
        actuators.append(
            replace(
                first[k % 8],
                name=f"a_thruster_with_quite_a_long_name_{k + 1}",
                position=(x * (1.0 + 0.1 * (k // 8)), y, z + 0.1 * (k // 8)),
                force=(-newtons, newtons),
            )
        )
    return replace(octo, name="thirty", actuators=tuple(actuators))


CASES: dict[str, tuple[Callable[[], Layout], tuple[float, ...]]] = {
    "ucat": (lambda: load_layout("ucat"), (1.2, 0.0, 0.0, 0.0, 0.0, 0.25)),
    "nothing asked": (lambda: load_layout("octo"), (0.0,) * 6),
    "next to nothing": (lambda: load_layout("hexa"), (1e-9, 0.0, -1e-12, 0.0, 0.0, 0.0)),
    "out of reach": (lambda: load_layout("bluerov2"), (900.0, -900.0, 0.0, 0.0, 30.0, 0.0)),
    "free axes": (lambda: load_layout("catamaran"), (60.0, 15.0, 0.0, 0.0, 0.0, 12.0)),
    "cannot yaw": (lambda: load_layout("no_yaw"), (1.0, 0.0, 0.0, 0.0, 0.0, 2.0)),
    "thirty": (lambda: thirty(40.0), (300.0, 20.0, -1.0, 0.0, 0.0, 0.0)),
    "large": (lambda: thirty(4e5), (9e5, 2e5, -1.0, 0.0, 0.0, 0.0)),
}
"""Robots, and what they are asked for."""


@pytest.mark.parametrize("case", CASES)
def test_no_figure_is_unreadable(server: viser.ViserServer, view: View, case: str) -> None:
    load, wrench = CASES[case]
    layout = load()
    session = view.session

    def do(act: Callable[[], object]) -> None:
        on_loop(server, lambda: view.do(act))
        until(lambda: on_loop(server, lambda: view.is_settled))

    do(lambda: session.open_layout(layout))
    do(lambda: session.ask_for([str(value) for value in wrench], "Ask"))
    found = []
    for task in TASKS:
        for drawer in DRAWERS[task] or ("",):
            do(lambda task=task: session.show_task(task))
            if drawer:
                do(lambda drawer=drawer: session.show_drawer(drawer))
            for text in texts(server):
                found += unreadable(text)
    assert sorted(set(found)) == []


@pytest.mark.parametrize(
    ("ends", "max_ticks", "ticks"),
    [
        ((0.0, 103.0), 4, ["0", "50", "100"]),
        ((-21.0, -5.0), 4, ["−20", "−15", "−10", "−5"]),
        # Steps of 50 would leave the zero alone.
        ((-42.0, 42.0), 4, ["−40", "−20", "0", "20", "40"]),
    ],
)
def test_an_axis_has_two_ticks_at_least(
    ends: tuple[float, float], max_ticks: int, ticks: list[str]
) -> None:
    axis = cost_axis("heave [N]", np.array(ends), max_ticks)
    assert [words for _, words in axis.ticks] == ticks
