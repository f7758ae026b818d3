"""A search for a better layout that can be watched, stopped, and taken or left."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from finlab.analysis import Bounds, Improvement, Progress, optimize_layout
from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.swim.hull import hull_of
from webapp.scene.actuator_shapes import CHORD, ROOT, SPAN
from webapp.session.looking import GOALS_BY_WORDS, SearchRequest
from webapp.session.state import State
from webapp.tasks.context import Context
from webapp.tasks.slot import Slot, Work

ALONG = np.linspace(ROOT, ROOT + SPAN, 4)
"""Places along a fin's shaft, from where its blade begins to where it ends [m]."""
PROPELLER = 0.05
"""Radius of what is kept free about any other actuator [m]."""
INSIDE = 0.02
"""How far a place inside the hull counts as wrong [m]."""
APART_M = 0.02
"""Least distance between what two actuators sweep."""
GRID = 0.001, math.radians(1.0)
"""What is proposed is round: steps of places [m] and angles [rad]."""
REST_S = 0.3
"""How long the view rests between two looks at the best layout so far [s]."""


class Room:
    """What a layout's actuators have to keep when they are moved."""

    def __init__(self, layout: Layout, apart: float) -> None:
        """Blades, and what stands outside of the layout's hull now, stay outside; what two
        actuators sweep is `apart` [m]; what is closer already, or overlaps, need not part, but
        comes no closer."""
        self._hull = hull_of(layout).coarse()
        fins = layout.is_fin
        self._along = np.where(fins[:, None], ALONG, 0.0)
        self._radius = np.where(fins, CHORD, PROPELLER)
        here = layout.position[None], layout.frames[None]
        self._outside = (fins[:, None] | ~self._hull.contains(self._places(*here)))[0]
        self._needed = np.minimum(self.gaps(*here)[0], apart)

    def broken(self, position: Array, frames: Array) -> Array:
        """How far positions (P, n, 3) [m] and own axes (P, n, 3, 3) break the rules (P,) [m]."""
        inside = (self._outside & self._hull.contains(self._places(position, frames))).sum(
            axis=(-1, -2)
        )
        close = np.maximum(self._needed - self.gaps(position, frames) - 1e-9, 0.0).sum(axis=-1)
        return np.asarray(INSIDE * inside + close)

    def gaps(self, position: Array, frames: Array) -> Array:
        """Distances (P, pairs) [m] between what actuators sweep; negative where that overlaps."""
        places = self._places(position, frames)
        first, second = np.triu_indices(position.shape[1], k=1)
        between = np.linalg.norm(places[:, first, :, None] - places[:, second, None], axis=-1)
        return np.asarray(between.min(axis=(-1, -2)) - self._radius[first] - self._radius[second])

    def _places(self, position: Array, frames: Array) -> Array:
        """Places along the shafts (P, n, 4, 3) [m]."""
        return np.asarray(position[..., None, :] + self._along[..., None] * frames[..., None, 0, :])


@dataclass(frozen=True, eq=False)
class Search:
    """One search."""

    state: State
    """Where it begins; what is lost stays where it is."""
    goal: str
    """What to raise, as `optimize_layout` calls it."""
    bounds: Mapping[str, Bounds]


class Improver(Slot[Search, Improvement]):
    """One search at a time for one page."""

    def __init__(self, context: Context) -> None:
        super().__init__(context.pools.long, context.bell, improve, watched=True)

    @property
    def best(self) -> Layout | None:
        """What works of the best layout so far; of the offered one, once the search is done."""
        if self.answer is not None and self.question is not None:
            return self.answer.layout.without(self.question.state.lost)
        progress: Progress | None = self.progress
        return None if progress is None else progress.layout

    def start(self, state: State, request: SearchRequest) -> None:
        """Search from a layout for places of what works; mirror pairs stay mirror pairs.
        FinlabError: a search is running, nothing works, or nothing may move."""
        if self.busy:
            raise FinlabError("a search is running already; cancel it first")
        bounds = request.bounds(state.layout.without(state.lost))
        self.forget()
        self.ask(Search(state, GOALS_BY_WORDS[request.goal], bounds))


def improve(search: Search, work: Work[Search]) -> Improvement:
    """The best layout that is found until the work is cancelled, or all rounds are done."""
    layout = search.state.layout
    state = search.state
    left = layout.without(state.lost)
    rests = time.monotonic()

    def report(progress: Progress) -> None:
        nonlocal rests
        if time.monotonic() >= rests:
            work.report(progress)
            rests = time.monotonic() + REST_S

    improvement = optimize_layout(
        left,
        tuple(search.bounds),
        search.bounds,
        search.goal,
        rule=Room(left, APART_M).broken,
        grid=GRID,
        flow=state.flow,
        progress=report,
        cancelled=work.cancelled.is_set,
    )
    for actuator in improvement.layout.actuators:
        layout = layout.with_part(actuator)
    return replace(improvement, layout=layout)
