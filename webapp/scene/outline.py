"""Outlines of arrows: larger ones of which only the far side is drawn, so that they frame what
stands within them on any background."""

import math

import numpy as np
import viser
from numpy.typing import NDArray

from finlab.arrays import Array
from finlab.swim.hull.mesh_file import Mesh
from webapp.scene.actuator_shapes import SHORTEST, tube
from webapp.theme import Rgb
from webapp.viser_internals import assign

HEAD_RADIUS = 2.5
"""Radius of an arrow's head, in radii of its shaft."""
HEAD_LENGTH = 4.2
"""Length of an arrow's head, in radii of its shaft."""
DIGITS = 4
"""Places and lengths are sent in tenths of a millimetre, so that rounding errors are not."""
SIDES = 16
"""Of a shaft or a head all round."""
POINT = 1e-3
"""Radius of the tip of a head, as a share of that of its base."""
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
            name: of their nodes, with what is added for shafts and heads.
            thickness: radius of the arrows' shafts, for size 1 [m].
            margin: how far an outline stands off its arrow, for size 1 [m].
            color: of all of them.
        """
        self._thickness = thickness
        self._thickened = 1.0
        """Factor of the thickness that `thicken` was told."""
        self._margin = margin
        shaft = tube(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 1.0, SIDES)
        head = tube(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), np.array([1.0, POINT]), SIDES)
        self._nodes = [
            _batch(scene, f"{name}/shafts", shaft, color),
            _batch(scene, f"{name}/heads", head, color),
        ]
        self._is_visible = False
        self._sent = b""

    def paint(self, color: Rgb) -> None:
        """Gives all of them another colour."""
        for node in self._nodes:
            assign(node, {"batched_colors": np.array(color, dtype=np.uint8)})

    def thicken(self, factor: float) -> None:
        """Draws outlines for arrows that are thicker by a factor, from the next that is shown."""
        self._thickened = factor

    def show(self, starts: Array, vectors: Array, size: float) -> None:
        """Shows outlines of arrows; those of no length have none.

        Args:
            starts: where they begin (n, 3) [m].
            vectors: from there to their tips (n, 3) [m].
            size: factor of the thickness of their shafts.
        """
        length = np.sqrt((vectors * vectors).sum(axis=1))
        is_drawn = length > SHORTEST * size
        is_visible = bool(is_drawn.any())
        if is_visible != self._is_visible:
            self._is_visible = is_visible
            for node in self._nodes:
                node.visible = is_visible
        if not is_visible:
            return
        starts = starts[is_drawn]
        length = length[is_drawn, None]
        directions = vectors[is_drawn] / length
        radius = size * self._thickened * self._thickness
        margin = size * self._margin
        head = HEAD_LENGTH * radius
        # The shaft, from one margin before its start to within the head.
        shaft_length = np.maximum(length - head, 0.0) + 2.0 * margin
        shaft_radius = radius + margin
        # A cone whose base and side are one margin outside of the head's.
        head_start = starts + (length - head - margin) * directions
        head_length = head + (1.0 + BEYOND_TIP) * margin
        head_radius = head_length * HEAD_RADIUS / HEAD_LENGTH
        places = [starts - margin * directions, head_start]
        scales = [
            np.broadcast_to(shaft_radius, (len(length), 3)).copy(),
            np.broadcast_to(head_radius, (len(length), 3)).copy(),
        ]
        scales[0][:, 0] = shaft_length[:, 0]
        scales[1][:, 0] = head_length
        turns = turned_to(directions).astype(np.float32)
        packed = [_packed(places[k]) for k in (0, 1)] + [_packed(scales[k]) for k in (0, 1)]
        sent = b"".join([part.tobytes() for part in packed])
        if sent == self._sent:
            return
        self._sent = sent
        for k, node in enumerate(self._nodes):
            values = {
                "batched_positions": packed[k],
                "batched_scales": packed[2 + k],
                "batched_wxyzs": turns,
            }
            assign(node, values)


def _batch(scene: viser.SceneApi, name: str, mesh: Mesh, color: Rgb) -> viser.BatchedMeshHandle:
    """A node of some copies of a mesh of which the far side is drawn."""
    return scene.add_batched_meshes_simple(
        name,
        mesh.vertices,
        mesh.faces,
        np.array([[1.0, 0.0, 0.0, 0.0]]),
        np.zeros((1, 3)),
        batched_scales=np.ones((1, 3)),
        batched_colors=np.array(color, dtype=np.uint8),
        lod="off",
        side="back",
        cast_shadow=False,
        receive_shadow=False,
        visible=False,
    )


def _packed(values: Array) -> NDArray[np.float32]:
    """Values as they are sent."""
    return values.round(DIGITS).astype(np.float32)


def turned_to(directions: Array) -> Array:
    """Quaternions (n, 4) that take the x axis to directions (n, 3) by the shortest way: half the
    sum of 1 and the product of both, as Shoemake (1985) has it."""
    x, y, z = directions.T
    wxyz = np.stack([1.0 + x, np.zeros(len(x)), -z, y], axis=1)
    wxyz[x < -1.0 + 1e-9] = (0.0, 0.0, 1.0, 0.0)
    return np.asarray(wxyz / np.linalg.norm(wxyz, axis=1, keepdims=True))
