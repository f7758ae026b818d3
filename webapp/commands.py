"""The table of all that can be done by a key or from the list of commands (Ctrl+K)."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from webapp.page import Page
from webapp.session.looking import TASKS
from webapp.session.state import LEAST
from webapp.session.targets import PRESETS

CTRL, CTRL_SHIFT, ALT = "cmd/ctrl", "cmd/ctrl+shift", "alt"


class Command(NamedTuple):
    """One thing to do."""

    label: str
    act: Callable[[], object]
    key: str = ""
    """As viser calls it; none where it is done from the list alone."""
    modifier: str = ""


def commands(page: Page) -> list[Command]:
    """All commands of one page. The camera owns W A S D Q E and the arrow keys."""
    session, robot = page.session, page.scenery.robot

    def fail_selected() -> None:
        session.toggle_failure(session.selected or session.state.layout.names[0])

    def swim_on() -> None:
        page.jobs.swimming.set_running(not page.jobs.swimming.running)

    return [
        *(Command(task, partial(session.show_task, task), str(k + 1), ALT) for k, task in enumerate(TASKS)),
        Command("Fold or open the drawer", session.fold_drawer, "J", CTRL),
        Command("Undo", session.undo, "Z", CTRL),
        Command("Redo", session.redo, "Z", CTRL_SHIFT),
        Command("Select the next fin", session.select_next, "N"),
        Command("Select nothing", partial(session.select, None), "escape"),
        Command("Duplicate the selected fin", session.duplicate, "D", CTRL),
        Command("Mirror the selected fin", session.mirror, "M"),
        Command("Delete the selected fin", session.delete, "delete"),
        Command("Add a fin", partial(session.add, "fin"), "I"),
        Command("New design", page.designs.new),
        Command("Save the design", page.designs.save, "S", CTRL),
        Command("Share the design by a link", page.designs.share),
        Command("Unlink the selected fin from its mirror image", session.unlink),
        Command("Start over", session.start_over),
        Command("Fail or repair the selected fin", fail_selected, "X"),
        *(Command(f"Ask for: {name}", partial(session.set_preset, name)) for name in PRESETS),
        *(Command(f"Keep {word} least", partial(session.keep_least, word)) for word in LEAST),
        Command("Swim: pause or go on", swim_on, "B"),
        Command("Swim: back to the design", page.scenery.end_swim),
        Command("Frame what is selected", robot.frame, "F"),
        *(
            Command(f"Camera: {view}", partial(robot.look_from, view), key)
            for view, key in (("3D", "1"), ("Top", "2"), ("Side", "3"), ("Front", "4"))
        ),
        Command("Freeze or move the fins", partial(session.toggle, "frozen"), "P"),
        Command("Dark or light theme", partial(session.toggle, "dark")),
        Command("Tour: start, or next stop", session.guide.tour, "T"),
        Command("Export the bundle for the robot", page.designs.bundle),
    ]


def add_commands(page: Page) -> None:
    """Let a browser have the commands."""
    for command in commands(page):
        key: Any = command.key or None
        modifier: Any = command.modifier or None
        handle = page.gui.add_command(command.label, hotkey=key, modifier=modifier)

        @handle.on_trigger
        async def _triggered(_event: Any, act: Callable[[], object] = command.act) -> None:
            page.do(act)
