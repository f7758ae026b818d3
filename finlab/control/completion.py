"""The axes that a controller commands, and those that it leaves open: held near zero, or as they come.

A controller commands some axes of the wrench, holds others at zero, and may leave some free. Few fins, or few
that are left, may not be able to hold zeros: two fins have four forces to choose for six axes. A target that
asks for the impossible spoils what the controller wants, so the open axes are set to what the fins give with
it; and free axes to what they give with the least force.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from finlab.arrays import Array
from finlab.axes import mask_of
from finlab.layout import Layout
from finlab.layout.effectiveness import layout_effectiveness

LEVER_M = 0.25
"""Torques count as forces at this lever when open axes are traded against each other [m]; about U-CAT's."""
RANK_TOLERANCE = 1e-6
"""Singular values below this share of the largest count as zero."""


class Completion:
    """Wanted axes to whole wrenches, for one layout with some fins lost. Linear in the wanted axes."""

    def __init__(
        self, layout: Layout, failed: Sequence[str], axes: Sequence[str], free: Sequence[str] = ()
    ) -> None:
        """Prepares for the actuators that work, at least one, the wanted and the free axes, by their names.
        Raises LayoutError: an unknown name, or no actuator is left."""
        scale = np.array([1.0, 1.0, 1.0, 1 / LEVER_M, 1 / LEVER_M, 1 / LEVER_M])
        planar = layout_effectiveness(layout.without(failed) if failed else layout) * scale[:, None]
        chosen = mask_of(axes)
        wanted, held = planar[chosen], planar[~mask_of((*axes, *free))]
        left, values, right = np.linalg.svd(wanted)
        rank = int((values > RANK_TOLERANCE * max(float(values[0]), 1e-9)).sum())
        self.controllable = rank == len(wanted)
        """Whether the working actuators can give any small combination of the wanted axes."""
        inverse = right[:rank].T @ np.diag(1.0 / values[:rank]) @ left[:, :rank].T
        spare = right[rank:].T
        give = inverse - spare @ np.linalg.pinv(held @ spare, rcond=RANK_TOLERANCE) @ held @ inverse
        scaled = planar @ give * scale[chosen] / scale[:, None]
        self.matrix = np.zeros((6, 6))
        """Wrench with the wanted axes filled in, to the whole wrench (6, 6)."""
        self.matrix[:, chosen] = np.where(np.abs(scaled) < 1e-9, 0.0, scaled)

    def __call__(self, wrench: Array) -> Array:
        """Wrenches (..., 6) whose wanted axes are asked for, whole."""
        completed: Array = wrench @ self.matrix.T
        return completed


def axes_of(layout: Layout) -> tuple[str, ...]:
    """The axes that are commanded: surge, heave and yaw, and sway where that costs nothing. Fins that push
    sideways hardly push ahead: with them sway is headed against. A robot that lifts by rudders alone dives by
    its pitch, and one that does not lift at all is steered in the plane."""
    lifts = ("Fx", "Fz", "Tz")
    rudders = layout.by_flow
    driven = layout.without(rudders) if len(rudders) < layout.n else layout
    candidates: list[tuple[Layout, tuple[str, ...]]]
    candidates = [(driven, lifts), (layout, ("Fx", "Ty", "Tz"))] if rudders else [(layout, lifts)]
    if not layout.n_fins:
        candidates = [(driven, ("Fx", "Fy", "Fz", "Tz")), *candidates, (layout, ("Fx", "Fy", "Tz"))]
    able = (axes for robot, axes in candidates if Completion(robot, (), axes).controllable)
    return next(able, lifts)


def steers(layout: Layout, failed: Sequence[str] = ()) -> bool:
    """Whether what works of a robot can give the axes that are commanded independently, in small."""
    return Completion(layout, failed, axes_of(layout)).controllable


def steerable_loss(layout: Layout, count: int, failed: Sequence[str] = ()) -> tuple[str, ...] | None:
    """The first actuators, so many besides those that failed, without which a robot can still be steered."""
    working = [name for name in layout.names if name not in failed]
    ways = combinations(working, count) if count < len(working) else ()
    return next((way for way in ways if not count or steers(layout, (*failed, *way))), None)
