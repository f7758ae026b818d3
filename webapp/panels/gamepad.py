"""A gamepad that asks for a wrench; its other half is `gamepad.js`."""

import json
import math

from finlab.axes import AXES
from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.page import Page
from webapp.session.targets import lone_reach, nudge
from webapp.viser_internals import run_file, run_script

WORDS = (
    "left stick: ahead, astern",
    "left stick: left, right",
    "right stick: up, down",
    "triggers: roll",
    "bumpers: pitch",
    "right stick: turn",
)
"""What moves each axis of the wrench."""


def add_gamepad(page: Page) -> None:
    """Let a gamepad of the browser ask for wrenches; when it is let go, nothing is asked."""
    session = page.session
    run_file(page.gui, "gamepad.js")

    def begin(layout: Layout) -> None:
        """The sign says what moves what, of axes that the robot commands."""
        arguments = json.dumps([layout.commanded.tolist(), WORDS])
        run_script(page.gui, f"finlabGamepad.begin(...{arguments});")

    held = False

    def ask(key: str, _text: str) -> None:
        nonlocal held
        shares = shares_of(key)
        state = session.state
        if not held:
            session.history.end_merge()
        held = any(shares)
        reach = lone_reach(state.able, state.lost, state.flow).tolist()
        target = list(state.target)
        for axis, (share, size) in enumerate(zip(shares, reach, strict=True)):
            if state.layout.commanded[axis]:
                step = nudge(size)
                target[axis] = round(round(share * size / step) * step, 6) + 0.0
        session.pull(target, "Gamepad")
        if not held:
            session.history.end_merge()

    page.board.act(begin)
    page.presses.on("gamepad", ask)


def shares_of(key: str) -> tuple[float, ...]:
    """Six shares of the robot's reach from -1 to 1, as a page sends them.

    Raises:
        FinlabError: it says no such six.
    """
    try:
        shares = tuple([float(word) for word in key[:80].split(" ")])
    except ValueError:
        shares = ()
    is_shares = all(math.isfinite(share) and abs(share) <= 1.0 for share in shares)
    if len(shares) != len(AXES) or not is_shares:
        raise FinlabError(f"gamepad: expected six numbers from -1 to 1, got {key!r:.80}")
    return shares
