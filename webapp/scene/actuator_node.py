"""One actuator in the scene: its gizmo, and under it what moves and what holds it.

A fin beats, a foil is deflected, a propeller spins, a pod turns as well; `frames.js` moves them.
"""

import math
from collections.abc import Callable, Collection, Sequence
from typing import Any, NamedTuple

import numpy as np
import viser
from viser.transforms import SO3

from finlab.arrays import Array
from finlab.layout import Actuator, Layout
from finlab.swim.hull import Surface
from finlab.swim.hull.mesh_file import Mesh
from webapp.handles import set_properties
from webapp.scene import actuator_shapes as shapes
from webapp.scene.actuator_shapes import NOTHING, joined, tube
from webapp.scene.stage import Shape
from webapp.theme import DEAD, LIGHT, MISSING, fin_color

LABEL = 0.85
GIZMO_SIZE = 0.24
HELD: tuple[Any, ...] = (None, "cmd/ctrl", "shift")
"""Keys that may be held while an actuator is clicked; viser hears each by itself."""
TURNS_PER_S = 4.0
"""Of a propeller at its most force; faster ones would seem to turn back."""


class Motion(NamedTuple):
    """How an actuator moves; `frames.js` reads it in this order."""

    amplitude: float = 0.0
    """Half amplitude of a beat [rad]."""
    frequency: float = 0.0
    """Of the beat [Hz]."""
    angle: float = 0.0
    """Angle about the own first axis [rad]; a beat is about it."""
    turns: float = 0.0
    """Turns of a propeller per second."""
    along: int = 0
    """Own axis of the propeller: 0 or 1."""


def motion(actuator: Actuator, command: Sequence[float] | None) -> Motion:
    """How an actuator moves with a command (3,), and how it hangs where that is None."""
    along = int(actuator.KIND.drawn_as == "pod")
    if command is None:
        _, across, third = actuator.frame
        limp = math.atan2(third[2], across[2]) if actuator.KIND.drawn_as == "fin" else 0.0
        return Motion(angle=limp, along=along)  # the blade hangs as far down as it can
    if actuator.KIND.drawn_as == "fin":
        amplitude, frequency, angle = command
        return Motion(amplitude, frequency, angle)
    angle = command[actuator.KIND.stuck_number] if actuator.KIND.sticks_at_angle else 0.0
    if actuator.KIND.force_number is None:
        return Motion(angle=angle)
    force = command[actuator.KIND.force_number]
    most = (
        actuator.upper[actuator.KIND.force_number]
        if force >= 0.0
        else -actuator.lower[actuator.KIND.force_number]
    )
    # Thrust grows with the square of the speed.
    turns = (
        math.copysign(TURNS_PER_S * math.sqrt(min(abs(force) / most, 1.0)), force) if force else 0.0
    )
    return Motion(angle=angle, turns=turns, along=along)


def motions(
    layout: Layout, commands: Array, idle: Collection[str]
) -> tuple[list[bool], list[Motion]]:
    """Which actuators of a layout work, and how each of them moves.

    Args:
        layout: the robot.
        commands: of its actuators (n, 3); NaN where there is none.
        idle: names of those that are lost.
    """
    # Lists: a robot has few actuators, and an operation on an array takes as long as on ten.
    works: list[bool] = []
    moves: list[Motion] = []
    for actuator, row in zip(layout.actuators, commands.tolist(), strict=True):
        alive = actuator.name not in idle and math.isfinite(row[0])
        works.append(alive)
        moves.append(motion(actuator, row if alive else None))
    return works, moves


def _moving(looks: str, slenderness: float) -> Mesh:
    """What of an actuator turns about its first axis, in its own frame."""
    if looks == "foil":
        return shapes.foil(slenderness)
    return shapes.blade() if looks == "fin" else shapes.duct(int(looks == "pod"))


def _mount(looks: str, up: bool) -> Mesh:
    """What of an actuator stands still, in its own frame."""
    if looks == "thruster":
        return NOTHING
    if looks == "pod":
        return shapes.column(up)
    return shapes.stock() if looks == "foil" else shapes.shaft()


def _propeller(along: int) -> Mesh:
    return NOTHING if along < 0 else shapes.propeller(along)


def shape_of(actuator: Actuator, size: float) -> tuple[float, float]:
    """Slenderness of a foil, and how large an actuator is drawn; a foil by its area."""
    ratio, area = (
        (actuator.value("aspect_ratio"), actuator.value("area"))
        if actuator.KIND.drawn_as == "foil"
        else (None, None)
    )
    if ratio is None or area is None:
        return 1.0, size
    ratio = min(max(ratio, 0.5), 8.0) / 2.0
    span = math.sqrt(ratio * area)
    return round(ratio, 3), min(max(span, 0.05 * size), 0.3 * size)


