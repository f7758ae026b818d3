"""One fin in the scene: its gizmos, and under them blade, sweep and force, so that all follow a drag."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from finlab.layout import Fin
from webapp.handles import put
from webapp.scene.meshes import fin as fin_mesh
from webapp.scene.meshes.arrows import NOTHING, force_arrow
from webapp.scene.meshes.hull import AnyHull
from webapp.scene.meshes.mesh import Mesh, tube
from webapp.scene.shape import Shape
from webapp.theme import DEAD, LIGHT, Rgb, fin_color

Array = NDArray[np.float64]
GIZMO_SIZE = 0.24
RING_SIZE = 0.20


class FinNode:
    """The nodes of the fin at one place of the layout. Made once; hidden while the layout has fewer fins."""

    def __init__(
        self,
        scene: viser.SceneApi,
        index: int,
        on_click: Callable[[int], None],
        on_drag: Callable[[int, str, tuple[float, float, float], float], None],
    ) -> None:
        """Build the nodes.

        Args:
            scene: the client's scene.
            index: place of the fin in the layout.
            on_click: called with the index when the fin is clicked.
            on_drag: called with index, phase (`start`, `update`, `end`), position [m] and angle [rad].
        """
        self._color = fin_color(index)
        self._angle: float | None = None
        name = f"/robot/fins/{index}"
        # Only the ring turns; the arrows stay along the body's axes, like the numbers beside them.
        self._move = scene.add_transform_controls(
            name,
            GIZMO_SIZE,
            line_width=3.5,
            depth_test=False,
            disable_rotations=True,
            disable_sliders=True,
            active_axes=(False,) * 3,
        )
        self._turn = scene.add_transform_controls(
            f"{name}/turn",
            RING_SIZE,
            line_width=4.0,
            depth_test=False,
            disable_axes=True,
            disable_sliders=True,
            active_axes=(False,) * 3,
        )
        blade, shaft = fin_mesh.blade(), fin_mesh.shaft()
        self._blade = scene.add_mesh_simple(
            f"{name}/turn/blade", blade.vertices, blade.faces, color=self._color
        )
        self._shaft = scene.add_mesh_simple(
            f"{name}/turn/shaft", shaft.vertices, shaft.faces, color=LIGHT.metal
        )
        fan = fin_mesh.sweep(0.1)
        self._fan = Shape(
            scene.add_mesh_simple(
                f"{name}/turn/fan",
                fan.vertices,
                fan.faces,
                color=self._color,
                opacity=0.3,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
        )
        self._force = Shape(
            scene.add_mesh_simple(
                f"{name}/turn/force", NOTHING.vertices, NOTHING.faces, color=self._color, cast_shadow=False
            )
        )
        self._label = scene.add_label(
            f"{name}/label", str(index + 1), anchor="center-center", font_screen_scale=0.85
        )
        self._strut = Shape(
            scene.add_mesh_simple(
                f"/robot/struts/{index}", NOTHING.vertices, NOTHING.faces, color=LIGHT.metal
            )
        )

        for node in (self._blade, self._shaft):

            @node.on_click
            async def _clicked(event: Any) -> None:
                on_click(index)

        for gizmo in (self._move, self._turn):

            @gizmo.on_update
            async def _dragged(event: Any) -> None:
                if event.client is not None:
                    on_drag(index, event.phase, *self.pose())

    def pose(self) -> tuple[tuple[float, float, float], float]:
        """Position [m] and mounting angle [rad] as they stand in the scene."""
        x, y, z = (float(v) for v in self._move.position)
        w, _, _, sin_half = (float(v) for v in self._turn.wxyz)
        return (x, y, z), 2.0 * math.atan2(sin_half, w)

    def hide(self) -> None:
        """The layout has no fin at this place."""
        put(self._move, visible=False, active_axes=(False,) * 3)
        put(self._turn, active_axes=(False,) * 3)
        put(self._strut.node, visible=False)

    def place(self, fin: Fin, hull: AnyHull, selected: bool, label: str | None, owned_by_user: bool) -> None:
        """Show a fin.

        Args:
            fin: the fin.
            hull: what its strut ends at.
            selected: whether its gizmos are shown.
            label: text at its root, None for none.
            owned_by_user: True while it is dragged; the gizmo's pose is then left alone.
        """
        put(self._move, visible=True, active_axes=(selected,) * 3)
        put(self._turn, active_axes=(selected, selected, False))
        if not owned_by_user:
            half = fin.mounting_angle / 2
            put(self._move, position=np.array(fin.position))
            put(self._turn, wxyz=np.array([math.cos(half), 0.0, 0.0, math.sin(half)]))
        put(self._label, visible=label is not None, text=label or "")
        put(self._label, position=np.array([0.0, 0.0, 0.04]))
        shaft = np.array([math.cos(fin.mounting_angle), math.sin(fin.mounting_angle), 0.0])
        servo = np.array(fin.position) - 0.03 * shaft
        self._strut.show(_strut, servo, hull)
        put(self._strut.node, visible=True)

    def command(self, command: Array | None, arrow: Array, mounting_angle: float, fans: bool) -> None:
        """Show a command (3,), None for a failed fin, and its force as a body-frame arrow (3,) [m]."""
        alive = command is not None
        color: Rgb = self._color if alive else DEAD
        put(self._blade, color=color)
        put(self._fan.node, visible=fans and alive)
        put(self._force.node, visible=alive)
        if command is None:
            return
        self._fan.show(fin_mesh.sweep, float(command[0]))
        half = command[2] / 2
        put(self._fan.node, wxyz=np.array([math.cos(half), math.sin(half), 0.0, 0.0]))
        cos, sin = math.cos(mounting_angle), math.sin(mounting_angle)
        in_fin_frame = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ arrow
        root = np.array([fin_mesh.ROOT + fin_mesh.SPAN / 2, 0.0, 0.0])
        self._force.show(force_arrow, in_fin_frame, root, 0.007)

    def pose_blade(self, angle: float) -> None:
        """Turn the blade about its shaft to an angle [rad]; one that rests is not sent again."""
        if angle == self._angle:
            return
        self._angle = angle
        self._blade.wxyz = (math.cos(angle / 2), math.sin(angle / 2), 0.0, 0.0)


def _strut(servo: Array, hull: AnyHull) -> Mesh:
    """A rod from the servo to the hull, nothing where the servo already sits in it."""
    anchor = hull.anchor(servo)
    if np.linalg.norm(anchor - servo) < 5e-3:
        return NOTHING
    return tube(np.array([servo, anchor]), 0.008, 12)
