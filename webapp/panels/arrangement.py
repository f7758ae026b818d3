"""The arrangement of all panels on the page: in which region each stands, and when it is visible.

`Frame` (`frame.py`) builds them in this order. A new panel is a function in this folder and a line
of `PANELS`.
"""

from collections.abc import Callable
from typing import NamedTuple

from webapp.page import Page
from webapp.panels.actuator_inspector import add_actuator
from webapp.panels.actuator_list import add_actuator_list
from webapp.panels.body_inspector import add_body
from webapp.panels.capability_tab import add_capability
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
from webapp.panels.granted_card import add_granted
from webapp.panels.hull_panel import add_hull
from webapp.panels.limits_tab import add_improving, add_reach
from webapp.panels.log_tab import add_log, add_losses, log_plots, replays_table
from webapp.panels.menu import add_menu
from webapp.panels.modes_tab import add_candidates, add_comparison
from webapp.panels.null_space import add_null_space
from webapp.panels.swim_tab import add_figures, add_run, add_scenario, add_timeline
from webapp.panels.take_home import add_python, add_take_home
from webapp.panels.two_robots import add_figures_of_both, add_two_robots
from webapp.panels.wrench_tab import add_answer, add_commands, add_jets, add_speed, add_target
from webapp.session.looking import CANDIDATES, NULL_SPACE, TASKS, TWO_ROBOTS

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
"""Regions of the page, in the order in which they are built."""
DESIGN, ALLOCATE, SIMULATE, EXPORT, LOG = TASKS

NEEDS_ACTUATORS = "actuators"
"""Need of a panel about the actuators that are selected."""
NEEDS_ROBOT = "robot"
"""Need of a panel about the robot as a whole, which is there while no actuator is selected."""
NEEDS_GUIDE = "guide"
"""Need of a panel that is there during a tour or a lesson."""
NEEDS_ONE = "one"
"""Need of a panel about one robot, which is not there while two stand beside each other."""
NEEDS_TWO = "two"
"""Need of a panel that is there while two robots stand beside each other."""
NEEDS_FILE = "file"
"""Need of a panel about the file of another program that the robot was read from."""
NEEDS_FLOW = "flow"
"""Need of a panel that is there where an actuator feels the flow of the water."""


class Panel(NamedTuple):
    """A panel: what builds it, and where and when it is visible."""

    region: str
    """One of `REGIONS`."""
    tasks: tuple[str, ...]
    """Tasks in which it is visible."""
    title: str
    """Its heading; in the drawer the name of its tab, one of `DRAWERS`; not shown in the bar."""
    build: Callable[[Page], object]
    """Adds its widgets to a page."""
    is_folded: bool = False
    """Whether it is closed at first."""
    need: str = ""
    """One of `NEEDS_*`, without which it is not visible; empty where it needs nothing."""


PANELS = (
    Panel(TOP, TASKS, "Robot", card(robot_name)),
    Panel(TOP, TASKS, "File", add_file),
    Panel(TOP, TASKS, "History", add_history),
    Panel(TOP, TASKS, "Tasks", card(tasks)),
    Panel(TOP, TASKS, "Answers", add_answering),
    Panel(TOP, TASKS, "Menu", add_menu),
    Panel(LEFT, TASKS, "Guide", card(guide_card), need=NEEDS_GUIDE),
    Panel(LEFT, (DESIGN,), "Actuators", add_actuator_list),
    Panel(LEFT, (DESIGN,), "Taken for granted", add_granted, need=NEEDS_FILE),
    Panel(LEFT, (DESIGN,), "Designs", add_designs),
    Panel(RIGHT, (DESIGN, ALLOCATE), "Water", add_speed, need=NEEDS_FLOW),
    Panel(RIGHT, (DESIGN,), "Actuator", add_actuator, need=NEEDS_ACTUATORS),
    Panel(RIGHT, (DESIGN,), "Body", add_body, need=NEEDS_ROBOT),
    Panel(RIGHT, (DESIGN,), "Hull", add_hull, is_folded=True, need=NEEDS_ROBOT),
    Panel(RIGHT, (DESIGN,), "Check", card(check)),
    Panel(DRAWER, (DESIGN,), "Reach", add_reach),
    Panel(DRAWER, (DESIGN,), "Improve", add_improving),
    Panel(DRAWER, (DESIGN,), "Capability", add_capability),
    Panel(LEFT, (ALLOCATE,), TWO_ROBOTS, add_two_robots, need=NEEDS_TWO),
    Panel(LEFT, (ALLOCATE,), "Actuators", add_commands, need=NEEDS_ONE),
    Panel(LEFT, (ALLOCATE,), "Damage", add_damage, is_folded=True, need=NEEDS_ONE),
    Panel(RIGHT, (ALLOCATE,), "Wrench", add_target),
    Panel(LEFT, (LOG,), "Log", add_log),
    Panel(RIGHT, (LOG,), "Lost", add_losses),
    Panel(RIGHT, (ALLOCATE, LOG), "Asked and delivered", add_answer, need=NEEDS_ONE),
    Panel(DRAWER, (LOG,), "Log over time", card(log_plots)),
    Panel(DRAWER, (LOG,), "Replays", card(replays_table)),
    Panel(RIGHT, (DESIGN, ALLOCATE), "Jets", add_jets, need=NEEDS_ONE),
    Panel(DRAWER, (ALLOCATE,), CANDIDATES, add_candidates),
    Panel(DRAWER, (ALLOCATE,), NULL_SPACE, add_null_space),
    Panel(DRAWER, (ALLOCATE,), "Comparison", add_comparison),
    Panel(DRAWER, (ALLOCATE,), TWO_ROBOTS, add_figures_of_both),
    Panel(LEFT, (SIMULATE,), "Scenario", add_scenario),
    Panel(RIGHT, (SIMULATE,), "Run", add_run),
    Panel(RIGHT, (SIMULATE,), "Figures", add_figures),
    Panel(DRAWER, (SIMULATE,), "Swim over time", add_timeline),
    Panel(LEFT, (EXPORT,), "Take home", add_take_home),
    Panel(RIGHT, (EXPORT,), "Files", add_files),
    Panel(RIGHT, (EXPORT,), "Python", add_python),
    Panel(VIEW, TASKS, "Camera", card(camera)),
    Panel(VIEW, TASKS, "Display", add_switches, is_folded=True),
)
"""All panels, by region from top to bottom."""
