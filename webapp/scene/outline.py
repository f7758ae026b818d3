"""Outlines of arrows: larger ones of which only the far side is drawn (`frames.js`), so that they
frame what stands within them on any background."""

import math

import numpy as np
import viser

from finlab.arrays import Array
from webapp.scene.actuator_shapes import SHORTEST
from webapp.theme import Rgb
from webapp.viser_internals import assign, script_of_points

HEAD_RADIUS = 2.5
"""Radius of an arrow's head, in radii of its shaft."""
HEAD_LENGTH = 4.2
"""Length of an arrow's head, in radii of its shaft."""
DIGITS = 4
"""Places and lengths are sent in tenths of a millimetre, so that rounding errors are not."""
SLOPE = math.hypot(HEAD_RADIUS, HEAD_LENGTH)
"""Length of a head's side, in radii of the shaft."""
BEYOND_TIP = SLOPE / HEAD_RADIUS
"""How far a cone about a head reaches beyond its tip, in margins: all its sides are one margin
outside."""


class Outline:
    """Outlines of some arrows of one thickness, all of one colour."""

    def __init__(
        self, scene: viser.SceneApi, name: str, thickness: float, margin: float, color: Rgb
    ) -> None:
        """No outline yet.

        Args:
            scene: where they stand.
            name: of their node; `frames.js` knows those of outlines by how they end.
            thickness: radius of the arrows' shafts, for size 1 [m].
            margin: how far an outline stands off its arrow, for size 1 [m].
            color: of all of them, in linear light.
        """
        self._thickness = thickness
        self._margin = margin
        radius, head_radius, head_length = self._sizes_for(1.0)
        self.node = scene.add_arrows(
            name,
            np.zeros((1, 2, 3)),
            np.array([color], dtype=np.uint8),
            shaft_radius=radius,
            head_radius=head_radius,
            head_length=head_length,
            visible=False,
        )
        self._color = np.array(color, dtype=np.uint8)
        self._is_visible = False
        self._size = 0.0
        self._count = 0
        """How many are shown."""
        self._points = np.zeros((0, 2, 3))
        """Their ends (m, 2, 3), for size 1 [m]."""

    def _sizes_for(self, factor: float) -> tuple[float, float, float]:
        """Radius of the shaft, radius and length of the head of an outline, for size 1 and an arrow
        that is thicker by a factor [m]."""
        radius = factor * self._thickness
        # The base and the side of the head are one margin outside of the arrow's.
        head_length = HEAD_LENGTH * radius + (1.0 + BEYOND_TIP) * self._margin
        return radius + self._margin, head_length * HEAD_RADIUS / HEAD_LENGTH, head_length

    def paint(self, color: Rgb) -> None:
        """Gives all of them another colour, in linear light."""
        self._color = np.array(color, dtype=np.uint8)
        self._count = 0  # with the next that are shown

    def thicken(self, factor: float) -> None:
        """Draws outlines for arrows that are thicker by a factor."""
        radius, head_radius, head_length = self._sizes_for(factor)
        sizes = {"shaft_radius": radius, "head_radius": head_radius, "head_length": head_length}
        assign(self.node, sizes)

    def show(self, starts: Array, vectors: Array, size: float) -> str:
        """Shows outlines of arrows; those of no length have none.

        Args:
            starts: where they begin (n, 3) [m].
            vectors: from there to their tips (n, 3) [m].
            size: factor of the thickness of their shafts.

        Returns:
            A script that tells the page where they end, where as many were shown before; empty
            where a message tells it, or the page knows.
        """
        length = np.sqrt((vectors * vectors).sum(axis=1))
        is_drawn = length > SHORTEST * size
        count = int(np.count_nonzero(is_drawn))
        if (count > 0) != self._is_visible:
            self._is_visible = count > 0
            self.node.visible = self._is_visible
        if count == 0:
            self._count = 0
            return ""
        if count < len(starts):
            starts, vectors, length = starts[is_drawn], vectors[is_drawn], length[is_drawn]
        direction = vectors / length[:, None]
        margin = self._margin  # for size 1
        points = np.empty((count, 2, 3))
        points[:, 0] = starts / size - margin * direction
        points[:, 1] = (starts + vectors) / size + BEYOND_TIP * margin * direction
        points = points.round(DIGITS)
        if count == self._count and size == self._size:
            if points.tobytes() == self._points.tobytes():
                return ""
            self._points = points
            return script_of_points(self.node, points)
        self._points = points
        colors = np.broadcast_to(self._color, (count, 3)).copy()
        values = {"points": points.astype(np.float32), "colors": colors}
        if size != self._size:
            values["scale"] = size
        self._count = count
        self._size = size
        assign(self.node, values)
        return ""
