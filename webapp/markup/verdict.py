"""Verdict on an answer in a word, in a sentence and axis by axis; the three agree.

The corner of the view (`panels/status.py`) shows the word, the panel of the wrench
(`panels/wrench_tab.py`) the sentences.
"""

from enum import Enum

from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.allocation.binding import NOT_APART
from finlab.allocation.power_budget import ALL
from finlab.allocation.report import bound_words, missing_words, share_words
from finlab.display import as_sentence, listed
from finlab.physics.objective import REACHED
from webapp.markup.words import authority_sentence, in_app, unlearned_sentence
from webapp.session.state import State
from webapp.session.targets import axis_reach
from webapp.theme import DELIVERED, MISSING, NEARLY, UNLEARNED, Rgb

WORKING = "Working …"
"""What stands in place of a verdict while the present question has no answer."""
BUS = "bus "
"""How what binds begins where it is the power budget of a bus."""
AT_REST = "(flow)"
"""How a note ends that the panel beside the speed tells in its own words."""


class Verdict(Enum):
    """One of four, each with a word and a colour."""

    EXACT = "Exact"
    APPROXIMATE = "Approximate"
    """They could, but this answer does not."""
    UNLEARNED = "Not learned"
    """The method does not know a fin, so its commands for it are wrong."""
    OUT_OF_REACH = "Out of reach"
    """No command of what works gives it."""


COLORS: dict[Verdict, Rgb] = {
    Verdict.EXACT: DELIVERED,
    Verdict.APPROXIMATE: NEARLY,
    Verdict.UNLEARNED: UNLEARNED,
    Verdict.OUT_OF_REACH: MISSING,
}


def verdict_of(allocation: Allocation, in_reach: bool) -> Verdict:
    """What an answer is worth; `in_reach` where any command of the working fins gives what is
    asked."""
    if allocation.unknown_fins:
        return Verdict.UNLEARNED  # whatever it gives, it gives by chance
    if allocation.reachable:
        return Verdict.EXACT
    return Verdict.APPROXIMATE if in_reach else Verdict.OUT_OF_REACH


def verdict_sentence(allocation: Allocation, in_reach: bool) -> str:
    """The verdict, and what else could be done, or which policy chose the answer; the answer's
    sentence says what is missing."""
    verdict = verdict_of(allocation, in_reach)
    if verdict is Verdict.UNLEARNED:
        return unlearned_sentence(allocation.layout, allocation.unknown_fins)
    if verdict is Verdict.EXACT:
        expected = allocation.expected_error
        within = f" by the model, expected within {expected:.2g}" if expected > REACHED else ""
        return f"{verdict.value}{within}"
    if verdict is Verdict.APPROXIMATE:
        return f"{verdict.value}: the robot can, {allocation.method} does not"
    budgets = [_budget_words(words) for words in allocation.binding if _is_budget(words)]
    limit = f": {listed(budgets)}" if budgets else ""
    return f"{verdict.value}{limit}, {allocation.policy.kind}"


def _is_budget(words: str) -> bool:
    """Whether what binds is a power budget."""
    return words == ALL or words.startswith(BUS)


def _budget_words(words: str) -> str:
    """What binds, in the words of the page."""
    return "power budget" if words == ALL else words


def answer_sentence(
    state: State, allocation: Allocation | None, busy: bool, searching: bool = False
) -> Markup:
    """What is left undone, why, and what the method ignores.

    Args:
        state: the present state.
        allocation: the answer that is on the robot, if any.
        busy: whether the answer is one to an earlier question.
        searching: whether what is proved of the answer is not known yet, and not said.
    """
    sentences: list[str] = []
    blind = authority_sentence(
        state.layout, state.lost, axis_reach(state.able, state.lost, state.flow)
    )
    if allocation is not None and not busy:
        if allocation.unknown_fins:
            sentences.append(_warning("; ".join(allocation.notes) + "."))
        sentences.append(as_sentence(missing_words(allocation)))
        if not allocation.reachable and not allocation.unknown_fins:
            sentences.append(_remarks_sentence(allocation, searching, blind is not None))
        elif allocation.reachable and not searching:
            sentences.append(as_sentence(bound_words(allocation)))
            sentences.append(as_sentence(allocation.measure_next))
    elif busy:
        sentences.append(WORKING)
    if blind is not None:
        sentences.insert(0, _warning(blind))
    return Markup(" ").join(filter(None, sentences))


def _remarks_sentence(allocation: Allocation, searching: bool, is_blind: bool) -> str:
    """How much is delivered, what binds, and what the method notes.

    Args:
        allocation: the answer that is on the robot.
        searching: whether what the method notes is not known yet.
        is_blind: whether it has been said already that the robot cannot act on some axes.
    """
    remarks = share_words(allocation)
    for words in allocation.binding:
        is_told = is_blind and words.endswith(NOT_APART)
        if not is_told:
            remarks.append(f"{_budget_words(words)} used up" if _is_budget(words) else words)
    if not searching:
        remarks += allocation.notes
    words = "; ".join([remark for remark in remarks if not remark.endswith(AT_REST)])
    return in_app(as_sentence(words))


def _warning(text: str) -> Markup:
    return Markup(Markup("<span class='missing'>{}</span>")).format(text)
