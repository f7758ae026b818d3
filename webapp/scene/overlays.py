"""What is drawn over the robot: pale blades, another method's arrows."""

import numpy as np
import viser

from finlab.allocation.allocation import Allocation
from finlab.layout import Fin, Layout
from webapp.handles import put
from webapp.scene.meshes import fin as fin_mesh
from webapp.scene.meshes.mesh import Mesh, force_arrow, joined
from webapp.scene.shape import Shape
from webapp.theme import DEAD, LIGHT, Rgb, look

LIFT = np.array([0.0, 0.0, 0.025])
"""The arrows stand a little above the fins' own ones, so that equal ones can be told apart [m]."""


class Ghost:
    """Blades of some fins: pale where they stood or one would land, full where a search puts them."""

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
    now = {fin.name: (fin.position, fin.mounting_angle) for fin in layout.fins}
    return tuple(fin for fin in other.fins if now.get(fin.name) != (fin.position, fin.mounting_angle))


def _blades(fins: tuple[Fin, ...]) -> Mesh:
    parts = []
    for fin in fins:
        turn = fin_mesh.mounting(fin.mounting_angle)
        for part in (fin_mesh.blade(), fin_mesh.shaft()):
            parts.append(Mesh(part.vertices @ turn.T + np.array(fin.position), part.faces))
    return joined(*parts)


class Overlay:
    """Forces of the fins by another method, as plain arrows beside the robot's own."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._shape = Shape(scene, "/robot/overlay", LIGHT.overlay, visible=False, cast_shadow=False)

    def refresh(self, answer: Allocation | None, scale: float, dark: bool) -> None:
        """Show an answer's forces, arrows of `scale` [m/N]; nothing for None."""
        put(self._shape.node, visible=answer is not None, color=look(dark).overlay)
        if answer is not None:
            place = answer.layout.position
            self._shape.show(_arrows, place, np.nan_to_num(answer.fin_forces) * scale)


def _arrows(place: np.ndarray, way: np.ndarray) -> Mesh:
    return joined(*(force_arrow(w, p + LIFT, 0.005) for p, w in zip(place, way, strict=True)))
