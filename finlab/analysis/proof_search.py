"""The search of a proof among convex parts of forces, by floats.

Where the forces of actuators are not convex (several arcs, arcs wider than half a turn, no stop),
one convex part of each actuator at a time is taken. `PartSearch.common_parts` finds parts that give
all corners of a box together; `PartSearch.trees` splits what is possible into pieces until each is
parted from a wrench by a plane. Both begin with the cover of all parts of every actuator, and
replace that of one actuator after the other by its parts (branch and bound).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.analysis.force_pieces import Piece, PieceTable
from finlab.arrays import Array
from finlab.forces.force_sets import SCALE
from finlab.forces.reach import FINE

MAX_CHOICES = 200
"""Most choices of parts that are looked at for one box."""
MAX_NODES = 1500
"""Most choices of pieces that are looked at for one set of wrenches."""
MAX_ROWS = 200_000
"""Most wrenches of which splits of sets of forces may ask, for one statement."""
COVER = 0
"""The choice of an actuator of which all parts count; part k has the number k + 1."""

Choice = tuple[int, ...]
"""Part of each actuator, or `COVER`."""


class Solved(NamedTuple):
    """How far R wrenches are within what chosen parts give."""

    share: Array
    """Lengths (R,) of rays from an inner wrench to the end of what is attainable, over the distance
    of the wrench [1]: at least 1 within reach."""
    normal: Array
    """Normals (R, 6) of the planes at their ends, of scaled wrenches."""
    force: Array
    """Forces (R, n, 2) [N]: of a wrench within reach those that give it, as far inside as the ray
    allows."""


class Tried(NamedTuple):
    """A choice of parts for C wrenches."""

    choice: Choice
    is_reached: NDArray[np.bool_]
    """Whether they give each wrench (C,)."""
    force: Array
    """Forces (C, n, 2) [N] of those that they give."""


@dataclass(eq=False)
class Tree:
    """A node of a refutation: a choice of pieces, with a plane, or split by one actuator's."""

    question: int
    choice: Choice
    normal: Array | None = None
    """Normal (6,) of a plane that parts the wrench, scaled; None of a node that is split."""
    actuator: int = -1
    """The actuator by whose pieces it is split."""
    branches: list[Tree] = field(default_factory=list)
    """A node for each of these."""


