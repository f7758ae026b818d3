"""Context that the tasks of one page share."""

from dataclasses import dataclass

from webapp.session import Session
from webapp.tasks.slot import Bell, Pools
from webapp.tasks.solver import Solver


@dataclass(frozen=True)
class Context:
    """One page's session, and the solver and threads that it shares with others."""

    session: Session
    solver: Solver
    pools: Pools
    bell: Bell
    """Wakes the page when there is something new to show."""
