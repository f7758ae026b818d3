"""A gamepad asks for shares of what the robot reaches, and for nothing when it is let go."""

import json

import pytest

from finlab.errors import FinlabError
from finlab.layout import load_layout
from tests.webapp.test_faults import Tab
from tests.webapp.test_number_boxes import tab
from webapp.panels.gamepad import shares_of
from webapp.session.targets import lone_reach, nudge

__all__ = ["tab"]


def push(tab: Tab, *shares: float) -> None:
    """What the page's script sends."""
    number = tab.on_loop(lambda: tab.view.page.presses._last) + 1
    message = json.dumps([[number, "gamepad", " ".join(map(str, shares)), ""]])
    tab.on_loop(lambda: tab.view.page.presses.read(message))


def test_sticks_ask_for_shares_of_the_reach_in_one_step_of_undo(tab: Tab) -> None:
    session = tab.view.session
    before = session.state.target
    n_steps = len(session.history.past)
    reach = lone_reach(session.state.layout).tolist()
    for share in (0.1, 0.4, 1.0, 0.5):
        push(tab, share, 0.0, -share, 0.0, 0.0, share)
    tab.settle()
    asked = session.state.target
    for axis, share in ((0, 0.5), (2, -0.5), (5, 0.5)):
        assert asked[axis] == pytest.approx(share * reach[axis], abs=nudge(reach[axis]))
    assert asked[1] == asked[3] == asked[4] == 0.0
    push(tab, *(0.0,) * 6)
    tab.settle()
    assert session.state.target == (0.0,) * 6
    assert len(session.history.past) == n_steps + 1 and session.history.undo_name == "Gamepad"
    push(tab, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    push(tab, *(0.0,) * 6)
    assert len(session.history.past) == n_steps + 2, "each push until release is a step"
    session.undo()
    session.undo()
    assert session.state.target == before


def test_axes_that_the_robot_does_not_command_stay(tab: Tab) -> None:
    session = tab.view.session
    tab.open(load_layout("catamaran"))
    before = session.state.target
    push(tab, *(1.0,) * 6)
    tab.settle()
    for axis, commanded in enumerate(session.state.layout.commanded.tolist()):
        assert (session.state.target[axis] != before[axis]) == commanded


@pytest.mark.parametrize("key", ["", "1 0 0", "2 0 0 0 0 0", "nan 0 0 0 0 0", "x 0 0 0 0 0"])
def test_what_is_no_wrench_is_refused(key: str) -> None:
    with pytest.raises(FinlabError, match="six numbers from -1 to 1"):
        shares_of(key)
