"""What is found about an answer after it: the proof of its watts, and other ways to do the same."""

from dataclasses import dataclass

from webapp.session.looking import WAYS
from webapp.tasks.null_ways import null_modes
from webapp.tasks.solver import Modes, Reply, Solver


@dataclass(frozen=True)
class Search:
    """What is to be found."""

    solver: Solver
    reply: Reply
    kind: str
    """In which drawer the ways are seen; nothing where the answer is only proved."""
    shifts: tuple[float, ...] = ()
    """How far along the directions of the null space the forces are [N]."""


def find_ways(search: Search) -> Modes:
    """The ways that are looked at; the answer is proved in any case."""
    modes = search.solver.modes(search.reply, seen=search.kind == WAYS[0])
    return null_modes(search.reply.answer, search.shifts) if search.kind == WAYS[1] else modes
