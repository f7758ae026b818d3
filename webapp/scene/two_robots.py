"""Two robots beside each other in one view, each with its hull, actuators, arrows and name."""

from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import numpy as np
import viser

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.swim.hull import hull_of
from finlab.swim.hull.surface import has_inside
from webapp.board import Board
from webapp.handles import set_properties
from webapp.markup.words import damage_words, missing_part
from webapp.scene.actuator_node import ActuatorNode, Motion, motions
from webapp.scene.actuator_shapes import SPAN
from webapp.scene.force_nodes import ForceNodes
from webapp.scene.robot_scene import CAMERAS, LONGEST_NAME, NO_WRENCH, SPEED
from webapp.scene.stage import (
    BELOW,
    Shape,
    add_floor,
    aim_camera,
    arrow_size,
    bow_of,
    hull_top,
    paint_floor,
    part_size,
    view_size,
)
from webapp.scene.wrench_nodes import LENGTH, Scale, WrenchNodes, fitting_scale
from webapp.session.looking import Display
from webapp.session.state import one_of
from webapp.session.two_robots import PLACES, Pair, Standing
from webapp.tasks.solver import Reply
from webapp.theme import LIGHT, look
from webapp.viser_internals import run_script

GAP = 0.3
"""Gap between the two, as a share of the width of the wider one."""
HALF_VIEW = 0.62
"""Half of the width that a view of size 1 has free above an open drawer [m]."""
HALF_HIGH_VIEW = 0.42
"""The same where the drawer is folded: the view is higher, and as wide as before."""
BELOW_NAME = 0.06
"""How far below a robot its name stands, for a view of size 1 [m]."""
RESIZED = (0.75, 1.34)
"""Changes of the size of both up to which the camera stays."""


class Placement(NamedTuple):
    """Where two robots stand, and how large the view of both is."""

    left: Array
    """Place (3,) of the origin of the left one [m]."""
    right: Array
    """Of the right one."""
    size: float
    """As `view_size` has it of a single robot."""
    down: Array
    """Direction (3,) that points downwards in the picture."""


def placement(left: Layout, right: Layout, view: str, is_folded: bool = False) -> Placement:
    """Where two robots stand so that they are left and right in a view of the camera.

    Args:
        left: the one that is seen at the left.
        right: the other one.
        view: key of `CAMERAS`.
        is_folded: whether the drawer below the view is folded.
    """
    line = -np.array(CAMERAS[view])
    line /= np.linalg.norm(line)
    # Across the line of sight, to the right of the picture: line x (0, 0, 1).
    across = np.array([line[1], -line[0], 0.0])
    across /= np.linalg.norm(across)
    down = np.cross(line, across)
    widths = [half_extent(layout, across) for layout in (left, right)]
    gap = GAP * 2.0 * max(widths)
    total_width = 2.0 * sum(widths) + gap
    left_place = -(0.5 * total_width - widths[0]) * across
    right_place = (0.5 * total_width - widths[1]) * across
    half_view = HALF_HIGH_VIEW if is_folded else HALF_VIEW
    size = max(view_size(left), view_size(right), 0.5 * total_width / half_view)
    return Placement(left_place, right_place, size, down)


def half_extent(layout: Layout, direction: Array) -> float:
    """How far a robot reaches from its origin along a direction (3,), either way [m]; its hull
    counts as an ellipsoid."""
    hull = hull_of(layout)
    center = abs(float(np.array(hull.center) @ direction))
    hull_reach = center + float(np.linalg.norm(np.array(hull.half) * direction))
    blade = SPAN * part_size(layout)
    actuator_reach = float(np.abs(layout.position @ direction).max()) + blade
    return max(hull_reach, actuator_reach)


def pair_scale(
    target: Sequence[float], allocations: Sequence[Allocation | None], now: Scale
) -> Scale:
    """The scale by which arrows and rings of all allocations fit the view.

    Args:
        target: wrench (6,) that is asked of all [N, N m].
        allocations: the answers; None while there is none.
        now: the present scale, which is kept as far as it is good enough.
    """
    scales = [fitting_scale(target, allocation, now) for allocation in allocations]
    newtons = max(scale.newtons for scale in scales)
    torque = max(scale.torque for scale in scales)
    actuator = max(scale.actuator for scale in scales)
    return Scale(newtons, torque, actuator)


