"""Moves of actuators: which may move, how far, and which are each other's mirror image.

`optimize` searches over vectors of free numbers; `Moves` turns them into layouts and force sets.
An actuator goes along x, y and z, turns about the vertical, and tilts about the horizontal line
across its main axis: shaft, axis of a thruster, or turn_axis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.actuator import Actuator
from finlab.actuators.kinds import laws_of
from finlab.analysis.authority import held_axes
from finlab.arrays import Array
from finlab.axes import MIRROR_SIGNS
from finlab.errors import LayoutError
from finlab.forces.force_sets import SCALE, ForceSets, assembled, shapes_of
from finlab.layout import Layout
from finlab.layout.effectiveness import moved_effectiveness

MIRROR_TOLERANCE = 1e-3
"""How far [m, rad] two actuators may be from each other's mirror image and still count as a
pair."""
TURN = 2.0 * math.pi
"""A whole turn [rad]."""
ROUNDING = 1e-9
"""Angle by which a range may fall short of a whole turn [rad]."""
PROBE_SHARE = 0.1
"""Share of its bounds by which a number is changed to see whether it costs an axis."""


@dataclass(frozen=True)
class Bounds:
    """Bounds of one actuator's position and angles; equal ones hold a number fixed. Checked on
    construction."""

    x: tuple[float, float]
    """Least and most forward position [m]."""
    y: tuple[float, float]
    """The same to the left [m]."""
    z: tuple[float, float]
    """The same upward [m]."""
    mounting_angle: tuple[float, float]
    """Azimuth of the shaft [rad]; may reach beyond half a turn, as in 170 to 190 degrees. Of an
    actuator without a mounting angle, how far it turns about the vertical from where it points."""
    tilt: tuple[float, float] = (0.0, 0.0)
    """Rise of its main axis from where it points [rad]."""

    def __post_init__(self) -> None:
        for name in ("x", "y", "z", "mounting_angle", "tilt"):
            low, high = getattr(self, name)
            if not (math.isfinite(low) and math.isfinite(high) and low <= high):
                raise LayoutError(
                    f"bounds of {name}: expected two numbers, smaller first, got {low} {high}"
                )

    @staticmethod
    def around(
        actuator: Actuator, reach: float | Sequence[float] = 0.05, turn: float = math.pi
    ) -> Bounds:
        """Returns bounds about the present position and angles of an actuator.

        Horizontal shafts stay horizontal, others also tilt by as much as they turn.

        Args:
            actuator: the actuator.
            reach: largest change of each coordinate [m]; one number, or three.
            turn: largest change of the angles [rad].
        """
        reaches = np.broadcast_to(np.asarray(reach, dtype=np.float64), 3)
        x, y, z = (
            (p - float(r), p + float(r)) for p, r in zip(actuator.position, reaches, strict=True)
        )
        tilt = turn if getattr(actuator, "mounting_angle", None) is None else 0.0
        angle = azimuth(actuator)
        return Bounds(x, y, z, (angle - turn, angle + turn), (-tilt, tilt))

    @property
    def pairs(self) -> Array:
        """All of it as an array (5, 2) [m, m, m, rad, rad]."""
        return np.array([self.x, self.y, self.z, self.mounting_angle, self.tilt])


def azimuth(actuator: Actuator) -> float:
    """Returns the angle [rad] that `Bounds.mounting_angle` is about, as it is now: 0 of an actuator
    without a mounting angle."""
    return (getattr(actuator, "mounting_angle", None) or 0.0) + 0.0


def mirror_pairs(layout: Layout) -> tuple[tuple[str, str], ...]:
    """Returns the pairs of actuators that are each other's image in the plane y = 0: y and the
    azimuth change sign."""
    pairs: list[tuple[str, str]] = []
    for i, first in enumerate(layout.actuators):
        taken = {name for pair in pairs for name in pair}
        for second in layout.actuators[i + 1 :]:
            if not {first.name, second.name} & taken and is_mirrored(first, second):
                pairs.append((first.name, second.name))
                break
    return tuple(pairs)


def is_mirrored(first: Actuator, second: Actuator, tolerance: float = MIRROR_TOLERANCE) -> bool:
    """Whether two actuators of a type are each other's mirror image in the plane y = 0.

    Args:
        first: an actuator.
        second: another one.
        tolerance: largest difference of positions [m] and directions [rad]. Shafts of fins have to
            point the same way, other axes may point either way.
    """
    count = len(first.KIND.axes)
    image = np.array(first.frame)[:count] * MIRROR_SIGNS
    axes = np.array(second.frame)[:count]
    distance = np.abs(np.subtract(second.position, MIRROR_SIGNS * first.position)).max()
    angle = np.linalg.norm(np.cross(image, axes), axis=-1).max()
    same_way = first.type != "fin" or image[0] @ axes[0] > 0.0
    return first.type == second.type and same_way and bool(max(distance, angle) <= tolerance)


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
        """Sets up the free numbers.

        Args:
            layout: the robot at the start.
            names: actuators to be moved.
            bounds: their bounds by name; one that follows its mirror image needs none.
            pairs: mirror pairs; of each the one that is named later follows the other.
            grid: steps [m], [rad] of coordinates and angles, which then are multiples of them where
                the bounds hold one; 0 for any number.
            flow: velocity (6,) relative to the water [m/s, rad/s]; None at rest.

        Raises:
            LayoutError: an actuator is unknown, none is named, one has no bounds, a pair is not
                mirrored or shares one with another pair, or nothing is free to move.
        """
        kind = "fin" if layout.is_of_fins else "actuator"
        if not names:
            raise LayoutError(f"names: expected at least one {kind} to move, got none")
        layout.indices(tuple(names), "names")
        twins = _twins_of(layout, pairs)
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
        self._leader_rows = list(layout.indices(leaders))
        self._twin_rows = np.array(
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
        self._azimuths = np.array([azimuth(part) for part in layout.actuators])
        box = np.concatenate([bounds[name].pairs for name in leaders])  # (5 leaders, 2)
        held = np.concatenate(
            [[*self.start_position[i], self._azimuths[i], 0.0] for i in self._leader_rows]
        )
        self._values = np.clip(held, box[:, 0], box[:, 1])
        self._free = box[:, 1] - box[:, 0] > 0.0
        if not self._free.any():
            raise LayoutError("bounds: nothing is left free to move; widen them")
        self.lower, self.upper = box[self._free].T
        """Bounds of the free numbers (D,)."""
        self.changes_forces = flow is not None and any(
            law.feels_flow for _, law in laws_of(layout.actuators)
        )
        """Whether what actuators push changes as they move."""
        self.step = np.tile([grid[0]] * 3 + [grid[1]] * 2, len(leaders))[self._free]
        """Steps (D,) of the grid, 0 for any number."""
        self.start = self._values[self._free]
        """Where the actuators are now, brought within bounds (D,)."""

    @property
    def numbers_by_kind(self) -> list[NDArray[np.intp]]:
        """Indices of the free numbers of each kind: x, y, z, turn and tilt; kinds that are held are
        left out."""
        kind = np.flatnonzero(self._free) % 5
        indices = [np.flatnonzero(kind == k) for k in range(5)]
        return [numbers for numbers in indices if len(numbers)]

    @property
    def moves_actuator(self) -> NDArray[np.bool_]:
        """Which actuators a free number moves (D, n)."""
        leader = np.flatnonzero(self._free) // 5
        actuators = np.arange(self.layout.n)
        leader_row = np.array(self._leader_rows)[leader]
        twin_row = self._twin_rows[leader]
        return np.asarray((leader_row[:, None] == actuators) | (twin_row[:, None] == actuators))

    @property
    def is_whole_turn(self) -> NDArray[np.bool_]:
        """Which free numbers are angles whose bounds are a whole turn apart (D,)."""
        is_angle = np.flatnonzero(self._free) % 5 >= 3
        return np.asarray(is_angle & (self.upper - self.lower >= TURN - ROUNDING))

    @property
    def whole_tilts(self) -> NDArray[np.intp]:
        """Indices of tilts over a whole turn: half a turn of one reverses its main axis."""
        is_tilt = np.flatnonzero(self._free) % 5 == 4
        return np.flatnonzero(is_tilt & self.is_whole_turn)

    @property
    def smooth(self) -> Moves:
        """The same moves without a grid."""
        moves = copy(self)
        moves.step = np.zeros_like(self.step)
        return moves

    def keep_alone(self, axes: Sequence[str]) -> None:
        """Holds the free numbers that cost one of some axes, which are pushed alone now, when they
        change by themselves; all stay free where each of them does."""
        step = PROBE_SHARE * np.diag(self.upper - self.lower)
        probes = np.clip(
            np.concatenate([self.start - step, self.start + step]), self.lower, self.upper
        )
        authorities = held_axes(self.layout, self.sets(probes))
        is_kept = (
            np.array([set(axes) <= set(authority.alone) for authority in authorities])
            .reshape(2, -1)
            .all(axis=0)
        )
        if is_kept.any():
            self._free[np.flatnonzero(self._free)[~is_kept]] = False
            self.lower = self.lower[is_kept]
            self.upper = self.upper[is_kept]
            self.start = self.start[is_kept]
            self.step = self.step[is_kept]

    def positions(self, vectors: Array) -> Array:
        """Returns positions (P, n, 3) [m] of vectors (P, D)."""
        return self._positions(self._numbers(vectors))

    def geometry(self, vectors: Array) -> tuple[Array, Array]:
        """Returns positions (P, n, 3) [m] and own axes (P, n, 3, 3) of vectors (P, D)."""
        numbers = self._numbers(vectors)
        frames = np.tile(self.layout.frames, (len(vectors), 1, 1, 1))
        turns = turn_matrices(
            self.layout.frames[self._leader_rows, 0],
            numbers[..., 3] - self._azimuths[self._leader_rows],
            numbers[..., 4],
        )
        frames[:, self._leader_rows] = frames[:, self._leader_rows] @ turns
        follows = self._twin_rows >= 0
        twin = self._twin_rows[self._twin_rows >= 0]
        # The mirror image of a rotation R is S R S, with S = diag(MIRROR_SIGNS).
        mirrored_turns = turns[:, follows] * MIRROR_SIGNS * MIRROR_SIGNS[:, None]
        frames[:, twin] = frames[:, twin] @ mirrored_turns
        return self._positions(numbers), frames

    def _numbers(self, vectors: Array) -> Array:
        """All numbers (P, leaders, 5) of vectors (P, D)."""
        numbers = np.tile(self._values, (len(vectors), 1))
        numbers[:, self._free] = self.on_grid(vectors)
        return numbers.reshape(len(vectors), len(self._leader_rows), 5)

    def _positions(self, numbers: Array) -> Array:
        """Positions (P, n, 3) [m] of all actuators by all numbers (P, leaders, 5)."""
        position = np.tile(self.start_position, (len(numbers), 1, 1))
        position[:, self._leader_rows] = numbers[..., :3]
        follows = self._twin_rows >= 0
        position[:, self._twin_rows[follows]] = numbers[:, follows, :3] * MIRROR_SIGNS
        return position

    def mirrored(self, vectors: Array) -> Array:
        """Returns vectors (P, D) in which one of each two actuators that are each other's mirror
        image now follows the other, as far as its bounds let it."""
        numbers = self._numbers(vectors)
        for name_1, name_2 in mirror_pairs(self.layout):
            if name_1 in self.leaders and name_2 in self.leaders:
                column_1 = self.leaders.index(name_1)
                column_2 = self.leaders.index(name_2)
                i = self._leader_rows[column_1]
                j = self._leader_rows[column_2]
                sign = np.sign(self.layout.frames[i, 0] * MIRROR_SIGNS @ self.layout.frames[j, 0])
                image = (numbers[:, column_1, 3:] - [self._azimuths[i], 0.0]) * [-1.0, sign] + [
                    self._azimuths[j],
                    0.0,
                ]
                numbers[:, column_2] = np.concatenate(
                    [numbers[:, column_1, :3] * MIRROR_SIGNS, image], axis=-1
                )
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
        if self.changes_forces:
            return assembled(
                [shapes_of(self.moved(vector), self._flow) for vector in vectors], effectiveness
            )
        unmoved = assembled([self._shapes], effectiveness[:1]).repeat(len(vectors))
        directions = np.array([shape.directions for shape in self._shapes])
        return unmoved._replace(
            effectiveness=np.ascontiguousarray(directions @ effectiveness / SCALE)
        )

    def moved(self, vector: Array) -> Layout:
        """Returns the layout with its actuators moved by a vector (D,)."""
        position, frames = self.geometry(vector[None])
        result = self.layout
        for i in self.layout.indices(self.names):
            result = result.with_actuator(
                self.layout.actuators[i].turned(frames[0, i], position[0, i])
            )
        return result


def turn_matrices(axis: Array, turn: Array, tilt: Array) -> Array:
    """Returns matrices (P, L, 3, 3), from the right of rows, that raise main axes and then turn
    them about the vertical; those that are vertical tilt towards x.

    Args:
        axis: main axes (L, 3).
        turn: angles about the vertical (P, L) [rad].
        tilt: angles by which the axes are raised (P, L) [rad].
    """
    level = np.hypot(axis[:, 0], axis[:, 1])[:, None]
    upright = np.stack([np.zeros(len(axis)), np.sign(axis[:, 2]), np.zeros(len(axis))], axis=-1)
    sideways = np.stack([axis[:, 1], -axis[:, 0], np.zeros(len(axis))], axis=-1) / np.maximum(
        level, MIRROR_TOLERANCE
    )
    across = np.where(level > MIRROR_TOLERANCE, sideways, upright)
    return _rotation_matrices(across, tilt) @ _rotation_matrices(np.eye(3)[2:], turn)


def _rotation_matrices(axis: Array, angle: Array) -> Array:
    """Rodrigues' matrices (P, L, 3, 3), from the right of rows, of turns about unit axes by angles
    (P, L)."""
    cross = np.cross(np.eye(3), axis[:, None, :])
    sine = np.sin(angle)[..., None, None]
    versine = 1.0 - np.cos(angle)[..., None, None]
    return np.asarray(np.eye(3) - sine * cross + versine * (cross @ cross))


def _twins_of(layout: Layout, pairs: Sequence[tuple[str, str]]) -> dict[str, str]:
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
                "= 0; mirror one of them first, or leave the pair out"
            )
        twins |= {first.name: second.name, second.name: first.name}
    return twins
