"""Arrow keys that move the selected actuators in the view; their other half is `nudges.js`."""

import json

from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.page import Page
from webapp.scene.stage import arrow_size
from webapp.session.looking import TASKS
from webapp.viser_internals import run_file, run_script

STEP_M = 0.01
"""How far an actuator goes by a key, on a robot of the size of a U-CAT [m]."""
MOST_STEPS = 100
"""Steps that a page may send at once."""
DESIGN = TASKS[0]


def add_nudging(page: Page) -> None:
    """Let a page move what is selected by arrow keys, in the task in which it can be dragged."""
    session = page.session
    run_file(page.gui, "nudges.js")

    def listen(selection: tuple[str, ...], task: str, swims: bool) -> None:
        """While nothing is selected the keys move the camera."""
        moves = bool(selection) and task == DESIGN and not swims
        run_script(page.gui, f"finlabNudges.listen({json.dumps(moves)});")

    def nudge(key: str, text: str) -> None:
        step = step_m(session.state.layout)
        x, y, z = steps_of(key)
        session.nudge((step * x, step * y, step * z), held=text == "held")

    page.board.act(listen)
    page.presses.on("nudge", nudge)


def step_m(layout: Layout) -> float:
    """How far an actuator of a robot goes by a key [m]: a centimetre on one of half a metre."""
    return STEP_M * arrow_size(layout)


def steps_of(key: str) -> tuple[int, int, int]:
    """Steps along x, y and z as a page sends them: `1 0 -2`.

    Raises:
        FinlabError: it says no three steps, or too many.
    """
    try:
        steps = [int(word) for word in key[:40].split(" ")]
    except ValueError:
        steps = []
    if len(steps) != 3 or max(map(abs, steps)) > MOST_STEPS:
        raise FinlabError(f"arrow keys: expected three numbers of steps, got {key!r:.40}")
    x, y, z = steps
    return x, y, z
