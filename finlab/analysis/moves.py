"""Which fins may move, how far, and which fin is the mirror image of which."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.forces.fin_sets import SCALE, FinSets, fin_sets
from finlab.layout import Fin, Layout
from finlab.layout.arrays import force_effectiveness

MIRROR_TOLERANCE = 1e-3
"""How far [m, rad] two fins may be from each other's mirror image and still count as a pair."""


@dataclass(frozen=True)
class Bounds:
    """Where one fin may go. Equal ends hold a number fixed. Checked on construction."""

    x: tuple[float, float]
    """Forward [m], (minimum, maximum)."""
    y: tuple[float, float]
    """To the left [m]."""
    z: tuple[float, float]
    """Up [m]."""
    mounting_angle: tuple[float, float]
    """Azimuth of the shaft [rad]; may reach beyond half a turn, as in 170 to 190 degrees."""

    def __post_init__(self) -> None:
        for name in ("x", "y", "z", "mounting_angle"):
            low, high = getattr(self, name)
            if not (math.isfinite(low) and math.isfinite(high) and low <= high):
                raise LayoutError(f"bounds of {name}: expected two numbers, smaller first, got {low} {high}")

    @staticmethod
    def around(fin: Fin, reach: float | Sequence[float] = 0.05, turn: float = math.pi) -> Bounds:
        """Returns bounds of `reach` [m], one number or three, and `turn` [rad] either way of where a fin
        is."""
        by = np.broadcast_to(np.asarray(reach, dtype=np.float64), 3)
        x, y, z = ((p - float(r), p + float(r)) for p, r in zip(fin.position, by, strict=True))
        return Bounds(x, y, z, (fin.shaft_azimuth - turn, fin.shaft_azimuth + turn))

    @property
    def pairs(self) -> Array:
        """All of it as an array (4, 2) [m, m, m, rad]."""
        return np.array([self.x, self.y, self.z, self.mounting_angle])


def mirror_pairs(layout: Layout) -> tuple[tuple[str, str], ...]:
    """Returns the pairs of fins that are each other's image in the plane y = 0: y and the azimuth change
    sign."""
    pairs: list[tuple[str, str]] = []
    for i, fin in enumerate(layout.fins):
        taken = {name for pair in pairs for name in pair}
        for other in layout.fins[i + 1 :]:
            if not {fin.name, other.name} & taken and is_mirrored(fin, other):
                pairs.append((fin.name, other.name))
                break
    return tuple(pairs)


def is_mirrored(fin: Fin, other: Fin) -> bool:
    """Says whether two fins are each other's mirror image."""
    x, y, z = fin.position
    apart = np.abs(np.subtract(other.position, (x, -y, z))).max()
    turned = abs(math.remainder(fin.shaft_azimuth + other.shaft_azimuth, math.tau))
    return bool(max(apart, turned) <= MIRROR_TOLERANCE)


