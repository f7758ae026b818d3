"""What is drawn over the robot: pale blades."""

import numpy as np
import viser

from finlab.layout import Fin, Layout
from webapp.handles import put
from webapp.scene.meshes import fin as fin_mesh
from webapp.scene.meshes.mesh import Mesh, joined
from webapp.scene.shape import Shape
from webapp.theme import DEAD, Rgb


class Ghost:
    """Blades of some fins: pale where they stood, full where a search puts them."""

    def __init__(
        self, scene: viser.SceneApi, name: str, color: Rgb = DEAD, opacity: float | None = 0.3
    ) -> None:
        self._shape = Shape(scene, name, color, opacity=opacity, visible=False, cast_shadow=False)

    def show(self, fins: tuple[Fin, ...]) -> None:
        """Show fins; none hides the node."""
        put(self._shape.node, visible=bool(fins))
        if fins:
            self._shape.show(_blades, fins)


def moved_fins(other: Layout | None, layout: Layout) -> tuple[Fin, ...]:
    """The fins of another version of a layout that stand elsewhere now."""
    if other is None or other.name != layout.name:
        return ()
    now = {fin.name: (fin.position, fin.frame) for fin in layout.fins}
    return tuple(fin for fin in other.fins if now.get(fin.name) != (fin.position, fin.frame))


def _blades(fins: tuple[Fin, ...]) -> Mesh:
    parts = []
    for fin in fins:
        frame = np.array(fin.frame)
        for part in (fin_mesh.blade(), fin_mesh.shaft()):
            parts.append(Mesh(part.vertices @ frame + np.array(fin.position), part.faces))
    return joined(*parts)
