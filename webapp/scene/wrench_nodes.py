"""The whole robot's wrench above the hull: asked, delivered, and what is missing."""

import numpy as np
import viser
from numpy.typing import NDArray

from webapp.handles import put
from webapp.scene.meshes.arrows import NOTHING, RING_RADIUS, force_arrow, torque_ring
from webapp.scene.meshes.mesh import tube
from webapp.scene.shape import Shape
from webapp.theme import ASKED, DELIVERED, LIGHT, MISSING

Array = NDArray[np.float64]
HEIGHT = 0.16
"""How far above the hull the arrows begin [m]; inside it they could not be seen."""


class WrenchNodes:
    """Arrows and rings over a stalk that stands on the centre of gravity."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Build the nodes, showing nothing."""
        self._root = scene.add_frame("/robot/wrench", show_axes=False)
        stalk = tube(np.array([[0, 0, -HEIGHT - 0.2], [0, 0, 0.0]]), 0.0025, 10)
        scene.add_mesh_simple(
            "/robot/wrench/stalk", stalk.vertices, stalk.faces, color=LIGHT.line, cast_shadow=False
        )
        self._hub = scene.add_icosphere("/robot/wrench/hub", 0.012, color=(70, 78, 86), cast_shadow=False)

        def node(name: str, color: tuple[int, int, int], opacity: float | None) -> Shape:
            node = scene.add_mesh_simple(
                f"/robot/wrench/{name}",
                NOTHING.vertices,
                NOTHING.faces,
                color=color,
                opacity=opacity,
                cast_shadow=False,
                receive_shadow=False,
            )
            return Shape(node)

        self._asked = node("asked_force", ASKED, 0.4), node("asked_torque", ASKED, 0.4)
        self._given = node("delivered_force", DELIVERED, None), node("delivered_torque", DELIVERED, None)
        self._missing = node("missing_force", MISSING, None), node("missing_torque", MISSING, None)

    @staticmethod
    def hub(top: float) -> Array:
        """Where the arrows begin (3,), given the height of the hull's top [m]."""
        return np.array([0.0, 0.0, top + HEIGHT])

    def refresh(self, target: Array, wrench: Array | None, missing: Array, top: float, scale: float) -> None:
        """Show a target (6,) and what is delivered of it (6,), None while unknown.

        Args:
            target: asked wrench [N, N m].
            wrench: delivered wrench.
            missing: the part (6,) of the difference that matters enough to be drawn.
            top: height of the hull's top [m].
            scale: length of a force arrow per newton [m/N].
        """
        put(self._root, position=self.hub(top))
        zero = np.zeros(3)
        self._asked[0].show(force_arrow, target[:3] * scale, zero, 0.011)
        self._asked[1].show(torque_ring, target[3:], zero, 0.0085)
        given = np.zeros(6) if wrench is None else wrench
        self._given[0].show(force_arrow, given[:3] * scale, zero, 0.0065)
        self._given[1].show(torque_ring, given[3:], zero, 0.005)
        self._missing[0].show(force_arrow, missing[:3] * scale, given[:3] * scale, 0.006)
        self._missing[1].show(torque_ring, missing[3:], zero, 0.005, 1.35 * RING_RADIUS)
