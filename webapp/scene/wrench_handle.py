"""Handle of the wrench that is asked for: the tip of its force is dragged, and rings about its
foot are turned.

Two mappings of what a hand does say how much is asked. Near the foot both are linear or finer, so
that small wrenches can be set; farther out they grow, so that one drag goes to the end of the
robot's reach.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import viser

from finlab.arrays import Array
from webapp.handles import set_properties
from webapp.session.targets import nudge, slider_end
from webapp.viser_internals import know_position

TIP_SIZE = 0.13
"""Length of the gizmo's axes at the tip, for arrows of size 1 [m]."""
RING_SIZE = 0.2
"""Size of the gizmos of the rings, for arrows of size 1; their arcs have 0.65 of it as radius
[m]."""
LINEAR_M = 0.2
"""Distance from the foot up to which the force grows as the arrow does, for size 1 [m]."""
GROWTH_M = 0.2
"""Beyond it the force grows by the factor e in each such distance, for size 1 [m]."""
QUARTER = math.pi / 2
"""Turn of a ring that asks for as much more as the robot reaches [rad]."""
MOVED = 1e-6
"""Change of a component of the handle's pose up to which it was not moved [m, rad]."""
AXIS_COUNT = 3
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
"""Quaternion of a ring that is not turned."""


class Grip(NamedTuple):
    """What a hand took hold of, and how things were then."""

    ring: int | None
    """Axis of the ring that is turned; None where the tip is dragged."""
    target: tuple[float, ...]
    """Wrench that was asked for (6,) [N, N m]."""
    start: Array
    """Where the tip was (3,) [m]."""


class Pull(NamedTuple):
    """What is asked by a drag of the tip."""

    force: tuple[float, float, float]
    """[N]."""
    newtons: float
    """Force of an arrow of 0.1 m and size 1 whose tip is in the hand [N]."""


def pulled_force(
    tip: Array, grip: Grip, newtons: float, size: float, reach: Sequence[float], length_m: float
) -> Pull:
    """The force that a drag of the tip asks for.

    Args:
        tip: where the hand is, from the arrow's foot (3,) [m].
        grip: what it took hold of.
        newtons: force of an arrow of `length_m` and size 1 at the start [N].
        size: of the arrows.
        reach: how far the robot goes along each axis (3,) [N].
        length_m: the length that `newtons` speaks of [m].

    Returns:
        The force, rounded to steps that fit it where the hand has moved, and the scale by which
        its arrow ends in the hand.
    """
    per_meter = newtons / (length_m * size)
    distance = float(np.linalg.norm(tip))
    linear_end = max(LINEAR_M * size, float(np.linalg.norm(grip.start)))
    growth = math.exp(max(distance - linear_end, 0.0) / (GROWTH_M * size))
    growth *= min(distance, linear_end) / distance if distance > 0.0 else 1.0
    pull = tip * (per_meter * growth)
    size_n = max(float(np.linalg.norm(pull)), per_meter * linear_end)
    force = list(grip.target[:AXIS_COUNT])
    for axis in range(AXIS_COUNT):
        if abs(tip[axis] - grip.start[axis]) > MOVED:
            force[axis] = _stepped(float(pull[axis]), reach[axis], size_n)
    Fx, Fy, Fz = force
    return Pull((Fx, Fy, Fz), float(f"{newtons * max(growth, 1.0):.2g}"))


def turned_torque(angle: float, before: float, reach: float) -> float:
    """The torque that a turn of a ring asks for [N m].

    Args:
        angle: of the turn [rad]; a quarter asks for `reach` more, half of it for a fourth of that.
        before: what was asked for [N m].
        reach: how far the robot goes [N m].
    """
    if abs(angle) <= MOVED:
        return before
    most = slider_end(reach)
    share = angle / QUARTER
    change = math.copysign(share**2, angle) * most
    return _stepped(before + change, reach, abs(change))


def _stepped(value: float, reach: float, size: float) -> float:
    """A component within the track of its slider, in steps that fit the size of what changes, and
    no larger than those of the slider."""
    most = slider_end(reach)
    step = nudge(min(most, 2.0 * size)) if size > 0.0 else nudge(most)
    rounded = round(round(value / step) * step, 6)
    return min(max(rounded, -most), most) + 0.0


def turn_of(wxyz: Array, axis: int) -> float:
    """The angle about an axis of a quaternion that turns about this one alone [rad]."""
    return 2.0 * math.atan2(float(wxyz[1 + axis]), float(wxyz[0]))


