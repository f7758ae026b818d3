"""The answers of two robots to the same question, and their score cards."""

from dataclasses import dataclass

from finlab.analysis import ScoreCard, score_card
from finlab.layout import Layout
from webapp.session.state import Flow, State
from webapp.session.two_robots import Pair
from webapp.tasks.context import Context
from webapp.tasks.slot import Slot, Work
from webapp.tasks.solver import Reply

CARDS_REST_S = 0.35
"""How long two robots may not change before their cards are worked out [s]."""


@dataclass(frozen=True)
class CardQuestion:
    """A robot whose score card is asked for."""

    layout: Layout
    """With the limits that damage has left."""
    lost: tuple[str, ...]
    """Names of its lost actuators."""
    flow: Flow | None
    """Velocity (6,) relative to the water [m/s, rad/s]; None at rest."""

    @staticmethod
    def of_state(state: State) -> "CardQuestion":
        """The question of a state, whatever wrench that asks for."""
        return CardQuestion(state.able, state.lost, state.flow)


CardQuestions = tuple[CardQuestion, CardQuestion]
"""Of the left and the right robot."""
Cards = tuple[ScoreCard | None, ScoreCard | None]
"""Of the left and the right robot; None where that was given up, or the robot is lost."""


class Pairing:
    """What is asked of the two robots of one page."""

    def __init__(self, context: Context) -> None:
        """Nothing has been asked yet."""
        pools = context.pools
        bell = context.bell

        def answers() -> Slot[State, Reply]:
            alike = State.is_same_but_target
            return Slot(pools.answers, bell, context.solver.reply, live=True, alike=alike)

        self.left = answers()
        self.right = answers()
        self.cards: Slot[CardQuestions, Cards] = Slot(
            pools.brief, bell, cards_of, rest_s=CARDS_REST_S, watched=True
        )

    @property
    def slots(self) -> tuple[Slot[State, Reply], Slot[State, Reply]]:
        """Of the answers, left and right."""
        return self.left, self.right

    def ask(self, pair: Pair) -> None:
        """Have the robots of a pair that is looked at answered, and their cards made."""
        for slot, standing in zip(self.slots, pair.both, strict=True):
            slot.ask(standing.state)
        left = CardQuestion.of_state(pair.left.state)
        right = CardQuestion.of_state(pair.right.state)
        self.cards.ask((left, right))

    def reply(self, index: int, pair: Pair | None) -> Reply | None:
        """The newest answer of the robot that stands left (0) or right (1), perhaps to an earlier
        question; None of another robot than stands there."""
        slot = self.slots[index]
        if pair is None or slot.answer is None:
            return None
        layout = pair.both[index].state.layout
        is_of_robot = slot.answer.state.layout is layout or slot.answer.state.layout == layout
        return slot.answer if is_of_robot else None

    def compare_again(self) -> None:
        """Make the cards that were given up."""
        question = self.cards.question
        self.cards.forget()
        if question is not None:
            self.cards.ask(question, at_once=True)

    def forget(self) -> None:
        """Give up all, and forget it."""
        for slot in (*self.slots, self.cards):
            slot.forget()


def cards_of(questions: CardQuestions, work: Work[CardQuestions]) -> Cards:
    """The score cards of two robots, one after the other.

    Args:
        questions: the robots.
        work: is told how many are done; where it is cancelled, the second one is left out.
    """
    cards: list[ScoreCard | None] = []
    for question in questions:
        is_alive = len(question.lost) < question.layout.n
        is_wanted = is_alive and not work.cancelled.is_set()
        card = score_card(question.layout, question.lost, question.flow) if is_wanted else None
        cards.append(card)
        work.report(len(cards))
    left, right = cards
    return left, right
