"""Nodes of the target wrench, and the needle by which the selected actuator is turned."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray

from finlab.allocation.allocation import Allocation
from finlab.analysis import AttainableSet
from finlab.arrays import Array
from finlab.swim.hull.mesh_file import Mesh
from webapp.handles import set_properties
from webapp.markup.words import missing_part
from webapp.scene.actuator_shapes import NOTHING, SHORTEST, tube, unit_ring
from webapp.scene.force_nodes import Arrows, linear, linear_of, quaternion
from webapp.scene.outline import DIGITS, Outline
from webapp.scene.stage import Shape
from webapp.tasks.analysing import Analysis
from webapp.tasks.swimmer import Swimmer
from webapp.theme import ASKED, DEAD, DELIVERED, LIGHT, MISSING, REACH, Rgb
from webapp.viser_internals import assign

NEWTONS = tuple([digit * 10.0**power for power in range(-2, 7) for digit in (1.0, 2.0, 5.0)])
"""Forces [N] that an arrow of 0.1 m may stand for."""
LENGTH = 0.1
"""Length that the legend speaks of [m]."""
ARROWS = (0.1, 0.3)
"""The longest arrow stays within these [m]; between them the scale is left alone, so it seldom
jumps."""

ACTUATOR_ARROWS = (0.07, 0.2)
"""The same for the forces of actuators [m], which have a scale of their own: of thirty that push
together none could be seen on that of their sum."""

TORQUES = NEWTONS
"""Torques [N m] that a ring of a radius of 0.1 m may stand for."""
RINGS = (0.05, 0.16)
"""The largest ring's radius stays within these [m]."""
HEIGHT = 0.16
"""How far above the hull the arrows begin [m]; inside it they could not be seen."""
FORCE_THICKNESS = 0.0075
"""Radius of the shafts of the wrench's force, for size 1 [m]."""
ASKED_MARGIN = 0.0042
"""How far what is asked stands off what is delivered, for size 1 [m]."""
FORCE_COLORS = linear([DELIVERED, MISSING])
"""Of the arrows of the delivered and of the missing force (2, 3), in linear light."""
NO_LENGTH = (0.0, 0.0, 0.0)
"""A vector of no length [m]."""
LEAST_TURN = 1e-4
"""Change of a component of a direction up to which a mesh is not turned [1]."""
NEGLIGIBLE = 1e-4
"""Share of what a robot can push below which a force or torque sets no scale: fins that idle are
not drawn as if they pushed."""
LARGEST = 0.42
"""How far the drawn set may reach from the centre of gravity [m]."""


class Scale(NamedTuple):
    """What lengths in the view stand for."""

    newtons: float
    """Force of an arrow of 0.1 m [N]."""
    torque: float
    """Torque of a ring of a radius of 0.1 m [N m]."""
    actuator: float
    """Force of an actuator's arrow of 0.1 m [N]."""


def fitting_scale(
    target: Sequence[float], shown_allocation: Allocation | None, now: Scale
) -> Scale:
    """The scale for a target (6,) and what is shown of it; `now` as far as that is good enough."""
    force = math.hypot(*target[:3])
    torque = math.hypot(*target[3:])
    actuator_force = 0.0
    if shown_allocation is not None:
        wrench = shown_allocation.wrench.tolist()
        missing = missing_part(shown_allocation)
        force = max(force, math.hypot(*wrench[:3]))
        torque = max(torque, math.hypot(*missing[3:]), math.hypot(*wrench[3:]))
        actuator_force = max([math.hypot(*f) for f in shown_allocation.forces.tolist()])
        least_force = NEGLIGIBLE * shown_allocation.scale[0]
        if force < least_force:
            force = 0.0
        if actuator_force < least_force:
            actuator_force = 0.0
        if torque < NEGLIGIBLE * shown_allocation.scale[3]:
            torque = 0.0
    return _scale(force, torque, actuator_force, now)


def _scale(force: float, torque: float, actuator_force: float, now: Scale) -> Scale:
    """The scale of which the largest force [N], torque [N m] and force of an actuator [N] fit."""
    return Scale(
        fitting(NEWTONS, force, now.newtons, LENGTH, ARROWS),
        fitting(TORQUES, torque, now.torque, LENGTH, RINGS),
        fitting(NEWTONS, actuator_force, now.actuator, LENGTH, ACTUATOR_ARROWS),
    )