def unwound(angle: float, last: float) -> float:
    """The angle [rad] nearest to the last one, of all that are whole turns apart."""
    return last + math.remainder(angle - last, math.tau)


OnPull = Callable[[str, Grip, Array, float], None]
"""Gets the phase (`start`, `update`, `end`), what is held, where the tip is (3,) [m], and the
turn of the ring [rad]."""


class WrenchHandle:
    """Gizmos at the tip of the asked force and about its foot; of axes that the robot commands."""

    def __init__(self, scene: viser.SceneApi, parent: str, on_pull: OnPull) -> None:
        """Hidden at first.

        Args:
            scene: of the page.
            parent: name of the node at the arrow's foot.
            on_pull: told of each drag.
        """
        self._on_pull = on_pull
        self.grip: Grip | None = None
        """What is held; None for nothing."""
        self._target: tuple[float, ...] = (0.0,) * 6
        self._angle = 0.0
        self._tip_at: tuple[float, float, float] | None = None
        """Where the gizmo of the tip was brought to [m]; None where a hand has left it."""
        self._is_turned = False
        """Whether a ring stands where a hand has turned it to."""
        self._shown: tuple[float, tuple[bool, ...], bool] | None = None
        """What the gizmos look like: arguments of `_set_looks`."""
        look: dict[str, Any] = {"depth_test": False, "line_width": 2.5, "visible": False}
        self._tip = scene.add_transform_controls(
            f"{parent}/tip", TIP_SIZE, disable_rotations=True, opacity=0.9, **look
        )
        self._tip.on_update(self._hearing(None))
        self._rings = []
        for axis, name in enumerate("xyz"):
            # A ring is drawn between the two other axes.
            others = tuple([other != axis for other in range(AXIS_COUNT)])
            ring = scene.add_transform_controls(
                f"{parent}/ring_{name}",
                RING_SIZE,
                disable_axes=True,
                disable_sliders=True,
                opacity=0.6,
                active_axes=others,  # type: ignore[arg-type]
                **look,
            )
            ring.on_update(self._hearing(axis))
            self._rings.append(ring)

    def show(
        self,
        target: tuple[float, ...],
        tip: tuple[float, float, float],
        size: float,
        commanded: Sequence[bool],
        is_visible: bool,
    ) -> str:
        """Stand at the tip of the asked force; what is held is left to the hand.

        Args:
            target: wrench that is asked for (6,) [N, N m].
            tip: of its force's arrow, from the arrow's foot [m].
            size: of the arrows.
            commanded: whether the robot commands each axis (6,).
            is_visible: whether the handle is shown.

        Returns:
            A script for the page that brings the gizmo of the tip there; empty for none.
        """
        self._target = target
        shown = size, tuple(commanded), is_visible
        if shown != self._shown:
            self._shown = shown
            self._set_looks(*shown)
        if not is_visible:
            return ""
        held = self.grip
        if held is None and self._is_turned:
            self._is_turned = False
            for ring in self._rings:
                set_properties(ring, wxyz=UPRIGHT)
        if (held is not None and held.ring is None) or tip == self._tip_at:
            return ""
        self._tip_at = tip
        know_position(self._tip, np.array(tip))
        x, y, z = tip
        return f"finlabFrames.place('{self._tip.name}', [{x:.5f}, {y:.5f}, {z:.5f}]);"

    def _set_looks(self, size: float, commanded: Sequence[bool], is_visible: bool) -> None:
        """Let the gizmos fit the robot; arguments as for `show`."""
        moves = tuple(map(bool, commanded[:AXIS_COUNT]))
        set_properties(
            self._tip, visible=is_visible and any(moves), active_axes=moves, scale=TIP_SIZE * size
        )
        for ring, turns in zip(self._rings, commanded[AXIS_COUNT:], strict=True):
            set_properties(ring, visible=is_visible and bool(turns), scale=RING_SIZE * size)

    def _hearing(self, ring: int | None) -> Callable[[Any], Any]:
        async def pulled(event: Any) -> None:
            if event.client is None:
                return
            if event.phase == "start" or self.grip is None:
                self.grip = Grip(ring, self._target, np.array(self._tip.position))
                self._angle = 0.0
            grip = self.grip
            if ring is not None:
                angle = turn_of(np.array(self._rings[ring].wxyz), ring)
                self._angle = unwound(angle, self._angle)
                self._is_turned = True
            else:
                self._tip_at = None
            if event.phase == "end":
                self.grip = None
            self._on_pull(event.phase, grip, np.array(self._tip.position), self._angle)

        return pulled
