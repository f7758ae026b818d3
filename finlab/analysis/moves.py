"""Moves of actuators: which may move, how far, and which one is the mirror image of which.

An actuator goes along x, y and z, turns about the vertical, and tilts about the horizontal line
across its main axis: shaft, axis of a thruster, or turn_axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from finlab.actuators.actuator import Actuator
from finlab.actuators.kinds import laws_of
from finlab.analysis.authority import held_axes
from finlab.arrays import Array
from finlab.axes import MIRROR
from finlab.errors import LayoutError
from finlab.forces.force_sets import SCALE, ForceSets, assembled, shapes_of
from finlab.layout import Layout
from finlab.layout.effectiveness import moved_effectiveness

MIRROR_TOLERANCE = 1e-3
"""How far [m, rad] two actuators may be from each other's mirror image and still count as a
pair."""
PROBE = 0.1  # share of its bounds by which a number is changed to see what it costs


@dataclass(frozen=True)
class Bounds:
    """Where one actuator may go. Equal ends hold a number fixed. Checked on construction."""

    x: tuple[float, float]  # forward [m], (minimum, maximum)
    y: tuple[float, float]  # to the left [m]
    z: tuple[float, float]  # up [m]
    mounting_angle: tuple[float, float]
    """Azimuth of the shaft [rad]; may reach beyond half a turn, as in 170 to 190 degrees. Of an
    actuator without a mounting angle, how far it turns about the vertical from where it points."""
    tilt: tuple[float, float] = (0.0, 0.0)  # how far its main axis rises [rad] from where it points

    def __post_init__(self) -> None:
        for name in ("x", "y", "z", "mounting_angle", "tilt"):
            low, high = getattr(self, name)
            if not (math.isfinite(low) and math.isfinite(high) and low <= high):
                raise LayoutError(
                    f"bounds of {name}: expected two numbers, smaller first, got {low} {high}"
                )

    @staticmethod
    def around(
        part: Actuator, reach: float | Sequence[float] = 0.05, turn: float = math.pi
    ) -> Bounds:
        """Returns bounds of `reach` [m], one number or three, and `turn` [rad] either way of where
        an actuator is; horizontal shafts stay horizontal, others also tilt, by up to a quarter
        turn."""
        by = np.broadcast_to(np.asarray(reach, dtype=np.float64), 3)
        x, y, z = ((p - float(r), p + float(r)) for p, r in zip(part.position, by, strict=True))
        tilt = min(turn, 0.5 * math.pi) if getattr(part, "mounting_angle", None) is None else 0.0
        angle = azimuth(part)
        return Bounds(x, y, z, (angle - turn, angle + turn), (-tilt, tilt))

    @property
    def pairs(self) -> Array:
        """All of it as an array (5, 2) [m, m, m, rad, rad]."""
        return np.array([self.x, self.y, self.z, self.mounting_angle, self.tilt])


def azimuth(part: Actuator) -> float:
    """Returns the angle [rad] that `Bounds.mounting_angle` is about, as it is now: 0 of an actuator
    without a mounting angle."""
    return (getattr(part, "mounting_angle", None) or 0.0) + 0.0


def mirror_pairs(layout: Layout) -> tuple[tuple[str, str], ...]:
    """Returns the pairs of actuators that are each other's image in the plane y = 0: y and the
    azimuth change sign."""
    pairs: list[tuple[str, str]] = []
    for i, part in enumerate(layout.actuators):
        taken = {name for pair in pairs for name in pair}
        for other in layout.actuators[i + 1 :]:
            if not {part.name, other.name} & taken and is_mirrored(part, other):
                pairs.append((part.name, other.name))
                break
    return tuple(pairs)


def is_mirrored(part: Actuator, other: Actuator, tolerance: float = MIRROR_TOLERANCE) -> bool:
    """Says whether two actuators of a type are each other's mirror image, within [m, rad]: fins
    with their shafts, others whichever way their axes count."""
    count = len(part.KIND.axes)
    image = np.array(part.frame)[:count] * MIRROR
    axes = np.array(other.frame)[:count]
    apart = np.abs(np.subtract(other.position, MIRROR * part.position)).max()
    turned = np.linalg.norm(np.cross(image, axes), axis=-1).max()
    same_way = part.type != "fin" or image[0] @ axes[0] > 0.0
    return part.type == other.type and same_way and bool(max(apart, turned) <= tolerance)


class Moves:
    """Turns vectors of free numbers into places and directions of all actuators."""

    def __init__(
        self,
        layout: Layout,
        names: Sequence[str],
        bounds: Mapping[str, Bounds],
        pairs: Sequence[tuple[str, str]] = (),
        grid: tuple[float, float] = (0.0, 0.0),
        flow: Array | None = None,
    ) -> None:
        """Takes the actuators to be moved, their bounds, and mirror pairs whose second follows the
        first: one that moves along with its twin needs no bounds of its own. Free coordinates and
        angles are multiples of the steps [m], [rad] of `grid` where these are above zero and the
        bounds hold one. `flow` as for `force_sets`. Raises LayoutError: an actuator is unknown,
        none is named, one has no bounds, a pair is not mirrored or shares one with another pair, or
        nothing is free to move."""
        kind = "fin" if layout.is_of_fins else "actuator"
        if not names:
            raise LayoutError(f"names: expected at least one {kind} to move, got none")
        layout.indices(tuple(names), "names")
        twins = _twins(layout, pairs)
        self.layout = layout
        leaders: list[str] = []
        for name in names:
            if name not in leaders and twins.get(name) not in leaders:
                leaders.append(name)
        missing = [name for name in leaders if name not in bounds]
        if missing:
            raise LayoutError(
                f"bounds: {kind} {missing[0]} is to be moved but has none; give it some"
            )
        self.leaders = tuple(leaders)
        self._lead = list(layout.indices(leaders))
        self._twin = np.array(
            [layout.index(twins[name]) if name in twins else -1 for name in leaders]
        )
        self.names = tuple(
            name for name in layout.names if name in leaders or twins.get(name) in leaders
        )
        """All that move, twins included, in the layout's order."""
        self._flow = flow
        self._shapes = shapes_of(layout, flow)
        self.start_position = layout.position
        """Where all actuators are now (n, 3) [m]."""
        self._angle = np.array([azimuth(part) for part in layout.actuators])
        box = np.concatenate([bounds[name].pairs for name in leaders])  # (5 leaders, 2)
        held = np.concatenate([[*self.start_position[i], self._angle[i], 0.0] for i in self._lead])
        self._held = np.clip(held, box[:, 0], box[:, 1])
        self._free = box[:, 1] - box[:, 0] > 0.0
        if not self._free.any():
            raise LayoutError("bounds: nothing is left free to move; widen them")
        self.lower, self.upper = box[self._free].T
        """Bounds of the free numbers (D,)."""
        self.bends = flow is not None and any(
            law.feels_flow for _, law in laws_of(layout.actuators)
        )
        """Whether what actuators push changes as they move."""
        self.step = np.tile([grid[0]] * 3 + [grid[1]] * 2, len(leaders))[self._free]
        """Steps (D,) of the grid, 0 for any number."""
        self.start = self._held[self._free]
        """Where the actuators are now, brought within bounds (D,)."""

    @property
    def smooth(self) -> Moves:
        """The same moves without a grid."""
        moves = copy(self)
        moves.step = np.zeros_like(self.step)
        return moves

    def keep_alone(self, axes: Sequence[str]) -> None:
        """Holds the free numbers that cost one of some axes, which are pushed alone now, when they
        change by themselves; all stay free where each of them does."""
        step = PROBE * np.diag(self.upper - self.lower)
        tried = np.clip(
            np.concatenate([self.start - step, self.start + step]), self.lower, self.upper
        )
        held = held_axes(self.layout, self.sets(tried))
        kept = np.array([set(axes) <= set(each.alone) for each in held]).reshape(2, -1).all(axis=0)
        if kept.any():
            self._free[np.flatnonzero(self._free)[~kept]] = False
            self.lower = self.lower[kept]
            self.upper = self.upper[kept]
            self.start = self.start[kept]
            self.step = self.step[kept]

    def positions(self, vectors: Array) -> Array:
        """Returns positions (P, n, 3) [m] of vectors (P, D)."""
        return self._placed(self._numbers(vectors))

    def geometry(self, vectors: Array) -> tuple[Array, Array]:
        """Returns positions (P, n, 3) [m] and own axes (P, n, 3, 3) of vectors (P, D)."""
        moved = self._numbers(vectors)
        frames = np.tile(self.layout.frames, (len(vectors), 1, 1, 1))
        turned = _turned(
            self.layout.frames[self._lead, 0],
            moved[..., 3] - self._angle[self._lead],
            moved[..., 4],
        )
        frames[:, self._lead] = frames[:, self._lead] @ turned
        follows = self._twin >= 0
        twin = self._twin[self._twin >= 0]
        frames[:, twin] = frames[:, twin] @ (turned[:, follows] * MIRROR * MIRROR[:, None])
        return self._placed(moved), frames

    def _numbers(self, vectors: Array) -> Array:
        """All numbers (P, leaders, 5) of vectors (P, D)."""
        numbers = np.tile(self._held, (len(vectors), 1))
        numbers[:, self._free] = self.on_grid(vectors)
        return numbers.reshape(len(vectors), len(self._lead), 5)

    def _placed(self, numbers: Array) -> Array:
        position = np.tile(self.start_position, (len(numbers), 1, 1))
        position[:, self._lead] = numbers[..., :3]
        follows = self._twin >= 0
        position[:, self._twin[follows]] = numbers[:, follows, :3] * MIRROR
        return position

    def mirrored(self, vectors: Array) -> Array:
        """Returns vectors (P, D) in which one of each two actuators that are each other's mirror
        image now follows the other, as far as its bounds let it."""
        numbers = self._numbers(vectors)
        for first, second in mirror_pairs(self.layout):
            if first in self.leaders and second in self.leaders:
                one = self.leaders.index(first)
                other = self.leaders.index(second)
                i = self._lead[one]
                j = self._lead[other]
                way = np.sign(self.layout.frames[i, 0] * MIRROR @ self.layout.frames[j, 0])
                image = (numbers[:, one, 3:] - [self._angle[i], 0.0]) * [-1.0, way] + [
                    self._angle[j],
                    0.0,
                ]
                numbers[:, other] = np.concatenate([numbers[:, one, :3] * MIRROR, image], axis=-1)
        return np.clip(numbers.reshape(len(vectors), -1)[:, self._free], self.lower, self.upper)

    def on_grid(self, vectors: Array) -> Array:
        """Returns vectors (P, D) whose numbers are multiples of their steps, within bounds."""
        step = np.where(self.step > 0.0, self.step, 1.0)
        low = np.ceil(self.lower / step - 1e-9)
        high = np.floor(self.upper / step + 1e-9)
        rounded = np.clip(np.round(vectors / step), low, high) * step
        return np.where((self.step > 0.0) & (low <= high), rounded, vectors)

    def sets(self, vectors: Array) -> ForceSets:
        """Returns what the actuators can push once moved by vectors (P, D)."""
        position, frames = self.geometry(vectors)
        effectiveness = moved_effectiveness(self.layout, position, frames) * self.layout.commanded
        if self.bends:
            return assembled(
                [shapes_of(self.moved(vector), self._flow) for vector in vectors], effectiveness
            )
        alike = assembled([self._shapes], effectiveness[:1]).repeat(len(vectors))
        directions = np.array([shape.directions for shape in self._shapes])
        return alike._replace(
            effectiveness=np.ascontiguousarray(directions @ effectiveness / SCALE)
        )

    def moved(self, vector: Array) -> Layout:
        """Returns the layout with its actuators moved by a vector (D,)."""
        position, frames = self.geometry(vector[None])
        result = self.layout
        for i in self.layout.indices(self.names):
            result = result.with_part(self.layout.actuators[i].turned(frames[0, i], position[0, i]))
        return result


