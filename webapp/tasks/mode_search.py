"""Searches that follow an answer: the proof of its power, and its modes."""

from dataclasses import dataclass

from webapp.session.looking import CANDIDATES, NULL_SPACE
from webapp.tasks.null_space_modes import null_space_modes
from webapp.tasks.solver import Modes, Reply, Solver


@dataclass(frozen=True)
class ModeSearch:
    """A question about an answer."""

    solver: Solver
    """Proves it, and asks the network for candidates."""
    reply: Reply
    """The answer."""
    drawer: str
    """Tab of the drawer in which modes are seen; empty where the answer is only proved."""
    shifts: tuple[float, ...] = ()
    """How far along the directions of the null space the forces are [N]."""

    def is_same_but_target(self, other: "ModeSearch") -> bool:
        """Whether both only prove an answer, of the same robot asked in the same way."""
        is_proof = not self.drawer and not other.drawer
        return is_proof and self.reply.state.is_same_but_target(other.reply.state)


def search_modes(search: ModeSearch) -> Modes:
    """The modes that can be seen; the answer is proved in any case."""
    modes = search.solver.modes(search.reply, seen=search.drawer == CANDIDATES)
    if search.drawer == NULL_SPACE:
        return null_space_modes(search.reply.answer, search.shifts)
    return modes
