"""The whole 3D view of one browser."""

import json
import math
from functools import partial

import numpy as np
import viser

from finlab.allocation.allocation import Allocation
from finlab.analysis import Improvement
from finlab.arrays import Array
from finlab.layout import Fin, Layout
from finlab.layout.damage import Health
from webapp.board import Board
from webapp.handles import put
from webapp.markup.words import damage_words, missing_part
from webapp.scene.fin_node import FinNode, motion
from webapp.scene.meshes import fin as fin_mesh
from webapp.scene.meshes.hull import has_inside, hull_of
from webapp.scene.meshes.mesh import Mesh, joined
from webapp.scene.stage import Shape, Stage, aim_camera
from webapp.scene.wrench_nodes import LENGTH, AttainableNodes, Scale, WrenchNodes
from webapp.session.display import Display
from webapp.session.state import chosen
from webapp.session.swim_plan import SwimSettings
from webapp.tasks.analyst import Findings
from webapp.tasks.context import Context
from webapp.tasks.moment import Moment
from webapp.tasks.swimmer import Swimmer
from webapp.theme import DELIVERED, HALF_TURN
from webapp.viser_internals import run_script

CAMERAS = {
    "3D": (0.42, 0.40, 0.51),
    "Top": (-0.001, 0.0, 1.35),
    "Side": (0.0, -1.3, 0.1),
    "Front": (1.3, 0.0, 0.1),
}
"""Where the camera stands in each view [m]."""
SPEED = 0.5
SWIM = Scale(1.0, 1.0, False)
"""What arrows stand for while the robot swims: one scale, so that they compare."""
FORCES_ONLY = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


