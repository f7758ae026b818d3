"""A page that sends what no honest page would: nothing breaks, nothing of it gets into the session."""

import asyncio
import math
import types
from typing import Any

import pytest
import viser

from tests.webapp.test_app import app, on_loop, server, until, view
from webapp.panels.frame import View

__all__ = ["app", "server", "view"]

GARBAGE: tuple[Any, ...] = (
    math.nan,
    math.inf,
    None,
    [],
    {},
    "<script>alert(1)</script>",
    2**63,
    -1e308,
    (math.nan,) * 3,
    (1e308,) * 3,
    (math.inf, math.nan),
    (1,),
    (),
    ("a", "b", "c"),
    True,
    b"\xff",
    "x" * 100_000,
    [math.nan] * 3,
    {"a": 1},
)


def taken(handle: Any, value: Any) -> bool:
    """Put a value into an input as viser does with one from a page: cast to its type, if it can be."""
    now = handle._impl.value
    try:
        if isinstance(now, tuple):
            handle._impl.value = tuple(type(now[0])(part) for part in value) if now else tuple(value)
        else:
            handle._impl.value = type(now)(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return True


def test_garbage_from_the_page_changes_nothing_but_raises_no_fault(
    server: viser.ViserServer, view: View, capsys: pytest.CaptureFixture[str]
) -> None:
    view.session.select("front_left")
    before = view.session.state.layout
    handles = [h for c in server.gui._container_handle_from_uuid.values() for h in c._children.values()]
    heard = 0
    for handle in handles:
        if isinstance(handle, viser.GuiUploadButtonHandle):
            continue  # viser makes these values itself
        for listen in getattr(handle._impl, "update_cb", ()):
            for value in GARBAGE:
                if not taken(handle, value):
                    continue
                event = types.SimpleNamespace(client=view.client, target=handle)
                asyncio.run_coroutine_threadsafe(listen(event), server.get_event_loop()).result(30)
                heard += 1
    assert heard > 500
    session = view.session
    kept = repr((session.state, session.display, session.draft, session.swim))
    assert "alert" not in kept and "xxx" not in kept and "=nan" not in kept
    states = [state for _, state in view.session.history.past]
    assert any(set(before.names) <= set(state.layout.names) for state in states), "buttons may well add fins"
    assert "Traceback" not in capsys.readouterr().err
    assert not any("fault" in note for note in view.client.notes)
    on_loop(server, lambda: view.do(lambda: view.session.set_target(0, 0.7)))
    until(lambda: not view.busy)
    assert view.shown is not None and view.shown.target[0] == 0.7


def test_a_fault_of_ours_is_told_and_the_page_goes_on(
    server: viser.ViserServer, view: View, capsys: pytest.CaptureFixture[str]
) -> None:
    on_loop(server, lambda: view.do(lambda: 1 / 0))
    assert view.client.notes[-1].startswith("A fault of the app: ZeroDivisionError")
    assert "ZeroDivisionError" in capsys.readouterr().err
    on_loop(server, lambda: view.do(lambda: view.session.set_target(0, 0.3)))
    until(lambda: not view.busy)
    assert view.shown is not None and view.shown.target[0] == 0.3
