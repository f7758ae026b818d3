"""Verdict on an answer in a word, in a sentence and axis by axis; the three agree.

The corner of the view (`panels/status.py`) shows the word, the panel of the wrench
(`panels/wrench_tab.py`) the sentences.
"""

from enum import Enum

import numpy as np
from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.axes import MOTIONS, UNITS
from finlab.physics.objective import REACHED
from webapp.markup.words import authority_sentence, in_app, listed, three_digits, unlearned_sentence
from webapp.session.state import State
from webapp.session.targets import axis_reach
from webapp.theme import DELIVERED, MISSING, NEARLY, UNLEARNED, Rgb

WORKING = "Working …"
"""What stands in place of a verdict while the present question has no answer."""
SPOKEN = 0.05
"""Share of the largest miss, each axis over its scale, from which another axis is spoken of,
too."""
UNKNOWN_GAP = 9.0
"""Share above the bound that says nothing of an answer, such as noise that pushes for nothing in a
table."""
PROVED = 1e-4
"""Share of its watts that an answer may lie above the bound and count as proved least."""
LEAST_WATTS = 1e-3
"""Bound [W] that shares are taken of where it is smaller, or nothing."""
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
    return f"{verdict.value}, {allocation.policy.kind}"


def missing_sentence(allocation: Allocation) -> str:
    """One sentence on what is left undone, and on what comes along unasked, axis by axis."""
    if allocation.reachable:
        return "Nothing is left undone."
    unallocated = allocation.unallocated
    size = np.abs(unallocated / allocation.scale)
    undone: list[str] = []
    unasked: list[str] = []
    for k in np.argsort(-size):
        if size[k] < SPOKEN * size.max():
            continue
        is_undone = unallocated[k] * allocation.target[k] > 0.0
        (undone if is_undone else unasked).append(_amount(unallocated[k], k))
    phrases = []
    if undone:
        phrases.append(f"{listed(undone)} {'is' if len(undone) == 1 else 'are'} left undone")
    if unasked:
        verb = "comes" if len(unasked) == 1 else "come"
        phrases.append(f"{listed(unasked)} {verb} along unasked")
    return f"{'; '.join(phrases)}."


def _gap(allocation: Allocation, bound: float) -> float:
    """How far its watts lie above a bound [W], as a share of that."""
    return (allocation.power - bound) / max(bound, LEAST_WATTS)


def is_proved(allocation: Allocation) -> bool:
    """Whether the watts of an answer are proved to be least."""
    return allocation.bound is not None and _gap(allocation, allocation.bound) <= PROVED


def bound_sentence(allocation: Allocation) -> str:
    """How far an answer may be from the least watts, by the bound that its method proves; else
    nothing."""
    if allocation.bound is None:
        return ""
    gap = _gap(allocation, allocation.bound)
    if gap <= PROVED:
        return "Its watts are proved least."
    if gap > UNKNOWN_GAP:
        return "How far its watts are from the least is not known."
    percent = f"{100 * gap:.2g}" if gap < 0.1 else f"{100 * gap:.0f}"
    return f"Its watts are at most {percent} % above the least."


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
    if allocation is not None and not busy:
        if allocation.unknown_fins:
            sentences.append(_warning("; ".join(allocation.notes) + "."))
        sentences.append(missing_sentence(allocation))
        if not allocation.reachable and not allocation.unknown_fins:
            sentences.append(_remarks_sentence(allocation, searching))
        elif allocation.reachable and not searching:
            sentences.append(bound_sentence(allocation))
            if doubt := allocation.measure_next:
                sentences.append(f"{doubt[0].upper()}{doubt[1:]}.")
    elif busy:
        sentences.append(WORKING)
    blind = authority_sentence(
        state.layout, state.lost, axis_reach(state.able, state.lost, state.flow)
    )
    if blind is not None:
        sentences.insert(0, _warning(blind))
    return Markup(" ").join(filter(None, sentences))


def _remarks_sentence(allocation: Allocation, searching: bool) -> str:
    """How much is delivered, what binds, and what the method notes unless it is `searching`."""
    percent = round(100 * allocation.share)
    remarks = []
    if 0 <= percent < 100:
        remarks.append(f"{percent} % of what is asked is delivered")
    remarks += allocation.binding
    if not searching:
        remarks += allocation.notes
    sentence = "; ".join([remark for remark in remarks if not remark.endswith(AT_REST)])
    return in_app(f"{sentence[0].upper()}{sentence[1:]}.") if sentence else ""


def _amount(value: float, axis: int) -> str:
    return f"{three_digits(abs(value))} {UNITS[axis]} of {MOTIONS[axis]}"


def _warning(text: str) -> Markup:
    return Markup(Markup("<span class='missing'>{}</span>")).format(text)
