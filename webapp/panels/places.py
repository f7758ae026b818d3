"""Arrangement of panels on the page, and when each is shown; `Frame` builds them in this order."""

from collections.abc import Callable
from typing import NamedTuple

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

TOP = "top"
"""The bar above all."""
LEFT = "left"
"""The list at the left."""
RIGHT = "right"
"""The inspector at the right."""
DRAWER = "drawer"
"""The drawer below the view."""
VIEW = "view"
"""Over the view."""
REGIONS = (TOP, LEFT, RIGHT, DRAWER, VIEW)
DESIGN, ALLOCATE, SIMULATE, EXPORT, LOG = TASKS


class Place(NamedTuple):
    """Where a panel stands."""

    region: str
    """One of `REGIONS`."""
    tasks: tuple[str, ...]
    """Tasks in which it can be seen."""
    title: str
    """Its heading; in the drawer the name of its tab, which `DRAWERS` knows; nothing in the bar."""
    make: Callable[[Page], object]
    """Builds it."""
    folded: bool = False
    """Whether it is closed at first."""
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
