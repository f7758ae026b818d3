"""Which panel stands where: the one table of the frame. A panel is a class that takes `gui` and `page`."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import viser

from webapp.page import Page, Panel
from webapp.panels.body_inspector import BodyInspector
from webapp.panels.cards import Card, answer, camera, check, guide, robot_name, tasks
from webapp.panels.compare_tab import ComparePanel
from webapp.panels.damage import DamagePanel
from webapp.panels.design_panel import DesignPanel
from webapp.panels.files_tab import FilesTab
from webapp.panels.fin_inspector import FinInspector
from webapp.panels.fin_list import FinList
from webapp.panels.hull_panel import HullPanel
from webapp.panels.limits_tab import ImprovePanel, ReachPanel
from webapp.panels.modes_tab import CandidatesPanel
from webapp.panels.swim_tab import RunPanel, ScenarioPanel, SwimCardPanel
from webapp.panels.timeline import Timeline
from webapp.panels.top_bar import AnsweringBar, FileBar, HistoryBar
from webapp.panels.view_tab import ViewPanel
from webapp.panels.wrench_tab import FinsPanel, TargetPanel
from webapp.session.looking import TASKS

TOP, LEFT, RIGHT, DRAWER, VIEW = REGIONS = ("top", "left", "right", "drawer", "view")
"""The bar above all; the list at the left; the inspector at the right; the drawer below; over the view."""
DESIGN, ALLOCATE, SIMULATE, EXPORT = TASKS


class Place(NamedTuple):
    """Where a panel stands."""

    region: str
    """One of `REGIONS`."""
    tasks: tuple[str, ...]
    """In which tasks it is there."""
    title: str
    """Its heading; in the drawer the name of its tab, which `DRAWERS` knows; nothing in the bar."""
    make: Callable[[viser.GuiApi, Page], Panel]
    swims: bool = False
    """Whether it shows a swim, and is to follow it."""
    folded: bool = False
    """Whether only its heading is seen at first."""
    about: str = ""
    """What must be selected for it to be there: `fins`, or none of them (`robot`); `guide` where a tour or a
    lesson must be under way; nothing where it is there always."""
    fins_only: str | None = None
    """What a robot with other actuators is told that it cannot have yet; where it is empty, the panel is
    not there for such a robot. None for panels that take any robot."""


PLACES = (
    Place(TOP, TASKS, "Robot", partial(Card, robot_name)),
    Place(TOP, TASKS, "File", FileBar),
    Place(TOP, TASKS, "History", HistoryBar),
    Place(TOP, TASKS, "Tasks", partial(Card, tasks)),
    Place(TOP, TASKS, "Answers", AnsweringBar),
    Place(LEFT, TASKS, "Guide", partial(Card, guide), about="guide"),
    Place(LEFT, (DESIGN,), "Actuators", FinList),
    Place(LEFT, (DESIGN,), "Designs", DesignPanel),
    Place(RIGHT, (DESIGN,), "Fin", FinInspector, about="fins", fins_only="the inspector of a fin"),
    Place(RIGHT, (DESIGN,), "Body", BodyInspector, about="robot"),
    Place(RIGHT, (DESIGN,), "Hull", HullPanel, folded=True, about="robot"),
    Place(RIGHT, (DESIGN,), "Check", partial(Card, check), fins_only=""),
    Place(DRAWER, (DESIGN,), "Reach", ReachPanel, fins_only="reach with its score card"),
    Place(DRAWER, (DESIGN,), "Improve", ImprovePanel, fins_only="the search for a better layout"),
    Place(LEFT, (ALLOCATE,), "Actuators", FinsPanel),
    Place(LEFT, (ALLOCATE,), "Damage a fin", DamagePanel, folded=True, fins_only=""),
    Place(RIGHT, (ALLOCATE,), "Wrench", TargetPanel),
    Place(RIGHT, (ALLOCATE,), "Asked and delivered", partial(Card, answer)),
    Place(DRAWER, (ALLOCATE,), "Candidates", CandidatesPanel),
    Place(DRAWER, (ALLOCATE,), "Comparison", ComparePanel, fins_only="the comparison of methods"),
    Place(LEFT, (SIMULATE,), "Scenario", ScenarioPanel, fins_only=""),
    Place(RIGHT, (SIMULATE,), "Run", RunPanel, swims=True, fins_only="a swim"),
    Place(RIGHT, (SIMULATE,), "Figures", SwimCardPanel, swims=True, fins_only=""),
    Place(DRAWER, (SIMULATE,), "Swim over time", Timeline, swims=True, fins_only=""),
    Place(RIGHT, (EXPORT,), "Files", FilesTab),
    Place(VIEW, TASKS, "Camera", partial(Card, camera)),
    Place(VIEW, TASKS, "Display", ViewPanel, folded=True),
)
"""All panels, in the order in which they stand in their regions."""
