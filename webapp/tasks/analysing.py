"""Analyses of a layout and of a question: score cards, attainable sets, and ranges of the axes."""

from dataclasses import dataclass
from functools import lru_cache

from finlab.analysis import AttainableSet, ScoreCard, attainable_set, score_card
from finlab.forces.attainable import WrenchHalf
from finlab.forces.reach import Ranges, axis_ranges
from finlab.forces.within_budget import counted_power
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
        now = _set_of(layout, kind, lost, flow)
        if lost:
            reference = _set_of(layout, kind, (), flow)
        elif before is not None:
            reference = _set_of(before, kind, lost_before, flow)
    card = score_card(layout, lost, flow)
    card_before = None
    if before is not None and len(lost_before) < before.n:
        card_before = score_card(before, lost_before, flow)
    return Analysis(question, card, card_before, now, reference)


@lru_cache(maxsize=32)
def find_ranges(question: State) -> Ranges:
    """The range of each component of a state's target, within the power budget of its layout but
    where none is counted."""
    layout = question.layout
    power = counted_power(layout, question.flow) if layout.has_budget else None
    return axis_ranges(layout, question.target, question.lost, question.flow, power)


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
    return _set_of(question.layout, question.kind, (), question.flow)


def _set_of(
    layout: Layout, kind: WrenchHalf, lost: tuple[str, ...], flow: Flow | None
) -> AttainableSet:
    """The attainable set of a layout that has lost some actuators."""
    power = counted_power(layout, flow)
    return attainable_set(layout, kind, lost=lost, flow=flow, power=power)