def fixed_scale(reach: Sequence[float], full_thrust: float, now: Scale) -> Scale:
    """The scale of the most that a robot can give, on which answers compare.

    Args:
        reach: largest size of each component of its wrench (6,) [N, N m].
        full_thrust: largest force of an actuator [N].
        now: the scale so far.
    """
    return _scale(max(reach[:3]), max(reach[3:]), full_thrust, now)


def fitting(
    steps: Sequence[float], largest: float, current: float, unit: float, ends: tuple[float, float]
) -> float:
    """What `unit` [m] in the view stands for, one of `steps`, so that `largest` ends within two
    ends; `current` while that is good enough, or next to nothing is shown."""
    if largest < steps[0] / 100.0 or ends[0] <= unit * largest / current <= ends[1]:
        return current
    return next((step for step in steps if unit * largest / step <= ends[1]), steps[-1])


def swim_scale(swimmer: Swimmer, previous: Scale) -> Scale:
    """The scale of a swim, which only grows, so that its arrows compare; `before` is the last
    one."""
    moment = swimmer.visible_moment
    sizes = [float(np.linalg.norm(v)) for v in (moment.asked[:3], moment.delivered[:3])]
    actuator_force = float(np.linalg.norm(moment.force, axis=-1).max())
    newtons = _least_step(max(sizes), ARROWS[1])
    actuator = _least_step(actuator_force, ACTUATOR_ARROWS[1])
    return Scale(max(newtons, previous.newtons), 1.0, max(actuator, previous.actuator))


def _least_step(force: float, longest: float) -> float:
    """The first of `NEWTONS` by which an arrow of a force [N] is no longer than `longest` [m]."""
    return next((step for step in NEWTONS if LENGTH * force / step <= longest), NEWTONS[-1])


class WrenchNodes:
    """Arrows and rings over a stalk that stands on the centre of gravity."""

    def __init__(self, scene: viser.SceneApi, robot: str = "/robot") -> None:
        """Nothing is shown yet; `robot` is the node of the robot."""
        name = f"{robot}/wrench"
        self._root = scene.add_frame(name, show_axes=False)
        stalk = tube(np.array([[0, 0, -HEIGHT - 0.2], [0, 0, 0.0]]), 0.0025, 10)
        self._nodes: list[viser.MeshHandle | viser.IcosphereHandle] = [
            Shape(scene, f"{name}/stalk", LIGHT.line, stalk, cast_shadow=False).node,
            scene.add_icosphere(f"{name}/hub", 0.012, color=(70, 78, 86), cast_shadow=False),
        ]

        def part(word: str, color: Rgb, mesh: Mesh, side: str = "front") -> viser.MeshHandle:
            shape = Shape(scene, f"{name}/{word}", color, mesh, side=side, cast_shadow=False)
            return shape.node

        self._forces = Arrows(scene, f"{name}/forces", FORCE_THICKNESS)
        # What is asked frames what is delivered, and is seen where both are one.
        self._asked_force = Outline(
            scene, f"{name}/asked_force", FORCE_THICKNESS, ASKED_MARGIN, linear_of(ASKED)
        )
        rings = (
            part("asked_torque", ASKED, unit_ring(0.075), side="back"),
            part("delivered_torque", DELIVERED, unit_ring(0.042)),
            part("missing_torque", MISSING, unit_ring(0.05)),
        )
        self._torques = [UnitMesh(ring, about_z) for ring in rings]
        self._placed: tuple[float, float] | None = None
        """Top of the hull [m] and size that the nodes stand for."""

    def thicken(self, factor: float) -> None:
        """Draw the arrows of forces thicker by a factor."""
        self._forces.thicken(factor)
        self._asked_force.thicken(factor)

    def refresh(
        self,
        target: Sequence[float],
        got: Sequence[float],
        missing: Sequence[float],
        top: float,
        scale: float,
        turn: float,
        size: float,
    ) -> str:
        """Show a target (6,) [N, N m], what is delivered of it (zero while unknown), and what is
        missing enough to be drawn; `top` is the hull's [m], `scale` of arrows [m/N], `turn` of
        rings [m/(N m)].

        Returns:
            A script that tells the page where the outline ends; empty where it knows.
        """
        if (top, size) != self._placed:
            self._placed = top, size
            self._root.position = np.array([0.0, 0.0, top + HEIGHT * size])
            for node in self._nodes:
                set_properties(node, scale=size)
        length_scale = size * scale
        # Component by component: operations on arrays of three take longer.
        Fx, Fy, Fz = got[:3]
        delivered = length_scale * Fx, length_scale * Fy, length_scale * Fz
        Fx, Fy, Fz = missing[:3]
        left = length_scale * Fx, length_scale * Fy, length_scale * Fz
        # The missing force begins where the delivered one ends.
        self._forces.show(
            np.array([NO_LENGTH, delivered]), np.array([delivered, left]), FORCE_COLORS, size
        )
        Fx, Fy, Fz = target[:3]
        asked_force = length_scale * Fx, length_scale * Fy, length_scale * Fz
        script = self._asked_force.show(np.zeros((1, 3)), np.array([asked_force]), size)
        for ring, wrench in zip(self._torques, (target, got, missing), strict=True):
            torque = wrench[3:]
            length = math.hypot(*torque)
            radius = round(size * turn * length, DIGITS)
            ring.show(torque, length, (radius, radius, radius))
        return script


