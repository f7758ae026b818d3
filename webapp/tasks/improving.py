"""A search for a better layout that can be watched, stopped, and taken or left."""

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from finlab.analysis import Bounds, Improvement, Progress, optimize_layout
from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout import Layout
from webapp.scene.meshes.fin import CHORD, ROOT, SPAN
from webapp.scene.meshes.hull import AnyHull, hull_of
from webapp.scene.meshes.mesh_hull import MeshHull
from webapp.session.search_request import GOAL_WORDS, SearchRequest
from webapp.tasks.background import Newest
from webapp.tasks.context import Context

ALONG = np.linspace(ROOT, ROOT + SPAN, 4)
"""Places along a shaft, from where its blade begins to where it ends [m]."""
INSIDE = 0.02
"""How far a place inside the hull counts as wrong [m]."""
APART_M = 0.02
"""Least distance between what two fins sweep."""
GRID = 0.001, math.radians(1.0)
"""What is proposed is round: steps of places [m] and shafts [rad]."""


class Room:
    """What a layout's fins have to keep when they are moved."""

    def __init__(self, layout: Layout, apart: float) -> None:
        """Blades stand outside of the layout's hull, and what two fins sweep is `apart` [m].

        A fin sweeps a cylinder about its shaft. Cylinders that are closer already, or overlap, need not part,
        but come no closer.
        """
        hull = hull_of(layout)
        self._hull: AnyHull = hull.coarse() if isinstance(hull, MeshHull) else hull
        now = swept_gaps(layout.position[None], layout.mounting_angle[None])[0]
        self._needed = np.minimum(now, apart)

    def broken(self, position: Array, angle: Array) -> Array:
        """How far fins at positions (P, n, 3) [m] under angles (P, n) [rad] break the rules (P,) [m]."""
        inside = self._hull.contains(_places(position, angle)).sum(axis=(-1, -2))
        close = np.maximum(self._needed - swept_gaps(position, angle) - 1e-9, 0.0).sum(axis=-1)
        return np.asarray(INSIDE * inside + close)


def swept_gaps(position: Array, angle: Array) -> Array:
    """Distances (P, pairs) [m] between the cylinders that fins sweep; negative where they overlap."""
    places = _places(position, angle)
    first, second = np.triu_indices(position.shape[1], k=1)
    between = places[:, first, :, None] - places[:, second, None]
    return np.asarray(np.linalg.norm(between, axis=-1).min(axis=(-1, -2)) - 2.0 * CHORD)


def _places(position: Array, angle: Array) -> Array:
    """Places along the shafts (P, n, 4, 3) [m]."""
    shaft = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    return np.asarray(position[..., None, :] + ALONG[:, None] * shaft[..., None, :])


@dataclass(frozen=True, eq=False)
class Search:
    """One search."""

    layout: Layout
    """Where it begins; mirror pairs in it stay mirror pairs."""
    goal: str
    """What to raise, as `optimize_layout` calls it."""
    bounds: Mapping[str, Bounds]
    room: Room
    stop: threading.Event = field(default_factory=threading.Event)


class Improver(Newest[Search, Improvement]):
    """One search at a time for one page."""

    def __init__(self, context: Context) -> None:
        """The page is rendered when there is progress."""
        super().__init__(context.loop, context.workers.searches, self._improve, context.changed)
        self.progress: Progress | None = None

    def start(self, layout: Layout, request: SearchRequest) -> None:
        """Search from a layout.

        Raises:
            FinlabError: a search is running, or no fin may move.
        """
        if self.busy:
            raise FinlabError("a search is running already; cancel it first")
        room, goal = Room(layout, APART_M), GOAL_WORDS[request.goal]
        search = Search(layout, goal, request.bounds(layout), room)
        self.forget()
        self.ask(search)

    def cancel(self) -> None:
        """Stop after the present round; what has been found by then is offered."""
        if self.question is not None:
            self.question.stop.set()

    def forget(self) -> None:
        """The result has been taken or left, or the page has gone."""
        self.cancel()
        super().forget()
        self.progress = None

    def _improve(self, search: Search) -> Improvement:
        """On the worker's thread."""
        return optimize_layout(
            search.layout,
            tuple(search.bounds),
            search.bounds,
            search.goal,
            rule=search.room.broken,
            grid=GRID,
            progress=lambda progress: self._loop.post(partial(self._note, search, progress)),
            cancelled=search.stop.is_set,
        )

    def _note(self, search: Search, progress: Progress) -> None:
        if search is self.question:  # else it was forgotten
            self.progress = progress
            self._changed()
