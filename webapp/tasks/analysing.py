"""Analyses of a layout and of a question: score cards, attainable sets, and ranges of the axes."""

from dataclasses import dataclass
from functools import lru_cache

from finlab.analysis import AttainableSet, ScoreCard, attainable_set, score_card
from finlab.forces.attainable import WrenchHalf
from finlab.forces.reach import Ranges, axis_ranges
from finlab.layout import Layout
from webapp.session.looking import DRAWN
from webapp.session.state import Flow, State


@dataclass(frozen=True)
class AnalysisQuestion:
    """Which layout is analysed, and what of it is seen."""

    layout: Layout
    """The layout as it is edited, with the limits that damage has left."""
    lost: tuple[str, ...]
    """Names of its lost actuators."""
    saved: Layout
    """The layout to compare with: as it was opened or saved last."""
    drawn: str
    """Key of `DRAWN`: which attainable set is drawn."""
    flow: Flow | None = None
    """Velocity (6,) relative to the water [m/s, rad/s]; None at rest."""


@dataclass(frozen=True)
class Analysis:
    """Score cards and attainable sets of a layout."""

    question: AnalysisQuestion
    card: ScoreCard
    """What the working fins can do."""
    before: ScoreCard | None
    """The same for the layout to compare with, where it is another one."""
    now: AttainableSet | None
    """What the working fins attain, where a set is drawn."""
    whole: AttainableSet | None
    """The same with all fins, where one is lost; else that of the layout to compare with."""


@lru_cache(maxsize=32)
def analyse(question: AnalysisQuestion) -> Analysis:
    """Answer a question; takes about a second, but all first pages ask the same."""
    layout = question.layout
    lost = question.lost
    saved = question.saved
    flow = question.flow
    other = saved != layout
    # An actuator that the other layout does not have cannot be lost there.
    lost_in_saved = tuple(name for name in lost if name in saved.names)
    kind = DRAWN[question.drawn]
    now = reference = None
    if kind is not None:
        now = attainable_set(layout, kind, lost=lost, flow=flow)
        if lost or other:
            reference = attainable_set(layout if lost else saved, kind, flow=flow)
    card = score_card(layout, lost, flow)
    before = None
    if other and len(lost_in_saved) < saved.n:
        before = score_card(saved, lost_in_saved, flow)
    return Analysis(question, card, before, now, reference)


@lru_cache(maxsize=32)
def find_ranges(question: State) -> Ranges:
    """The range of each component of a state's target."""
    return axis_ranges(question.layout, question.target, question.lost, question.flow)


@dataclass(frozen=True)
class SetQuestion:
    """Which attainable set of a layout is asked for."""

    layout: Layout
    kind: WrenchHalf
    """Forces or torques."""
    flow: Flow | None
    """Velocity (6,) relative to the water [m/s, rad/s]; None at rest."""


def find_set(question: SetQuestion) -> AttainableSet:
    """The set of forces, or of torques, that a layout attains."""
    return attainable_set(question.layout, question.kind, flow=question.flow)
