"""Pale blades: where fins stood when the layout was opened or saved, or where a search would put them."""

import math

import numpy as np
import viser

from finlab.layout import Fin, Layout
from webapp.handles import put
from webapp.meshes import fin as fin_mesh
from webapp.meshes.arrows import NOTHING
from webapp.meshes.mesh import Mesh, joined
from webapp.scene.shape import Shape
from webapp.theme import DEAD


class Ghost:
    """One node for all of them."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Build the node, showing nothing."""
        self._shape = Shape(
            scene.add_mesh_simple(
                "/ghost",
                NOTHING.vertices,
                NOTHING.faces,
                color=DEAD,
                opacity=0.3,
                visible=False,
                cast_shadow=False,
                receive_shadow=False,
            )
        )

    def refresh(self, saved: Layout | None, layout: Layout) -> None:
        """Show the fins of another version, `saved`, that stand elsewhere in `layout`; nothing for None."""
        left = () if saved is None or saved.name != layout.name else _left(saved, layout)
        put(self._shape.node, visible=bool(left))
        if left:
            self._shape.show(_blades, left)


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
