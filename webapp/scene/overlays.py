"""What is drawn over the robot: where a search would put its fins."""

import numpy as np
import viser

from finlab.layout import Fin, Layout
from webapp.handles import put
from webapp.scene.meshes import fin as fin_mesh
from webapp.scene.meshes.mesh import Mesh, joined
from webapp.scene.shape import Shape
from webapp.theme import DELIVERED


class Offered:
    """Blades of the fins that a search would put elsewhere, where it would put them."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._shape = Shape(scene, "/robot/proposed", DELIVERED, visible=False, cast_shadow=False)

    def show(self, other: Layout | None, layout: Layout) -> None:
        """Show the fins of a better version of a layout that stand elsewhere now; None hides the node."""
        now = {fin.name: (fin.position, fin.frame) for fin in layout.fins}
        fins = () if other is None or other.name != layout.name else other.fins
        moved = tuple(fin for fin in fins if now.get(fin.name) != (fin.position, fin.frame))
        put(self._shape.node, visible=bool(moved))
        if moved:
            self._shape.show(_blades, moved)


def _blades(fins: tuple[Fin, ...]) -> Mesh:
    parts = []
    for fin in fins:
        frame = np.array(fin.frame)
        for part in (fin_mesh.blade(), fin_mesh.shaft()):
            parts.append(Mesh(part.vertices @ frame + np.array(fin.position), part.faces))
    return joined(*parts)