class Moves:
    """Turns vectors of free numbers into positions and angles of all fins."""

    def __init__(
        self,
        layout: Layout,
        fins: Sequence[str],
        bounds: Mapping[str, Bounds],
        pairs: Sequence[tuple[str, str]] = (),
        grid: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Takes the fins to be moved, their bounds, and mirror pairs whose second follows the first.

        A fin that is moved along with its twin needs no bounds of its own. Free coordinates and angles
        are multiples of the steps [m], [rad] of `grid` where these are above zero and the bounds hold one.

        Raises:
            LayoutError: a fin is unknown, none is named, one has no bounds, a pair is not mirrored or shares
                a fin with another pair, or nothing is free to move.
        """
        if not fins:
            raise LayoutError("expected at least one fin to move, got none")
        layout.indices(tuple(fins))
        twins = _twins(layout, pairs)
        self.layout = layout
        leaders: list[str] = []
        for name in fins:
            if name not in leaders and twins.get(name) not in leaders:
                leaders.append(name)
        missing = [name for name in leaders if name not in bounds]
        if missing:
            raise LayoutError(f"fin {missing[0]} is to be moved but has no bounds; give it some")
        self.leaders = tuple(leaders)
        self._lead = layout.indices(leaders)
        self._twin = [layout.index(twins[name]) if name in twins else -1 for name in leaders]
        self.names = tuple(name for name in layout.names if name in leaders or twins.get(name) in leaders)
        """All fins that move, twins included, in the layout's order."""
        self._sets = fin_sets(layout)
        self.start_position = layout.position
        """Where all fins are now (n, 3) [m]."""
        self._angle = layout.mounting_angle
        box = np.concatenate([bounds[name].pairs for name in leaders])  # (4 leaders, 2)
        held = np.concatenate([[*layout.fins[i].position, layout.fins[i].shaft_azimuth] for i in self._lead])
        self._whole = np.clip(held, box[:, 0], box[:, 1])
        self._free = box[:, 1] - box[:, 0] > 0.0
        if not self._free.any():
            raise LayoutError("the bounds leave nothing free to move; widen them")
        self.lower, self.upper = box[self._free].T
        """Bounds of the free numbers (D,)."""
        self._step = np.tile([grid[0]] * 3 + [grid[1]], len(leaders))[self._free]
        self.start = self._whole[self._free]
        """Where the fins are now, brought within bounds (D,)."""

    def geometry(self, vectors: Array) -> tuple[Array, Array]:
        """Returns positions (P, n, 3) [m] and mounting angles (P, n) [rad] of vectors (P, D)."""
        whole = np.tile(self._whole, (len(vectors), 1))
        whole[:, self._free] = self._on_grid(vectors)
        moved = whole.reshape(len(vectors), len(self._lead), 4)
        position = np.tile(self.start_position, (len(vectors), 1, 1))
        angle = np.tile(self._angle, (len(vectors), 1))
        for k, (lead, twin) in enumerate(zip(self._lead, self._twin, strict=True)):
            position[:, lead], angle[:, lead] = moved[:, k, :3], moved[:, k, 3]
            if twin >= 0:
                position[:, twin] = moved[:, k, :3] * (1.0, -1.0, 1.0)
                angle[:, twin] = -moved[:, k, 3]
        return position, angle

    def _on_grid(self, vectors: Array) -> Array:
        """Vectors (P, D) whose numbers are multiples of their steps, within bounds."""
        step = np.where(self._step > 0.0, self._step, 1.0)
        low, high = np.ceil(self.lower / step - 1e-9), np.floor(self.upper / step + 1e-9)
        rounded = np.clip(np.round(vectors / step), low, high) * step
        return np.where((self._step > 0.0) & (low <= high), rounded, vectors)

    def sets(self, vectors: Array) -> FinSets:
        """Returns what the fins can push once moved by vectors (P, D)."""
        effectiveness = force_effectiveness(*self.geometry(vectors))[..., 1:, :] / SCALE
        return self._sets.tile(len(vectors))._replace(effectiveness=np.ascontiguousarray(effectiveness))

    def moved(self, vector: Array) -> Layout:
        """Returns the layout with its fins moved by a vector (D,)."""
        position, angle = self.geometry(vector[None])
        result = self.layout
        for i in self.layout.indices(self.names):
            x, y, z = (round(float(value), 12) for value in position[0, i])
            turned = math.remainder(float(angle[0, i]), math.tau)
            result = result.replace_actuator(self.layout.names[i], position=(x, y, z), mounting_angle=turned)
        return result


def _twins(layout: Layout, pairs: Sequence[tuple[str, str]]) -> dict[str, str]:
    """Who is whose twin, both ways."""
    twins: dict[str, str] = {}
    for pair in pairs:
        first, second = (layout.fins[i] for i in layout.indices(pair))
        if first.name in twins or second.name in twins:
            raise LayoutError(f"{first.name} and {second.name}: a fin can be in one mirror pair only")
        if first is second or not is_mirrored(first, second):
            raise LayoutError(
                f"{first.name} and {second.name} are not each other's mirror image in the plane y = 0; "
                "mirror one of them first, or leave the pair out"
            )
        twins |= {first.name: second.name, second.name: first.name}
    return twins