class UnitMesh:
    """A mesh that is sent once, and then turned and scaled."""

    def __init__(self, node: viser.MeshHandle, turn: Callable[[Array], Array]) -> None:
        """`turn` gives the rotation (3, 3) for a direction (3,)."""
        self.node = node
        self._turn = turn
        self._direction: Sequence[float] = NO_LENGTH
        self._scale = (0.0, 0.0, 0.0)
        self._is_visible = True

    def show(
        self, vector: Sequence[float], length: float, scale: tuple[float, float, float]
    ) -> None:
        """Turn the mesh to a vector and scale it; one of no length is hidden.

        Args:
            vector: where it points (3,).
            length: of that vector.
            scale: of the mesh along its own axes.
        """
        is_visible = scale[0] > SHORTEST
        if is_visible != self._is_visible:
            self.node.visible = self._is_visible = is_visible
        if not is_visible:
            return
        if scale != self._scale:
            self._scale = scale
            assign(self.node, {"scale": scale})
        x, y, z = vector
        x /= length
        y /= length
        z /= length
        old_x, old_y, old_z = self._direction
        if max(abs(x - old_x), abs(y - old_y), abs(z - old_z)) > LEAST_TURN:
            direction = self._direction = x, y, z
            self.node.wxyz = quaternion(self._turn(np.array(direction)))


def along_x(direction: Array) -> Array:
    """A rotation (3, 3) that takes the x axis to a direction (3,)."""
    across = np.eye(3)[int(np.argmin(np.abs(direction)))]
    side = _cross(direction, across)
    side /= np.linalg.norm(side)
    return np.stack([direction, side, _cross(direction, side)], axis=1)


