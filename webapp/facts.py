"""The facts of one page: all that its panels and its view are functions of, by name."""

from typing import NamedTuple

from finlab.allocation.allocation import Allocation
from webapp.board import Facts
from webapp.markup.outcomes import pace_words
from webapp.scene.wrench_handle import Grip
from webapp.scene.wrench_nodes import Scale
from webapp.session import Session
from webapp.session.two_robots import Pair
from webapp.tasks.answering import ShownAnswer
from webapp.tasks.jobs import Jobs
from webapp.tasks.solver import Reply
from webapp.tasks.swimmer import Swimmer
from webapp.tasks.take_home import HomeQuestion


class PairFacts(NamedTuple):
    """Two robots that stand beside each other, and what is known of them."""

    pair: Pair | None
    """None where they are not looked at."""
    left_reply: Reply | None
    """The newest answer of the left one, perhaps to an earlier question."""
    right_reply: Reply | None
    """The same of the right one."""
    pair_allocations: tuple[Allocation | None, ...]
    """Answers of both; none where they are not looked at."""
    has_this_robot: bool
    """Whether the robot that the page works on can be seen."""


NO_PAIR = PairFacts(None, None, None, (), True)
"""Where no two robots are looked at."""


def pair_facts(session: Session, jobs: Jobs) -> PairFacts:
    """The two robots of a session, unless one swims."""
    pair = None if jobs.swimming.swimmer is not None else session.two_robots.pair
    if pair is None:
        return NO_PAIR
    replies = (jobs.pairing.reply(0, pair), jobs.pairing.reply(1, pair))
    allocations = tuple([None if reply is None else reply.answer for reply in replies])
    has_this_robot = any(standing.is_this for standing in pair.both)
    return PairFacts(pair, *replies, allocations, has_this_robot)


def facts_of(
    session: Session,
    jobs: Jobs,
    answer: ShownAnswer,
    swimmer: Swimmer | None,
    dragged: int | None,
    pulled: Grip | None,
    scale: Scale,
    pair: PairFacts,
) -> Facts:
    """The facts of a session, of what has been worked out for it, and of the view.

    Args:
        session: its state, and what is looked at.
        jobs: questions of the page, and their answers.
        answer: what is seen of the newest answer.
        swimmer: the robot that is seen to swim; None for none.
        dragged: index of the actuator that is dragged; None for none.
        pulled: what of the wrench is in the user's hand; None for nothing.
        scale: what lengths in the view stand for.
        pair: what is known of two robots beside each other.
    """
    state = session.state
    swimming = jobs.swimming
    opened = session.opened
    jet_comparison = jobs.jet_comparison.answer
    if jet_comparison is not None and jet_comparison.state != state:
        jet_comparison = None  # it is of an earlier question
    return {
        # The state: layout, damage, target, method, policy, network ...
        "state": state,
        **vars(state),
        "lost": state.lost,
        "flow": state.flow,
        "able": state.able,
        # The session: desk, display, draft, swim, loops ...
        **vars(session),
        "is_edited": state.layout not in session.kept,
        "selected": session.selected,
        "selection": session.selection,
        "task": session.desk.task,
        "drawer": None if session.desk.folded else opened or None,
        "opened": opened,
        "undo": session.history.undo_name,
        "redo": session.history.redo_name,
        "stop": session.guide.stop,
        "solved": session.guide.solved,
        # The newest answer: best, shown_allocation, in_reach, busy, error, modes ...
        **answer._asdict(),
        "playing": jobs.refining.running,
        "jet_comparison": jet_comparison,
        "run": jobs.comparison.run,
        # Two robots beside each other.
        **pair._asdict(),
        "pair_sources": session.two_robots.sources(jobs.improver.proposal) if pair.pair else (),
        "pair_busy": pair.pair is not None and any(slot.busy for slot in jobs.pairing.slots),
        "cards": jobs.pairing.cards.answer,
        "cards_error": jobs.pairing.cards.error,
        "cards_progress": jobs.pairing.cards.progress,
        "cards_busy": jobs.pairing.cards.busy,
        # What takes longer.
        "ranges": jobs.ranging.answer if pair.has_this_robot else None,
        "ranges_error": jobs.ranging.error,
        "analysis": jobs.analyst.answer,
        "analysis_error": jobs.analyst.error,
        "is_analysing": jobs.analyst.busy,
        "improvement": jobs.improver.answer,
        "bounded": jobs.improver.bounding.answer,
        "bounding": jobs.improver.bounding.busy,
        "improvement_error": jobs.improver.error,
        "progress": jobs.improver.progress,
        "improving": jobs.improver.busy,
        "growing": jobs.growing.answer,
        "capability_plot": jobs.capability.answer,
        "capability_question": jobs.capability.answered,
        "capability_error": jobs.capability.error,
        "plot_progress": jobs.capability.progress,
        "plotting": jobs.capability.busy,
        "fit_result": jobs.fitting.result,
        "fit_error": jobs.fitting.error,
        "fit_progress": jobs.fitting.progress,
        "judgement": jobs.log.shown,
        "judgement_error": jobs.log.error,
        "judgement_stage": jobs.log.progress,
        "by_page": jobs.log.by_page,
        "log_moment": jobs.log.moment,
        "offers": jobs.offers.answer,
        "offers_error": jobs.offers.error,
        "is_offered": (
            session.desk.task == "Export" and jobs.offers.answered == HomeQuestion.of_state(state)
        ),
        # A swim, and the view.
        "swims": swimming.active,
        "shows_swim": swimmer is not None or (swimming.active and swimming.swimmer is None),
        "swimmer": swimmer,
        "moment": None if swimmer is None else swimmer.visible_moment,
        "visible_layout": state.layout if swimmer is None else swimmer.layout,
        "paused": swimming.active and not swimming.running and not swimming.done,
        "swim_goes_on": swimming.active and not swimming.done,
        "pace": pace_words(swimming) if swimming.active else "",
        "dragged": dragged,
        "pulled": pulled,
        "scale": scale,
    }
