"""Pale blades: where fins stood, where a search would put them, or where one in the hand would land."""

import math

import numpy as np
import viser

from finlab.layout import Fin, Layout
from webapp.handles import put
from webapp.scene.meshes import fin as fin_mesh
from webapp.scene.meshes.arrows import NOTHING
from webapp.scene.meshes.mesh import Mesh, joined
from webapp.scene.shape import Shape
from webapp.theme import DEAD, Rgb


class Ghost:
    """One node for all of them."""

    def __init__(self, scene: viser.SceneApi, name: str, color: Rgb = DEAD, opacity: float = 0.3) -> None:
        """Build the node, showing nothing."""
        self._shape = Shape(
            scene.add_mesh_simple(
                name,
                NOTHING.vertices,
                NOTHING.faces,
                color=color,
                opacity=opacity,
                visible=False,
                cast_shadow=False,
                receive_shadow=False,
            )
        )

    def show(self, fins: tuple[Fin, ...]) -> None:
        """Show fins; none hides the node."""
        put(self._shape.node, visible=bool(fins))
        if fins:
            self._shape.show(_blades, fins)


def moved_fins(other: Layout | None, layout: Layout) -> tuple[Fin, ...]:
    """The fins of another version of a layout that stand elsewhere now."""
    return () if other is None or other.name != layout.name else _left(other, layout)


def _left(saved: Layout, layout: Layout) -> tuple[Fin, ...]:
    now = {fin.name: (fin.position, fin.mounting_angle) for fin in layout.fins}
    return tuple(fin for fin in saved.fins if now.get(fin.name) != (fin.position, fin.mounting_angle))


def _blades(fins: tuple[Fin, ...]) -> Mesh:
    parts = []
    for fin in fins:
        cos, sin = math.cos(fin.mounting_angle), math.sin(fin.mounting_angle)
        turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        for part in (fin_mesh.blade(), fin_mesh.shaft()):
            parts.append(Mesh(part.vertices @ turn.T + np.array(fin.position), part.faces))
    return joined(*parts)
