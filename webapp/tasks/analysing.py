"""Analyses of a layout and of a question: score cards, attainable sets, and ranges of the axes."""

from dataclasses import dataclass
from functools import lru_cache

from finlab.analysis import AttainableSet, ScoreCard, attainable_set, score_card
from finlab.forces.attainable import WrenchHalf
from finlab.forces.reach import Ranges, axis_ranges
from finlab.layout import Layout
from webapp.session.looking import DRAWN
from webapp.session.state import Flow, State
from webapp.tasks.budget_ranges import ranges_within_budget


@dataclass(frozen=True)
class AnalysisQuestion:
    """Which layout is analysed, and what of it is seen."""

    layout: Layout
    """The layout as it is edited, with the limits that damage has left."""
    lost: tuple[str, ...]
    """Names of its lost actuators."""
    before: Layout | None
    """What it was just before its last change, with the limits that damage had left; None where
    there is nothing to compare with."""
    drawn: str
    """Key of `DRAWN`: which attainable set is drawn."""
    flow: Flow | None = None
    """Velocity (6,) relative to the water [m/s, rad/s]; None at rest."""
    lost_before: tuple[str, ...] = ()
    """Names of actuators that were lost just before."""


@dataclass(frozen=True)
class Analysis:
    """Score cards and attainable sets of a layout."""

    question: AnalysisQuestion
    card: ScoreCard
    """What the working fins can do."""
    before: ScoreCard | None
    """What they could do just before, where that was another layout or damage."""
    now: AttainableSet | None
    """What the working fins attain, where a set is drawn."""
    whole: AttainableSet | None
    """The same with all fins, where one is lost; else that just before."""


@lru_cache(maxsize=32)
def analyse(question: AnalysisQuestion) -> Analysis:
    """Answer a question; takes about a second, but all first pages ask the same."""
    layout = question.layout
    lost = question.lost
    flow = question.flow
    before = question.before
    lost_before = question.lost_before
    if (before, lost_before) == (layout, lost):
        before = None
    kind = DRAWN[question.drawn]
    now = reference = None
    if kind is not None:
        now = attainable_set(layout, kind, lost=lost, flow=flow)
        if lost:
            reference = attainable_set(layout, kind, flow=flow)
        elif before is not None:
            reference = attainable_set(before, kind, lost=lost_before, flow=flow)
    card = score_card(layout, lost, flow)
    card_before = None
    if before is not None and len(lost_before) < before.n:
        card_before = score_card(before, lost_before, flow)
    return Analysis(question, card, card_before, now, reference)


@lru_cache(maxsize=32)
def find_ranges(question: State) -> Ranges:
    """The range of each component of a state's target."""
    ranges = axis_ranges(question.layout, question.target, question.lost, question.flow)
    layout = question.layout
    if layout.power_w is None and not layout.buses:
        return ranges
    return ranges_within_budget(question, ranges)


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
