"""What an answer is worth, in one word and one sentence: four things that are told apart."""

from enum import Enum

import numpy as np

from finlab.allocation.allocation import Allocation
from webapp.markup.words import fins_words, saturated, unlearned_sentence
from webapp.session.state import AXIS_UNITS, AXIS_WORDS
from webapp.theme import DELIVERED, MISSING, NEARLY, UNLEARNED, Rgb


class Verdict(Enum):
    """One of four, each with a word and a colour."""

    EXACT = "Exact"
    """The fins give what is asked."""
    APPROXIMATE = "Approximate"
    """They could, but this answer does not."""
    UNLEARNED = "Not learned"
    """The method does not know a fin, so its commands for it are wrong."""
    OUT_OF_REACH = "Out of reach"
    """No command of these fins gives it."""

    @property
    def color(self) -> Rgb:
        """Of everything that shows it."""
        return _COLORS[self]


_COLORS = {
    Verdict.EXACT: DELIVERED,
    Verdict.APPROXIMATE: NEARLY,
    Verdict.UNLEARNED: UNLEARNED,
    Verdict.OUT_OF_REACH: MISSING,
}


def verdict_of(allocation: Allocation, in_reach: bool) -> Verdict:
    """What an answer is worth.

    Args:
        allocation: the answer.
        in_reach: whether any command of the working fins gives what is asked.
    """
    if allocation.unknown_fins:
        return Verdict.UNLEARNED  # whatever it gives, it gives by chance
    if allocation.reachable:
        return Verdict.EXACT
    return Verdict.APPROXIMATE if in_reach else Verdict.OUT_OF_REACH


def verdict_sentence(allocation: Allocation, in_reach: bool) -> str:
    """The verdict with its reason: what is missing most, and the fins that are at their limits."""
    verdict = verdict_of(allocation, in_reach)
    if verdict is Verdict.UNLEARNED:
        return unlearned_sentence(allocation.layout, allocation.unknown_fins)
    if verdict is Verdict.EXACT:
        return str(verdict.value)
    axis = int(np.argmax(np.abs(allocation.unallocated / allocation.sigma)))
    target, given = allocation.target[axis], allocation.wrench[axis]
    kind = "force" if axis < 3 else "torque"
    if abs(target) > 1e-3 and -0.005 < given / target < 1.0:
        sentence = f"{verdict.value}: {abs(100 * given / target):.0f} % of the {AXIS_WORDS[axis]} {kind}"
    else:
        much = f"{abs(given - target):.2g} {AXIS_UNITS[axis]} of {AXIS_WORDS[axis]}"
        sentence = f"{verdict.value}: {much} too much"
    if verdict is Verdict.APPROXIMATE:
        return f"{sentence}; the fins can, {allocation.method} does not"
    full = np.flatnonzero(saturated(allocation).any(axis=1))
    return f"{sentence}; {fins_words(full.tolist())} at the limit" if len(full) else sentence
