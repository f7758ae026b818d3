"""A fault in whatever a widget does: the page says so in a sentence, and goes on."""

import asyncio
import types
from collections.abc import Iterator
from typing import Any

import pytest
import viser

from finlab.layout import load_layout
from tests.sampled_cases import sampled
from tests.webapp.stand_in import SilentClient, until
from tests.webapp.test_app import app, on_loop, server, view
from webapp.app import App
from webapp.session import Session
from webapp.session.lessons import Guide
from webapp.tasks.designs import Designs
from webapp.tasks.fitting import Fitting
from webapp.tasks.improving import Improver
from webapp.tasks.swimming import Swimming
from webapp.view import View

__all__ = ["app", "server", "view"]

FAULT_TEXT = "out of order"
"""Text of the exception that is raised."""
ACTING = (Session, Guide, Designs, Fitting, Improver, Swimming)
"""Whose methods the handlers of the widgets call."""
ASKED = ("ask", "tick", "resume")
"""Methods that are called to write the page, not by its widgets."""


def intents() -> Iterator[tuple[type, str]]:
    """Every method that does what a user has asked for."""
    for owner in ACTING:
        for name in dir(owner):
            if not name.startswith("_") and name not in ASKED and callable(getattr(owner, name)):
                yield owner, name


def handles(server: viser.ViserServer) -> list[Any]:
    """Every widget of the page that does anything."""
    handles = list[Any]()
    for container in server.gui._container_handle_from_uuid.values():
        handles += container._children.values()
    return [handle for handle in handles if getattr(handle._impl, "update_cb", ())]


def others(handle: Any) -> list[Any]:
    """Values that a user could give a widget, all but what it has now."""
    if isinstance(handle, viser.GuiUploadButtonHandle):
        return [types.SimpleNamespace(name="robot.yaml", content=b"name: x")]
    if isinstance(handle, viser.GuiButtonHandle):
        return [True]
    value = handle._impl.value
    if isinstance(handle, (viser.GuiButtonGroupHandle, viser.GuiDropdownHandle)):
        return [option for option in handle.options if option != value] or [value]
    if isinstance(value, bool):
        return [not value]
    if isinstance(value, tuple):
        return [tuple(part + 0.01 for part in value)]
    return [f"{value} " if isinstance(value, str) else value + 0.01]


def use(server: viser.ViserServer, view: View, handle: Any, value: Any) -> None:
    """As viser does when a value of a widget comes from the page."""
    handle._impl.value = value
    for listen in handle._impl.update_cb:
        event = types.SimpleNamespace(client=view.client, target=handle)
        asyncio.run_coroutine_threadsafe(listen(event), server.get_event_loop()).result(30)


def broken(*_: Any, **__: Any) -> Any:
    """Raise this exception, whatever is asked."""
    raise RuntimeError(FAULT_TEXT)


def faults(view: View) -> list[str]:
    """What the page was told to be wrong with the app itself."""
    return [note for note in view.client.notes if note.startswith("A fault of the app")]


def test_every_widget_survives_a_fault_in_what_it_does(
    server: viser.ViserServer,
    app: App,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    client: Any = SilentClient(server)
    session = Session(load_layout("ucat"))
    loop = server.get_event_loop()
    session.select("front_left")
    with monkeypatch.context() as patch:  # while the page is built: widgets keep what they call
        for owner, name in intents():
            patch.setattr(owner, name, broken)
        view = on_loop(server, lambda: View(client, session, app._solver, app._pools, loop))
        assert faults(view) == []
        until(lambda: not view.busy)
        before = session.state
        told = 0
        for handle in handles(server):
            for value in others(handle):
                client.notes.clear()
                use(server, view, handle, value)
                told += any(FAULT_TEXT in note for note in faults(view))
        assert told > 100, "most widgets do something"
        assert session.state == before
    printed = capsys.readouterr().err
    assert "Task exception" not in printed and f"RuntimeError: {FAULT_TEXT}" in printed
    on_loop(server, lambda: view.do(lambda: session.set_target(0, 0.4)))
    until(lambda: not view.busy)
    assert view.shown_allocation is not None and view.shown_allocation.target[0] == 0.4
    shown = [handle.value for handle in handles(server) if getattr(handle, "label", "") == "Fx [N]"]
    assert shown == [0.4]
    view.close()
    on_loop(server, lambda: (server.gui.reset(), server.scene.reset()))


@pytest.mark.parametrize(
    ("place", "task", "selected"),
    sampled(
        [
            pytest.param("webapp.panels.actuator_model.model_card", "Design", "front_left"),
            pytest.param("webapp.panels.damage.button_colors", "Allocate", None),
            pytest.param("webapp.panels.hull_panel.hull_of", "Design", None),
            pytest.param("webapp.panels.files_tab.command_line", "Export", None),
            pytest.param("webapp.panels.swim_tab.axis_reach", "Simulate", None),
        ],
        every=3,
    ),
)
def test_every_widget_survives_a_fault_in_what_is_written(
    server: viser.ViserServer,
    view: View,
    place: str,
    task: str,
    selected: str | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    on_loop(server, lambda: view.do(lambda: view.session.select(selected)))
    on_loop(server, lambda: view.do(lambda: view.session.show_task(task)))
    with monkeypatch.context() as patch:
        patch.setattr(place, broken)
        for handle in handles(server):
            on_loop(server, lambda: view.session.show_task(task))  # New goes to another one
            if not isinstance(handle, viser.GuiUploadButtonHandle):
                use(server, view, handle, others(handle)[0])
                on_loop(
                    server, lambda: view.do(lambda: view.session.show_task(task))
                )  # New shows another
        assert any(FAULT_TEXT in note for note in faults(view))
    view.client.notes.clear()
    on_loop(server, lambda: view.do(view.session.start_over))
    on_loop(server, lambda: view.do(lambda: view.session.set_target(0, 0.3)))
    until(lambda: not view.busy)
    assert (
        view.shown_allocation is not None
        and view.shown_allocation.target[0] == 0.3
        and faults(view) == []
    )
