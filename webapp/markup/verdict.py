"""Verdict on an answer in a word, in a sentence and axis by axis; the three agree."""

from enum import Enum

import numpy as np
from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.physics.objective import REACHED
from webapp.markup.words import authority_sentence, in_app, listed, three_digits, unlearned_sentence
from webapp.session.state import AXIS_UNITS, AXIS_WORDS, State
from webapp.session.targets import axis_reach
from webapp.theme import DELIVERED, MISSING, NEARLY, UNLEARNED, Rgb

WORKING = "Working …"
"""What stands in place of a verdict while the present question has no answer."""
SPOKEN = 0.05
"""Share of the largest miss, each axis over its scale, from which another axis is spoken of,
too."""
FAR = 9.0
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


def rest_sentence(allocation: Allocation) -> str:
    """One sentence on what is left undone, and on what comes along unasked, axis by axis."""
    if allocation.reachable:
        return "Nothing is left undone."
    rest = allocation.unallocated
    size = np.abs(allocation.unallocated / allocation.scale)
    spoken = [k for k in np.argsort(-size) if size[k] >= SPOKEN * size.max()]
    less = [_amount(rest[k], k) for k in spoken if rest[k] * allocation.target[k] > 0.0]
    more = [_amount(rest[k], k) for k in spoken if rest[k] * allocation.target[k] <= 0.0]
    parts = [f"{listed(less)} {'is' if len(less) == 1 else 'are'} left undone"] if less else []
    parts += (
        [f"{listed(more)} {'comes' if len(more) == 1 else 'come'} along unasked"] if more else []
    )
    return f"{'; '.join(parts)}."


def _gap(allocation: Allocation, bound: float) -> float:
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
    if gap > FAR:
        return "How far its watts are from the least is not known."
    share = f"{100 * gap:.2g}" if gap < 0.1 else f"{100 * gap:.0f}"
    return f"Its watts are at most {share} % above the least."


def answer_sentence(
    state: State, allocation: Allocation | None, busy: bool, searching: bool = False
) -> Markup:
    """What is left undone, why, and what the method ignores; while `busy` of an earlier question,
    and while `searching` without what is proved of it."""
    sentences: list[str] = []
    if allocation is not None and not busy:
        if allocation.unknown_fins:
            sentences.append(_warning("; ".join(allocation.notes) + "."))
        sentences.append(rest_sentence(allocation))
        if not allocation.reachable and not allocation.unknown_fins:
            share = round(100 * allocation.share)
            remarks = [f"{share} % of what is asked is delivered"] if 0 <= share < 100 else []
            remarks += [*allocation.binding, *(() if searching else allocation.notes)]
            sentence = "; ".join(note for note in remarks if not note.endswith(AT_REST))
            sentences.append(in_app(f"{sentence[0].upper()}{sentence[1:]}.") if sentence else "")
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


def _amount(value: float, axis: int) -> str:
    return f"{three_digits(abs(value))} {AXIS_UNITS[axis]} of {AXIS_WORDS[axis]}"


def _warning(text: str) -> Markup:
    return Markup(Markup("<span class='missing'>{}</span>")).format(text)
