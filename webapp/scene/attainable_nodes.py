"""Sets of attainable forces or torques as glass bodies around the centre of gravity."""

import numpy as np
import viser
from numpy.typing import NDArray

from finlab.analysis import AttainableSet
from webapp.handles import put
from webapp.scene.meshes.arrows import NOTHING
from webapp.scene.meshes.mesh import Mesh, tube
from webapp.scene.shape import Shape
from webapp.tasks.analyst import Findings
from webapp.theme import ASKED, DEAD, DELIVERED

Array = NDArray[np.float64]
LARGEST = 0.42
"""How far the drawn set may reach from the centre of gravity [m]."""


class AttainableNodes:
    """Green for the working fins, grey for all fins where one has failed, a blue ball for what is asked."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Build the nodes, showing nothing."""

        def glass(name: str, color: tuple[int, int, int], opacity: float) -> Shape:
            node = scene.add_mesh_simple(
                name,
                NOTHING.vertices,
                NOTHING.faces,
                color=color,
                opacity=opacity,
                side="double",
                visible=False,
                cast_shadow=False,
                receive_shadow=False,
            )
            return Shape(node)

        self._now = glass("/robot/attainable/now", DELIVERED, 0.34)
        self._whole = glass("/robot/attainable/whole", DEAD, 0.16)
        self._asked = scene.add_icosphere(
            "/robot/attainable/asked", 0.018, color=ASKED, visible=False, cast_shadow=False
        )

    def refresh(self, findings: Findings | None, target: Array) -> None:
        """Show the sets of findings, nothing for None; the ball marks what `target` (6,) asks in them."""
        now = None if findings is None else findings.now
        whole = None if findings is None else findings.whole
        for shape, body in ((self._now, now), (self._whole, whole)):
            put(shape.node, visible=body is not None)
        put(self._asked, visible=now is not None)
        if findings is None or now is None:
            return
        scale = set_scale(findings)
        for shape, body in ((self._now, now), (self._whole, whole)):
            if body is not None:
                shape.show(_body, body.vertices * scale, body.faces, body.outline)
        part = target[:3] if now.kind == "force" else target[3:]
        put(self._asked, position=np.asarray(part * scale))


def set_scale(findings: Findings) -> float:
    """Metres per newton, or per newton metre, of the drawn sets."""
    bodies: list[AttainableSet] = [s for s in (findings.now, findings.whole) if s is not None]
    reach = max((float(np.linalg.norm(s.vertices, axis=-1).max()) for s in bodies), default=1.0)
    return LARGEST / reach if reach > 1e-9 else 1.0


def _body(vertices: Array, faces: NDArray[np.intp], outline: NDArray[np.intp]) -> Mesh:
    if len(faces):
        return Mesh(vertices, faces.astype(np.int32))
    if len(outline) == 2:
        return tube(vertices[outline], 0.006)
    if len(outline) > 2:  # a fan; the node shows both sides
        fan = [(outline[0], outline[k], outline[k + 1]) for k in range(1, len(outline) - 1)]
        return Mesh(vertices, np.array(fan, dtype=np.int32))
    return NOTHING
