"""One actuator in the scene: its gizmos, and under them what moves, its sweep and its force.

A fin or a rudder is a blade, a thruster a duct. Gizmos, sweep and beat are for fins.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import viser
from viser.transforms import SO3

from finlab.arrays import Array
from finlab.layout import Actuator, Azimuth, Fin, Rudder, Thruster
from webapp.handles import put
from webapp.scene.meshes import fin as fin_mesh
from webapp.scene.meshes.hull import AnyHull
from webapp.scene.meshes.mesh import NOTHING, Mesh, force_arrow, tube
from webapp.scene.stage import Shape
from webapp.theme import DEAD, LIGHT, fin_color

LABEL = 0.85
GIZMO_SIZE = 0.24
RING_SIZE = 0.20
HELD: tuple[Any, ...] = (None, "cmd/ctrl", "shift")
"""Keys that may be held while a fin is clicked; viser hears each by itself."""


def _moving_part(kind: type[Actuator]) -> Mesh:
    """What of an actuator moves, in its own frame."""
    if issubclass(kind, (Thruster, Azimuth)):
        return fin_mesh.duct() if issubclass(kind, Thruster) else fin_mesh.pod()
    return fin_mesh.blade()


def motion(parts: Sequence[Actuator], command: Array) -> Array:
    """How actuators move (n, 3), as a fin's half amplitude [rad], frequency [Hz] and direction [rad]: others
    only turn to an angle, or not at all."""
    moving = command.copy()
    for row, part in zip(moving, parts, strict=True):
        if not isinstance(part, Fin):
            angle = 0.0 if isinstance(part, Thruster) else row[0]
            row[:] = 0.0 * row[0], 0.0, angle
    return moving


def add_gizmo(
    scene: viser.SceneApi, name: str, size: float, on_drag: Callable[[str], None], **options: Any
) -> viser.TransformControlsHandle:
    """A gizmo that shows through everything, idle at first; `on_drag` gets `start`, `update` and `end`."""
    gizmo = scene.add_transform_controls(name, size, depth_test=False, active_axes=(False,) * 3, **options)

    @gizmo.on_update
    async def _dragged(event: Any) -> None:
        if event.client is not None:
            on_drag(event.phase)

    return gizmo


class FinNode:
    """The nodes of the fin at one place of the layout. Made once; hidden while the layout has fewer fins."""

    def __init__(
        self,
        scene: viser.SceneApi,
        index: int,
        on_click: Callable[[int, bool], None],
        on_drag: Callable[[int, str, tuple[float, float, float], float], None],
    ) -> None:
        """Build the nodes.

        Args:
            scene: the client's scene.
            index: place of the fin in the layout.
            on_click: called with the index when the fin is clicked, and whether Ctrl or Shift was held.
            on_drag: called with index, phase (`start`, `update`, `end`), position [m] and angle [rad].
        """
        name = f"/robot/fins/{index}"

        def dragged(phase: str) -> None:
            on_drag(index, phase, *self.pose())

        # Only the ring turns; the arrows stay along the body's axes, like the numbers beside them.
        arrows = {"line_width": 3.5, "disable_rotations": True, "disable_sliders": True}
        ring = {"line_width": 4.0, "disable_axes": True, "disable_sliders": True}
        self._move = add_gizmo(scene, name, GIZMO_SIZE, dragged, **arrows)
        self._turn = add_gizmo(scene, f"{name}/turn", RING_SIZE, dragged, **ring)
        parent, self._color = f"{name}/turn", fin_color(index)
        self._blade = Shape(scene, f"{parent}/blade", self._color)
        self._shaft = Shape(scene, f"{parent}/shaft", LIGHT.metal, fin_mesh.shaft()).node
        self._force = Shape(scene, f"{parent}/force", self._color, cast_shadow=False)
        fan: dict[str, Any] = {"opacity": 0.3, "side": "double", "cast_shadow": False}
        self._fan = Shape(scene, f"{parent}/fan", self._color, fin_mesh.sweep(0.1), **fan)
        self._label = scene.add_label(
            f"{name}/label", str(index + 1), anchor="center-center", font_screen_scale=LABEL
        )
        self._strut = Shape(scene, f"/robot/struts/{index}", LIGHT.metal)

        for node in (self._blade.node, self._shaft):
            for held in HELD:

                @node.on_click(modifier=held)
                async def _clicked(event: Any) -> None:
                    on_click(index, event.modifier is not None)

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

    def place(self, part: Actuator, hull: AnyHull, selected: bool, label: str, owned_by_user: bool) -> None:
        """Show an actuator.

        Args:
            part: the actuator.
            hull: what its strut ends at.
            selected: whether its gizmos are shown.
            label: text at its root.
            owned_by_user: True while it is dragged; the gizmo's pose is then left alone.
        """
        frame, is_blade = np.array(part.frame), isinstance(part, (Fin, Rudder))
        put(self._shaft, visible=is_blade)
        self._blade.show(_moving_part, type(part))
        self._root = np.array([fin_mesh.ROOT + fin_mesh.SPAN / 2 if is_blade else 0.0, 0.0, 0.0])
        put(self._move, visible=True, active_axes=(selected,) * 3)
        level = isinstance(part, Fin) and part.mounting_angle is not None
        put(self._turn, active_axes=(selected and level, selected and level, False))
        if not owned_by_user:
            put(self._move, position=np.array(part.position))
            put(self._turn, wxyz=np.asarray(SO3.from_matrix(frame.T).wxyz))
        put(self._label, text=label, position=np.array([0.0, 0.0, 0.04]))
        servo = np.array(part.position) - (0.03 if is_blade else 0.0) * frame[0]
        self._strut.show(_strut, servo, hull)
        put(self._strut.node, visible=True)

    def command(self, command: Array | None, arrow: Array, frame: Array) -> None:
        """Show a motion (3,), None for what has failed, and its force as a body-frame arrow (3,) [m], given
        the own axes (3, 3)."""
        alive = command is not None
        put(self._blade.node, color=self._color if alive else DEAD)
        put(self._force.node, visible=alive)
        put(self._fan.node, visible=command is not None and bool(command[0] > 0.0))
        if command is not None:
            half = float(command[2]) / 2
            self._fan.show(fin_mesh.sweep, float(command[0]))
            put(self._fan.node, wxyz=np.array([math.cos(half), math.sin(half), 0.0, 0.0]))
            self._force.show(force_arrow, frame @ arrow, self._root, 0.007)


def _strut(servo: Array, hull: AnyHull) -> Mesh:
    """A rod from the servo to the hull, nothing where the servo already sits in it."""
    anchor = hull.anchor(servo)
    if np.linalg.norm(anchor - servo) < 5e-3:
        return NOTHING
    return tube(np.array([servo, anchor]), 0.008, 12)
