"""All that one page asks for, and what came of it."""

from typing import Any

from finlab.analysis import AttainableSet
from finlab.forces.reach import Ranges
from webapp.session.looking import DRAWN, LOG
from webapp.session.state import State
from webapp.tasks.analysing import (
    Analysis,
    AnalysisQuestion,
    SetQuestion,
    analyse,
    find_ranges,
    find_set,
)
from webapp.tasks.answering import Answering, Refining
from webapp.tasks.capability import CapabilityPlot
from webapp.tasks.comparing import Comparison
from webapp.tasks.context import Context
from webapp.tasks.fitting import Fitting
from webapp.tasks.improving import Improver
from webapp.tasks.log_reading import LogReading
from webapp.tasks.slot import Slot
from webapp.tasks.solver import JetComparison
from webapp.tasks.swimmer import Swimmer
from webapp.tasks.swimming import Swimming
from webapp.tasks.take_home import HomeQuestion, Offer, offers_of
from webapp.tasks.two_robots import Pairing

REST_S = 0.12
"""How long the target may not change before the marks are worked out again [s]."""
CARD_REST_S = 0.35
"""How long a layout may not change before its card is worked out [s]: that takes a second."""


class Jobs:
    """The slots of one page. What nobody can see is not asked."""

    def __init__(self, context: Context) -> None:
        self._session = context.session
        self._robot: tuple[str, tuple[str, ...]] | None = None
        bell = context.bell
        pools = context.pools
        solver = context.solver
        self.answering = Answering(context)
        self.refining = Refining(context, self.answering)
        self.ranging: Slot[State, Ranges] = Slot(
            pools.brief, bell, find_ranges, rest_s=REST_S, alike=State.is_same_but_target
        )
        self.jet_comparison: Slot[State, JetComparison] = Slot(
            pools.answers, bell, solver.jet_comparison, rest_s=REST_S
        )
        self.analyst: Slot[AnalysisQuestion, Analysis] = Slot(
            pools.brief, bell, analyse, rest_s=CARD_REST_S
        )
        self.improver = Improver(context)
        self.capability = CapabilityPlot(context)
        self.growing: Slot[SetQuestion, AttainableSet] = Slot(
            pools.brief, bell, find_set, live=True
        )
        """What the best layout of a search attains so far."""
        self.fitting = Fitting(context)
        self.swimming = Swimming(context)
        self.log = LogReading(context, self.swimming)
        self.comparison = Comparison(context)
        self.pairing = Pairing(context)
        self.offers: Slot[HomeQuestion, tuple[Offer, ...]] = Slot(pools.brief, bell, offers_of)
        """In which formats the robot can be taken home."""
        self.first = frozenset[Slot[Any, Any]]([self.answering.slot, *self.pairing.slots])
        """What a change of the state waits for before the page is written."""
        self.beside = frozenset[Slot[Any, Any]](
            [self.answering.search, self.ranging, self.jet_comparison]
        )
        """What is told shortly after an answer, all of it together."""

    def ask(self) -> None:
        """Have what can be seen worked out; a question that was asked already costs nothing."""
        session = self._session
        state = self._session.state
        robot = state.layout.name, state.layout.names
        if self._robot != robot:
            # What is known of another robot must not stand under this one's name.
            self._robot = robot
            for of_robot in (self.answering, self.analyst, self.ranging, self.jet_comparison):
                of_robot.forget()
        task = session.desk.task
        self.answering.ask()
        pair = session.two_robots.pair
        if pair is not None:
            self.pairing.ask(pair)
        if task == "Allocate":
            self.ranging.ask(
                State(state.able, state.damage, target=state.target, speed=state.speed)
            )
        if task == "Export":
            self.offers.ask(HomeQuestion.of_state(state))
        drawn = session.display.drawn
        if task == "Design" and (session.drawer == "Reach" or drawn != "none"):
            before = session.before
            question = AnalysisQuestion(
                state.able,
                state.lost,
                None if before is None else before.able,
                drawn,
                state.flow,
                () if before is None else before.lost,
            )
            self.analyst.ask(question)
        if task == "Design":
            self.improver.ask_bound()
        kind = DRAWN[drawn]
        if task == "Design" and kind is not None:
            best = self.improver.best
            if best is None:
                self.growing.forget()
            else:
                self.growing.ask(SetQuestion(best, kind, state.flow))
        if task in ("Design", "Allocate") and state.layout.interaction is not None:
            self.jet_comparison.ask(state)

    @property
    def visible_swimmer(self) -> Swimmer | None:
        """The robot that swims; None where none does, or where a moment of a log is looked at, with
        the robot of the page."""
        if self.log.shown is not None and self._session.desk.task == LOG:
            return None
        return self.swimming.swimmer

    @property
    def busy(self) -> bool:
        """Whether anything about the present state is still to come."""
        return self.answering.searching or any(
            slot.busy
            for slot in (
                *self.beside,
                self.analyst,
                self.offers,
                *self.pairing.slots,
                self.pairing.cards,
            )
        )

    def stop(self) -> None:
        """The page has gone."""
        self.swimming.halt()
        self.refining.stop()
        for slot in (
            self.comparison,
            self.improver,
            self.capability,
            self.growing,
            self.fitting,
            self.log,
        ):
            slot.forget()
        self.pairing.forget()
        self.offers.forget()
        for of_robot in (self.answering, self.analyst, self.ranging, self.jet_comparison):
            of_robot.forget()
