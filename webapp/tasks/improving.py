"""A search for a better layout: it reports its best so far, and can be stopped at any time."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple, cast

import numpy as np

from finlab.analysis import Bounds, Improvement, Progress, layout_bound, optimize_layout
from finlab.analysis.authority import named_axes
from finlab.analysis.layout_bound import check_bounded
from finlab.arrays import Array
from finlab.axes import MotionAxis
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.swim.hull import hull_of
from webapp.scene.actuator_shapes import CHORD, ROOT, SPAN
from webapp.session.looking import GOALS_BY_WORDS, SearchRequest
from webapp.session.state import State
from webapp.tasks.context import Context
from webapp.tasks.slot import Slot, Work

BLADE_POINTS = np.linspace(ROOT, ROOT + SPAN, 4)
"""Distances along a fin's shaft of points of its blade, from its root to its tip [m]."""
PROPELLER_RADIUS = 0.05
"""Radius of what is kept free about any other actuator [m]."""
INSIDE_COST = 0.02
"""Violation for each point inside the hull [m]."""
MIN_GAP = 0.02
"""Least distance between what two actuators sweep [m]."""
POSITION_GRID = 0.001
"""Step of the positions that are proposed, which are round [m]."""
ANGLE_GRID = math.radians(1.0)
"""Step of the angles that are proposed [rad]."""
REPORT_PERIOD_S = 0.3
"""Least time between two reports of the best layout so far [s]."""


class Clearance:
    """The distances from the hull and from each other that a layout's actuators keep in a
    search."""

    def __init__(self, layout: Layout, min_gap: float) -> None:
        """Takes the rules from a layout at the start of a search.

        Blades stay outside of the hull, and so does what is outside of it at the start. What two
        actuators sweep stays `min_gap` apart; where it is closer at the start, or overlaps, it
        comes no closer.

        Args:
            layout: the layout, whose hull it is.
            min_gap: least distance between what two actuators sweep [m].
        """
        self._hull = hull_of(layout).coarse()
        is_fin = layout.is_fin
        self._distances = np.where(is_fin[:, None], BLADE_POINTS, 0.0)
        self._radius = np.where(is_fin, CHORD, PROPELLER_RADIUS)
        position = layout.position[None]
        frames = layout.frames[None]
        is_inside = self._hull.contains(self._points(position, frames))
        self._stays_outside = (is_fin[:, None] | ~is_inside)[0]
        self._required_gaps = np.minimum(self.gaps(position, frames)[0], min_gap)

    def violation(self, position: Array, frames: Array) -> Array:
        """Returns how far P variants break the rules (P,) [m].

        Args:
            position: of their actuators (P, n, 3) [m].
            frames: own axes of their actuators (P, n, 3, 3).
        """
        is_inside = self._hull.contains(self._points(position, frames))
        n_inside = (self._stays_outside & is_inside).sum(axis=(-1, -2))
        shortfall = np.maximum(self._required_gaps - self.gaps(position, frames) - 1e-9, 0.0)
        return np.asarray(INSIDE_COST * n_inside + shortfall.sum(axis=-1))

    def gaps(self, position: Array, frames: Array) -> Array:
        """Returns distances (P, pairs) [m] between what actuators sweep, negative where that
        overlaps; arguments as for `violation`."""
        points = self._points(position, frames)
        first, second = np.triu_indices(position.shape[1], k=1)
        # Distances of all points of one actuator from all of the other (P, pairs, 4, 4).
        distances = np.linalg.norm(points[:, first, :, None] - points[:, second, None], axis=-1)
        nearest = distances.min(axis=(-1, -2))
        return np.asarray(nearest - self._radius[first] - self._radius[second])

    def _points(self, position: Array, frames: Array) -> Array:
        """Points along the shafts (P, n, 4, 3) [m]."""
        shafts = frames[..., None, 0, :]
        return np.asarray(position[..., None, :] + self._distances[..., None] * shafts)