class PairedRobot:
    """The nodes of one of the two."""

    def __init__(self, scene: viser.SceneApi, place: str) -> None:
        """Nothing is shown yet; `place` is one of `PLACES`."""
        self.name = f"/pair/{place}"
        self._scene = scene
        self._place = place
        self._root = scene.add_frame(self.name, show_axes=False, visible=False)
        self._hull = Shape(scene, f"{self.name}/hull", LIGHT.hull, side="double")
        self._bow = Shape(
            scene, f"{self.name}/hull/bow", LIGHT.glass, side="double", cast_shadow=False
        )
        self._actuators: list[ActuatorNode] = []
        self._forces = ForceNodes(scene, self.name)
        self._wrench = WrenchNodes(scene, self.name)
        self._label = scene.add_label(
            f"{self.name}/name", "", anchor="top-center", font_screen_scale=1.15
        )
        self._standing: tuple[Layout, object, float] | None = None
        """Layout, damage and size of arrows that the nodes stand for."""
        self._works: list[bool] = []
        self.moves: list[Motion] = []
        """How its actuators move."""
        self.outlines = ""
        """Script that tells the page where outlines of its arrows end."""

    def hide(self) -> None:
        """The two are not looked at."""
        set_properties(self._root, visible=False)

    def name_at(self, layout: Layout, placed: Placement) -> None:
        """Show the robot's name below it in the picture."""
        below = half_extent(layout, placed.down) + BELOW_NAME * placed.size
        text = f"{self._place}: {_short(layout.name)}"
        set_properties(self._label, text=text, position=below * placed.down)

    def stand(self, standing: Standing, position: Array, size: float, display: Display) -> None:
        """Show a robot at a place (3,) [m], with arrows of a size."""
        layout = standing.state.layout
        set_properties(self._root, visible=True, position=position)
        colors = look(display.dark)
        set_properties(self._hull.node, color=colors.hull)
        set_properties(self._bow.node, color=colors.glass)
        stands_for = (layout, standing.state.damage, size)
        if self._standing == stands_for:
            return
        self._standing = stands_for
        hull = hull_of(layout)
        opacity = 0.35 if has_inside(layout) else None
        for shape, mesh in ((self._hull, hull.mesh), (self._bow, bow_of(hull))):
            shape.become(mesh)
            set_properties(shape.node, opacity=opacity)
        while len(self._actuators) < layout.n:
            index = len(self._actuators)
            self._actuators.append(
                ActuatorNode(self._scene, index, _leave_alone, _leave_alone, self.name)
            )
        for node in self._actuators[layout.n :]:
            node.hide()
        sizes = (part_size(layout), size)
        damage = standing.state.damage
        for index, actuator in enumerate(layout.actuators):
            remark = ""
            if actuator.name not in damage.lost:
                remark = damage_words(damage, actuator.name, actuator.KIND.sticks_at_angle)
            label = f"{index + 1} {remark}".strip()
            is_stuck = actuator.name in damage.stuck
            self._actuators[index].place(actuator, hull, sizes, False, label, is_stuck, False)
        self._forces.place(layout, hull, sizes)
        self._works = []

    def push(
        self, standing: Standing, reply: Reply | None, scale: Scale, size: float, display: Display
    ) -> None:
        """Show what a robot does for its wrench; None while that is not known."""
        state = standing.state
        layout = state.layout
        commands = np.full((layout.n, 3), np.nan)
        forces = np.zeros((layout.n, 3))
        delivered = missing = NO_WRENCH
        if reply is not None:
            commands = reply.answer.command
            forces = reply.answer.forces
            delivered = reply.answer.wrench.tolist()
            missing = missing_part(reply.answer)
        works, self.moves = motions(layout, commands, state.lost)
        if works != self._works:
            self._works = works
            for node, alive in zip(self._actuators, works, strict=False):
                node.command(alive)
        length = display.arrow_length * LENGTH
        per_newton = size * length / scale.actuator
        is_drawn = np.array(works)[:, None] & display.arrows
        arrows = np.where(is_drawn, forces * per_newton, 0.0)
        self._forces.paint(display.dark)
        swept = [
            move.amplitude if alive else 0.0 for move, alive in zip(self.moves, works, strict=True)
        ]
        halo = self._forces.command(arrows, swept, [move.angle for move in self.moves])
        lengths = length / scale.newtons, length / scale.torque
        top = hull_top(layout)
        # An axis that the robot does not command takes what comes.
        demanded = (np.array(state.target) * layout.commanded).tolist()
        lines = self._wrench.refresh(demanded, delivered, missing, top, *lengths, size)
        self.outlines = halo + lines


