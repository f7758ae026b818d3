"""Forces of the fins by another method, as plain arrows beside the robot's own."""

import numpy as np
import viser

from finlab.allocation.allocation import Allocation
from webapp.handles import put
from webapp.scene.meshes.arrows import NOTHING, force_arrow
from webapp.scene.meshes.mesh import Mesh, joined
from webapp.scene.shape import Shape
from webapp.theme import overlay_color

LIFT = np.array([0.0, 0.0, 0.025])
"""The arrows stand a little above the fins' own ones, so that equal ones can be told apart [m]."""


class Overlay:
    """One node for all arrows."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Build the node, showing nothing."""
        self._shape = Shape(
            scene.add_mesh_simple(
                "/robot/overlay",
                NOTHING.vertices,
                NOTHING.faces,
                color=overlay_color(False),
                visible=False,
                cast_shadow=False,
            )
        )

    def refresh(self, answer: Allocation | None, scale: float, dark: bool) -> None:
        """Show an answer's forces, arrows of `scale` [m/N]; nothing for None."""
        put(self._shape.node, visible=answer is not None, color=overlay_color(dark))
        if answer is not None:
            place = answer.layout.position
            self._shape.show(_arrows, place, np.nan_to_num(answer.fin_forces) * scale)


def _arrows(place: np.ndarray, way: np.ndarray) -> Mesh:
    return joined(*(force_arrow(w, p + LIFT, 0.005) for p, w in zip(place, way, strict=True)))
