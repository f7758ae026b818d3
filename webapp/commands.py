"""The table of all that can be done by a key or from the list of commands (Ctrl+K)."""

from collections.abc import Callable
from functools import partial
from typing import Any

from webapp.page import Page
from webapp.session.looking import TASKS
from webapp.session.state import LEAST
from webapp.session.targets import PRESETS

CTRL, CTRL_SHIFT, ALT = "cmd/ctrl", "cmd/ctrl+shift", "alt"


def add_commands(page: Page) -> None:
    """Let a browser have all commands of one page. The camera owns W A S D Q E and the arrow keys."""
    session, robot, swimming = page.session, page.scenery.robot, page.jobs.swimming

    def fail_selected() -> None:
        session.toggle_failure(session.selected or session.state.layout.names[0])

    # What it is called and does and, if any, its key as viser calls that, and a modifier.
    table: list[tuple[Any, ...]] = [
        *((task, partial(session.show_task, task), str(k + 1), ALT) for k, task in enumerate(TASKS)),
        ("Fold or open the drawer", session.fold_drawer, "J", CTRL),
        ("Undo", session.undo, "Z", CTRL),
        ("Redo", session.redo, "Z", CTRL_SHIFT),
        ("Select the next fin", session.select_next, "N"),
        ("Select nothing", partial(session.select, None), "escape"),
        ("Duplicate the selected fin", session.duplicate, "D", CTRL),
        ("Mirror the selected fin", session.mirror, "M"),
        ("Delete the selected fin", session.delete, "delete"),
        ("Add a fin", partial(session.add, "fin"), "I"),
        ("New design", page.designs.new),
        ("Save the design", page.designs.save, "S", CTRL),
        ("Share the design by a link", page.designs.share),
        ("Unlink the selected fin from its mirror image", session.unlink),
        ("Start over", session.start_over),
        ("Fail or repair the selected fin", fail_selected, "X"),
        *((f"Ask for: {name}", partial(session.set_preset, name)) for name in PRESETS),
        *((f"Keep {word} least", partial(session.keep_least, word)) for word in LEAST),
        ("Swim: pause or go on", lambda: swimming.set_running(not swimming.running), "B"),
        ("Swim: back to the design", page.scenery.end_swim),
        ("Frame what is selected", robot.frame, "F"),
        *(
            (f"Camera: {view}", partial(robot.look_from, view), key)
            for view, key in (("3D", "1"), ("Top", "2"), ("Side", "3"), ("Front", "4"))
        ),
        ("Freeze or move the fins", partial(session.toggle, "frozen"), "P"),
        ("Dark or light theme", partial(session.toggle, "dark")),
        ("Tour: start, or next stop", session.guide.tour, "T"),
        ("Export the bundle for the robot", page.designs.bundle),
    ]
    for label, act, *key_and_modifier in table:
        key, modifier = (*key_and_modifier, None, None)[:2]
        handle = page.gui.add_command(label, hotkey=key, modifier=modifier)

        @handle.on_trigger
        async def _triggered(_event: Any, act: Callable[[], object] = act) -> None:
            page.do(act)
