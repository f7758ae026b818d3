"""The ways in which a wrench can be delivered, as the page lists them: with names, and what led to each; what
counts as one is for `finlab.allocation.modes` to say."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from finlab.allocation.allocation import Allocation
from finlab.allocation.modes import Mode, find_modes, force_sizes, mode_signature, same_signature
from finlab.allocation.solution import Candidates
from webapp.markup.words import fins_words
from webapp.theme import MODE_COLORS

MAX_SHOWN = len(MODE_COLORS)
"""Modes that are shown, each in its own colour; a robot with many fins has dozens, the last ones dear."""


class NamedMode(NamedTuple):
    """One way to deliver the wrench, as people call it."""

    mode: Mode
    name: str
    """What makes it different from the others that are shown."""
    badge: str
    """Whose it is: `network`, `optimum` where it is proved to be least, or another method's name."""


@dataclass(frozen=True, eq=False)
class Modes:
    """The modes of an answer, as the page lists them."""

    shown: tuple[NamedMode, ...]
    """The first `MAX_SHOWN` of them, the answer first, no two of the same name."""
    count: int
    ways: tuple[Candidates, ...] = ()
    """What a network proposed, then the same K after each step of their refinement where that is told."""
    ends: tuple[int, ...] = ()
    """For each proposal the shown mode at which it ends, -1 where that is none of them."""

    @property
    def steps(self) -> int:
        """Steps of the refinement."""
        return max(len(self.ways) - 1, 0)

    def proposal_of(self, mode: int) -> int | None:
        """The first proposal that ends at a mode: the likeliest, as those come first."""
        return self.ends.index(mode) if self.steps and mode in self.ends else None


NO_MODES = Modes((), 0)


def modes_of(answer: Allocation, candidates: Candidates, badge: str, ways: tuple[Candidates, ...]) -> Modes:
    """The modes of an answer, of itself as a candidate and others; `badge` says whose it is, `ways` are what
    a network proposed for it, and its refinement."""
    layout = answer.layout
    modes = find_modes(candidates, force_sizes(layout, candidates.command), layout.lower, layout.upper)
    shown, last = named_modes(modes, badge), ways[-1]
    signatures = map(mode_signature, last.command, force_sizes(layout, last.command))
    ends = tuple(
        next((k for k, named in enumerate(shown) if same_signature(named.mode.signature, end)), -1)
        for end in signatures
    )
    return Modes(shown, len(modes), ways, ends)


def named_modes(modes: Sequence[Mode], badge: str) -> tuple[NamedMode, ...]:
    """The first modes with their names, no two alike; all but the first one are the network's."""
    shown = modes[:MAX_SHOWN]
    badges = [badge, *["network"] * (len(shown) - 1)]
    return tuple(NamedMode(*each) for each in zip(shown, _names(shown), badges, strict=False))


def _names(modes: Sequence[Mode]) -> list[str]:
    """Who rests; modes of the same name are numbered."""
    names = [_resting_words(mode) for mode in modes]
    places = [names[:k].count(name) + 1 for k, name in enumerate(names)]
    return [f"{name} ({place})" if place > 1 else name for name, place in zip(names, places, strict=True)]


def _resting_words(mode: Mode) -> str:
    still = [k for k in mode.resting if k in mode.still]
    hardly = [k for k in mode.resting if k not in still]
    both = ((still, "rest", "rests"), (hardly, "hardly push", "hardly pushes"))
    parts = [f"{fins_words(fins)} {many if len(fins) > 1 else one}" for fins, many, one in both if fins]
    return ", ".join(parts) or "all fins push"
