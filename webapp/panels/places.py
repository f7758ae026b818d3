"""Tables of the frame: which panel stands where, and what can be done by a key or a command
(Ctrl+K)."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from webapp.page import Page
from webapp.panels.actuator_inspector import add_actuator
from webapp.panels.actuator_list import add_actuator_list
from webapp.panels.body_inspector import add_body
from webapp.panels.cards import (
    add_answering,
    add_file,
    add_history,
    add_switches,
    camera,
    card,
    check,
    guide_card,
    robot_name,
    tasks,
)
from webapp.panels.damage import add_damage
from webapp.panels.files_tab import add_designs, add_files
from webapp.panels.hull_panel import add_hull
from webapp.panels.limits_tab import add_improving, add_reach
from webapp.panels.log_tab import add_log, add_losses, log_plots, replays_table
from webapp.panels.modes_tab import add_candidates, add_comparison
from webapp.panels.null_space import add_null_space
from webapp.panels.swim_tab import add_figures, add_run, add_scenario, add_timeline
from webapp.panels.wrench_tab import add_answer, add_commands, add_jets, add_speed, add_target
from webapp.session.looking import CANDIDATES, NULL_SPACE, TASKS
from webapp.session.state import LEAST
from webapp.session.targets import PRESETS

TOP, LEFT, RIGHT, DRAWER, VIEW = REGIONS = ("top", "left", "right", "drawer", "view")
"""The bar above all; the list at the left; the inspector at the right; the drawer below; over the
view."""
DESIGN, ALLOCATE, SIMULATE, EXPORT, LOG = TASKS


class Place(NamedTuple):
    """Where a panel stands."""

    region: str
    tasks: tuple[str, ...]
    title: str
    """Its heading; in the drawer the name of its tab, which `DRAWERS` knows; nothing in the bar."""
    make: Callable[[Page], object]
    folded: bool = False
    about: str = ""
    """What must be selected for it to be there: `actuators`, or none of them (`robot`); `guide`
    where a tour or a lesson must be under way; `flow` where an actuator feels it; nothing where it
    is there always."""


PLACES = (
    Place(TOP, TASKS, "Robot", card(robot_name)),
    Place(TOP, TASKS, "File", add_file),
    Place(TOP, TASKS, "History", add_history),
    Place(TOP, TASKS, "Tasks", card(tasks)),
    Place(TOP, TASKS, "Answers", add_answering),
    Place(LEFT, TASKS, "Guide", card(guide_card), about="guide"),
    Place(LEFT, (DESIGN,), "Actuators", add_actuator_list),
    Place(LEFT, (DESIGN,), "Designs", add_designs),
    Place(RIGHT, (DESIGN, ALLOCATE), "Water", add_speed, about="flow"),
    Place(RIGHT, (DESIGN,), "Actuator", add_actuator, about="actuators"),
    Place(RIGHT, (DESIGN,), "Body", add_body, about="robot"),
    Place(RIGHT, (DESIGN,), "Hull", add_hull, folded=True, about="robot"),
    Place(RIGHT, (DESIGN,), "Check", card(check)),
    Place(DRAWER, (DESIGN,), "Reach", add_reach),
    Place(DRAWER, (DESIGN,), "Improve", add_improving),
    Place(LEFT, (ALLOCATE,), "Actuators", add_commands),
    Place(LEFT, (ALLOCATE,), "Damage", add_damage, folded=True),
    Place(RIGHT, (ALLOCATE,), "Wrench", add_target),
    Place(LEFT, (LOG,), "Log", add_log),
    Place(RIGHT, (LOG,), "Lost", add_losses),
    Place(RIGHT, (ALLOCATE, LOG), "Asked and delivered", add_answer),
    Place(DRAWER, (LOG,), "Log over time", card(log_plots)),
    Place(DRAWER, (LOG,), "Replays", card(replays_table)),
    Place(RIGHT, (DESIGN, ALLOCATE), "Jets", add_jets),
    Place(DRAWER, (ALLOCATE,), CANDIDATES, add_candidates),
    Place(DRAWER, (ALLOCATE,), NULL_SPACE, add_null_space),
    Place(DRAWER, (ALLOCATE,), "Comparison", add_comparison),
    Place(LEFT, (SIMULATE,), "Scenario", add_scenario),
    Place(RIGHT, (SIMULATE,), "Run", add_run),
    Place(RIGHT, (SIMULATE,), "Figures", add_figures),
    Place(DRAWER, (SIMULATE,), "Swim over time", add_timeline),
    Place(RIGHT, (EXPORT,), "Files", add_files),
    Place(VIEW, TASKS, "Camera", card(camera)),
    Place(VIEW, TASKS, "Display", add_switches, folded=True),
)


CTRL = "cmd/ctrl"
CTRL_SHIFT = "cmd/ctrl+shift"
ALT = "alt"


def add_keys(page: Page) -> None:
    """Let a browser have all commands of one page. The camera owns W A S D Q E and the arrow
    keys."""
    session = page.session
    robot = page.scenery.robot
    swimming = page.jobs.swimming

    def toggle_loss_of_selected() -> None:
        session.toggle_loss(session.selected or session.state.layout.names[0])

    # What it is called and does and, if any, its key as viser calls that, and a modifier.
    table: list[tuple[Any, ...]] = [
        *(
            (task, partial(session.show_task, task), str(k + 1), ALT)
            for k, task in enumerate(TASKS)
        ),
        ("Fold or open the drawer", session.fold_drawer, "J", CTRL),
        ("Undo", session.undo, "Z", CTRL),
        ("Redo", session.redo, "Z", CTRL_SHIFT),
        ("Select the next fin", session.select_next, "N"),
        ("Select nothing", partial(session.select, None), "escape"),
        ("Duplicate the selected fin", session.duplicate, "D", CTRL),
        ("Mirror the selected fin", session.mirror, "M"),
        ("Delete the selected fin", session.delete, "delete"),
        ("Add a fin", partial(session.add, "fin"), "I"),
        ("New design", page.new),
        ("Save the design", page.designs.save, "S", CTRL),
        ("Share the design by a link", page.designs.share),
        ("Unlink the selected fin from its mirror image", session.unlink),
        ("Start over", session.start_over),
        ("Fail or repair the selected fin", toggle_loss_of_selected, "X"),
        *((f"Ask for: {name}", partial(session.set_preset, name)) for name in PRESETS),
        *((f"Keep {word} least", partial(session.keep_least, word)) for word in LEAST),
        ("Swim: pause or go on", lambda: swimming.set_running(not swimming.running), "B"),
        ("Swim: back to the design", page.scenery.end_swim),
        ("Frame what is selected", robot.frame, "F"),
        ("Save the view as a picture", page.scenery.save),
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