@dataclass(frozen=True, eq=False)
class Search:
    """The question of a search."""

    state: State
    """The state at its start; lost actuators do not move."""
    goal: str
    """Name of the goal, as `optimize_layout` has it."""
    bounds: Mapping[str, Bounds]
    """Name of each actuator that may move -> its bounds."""


class Improver(Slot[Search, Improvement]):
    """One search at a time for one page."""

    def __init__(self, context: Context) -> None:
        super().__init__(context.pools.long, context.bell, improve, watched=True)
        self.bounding: Slot[Found, Improvement] = Slot(
            context.pools.long, context.bell, with_bound, watched=True
        )
        """The answer with what no layout of the search exceeds, once that is known."""

    def ask_bound(self) -> None:
        """Have it found how far from the best the answer of a search is, where that can be
        said."""
        search = self.question
        answer = self.answer
        if search is not None and answer is not None and has_bound(search):
            self.bounding.ask(Found(search, answer))

    def forget(self) -> None:
        """Drop the search, what it found, and the bound of that."""
        super().forget()
        self.bounding.forget()

    @property
    def best(self) -> Layout | None:
        """What works of the best layout so far; of the offered one, once the search is done."""
        if self.answer is not None and self.question is not None:
            return self.answer.layout.without(self.question.state.lost)
        progress: Progress | None = self.progress
        return None if progress is None else progress.layout

    @property
    def proposal(self) -> State | None:
        """The state of the search with the layout that is offered; None where none is better."""
        search = self.question
        answer = self.answer
        if search is None or answer is None or not answer.improved:
            return None
        return replace(search.state, layout=answer.layout)

    def start(self, state: State, request: SearchRequest) -> None:
        """Starts a search that moves the working actuators of a state; mirror pairs stay so.

        Args:
            state: the state at its start.
            request: the goal, the actuators that may not move, and how far the others may.

        Raises:
            FinlabError: a search is running, no actuator works, or none may move.
        """
        if self.busy:
            raise FinlabError("a search is running already; cancel it first")
        bounds = request.bounds(state.layout.without(state.lost))
        self.forget()
        self.ask(Search(state, GOALS_BY_WORDS[request.goal], bounds))


class Found(NamedTuple):
    """A search that is done."""

    search: Search
    improvement: Improvement
    """Its answer."""


def has_bound(search: Search) -> bool:
    """Whether it is known how good the layouts of a search can be at most."""
    state = search.state
    flow = None if state.flow is None else np.array(state.flow)
    try:
        check_bounded(state.layout.without(state.lost), search.goal, flow)
    except FinlabError:
        return False
    return True


def with_bound(found: Found, work: Work[Found]) -> Improvement:
    """Returns what a search has found, with what no layout within its bounds exceeds.

    Args:
        found: the search.
        work: ends it where it is cancelled.
    """
    search = found.search
    improvement = found.improvement
    limit = layout_bound(
        search.state.layout.without(search.state.lost),
        tuple(search.bounds),
        search.bounds,
        axes=named_axes(cast("tuple[MotionAxis, ...]", improvement.axes)),
        after_loss=search.goal == "worst_single_failure",
        cancelled=work.cancelled.is_set,
    )
    return replace(improvement, bound=limit)


def improve(search: Search, work: Work[Search]) -> Improvement:
    """Returns the best layout of a search, with its lost actuators.

    Args:
        search: the question.
        work: takes reports, and ends the search where it is cancelled.
    """
    state = search.state
    working = state.layout.without(state.lost)
    next_report_s = time.monotonic()

    def report(progress: Progress) -> None:
        nonlocal next_report_s
        if time.monotonic() >= next_report_s:
            work.report(progress)
            next_report_s = time.monotonic() + REPORT_PERIOD_S

    improvement = optimize_layout(
        working,
        tuple(search.bounds),
        search.bounds,
        search.goal,
        rule=Clearance(working, MIN_GAP).violation,
        grid=(POSITION_GRID, ANGLE_GRID),
        flow=state.flow,
        progress=report,
        cancelled=work.cancelled.is_set,
    )
    layout = state.layout
    for actuator in improvement.layout.actuators:
        layout = layout.with_actuator(actuator)
    return replace(improvement, layout=layout)