class RobotScene:
    """Draws a session, and makes intents of clicks and drags."""

    def __init__(self, context: Context, board: Board) -> None:
        self._client, self._session, self._do = context.client, context.session, context.do
        self._board = board
        scene, session = self._client.scene, self._session
        self.root = scene.add_frame("/robot", show_axes=False)
        self._stage = Stage(scene, hull_of(session.state.layout))
        self._wrench = WrenchNodes(scene)
        self._offered = Offered(scene)
        self._attainable = AttainableNodes(scene)
        self._fins: list[FinNode] = []
        self.dragged: int | None = None
        self._moves: list[list[float] | None] = []
        self._flaps = ""
        for act in (
            self._show_stage,
            self._place,
            self._push,
            self._flap,
            self._show_wrench,
            self._show_sets,
            self._offer,
        ):
            board.act(act)
        self.look_from("3D")

    def hide(self) -> None:
        """What stands there may be another robot's."""
        put(self.root, visible=False)

    def show(self, swimmer: Swimmer | None) -> None:
        """A robot that does not swim stands on a floor of its own."""
        put(self.root, visible=True)
        self._stage.show_floor(swimmer is None)
        if swimmer is None:
            put(self.root, position=np.zeros(3), wxyz=np.array([1.0, 0.0, 0.0, 0.0]))

    def look_from(self, view: str) -> None:
        """Move the camera to one of `CAMERAS`."""
        self.aim(np.array(CAMERAS[chosen(view, "view", CAMERAS)]), np.array([0.0, 0.0, 0.03]))

    def aim(self, place: Array, target: Array) -> None:
        """Let the camera see from a place (3,) to another one (3,) [m]."""
        aim_camera(self._client, place, target)

    @property
    def camera(self) -> tuple[Array, Array]:
        """Where the camera stands (3,), and what it looks at (3,) [m]."""
        return np.array(self._client.camera.position), np.array(self._client.camera.look_at)

    def frame(self) -> None:
        """Bring the selected fin, or the whole robot, into the middle of the view, seen from where it is."""
        session, (place, target) = self._session, self.camera
        layout = session.state.layout
        hull = hull_of(layout)
        center, size = np.array(hull.center), 2.6 * float(np.linalg.norm(hull.half))
        if session.selected is not None:
            center, size = layout.position[layout.index(session.selected)], 0.55
        way = place - target
        self.aim(center + way / max(float(np.linalg.norm(way)), 1e-6) * size, center)

    def _show_stage(self, drawn: Layout, display: Display, dragged: int | None) -> None:
        if dragged is None:  # a hull that breathes with the fin one drags is hard to aim at
            # Glass within glass is not drawn; inside an attainable set the hull is a net.
            net = display.drawn != "none"
            self._stage.refresh(hull_of(drawn), display.dark, display.shadows, net, has_inside(drawn))

    def _place(
        self,
        drawn: Layout,
        selection: tuple[str, ...],
        selected: str | None,
        task: str,
        failed: tuple[str, ...],
        health: Health | None,
        dragged: int | None,
        swims: bool,
    ) -> None:
        """Actuators where they are, with their numbers and gizmos."""
        hull = hull_of(drawn)
        while len(self._fins) < drawn.n:
            self._fins.append(FinNode(self._client.scene, len(self._fins), self._clicked, self._drag))
        for node in self._fins[drawn.n :]:
            node.hide()
        edited = selected if task == "Design" and not swims else None
        for i, part in enumerate(drawn.actuators):
            told = "" if swims or part.name in failed else damage_words(health, part.name)
            words = (str(i + 1), part.name if part.name in selection else "", told)
            label = " ".join([word for word in words if word])
            self._fins[i].place(part, hull, part.name == edited, label, i == dragged)

    def _push(
        self,
        drawn: Layout,
        failed: tuple[str, ...],
        shown: Allocation | None,
        scale: Scale,
        moment: Moment | None,
    ) -> None:
        """What actuators do, and their forces."""
        lost, newtons = (failed, scale.newtons) if moment is None else (moment.lost, SWIM.newtons)
        if moment is not None:
            moves, forces, frames = moment.motion, moment.force, drawn.frames
        elif shown is not None:
            # The forces belong to the answer's own axes, which a drag may have left behind.
            moves, forces = motion(drawn.actuators, shown.command), shown.forces
            frames = shown.layout.frames
        else:
            moves = forces = frames = np.full((drawn.n, 3), np.nan)
        self._moves = [None] * drawn.n
        for i, name in enumerate(drawn.names):
            if name in lost or not math.isfinite(moves[i, 0]):
                self._fins[i].command(None, np.zeros(3), np.eye(3))
            else:
                self._moves[i] = moves[i].tolist()
                self._fins[i].command(moves[i], forces[i] * (LENGTH / newtons), frames[i])

    def _flap(
        self,
        drawn: Layout,
        shown: Allocation | None,
        failed: tuple[str, ...],
        moment: Moment | None,
        display: Display,
        swim: SwimSettings,
        paused: bool,
    ) -> None:
        """The page moves the fins (`frames.js`): it is told the commands of all, and how fast."""
        speed, still = (SPEED, display.frozen) if moment is None else (swim.speed, paused or moment.done)
        told = json.dumps([self._moves, speed, still])[1:-1]
        if told != self._flaps:
            self._flaps = told
            run_script(self._client.gui, f"finlabFrames.flap({told});")

    def _show_wrench(
        self,
        drawn: Layout,
        target: tuple[float, ...],
        shown: Allocation | None,
        scale: Scale,
        moment: Moment | None,
    ) -> None:
        asked, given, missing = np.array(target), np.zeros(6), np.zeros(6)
        if moment is not None:
            asked, given, scale = moment.asked * FORCES_ONLY, moment.delivered * FORCES_ONLY, SWIM
        elif shown is not None:
            given, missing = shown.wrench, missing_part(shown)
        hull = hull_of(drawn)
        top = hull.center[2] + hull.half[2]
        self._wrench.refresh(asked, given, missing, top, LENGTH / scale.newtons, HALF_TURN / scale.torque)

    def _show_sets(
        self, found: Findings | None, display: Display, target: tuple[float, ...], swims: bool
    ) -> None:
        self._attainable.refresh(found if display.drawn != "none" and not swims else None, np.array(target))

    def _offer(self, better: Improvement | None, layout: Layout, swims: bool) -> None:
        self._offered.show(
            better.layout if better is not None and better.improved and not swims else None, layout
        )

    def _clicked(self, index: int, also: bool) -> None:
        select = self._session.select_also if also else self._session.select
        self._do(lambda: select(self._board.facts.drawn.names[index]) if self._board.facts else None)

    def _drag(self, index: int, phase: str, position: tuple[float, float, float], angle: float) -> None:
        session = self._session
        if index >= session.state.layout.n:
            return
        self.dragged = None if phase == "end" else index
        if phase == "start":
            session.history.end_merge()
            return
        drag = session.end_drag if phase == "end" else session.drag
        part = session.state.layout.actuators[index]
        level = isinstance(part, Fin) and part.mounting_angle is not None
        self._do(partial(drag, part.name, position, angle if level else None))


class Offered:
    """Blades of the fins that a search would put elsewhere, where it would put them."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._shape = Shape(scene, "/robot/proposed", DELIVERED, visible=False, cast_shadow=False)

    def show(self, other: Layout | None, layout: Layout) -> None:
        """Show the fins of a better version of a layout that stand elsewhere now; None hides the node."""
        now = {fin.name: (fin.position, fin.frame) for fin in layout.fins}
        fins = () if other is None or other.name != layout.name else other.fins
        moved = tuple(fin for fin in fins if now.get(fin.name) != (fin.position, fin.frame))
        put(self._shape.node, visible=bool(moved))
        if moved:
            self._shape.show(_blades, moved)


def _blades(fins: tuple[Fin, ...]) -> Mesh:
    parts = []
    for fin in fins:
        frame = np.array(fin.frame)
        for part in (fin_mesh.blade(), fin_mesh.shaft()):
            parts.append(Mesh(part.vertices @ frame + np.array(fin.position), part.faces))
    return joined(*parts)