def _turned(axis: Array, turn: Array, tilt: Array) -> Array:
    """Matrices (P, L, 3, 3), from the right of rows, that raise main axes (L, 3) by angles (P, L)
    [rad] and then turn them about the vertical by others; those that are vertical tilt towards
    x."""
    level = np.hypot(axis[:, 0], axis[:, 1])[:, None]
    upright = np.stack([np.zeros(len(axis)), np.sign(axis[:, 2]), np.zeros(len(axis))], axis=-1)
    sideways = np.stack([axis[:, 1], -axis[:, 0], np.zeros(len(axis))], axis=-1) / np.maximum(
        level, MIRROR_TOLERANCE
    )
    across = np.where(level > MIRROR_TOLERANCE, sideways, upright)
    return _about(across, tilt) @ _about(np.eye(3)[2:], turn)


def _about(axis: Array, angle: Array) -> Array:
    """Rodrigues' matrices (P, L, 3, 3), from the right of rows, of turns about unit axes by angles
    (P, L)."""
    cross = np.cross(np.eye(3), axis[:, None, :])
    sine = np.sin(angle)[..., None, None]
    rest = 1.0 - np.cos(angle)[..., None, None]
    return np.asarray(np.eye(3) - sine * cross + rest * (cross @ cross))


def _twins(layout: Layout, pairs: Sequence[tuple[str, str]]) -> dict[str, str]:
    twins: dict[str, str] = {}
    kind = "a fin" if layout.is_of_fins else "an actuator"
    for pair in pairs:
        first, second = (layout.actuators[i] for i in layout.indices(pair))
        if first.name in twins or second.name in twins:
            raise LayoutError(
                f"{first.name} and {second.name}: {kind} can be in one mirror pair only"
            )
        if first is second or not is_mirrored(first, second):
            raise LayoutError(
                f"{first.name} and {second.name} are not each other's mirror image in the plane y "
                "= 0; "
                "mirror one of them first, or leave the pair out"
            )
        twins |= {first.name: second.name, second.name: first.name}
    return twins
