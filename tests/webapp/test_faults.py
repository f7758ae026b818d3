"""Faults are put wherever an answer is made while a layout is opened: no figure of the robot before
stays.

What a page shows then is compared with a page that has never seen another robot.
"""

import asyncio
import hashlib
import re
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest
import viser

from finlab.assets import shipped_layouts
from finlab.errors import FinlabError
from finlab.layout import load_layout
from tests.sampled_cases import sampled
from tests.webapp.stand_in import SilentClient, load_stand_in
from webapp.session import Display, Session
from webapp.session.looking import CANDIDATES, DRAWERS
from webapp.tasks import analysing
from webapp.tasks.slot import Pools
from webapp.tasks.solver import Solver
from webapp.view import View
from webapp.viser_internals import start_server, stop_server, uuid_of

BEFORE, OPENED, AFTER = (load_layout(shipped_layouts()[name]) for name in ("A", "B", "ucat"))
DISPLAY = Display(frozen=True, drawn="forces")
"""Switches of a page that draws most."""
STEP_OF_HISTORY = r"<button[^>]*>(Undo|Redo)(: [^<]*)?</button>"
"""Entry of the menu that names what was done before, which no fresh page has."""
FAULT_TEXT = "out of order"
"""Text of the exception that is raised."""

COMPUTED = (
    "webapp.tasks.solver.Solver.solve",
    "webapp.tasks.solver.modes_of",
    "webapp.tasks.analysing.score_card",
    "webapp.tasks.analysing.attainable_set",
    "webapp.tasks.analysing.axis_ranges",
)
"""Where a fault meets a worker's thread."""
DRAWN = (
    "webapp.panels.status.verdict_sentence",
    "webapp.panels.status.corner",
    "webapp.panels.wrench_tab.axis_reach",
    "webapp.panels.wrench_tab.lone_reach",
    "webapp.panels.wrench_tab.slider_end",
    "webapp.markup.answer.wrench_bars",
    "webapp.panels.wrench_tab.full_thrust",
    "webapp.panels.wrench_tab.fin_table",
    "webapp.panels.cards.quick_check",
    "webapp.panels.cards.warnings",
    "webapp.panels.modes_tab.mode_plot",
    "webapp.panels.modes_tab.source_words",
    "webapp.panels.limits_tab.score_table",
    "webapp.panels.modes_tab.comparison_table",
    "webapp.panels.files_tab.command_line",
    "webapp.scene.stage.Stage.refresh",
    "webapp.scene.wrench_nodes.fitting",
    "webapp.scene.robot_scene.missing_part",
    "webapp.panels.status.legend",
)
"""Where it meets the writing of the page."""


