"""What a layout can do, and what is in reach of a question: score cards, attainable sets,
ranges."""

from dataclasses import dataclass
from functools import lru_cache

from finlab.analysis import AttainableSet, ScoreCard, attainable_set, score_card
from finlab.forces.attainable import WrenchHalf
from finlab.forces.reach import Ranges, axis_ranges
from finlab.layout import Layout
from webapp.session.looking import DRAWN
from webapp.session.state import Flow, State


@dataclass(frozen=True)
class Question:
    """What is to be worked out."""

    layout: Layout
    failed: tuple[str, ...]
    saved: Layout
    """Another one to compare with."""
    drawn: str
    flow: Flow | None = None


@dataclass(frozen=True)
class Findings:
    """What came of it."""

    question: Question
    card: ScoreCard
    """What the working fins can do."""
    before: ScoreCard | None
    """The same for the layout to compare with, where it is another one."""
    now: AttainableSet | None
    """What the working fins attain, where a set is drawn."""
    whole: AttainableSet | None
    """The same with all fins, where one has failed; else that of the layout to compare with."""


@lru_cache(maxsize=32)
def find(question: Question) -> Findings:
    """Answer a question; takes about a second, but all first pages ask the same."""
    layout = question.layout
    failed = question.failed
    saved = question.saved
    flow = question.flow
    other = saved != layout
    # An actuator that the other layout does not have cannot have failed there.
    lost = tuple(name for name in failed if name in saved.names)
    kind = DRAWN[question.drawn]
    now = reference = None
    if kind is not None:
        now = attainable_set(layout, kind, lost=failed, flow=flow)
        if failed or other:
            reference = attainable_set(layout if failed else saved, kind, flow=flow)
    card = score_card(layout, failed, flow)
    before = score_card(saved, lost, flow) if other and len(lost) < saved.n else None
    return Findings(question, card, before, now, reference)


@lru_cache(maxsize=32)
def find_ranges(question: State) -> Ranges:
    """The range of each component of a state's target."""
    return axis_ranges(question.layout, question.target, question.failed, question.flow)


@dataclass(frozen=True)
class Attained:
    """Which set of a layout is asked for."""

    layout: Layout
    kind: WrenchHalf
    flow: Flow | None


def find_set(question: Attained) -> AttainableSet:
    """The set of forces, or of torques, that a layout attains."""
    return attainable_set(question.layout, question.kind, flow=question.flow)