class PartSearch:
    """Convex parts of the forces of n actuators, some of which are lost."""

    def __init__(
        self,
        effectiveness: Array,
        pieces_of: Sequence[Sequence[Piece]],
        inner_points: Sequence[Sequence[Array]],
    ) -> None:
        """Takes the parts.

        Args:
            effectiveness: wrench (n, 2, 6) of 1 N along both axes of each actuator [1, m].
            pieces_of: of each actuator its cover and, where this is not the set itself, its convex
                parts.
            inner_points: of each of these a force (2,) [N] well inside.
        """
        self._effectiveness = effectiveness / SCALE
        self._pieces = pieces_of
        self._table = PieceTable(pieces_of)
        most = max(map(len, pieces_of))
        self._inner = np.zeros((len(pieces_of), most, 2))
        for i, points in enumerate(inner_points):
            for k, point in enumerate(points):
                self._inner[i, k] = point
        self._rows_left = MAX_ROWS

    @property
    def covers(self) -> Choice:
        """The choice of all parts."""
        return (COVER,) * len(self._pieces)

    def solve(
        self,
        lost: Sequence[int],
        choices: Sequence[Choice],
        wrench: Array,
        *,
        from_rest: bool = False,
    ) -> Solved:
        """Returns how far wrenches are within chosen parts.

        Args:
            lost: indices of actuators that give no force.
            choices: parts of each row (R, n).
            wrench: one of each row (R, 6) [N, N m].
            from_rest: whether rays begin at no wrench, so that their lengths are shares of the
                wrenches.
        """
        choice = np.array(choices)
        rows, n = choice.shape
        effectiveness = np.repeat(self._effectiveness[None], rows, axis=0)
        sets = self._table.sets(choice, effectiveness)
        gone = list(lost)
        sets.lose(slice(None), gone)
        inner = self._inner[np.arange(n), choice]
        inner[:, slice(None) if from_rest else gone] = 0.0
        origin = sets.wrench(inner)
        ray = wrench / SCALE - origin
        share, normal, end = sets.reach(origin, ray, FINE)
        share = np.where((ray == 0.0).all(axis=-1), np.inf, share)
        # From the end of the ray back to the wrench: a mean with the inner forces.
        weight = 1.0 / np.maximum(share, 1.0)
        return Solved(share, normal, inner + weight[:, None, None] * (end - inner))

    def common_parts(self, lost: Sequence[int], wrench: Array, first: Choice) -> Iterator[Tried]:
        """Yields choices of parts for C wrenches together: those that give all of them, and those
        that do not and are split no further.

        Args:
            lost: indices of actuators that give no force.
            wrench: wrenches (C, 6) [N, N m].
            first: a choice to begin with.
        """
        stack = [self.covers]
        if first != self.covers:
            stack.append(first)
        hardest = -1
        for _ in range(MAX_CHOICES):
            if not stack or self._rows_left < 0:
                return
            choice = stack.pop()
            # The wrench that the last choice missed most often spares asking of all others.
            if hardest >= 0:
                asked = wrench[hardest : hardest + 1]
                self._rows_left -= 1
                if self.solve(lost, [choice], asked).share[0] < 1.0:
                    continue
            found = self.solve(lost, [choice] * len(wrench), wrench)
            outside = self._outside(lost, choice, found.force)
            if found.share.min() < 1.0:
                hardest = int(found.share.argmin())
            if found.share.min() < 1.0 or not outside:
                yield Tried(choice, found.share >= 1.0, found.force)
                continue
            self._rows_left -= len(wrench)
            # The actuator whose best part leaves out most forces; its best part is tried first.
            i = max(outside, key=lambda i: min(outside[i]))
            parts = sorted(range(len(outside[i])), key=lambda k: -outside[i][k])
            for k in parts:
                stack.append((*choice[:i], k + 1, *choice[i + 1 :]))

    def _outside(self, lost: Sequence[int], choice: Choice, force: Array) -> dict[int, list[float]]:
        """Of each actuator that may choose, how many of its forces (C, n, 2) are outside of each of
        its parts."""
        outside: dict[int, list[float]] = {}
        for i, pieces in enumerate(self._pieces):
            if choice[i] != COVER or len(pieces) == 1 or i in lost:
                continue
            counts = [float((~piece.contains(force[:, i])).sum()) for piece in pieces[1:]]
            outside[i] = counts
        return outside

    def trees(self, lost: Sequence[int], wrench: Array) -> list[Tree | None]:
        """Returns for each of Q wrenches (Q, 6) a tree whose planes part it from all forces; None:
        it is within reach, or there is no such tree among those looked at.

        Args:
            lost: indices of actuators that give no force.
            wrench: wrenches (Q, 6) [N, N m].
        """
        roots = [Tree(question, self.covers) for question in range(len(wrench))]
        is_parted = [True] * len(wrench)
        open_nodes = [*roots]
        n_nodes = 0
        while open_nodes:
            n_nodes += len(open_nodes)
            is_split = open_nodes[0].choice != self.covers
            self._rows_left -= len(open_nodes) * is_split
            choices = [node.choice for node in open_nodes]
            asked = wrench[[node.question for node in open_nodes]]
            found = self.solve(lost, choices, asked)
            children = []
            for row, node in enumerate(open_nodes):
                if not is_parted[node.question]:
                    continue
                if found.share[row] < 1.0:
                    node.normal = found.normal[row]
                    continue
                node.actuator = self._unheld(lost, node.choice, found.force[row])
                if node.actuator < 0:
                    is_parted[node.question] = False
                    continue
                before, after = node.choice[: node.actuator], node.choice[node.actuator + 1 :]
                for k in range(1, len(self._pieces[node.actuator])):
                    node.branches.append(Tree(node.question, (*before, k, *after)))
                children += node.branches
            open_nodes = [node for node in children if is_parted[node.question]]
            if n_nodes + len(open_nodes) > MAX_NODES or self._rows_left < 0:
                for node in open_nodes:
                    is_parted[node.question] = False
                open_nodes = []
        return [root if parted else None for root, parted in zip(roots, is_parted, strict=True)]

    def _unheld(self, lost: Sequence[int], choice: Choice, force: Array) -> int:
        """The largest force (n, 2) of an actuator that none of its parts has, -1 where there is
        none."""
        best = -1
        largest = 0.0
        for i, counts in self._outside(lost, choice, force[None]).items():
            size = float(np.linalg.norm(force[i]))
            if min(counts) > 0 and size > largest:
                best, largest = i, size
        return best