class Tab:
    """One page on a server of its own."""

    def __init__(self, workers: Pools, layout: Any, solver: Solver | None = None) -> None:
        self.server = start_server()
        self.client: Any = SilentClient(self.server)
        session = Session(layout, DISPLAY)
        solver = solver or Solver(load=load_stand_in)
        loop = self.server.get_event_loop()
        self.view: View = self.on_loop(lambda: View(self.client, session, solver, workers, loop))
        self.meet_all()
        self.settle()

    def on_loop(self, act: Callable[[], Any]) -> Any:
        """Call something on the server's loop, and return its result."""

        async def run() -> Any:
            return act()

        return asyncio.run_coroutine_threadsafe(run(), self.server.get_event_loop()).result(30)

    @property
    def ways(self) -> list[Callable[[], object]]:
        """To all that can be seen: each task with each drawer, with a fin selected and without."""
        session = self.view.session
        acts: list[Callable[[], object]] = [lambda: session.select(session.state.layout.names[0])]
        # What stands there unless one is chosen was opened before, which no fresh page has; each
        # robot has another one beside it, so that its answer is no earlier one.
        beside = "octo" if session.state.layout == OPENED else "ucat"
        acts.append(partial(session.two_robots.choose, "right", f"Shipped: {beside}"))
        for names in DRAWERS.values():
            acts += [partial(session.show_drawer, name) for name in names]
        acts += [partial(session.show_task, task) for task in ("Export", "Design")]
        acts += [partial(session.select, None), partial(session.show_task, "Allocate")]
        return [*acts, partial(session.show_drawer, CANDIDATES)]  # of one robot, as it was opened

    def meet_all(self) -> None:
        """Let the page build each panel."""
        for act in self.ways:
            self.on_loop(partial(self.view.do, act))

    def open(self, layout: Any) -> None:
        """Open a layout, and wait for its answer."""
        self.on_loop(lambda: self.view.do(lambda: self.view.session.open_layout(layout)))
        self.settle()

    def type(self, handle: Any, text: str, place: int = 0, steps: int = 0) -> None:
        """Type a text into a number box, and wait for what comes of it."""
        key = f"{uuid_of(handle)} {place} {steps}"
        self.on_loop(lambda: self.view.page.number_boxes._take(key, text))
        self.settle()

    def settle(self) -> None:
        """Wait until all is answered and drawn."""
        end = time.monotonic() + 60
        while not self.on_loop(lambda: self.view.is_settled):
            assert time.monotonic() < end
            time.sleep(0.01)

    def figures(self) -> list[str]:
        """The markup that can be seen in any task, in order, without what no two runs have in
        common."""
        markup = []
        for act in self.ways:
            self.on_loop(partial(self.view.do, act))
            self.settle()
            root = self.server.gui._container_handle_from_uuid["root"]
            hidden = [s.whole for s in self.view.frame.sections if not s.group.is_visible]
            markup += list(_html(root, hidden))
        timeless = [re.sub(r"[\d.]+(e.?\d+)? ms", "ms", text) for text in markup]
        return [re.sub(STEP_OF_HISTORY, "", text) for text in timeless]

    def nodes(self) -> dict[str, str]:
        """The meshes that can be seen, and marks of their shapes."""
        nodes = self.server.scene._handle_from_node_name
        hidden = [name for name, node in nodes.items() if not node.visible]
        meshes = {name: node for name, node in nodes.items() if hasattr(node, "vertices")}
        return {
            name: hashlib.sha256(node.vertices.tobytes()).hexdigest()
            for name, node in meshes.items()
            if not any(name == other or name.startswith(f"{other}/") for other in hidden)
        }

    def close(self) -> None:
        """Close the page and the server."""
        self.on_loop(self.view.close)
        stop_server(self.server)


def _html(container: Any, hidden: list[Any]) -> Iterator[str]:
    """Blocks of HTML that are shown."""
    for child in container._children.values():
        if getattr(child, "visible", True) and child not in hidden:
            if hasattr(child, "_children"):
                yield from _html(child, hidden)
            elif isinstance(child, viser.GuiHtmlHandle):
                yield child.content


@pytest.fixture(scope="module")
def workers() -> Iterator[Pools]:
    """Pools for pages that answer at once."""
    workers = Pools()
    with (
        pytest.MonkeyPatch.context() as patch
    ):  # nobody types here, so nothing need come to rest first
        for name in ("jobs.CARD_REST_S", "jobs.REST_S", "answering.SEARCH_REST_S"):
            patch.setattr(f"webapp.tasks.{name}", 0.01)
        yield workers
    workers.stop()


@pytest.fixture(scope="module")
def tab(workers: Pools) -> Iterator[Tab]:
    """One page that meets one fault after the other."""
    tab = Tab(workers, BEFORE)
    yield tab
    tab.close()


@pytest.mark.parametrize(
    ("place", "fault"),
    sampled(
        [
            *(pytest.param(place, RuntimeError(FAULT_TEXT)) for place in COMPUTED + DRAWN),
            *(pytest.param(place, FinlabError(FAULT_TEXT)) for place in (COMPUTED[0], DRAWN[2])),
        ],
        every=6,
    ),
)
def test_no_figure_of_the_robot_before_stays(
    workers: Pools, tab: Tab, place: str, fault: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: Any, **__: Any) -> Any:
        raise fault

    tab.open(BEFORE)
    tab.client.notes.clear()
    whole = tab.figures()
    with monkeypatch.context() as patch:
        patch.setattr(place, broken)
        for known in (analysing.analyse, analysing.find_ranges):
            known.cache_clear()
        tab.open(OPENED)
        shown = tab.figures()
        told = " ".join([*shown, *tab.client.notes])
        assert FAULT_TEXT in told or "cannot be analysed" in told
        assert "<h1>B</h1>" in told or "shown of B" in told
        fresh = Tab(workers, OPENED)
        assert shown == fresh.figures()
        assert tab.nodes() == fresh.nodes()
        fresh.close()
    tab.open(AFTER)
    tab.open(BEFORE)
    assert tab.figures() == whole, "the page goes on as if nothing had been"