class ActuatorNode:
    """The nodes of the actuator at one place of the layout. Made once; hidden while the layout has
    fewer."""

    def __init__(
        self,
        scene: viser.SceneApi,
        index: int,
        on_click: Callable[[int, bool], None],
        on_drag: Callable[[int, str, tuple[float, float, float]], None],
        robot: str = "/robot",
    ) -> None:
        """Build the nodes. `on_click` gets the index and whether Ctrl or Shift was held, `on_drag`
        the index, phase (`start`, `update`, `end`) and the position [m]; `robot` is the node of the
        robot."""
        name = f"{robot}/fins/{index}"
        # The arrows stay along the body's axes, like the numbers beside them.
        idle: dict[str, Any] = {"depth_test": False, "active_axes": (False,) * 3, "line_width": 3.5}
        self._move = scene.add_transform_controls(
            name, GIZMO_SIZE, disable_rotations=True, disable_sliders=True, **idle
        )
        self._axes = scene.add_frame(f"{name}/turn", show_axes=False)
        parent = f"{name}/turn"
        self._color = fin_color(index)
        self._moving = Shape(scene, f"{parent}/blade", self._color)
        self._spinning = Shape(scene, f"{parent}/blade/propeller", LIGHT.metal, side="double")
        self._mount = Shape(scene, f"{parent}/shaft", LIGHT.metal)
        self._pin = Shape(scene, f"{parent}/pin", MISSING)
        self._label = scene.add_label(
            f"{name}/label", str(index + 1), anchor="center-center", font_screen_scale=LABEL
        )
        self._strut = Shape(scene, f"{robot}/struts/{index}", LIGHT.metal)

        @self._move.on_update
        async def _dragged(event: Any) -> None:
            if event.client is not None:
                x, y, z = (float(v) for v in self._move.position)
                on_drag(index, event.phase, (x, y, z))

        for node in (self._moving.node, self._spinning.node, self._mount.node):
            for held in HELD:

                @node.on_click(modifier=held)
                async def _clicked(event: Any) -> None:
                    on_click(index, event.modifier is not None)

    def hide(self) -> None:
        """The layout has no actuator at this place."""
        set_properties(self._move, visible=False, active_axes=(False,) * 3)
        set_properties(self._strut.node, visible=False)

    def place(
        self,
        actuator: Actuator,
        hull: Surface,
        sizes: tuple[float, float],
        moved: bool,
        label: str,
        stuck: bool,
        owned_by_user: bool,
    ) -> None:
        """Show an actuator with its strut to the hull; `sizes` are of actuators and of arrows,
        `moved` shows its gizmo, whose pose is left alone while `owned_by_user`, `stuck` a pin that
        holds it."""
        frame = np.array(actuator.frame)
        position = np.array(actuator.position)
        size, arrows = sizes
        slenderness, scale = shape_of(actuator, size)
        is_fin = actuator.KIND.drawn_as == "fin"
        is_pod = actuator.KIND.drawn_as == "pod"
        inward = hull.anchor(position) - position
        self._moving.show(_moving, actuator.KIND.drawn_as, slenderness)
        self._mount.show(_mount, actuator.KIND.drawn_as, bool(inward @ frame[0] >= 0.0))
        self._spinning.show(
            _propeller, int(is_pod) if is_pod or actuator.KIND.drawn_as == "thruster" else -1
        )
        for shape in (self._moving, self._spinning, self._mount):
            set_properties(shape.node, scale=scale)
        self._pin.show(shapes.pin, size)
        set_properties(self._pin.node, visible=stuck)
        set_properties(
            self._move, visible=True, active_axes=(moved,) * 3, scale=GIZMO_SIZE * arrows
        )
        if not owned_by_user:
            set_properties(self._move, position=position)
            set_properties(self._axes, wxyz=np.asarray(SO3.from_matrix(frame.T).wxyz))
        set_properties(self._label, text=label, position=np.array([0.0, 0.0, 0.04 * size]))
        if is_fin:
            position = position - 0.03 * size * frame[0]
        elif is_pod:
            column = size * shapes.COLUMN[-1, 0] * frame[0]
            position = position + (column if inward @ frame[0] >= 0.0 else -column)
        self._strut.show(_strut, position, hull, 0.008 * size)
        set_properties(self._strut.node, visible=True)

    def command(self, alive: bool) -> None:
        """Show whether it works."""
        self._moving.node.color = self._color if alive else DEAD
        self._spinning.node.color = LIGHT.metal if alive else DEAD


def _strut(end: Array, hull: Surface, radius: float) -> Mesh:
    anchor = hull.anchor(end)
    if np.linalg.norm(anchor - end) < 5e-3:
        return NOTHING
    return tube(np.array([end, anchor]), radius, 12)


def offered_mesh(actuators: tuple[Actuator, ...], size: float) -> Mesh:
    """Actuators that a search would put elsewhere, as one mesh for the ghost beside the robot.

    Args:
        actuators: of the layout that is offered, drawn at rest.
        size: of the shapes, as `part_size` of the layout has it.
    """
    meshes = []
    for actuator in actuators:
        slenderness, scale = shape_of(actuator, size)
        for mesh in (
            _moving(actuator.KIND.drawn_as, slenderness),
            _mount(actuator.KIND.drawn_as, True),
        ):
            meshes.append(
                Mesh(
                    scale * mesh.vertices @ np.array(actuator.frame) + np.array(actuator.position),
                    mesh.faces,
                )
            )
    return joined(*meshes)