def about_z(axis: Array) -> Array:
    """A rotation (3, 3) that takes the z axis to a direction (3,), and the x axis astern as far as
    it goes.

    So a ring begins out of the way of the force's arrow, which mostly points ahead.
    """
    astern = np.array([-1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    perpendicular = astern - axis * (astern @ axis)
    perpendicular /= np.linalg.norm(perpendicular)
    return np.stack([perpendicular, _cross(axis, perpendicular), axis], axis=1)


def _cross(a: Array, b: Array) -> Array:
    """The cross product of two vectors (3,); numpy's own takes ten times as long."""
    return a[[1, 2, 0]] * b[[2, 0, 1]] - a[[2, 0, 1]] * b[[1, 2, 0]]


class AttainableNodes:
    """Sand for what works, grey for all where something is lost, a blue ball for what is
    asked."""

    def __init__(self, scene: viser.SceneApi) -> None:

        def glass(name: str, color: tuple[int, int, int], opacity: float) -> Shape:
            return Shape(
                scene, name, color, opacity=opacity, side="double", visible=False, cast_shadow=False
            )

        self._now = glass("/robot/attainable/now", REACH, 0.34)
        self._whole = glass("/robot/attainable/whole", DEAD, 0.16)
        self._asked = scene.add_icosphere(
            "/robot/attainable/asked", 0.018, color=ASKED, visible=False, cast_shadow=False
        )

    def refresh(
        self, analysis: Analysis | None, better: AttainableSet | None, target: Array, size: float
    ) -> None:
        """Show the sets of analysis, nothing for None, as large as `size` says, or a better one
        around the present one; the ball marks what `target` (6,) [N, N m] asks in them."""
        if analysis is None and not (self._now.node.visible or self._whole.node.visible):
            return
        now, full = (None, None) if analysis is None else (analysis.now, analysis.whole)
        if now is not None and better is not None:
            now, full = better, now
        scale = 1.0 if analysis is None else set_scale(analysis)
        for shape, body in ((self._now, now), (self._whole, full)):
            set_properties(shape.node, visible=body is not None, scale=size)
            if body is not None:
                shape.show(_body, body.vertices * scale, body.faces, body.outline)
        set_properties(self._asked, visible=now is not None, scale=size)
        if now is None:
            return
        part = target[:3] if now.kind == "force" else target[3:]
        set_properties(self._asked, position=np.asarray(part * scale * size))


def set_scale(analysis: Analysis) -> float:
    """Metres per newton, or per newton metre, of the drawn sets."""
    bodies: list[AttainableSet] = [s for s in (analysis.now, analysis.whole) if s is not None]
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


NEEDLE = 0.3
"""From the actuator to the tip [m], for size 1."""
TIP, TAIL = 0.02, 0.012
"""Radii of the ends [m], for size 1; where the robot is before one of them, the other one is
free."""
SNAP = np.cos(np.radians(5.0))
"""Cosine of the angle up to which the needle jumps to an axis of the body."""


class DirectionHandle:
    """Needle and ends; hidden while nothing that can be turned is selected."""

    def __init__(self, client: viser.ClientHandle, on_turn: Callable[[str, Array], None]) -> None:
        """`on_turn` gets `update` or `end`, and a direction (3,) in the body frame."""
        self._client = client
        self._on_turn = on_turn
        self._size = 1.0
        self._direction = np.array([1.0, 0.0, 0.0])
        scene = client.scene
        self._root = scene.add_frame("/robot/direction", show_axes=False, visible=False)
        needle_path = np.array([[-NEEDLE, 0.0, 0.0], [NEEDLE, 0.0, 0.0]])
        needle = Shape(
            scene,
            "/robot/direction/needle",
            LIGHT.line,
            tube(needle_path, 0.0025, 10),
            cast_shadow=False,
        )
        self._ends = []
        for name, radius, sign in (("tip", TIP, 1.0), ("tail", TAIL, -1.0)):
            end = scene.add_icosphere(f"/robot/direction/{name}", radius, cast_shadow=False)
            end.on_drag(self._dragging(sign))
            self._ends.append((end, sign))
        self._needle = needle.node

    def _dragging(self, sign: float) -> Callable[[Any], Any]:
        async def dragged(event: Any) -> None:
            if event.phase != "start":
                center = np.array(self._root.position)
                eye = np.array(self._client.camera.position)
                aim = np.array(event.end_position) - eye
                previous = sign * self._direction
                radius = NEEDLE * self._size
                self._direction = sign * snapped(on_sphere(eye - center, aim, radius, previous))
                self._turn()
                self._on_turn(event.phase, self._direction)

        return dragged

    def show(self, position: Array | None, direction: Array, size: float, color: Rgb) -> None:
        """Show the direction (3,) of what stands at a place (3,) [m]; None hides it."""
        set_properties(self._root, visible=position is not None)
        if position is not None:
            self._size = size
            self._direction = direction
            set_properties(self._root, position=position)
            set_properties(self._needle, scale=size)
            for end, sign in self._ends:
                set_properties(
                    end,
                    scale=size,
                    color=color,
                    position=np.array([sign * NEEDLE * size, 0.0, 0.0]),
                )
            self._turn()

    def _turn(self) -> None:
        x, y, z = self._direction
        wxyz = (
            np.array([1.0 + x, 0.0, -z, y]) if x > -1.0 + 1e-9 else np.array([0.0, 0.0, 1.0, 0.0])
        )
        set_properties(self._root, wxyz=wxyz / np.linalg.norm(wxyz))


def on_sphere(eye: Array, aim: Array, radius: float, previous: Array) -> Array:
    """Direction (3,) to the point of a sphere about the origin that a ray from an eye (3,) along
    `aim` (3,) meets, the one nearer to `before` (3,) of two; the nearest to the ray where it passes
    by."""
    aim = aim / np.linalg.norm(aim)
    foot = eye - (eye @ aim) * aim
    inside = radius**2 - foot @ foot
    if inside > 0.0:
        both = foot + np.sqrt(inside) * np.array([[-1.0], [1.0]]) * aim
        foot = both[np.argmax(both @ previous)]
    return np.asarray(foot / np.linalg.norm(foot))


def snapped(direction: Array) -> Array:
    """The axis of the body that a direction (3,) almost has, or the direction itself."""
    k = int(np.argmax(np.abs(direction)))
    return np.sign(direction[k]) * np.eye(3)[k] if abs(direction[k]) > SNAP else direction