def _leave_alone(*_: object) -> None:
    """Actuators of a pair are neither selected nor dragged."""


def _short(name: str) -> str:
    """A robot's name, cut where it is long."""
    return name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]}…"


class PairScene:
    """Draws two robots; its nodes are made when they are looked at for the first time."""

    def __init__(self, client: viser.ClientHandle, board: Board) -> None:
        """`board` lets it show the facts."""
        self._client = client
        self._robots: tuple[PairedRobot, PairedRobot] | None = None
        self._floor: viser.GridHandle | None = None
        self._pair: Pair | None = None
        self._view = "3D"
        self._size = 0.0
        self._is_folded = False
        self._flaps = b""
        board.act(self._show)

    @property
    def is_open(self) -> bool:
        """Whether the two are shown."""
        return self._pair is not None

    def hide(self) -> None:
        """Show nothing: what stands there may be others."""
        for robot in self._robots or ():
            robot.hide()
        if self._floor is not None:
            set_properties(self._floor, visible=False)

    def look_from(self, view: str) -> None:
        """Move the camera to one of `CAMERAS`; the two stand across its line of sight."""
        self._view = one_of(view, "view", CAMERAS)
        self._size = 0.0
        if self._pair is not None:
            self._aim(self._pair)

    def _aim(self, pair: Pair) -> Placement:
        """Where the two stand; the camera moves where they are of another size."""
        layouts = [standing.state.layout for standing in pair.both]
        placed = placement(layouts[0], layouts[1], self._view, self._is_folded)
        least, most = RESIZED
        if not least * placed.size < self._size < most * placed.size:
            self._size = placed.size
            position = placed.size * np.array(CAMERAS[self._view])
            aim_camera(self._client, position, np.array([0.0, 0.0, 0.0]))
        return placed

    def _show(
        self,
        pair: Pair | None,
        left_reply: Reply | None,
        right_reply: Reply | None,
        scale: Scale,
        display: Display,
        drawer: str | None,
    ) -> None:
        if pair is None:
            if self._pair is not None:
                self._pair = None
                self._size = 0.0
                self.hide()
            return
        self._pair = pair
        self._is_folded = drawer is None
        if self._robots is None or self._floor is None:
            scene = self._client.scene
            left, right = [PairedRobot(scene, place) for place in PLACES]
            self._robots = left, right
            self._floor = add_floor(
                scene,
                "/pair/floor",
                6.0,
                0.1,
                0.5,
                fade_distance=5.0,
                fade_strength=1.6,
                shadow_opacity=0.22,
            )
        placed = self._aim(pair)
        size = pair_arrow_size(pair)
        bottoms = []
        robots = zip(
            self._robots,
            pair.both,
            (placed.left, placed.right),
            (left_reply, right_reply),
            strict=True,
        )
        for robot, standing, position, reply in robots:
            robot.stand(standing, position, size, display)
            robot.name_at(standing.state.layout, placed)
            robot.push(standing, reply, scale, size, display)
            hull = hull_of(standing.state.layout)
            bottoms.append(hull.center[2] - hull.half[2])
        floor = np.array([0.0, 0.0, min(bottoms) - BELOW * size])
        set_properties(self._floor, visible=True, position=floor, scale=size)
        paint_floor(self._floor, display.dark)
        self._flap(display)

    def _flap(self, display: Display) -> None:
        """Tell the page how the actuators of both move (`frames.js`)."""
        robots = self._robots
        assert robots is not None
        moves = [move for robot in robots for move in robot.moves]
        counts = {robot.name: len(robot.moves) for robot in robots}
        script = "".join([robot.outlines for robot in robots])
        flaps = msgspec.json.encode([moves, SPEED, display.frozen, counts])[1:-1]
        if flaps != self._flaps:
            self._flaps = flaps
            script += f"finlabFrames.flap({flaps.decode()});"
        if script:
            run_script(self._client.gui, script)


def pair_arrow_size(pair: Pair) -> float:
    """Size of the arrows of both: of one length for one force, so that they compare."""
    return max(arrow_size(standing.state.layout) for standing in pair.both)
