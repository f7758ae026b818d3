"""Commands of a page, by a key or from its list of commands (Ctrl+K)."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from webapp.page import Page
from webapp.panels.pairs import telling_pairs
from webapp.session.lessons import LESSONS, TOUR
from webapp.session.looking import TASKS, TWO_ROBOTS
from webapp.session.state import LEAST
from webapp.session.targets import PRESETS
from webapp.start_page import show_start_page

CTRL = "cmd/ctrl"
CTRL_SHIFT = "cmd/ctrl+shift"
ALT = "alt"
BACK = "The robot is as it was before; what was made meanwhile is there by Undo"
"""What is said where tour or lesson are closed by a key."""
CAMERA_KEYS = {"3D": "1", "Top": "2", "Side": "3", "Front": "4"}
"""Keys of the views of the camera."""


class Command(NamedTuple):
    """One line of the list."""

    label: str
    act: Callable[[], object]
    key: Any = None
    """As viser calls it; None for none."""
    modifier: Any = None
    """Keys that are held with it, as viser calls them."""
    looks: bool = False
    """Whether it changes nothing but what this page looks like."""


def add_page_commands(page: Page) -> None:
    """Let a browser have all commands of one page. The camera owns W A S D Q E and the arrow
    keys."""
    for command in page_commands(page):
        handle = page.gui.add_command(command.label, hotkey=command.key, modifier=command.modifier)

        @handle.on_trigger
        async def _triggered(_event: Any, command: Command = command) -> None:
            do = page.look if command.looks else page.do
            do(command.act)


def page_commands(page: Page) -> list[Command]:
    """All commands of one page, in the order of the list."""
    session = page.session
    scenery = page.scenery
    swimming = page.jobs.swimming

    def toggle_loss_of_selected() -> None:
        session.toggle_loss(session.selected or session.state.layout.names[0])

    def leave() -> None:
        if session.selected is not None:
            session.select(None)
        elif session.guide.stop is not None:
            course = session.guide.course
            session.guide.end()
            page.notify(f"Closed the {course}", BACK, calm=True)

    def pause_or_go_on() -> None:
        swimming.set_running(not swimming.running)

    commands = []
    for number, task in enumerate(TASKS, 1):
        commands.append(Command(task, partial(session.show_task, task), str(number), ALT))
    commands += [
        Command("Fold or open the drawer", session.fold_drawer, "J", CTRL),
        Command("Undo", page.undo, "Z", CTRL),
        Command("Redo", page.redo, "Z", CTRL_SHIFT),
        Command("Select the next fin", session.select_next, "N"),
        Command("Select nothing, or close tour and lesson", leave, "escape"),
        Command("Duplicate the selected fin", session.duplicate, "D", CTRL),
        Command("Mirror the selected fin", telling_pairs(page, session.mirror), "M"),
        Command("Delete the selected fin", telling_pairs(page, session.delete), "delete"),
        Command("Add a fin", partial(session.add, "fin"), "I"),
        Command("New design", page.new),
        Command("Save the design", page.designs.save, "S", CTRL),
        Command("Share the design by a link", page.designs.share),
        Command("Unlink the selected fin from its mirror image", session.unlink),
        Command("Start over", session.start_over),
        Command("Fail or repair the selected fin", toggle_loss_of_selected, "X"),
    ]
    for name in PRESETS:
        commands.append(Command(f"Ask for: {name}", partial(session.set_preset, name)))
    for word in LEAST:
        commands.append(Command(f"Keep {word} least", partial(session.keep_least, word)))
    commands += [
        Command("Two robots side by side", partial(session.show_drawer, TWO_ROBOTS)),
        Command("Two robots: swap", session.two_robots.swap),
        Command("Swim: pause or go on", pause_or_go_on, "B"),
        Command("Swim: back to the design", scenery.end_swim),
        Command("Frame what is selected", scenery.frame, "F", looks=True),
        Command("Save the view as a picture", scenery.save, looks=True),
    ]
    for view, key in CAMERA_KEYS.items():
        look = partial(scenery.look_from, view)
        commands.append(Command(f"Camera: {view}", look, key, looks=True))
    commands += [
        Command("Present, or leave", partial(session.toggle, "presents"), "P", looks=True),
        Command("Freeze or move the fins", partial(session.toggle, "frozen"), "H"),
        Command("Dark or light theme", partial(session.toggle, "dark")),
        Command("Tour: start, or next stop", session.guide.tour, "T"),
        Command("Export the bundle for the robot", page.designs.bundle),
        Command("Start page", partial(show_start_page, page)),
    ]
    for name, course in (("Tour", TOUR), ("Lesson", LESSONS)):
        for number, stop in enumerate(course, start=1):
            label = f"{name} {number}: {stop.title}"
            commands.append(Command(label, partial(session.guide.open, stop.name)))
    return commands
