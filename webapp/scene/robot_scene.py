"""The whole 3D view of one browser."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import msgspec
import numpy as np
import viser

from finlab.allocation.allocation import Allocation
from finlab.analysis import AttainableSet, Improvement, Progress
from finlab.arrays import Array
from finlab.layout import Actuator, Layout
from finlab.layout.damage import Damage
from finlab.swim.hull.surface import has_inside, hull_of
from webapp.board import Board
from webapp.handles import set_properties
from webapp.intents import Intents
from webapp.markup.words import damage_words, missing_part
from webapp.scene.actuator_node import ActuatorNode, Motion, motions, offered_mesh
from webapp.scene.force_nodes import ForceNodes
from webapp.scene.jet_nodes import JetNodes
from webapp.scene.stage import Shape, Stage, aim_camera, arrow_size, hull_top, part_size, view_size
from webapp.scene.wrench_handle import Grip, WrenchHandle, pulled_force, turned_torque
from webapp.scene.wrench_nodes import LENGTH, AttainableNodes, DirectionHandle, Scale, WrenchNodes
from webapp.session import Session
from webapp.session.looking import DRAWN, Display
from webapp.session.state import one_of
from webapp.session.swim_plan import SwimSettings
from webapp.session.targets import lone_reach
from webapp.session.two_robots import Pair
from webapp.tasks.analysing import Analysis
from webapp.tasks.swimmer import Moment, Swimmer
from webapp.theme import LIGHT, fin_color
from webapp.viser_internals import run_script

CAMERAS = {
    "3D": (0.46, 0.44, 0.545),
    "Top": (-0.001, 0.0, 1.35),
    "Side": (0.0, -1.3, 0.1),
    "Front": (1.3, 0.0, 0.1),
}
"""Where the camera stands in each view [m]."""
PRESENTED = 1.8
"""Factor of the thickness of arrows while the page presents."""
SPEED = 0.5
LONGEST_NAME = 24
"""Letters of a name that stand over the robot; of a longer one so many."""
FORCES_ONLY = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
NO_WRENCH = [0.0] * 6


class RobotScene:
    """Draws a session, and makes intents of clicks and drags."""

    def __init__(
        self, client: viser.ClientHandle, session: Session, board: Board, intents: Intents
    ) -> None:
        self._client = client
        self._session = session
        self._do = intents.do
        self._board = board
        scene = self._client.scene
        session = self._session
        self.root = scene.add_frame("/robot", show_axes=False)
        self._stage = Stage(scene, hull_of(session.state.layout))
        self._wrench = WrenchNodes(scene)
        ghost: dict[str, Any] = {"opacity": 0.6, "visible": False, "cast_shadow": False}
        self._offered = Shape(scene, "/robot/proposed", LIGHT.glass, **ghost)
        self._forces = ForceNodes(scene)
        self._jets = JetNodes(scene)
        self._attainable = AttainableNodes(scene)
        self._direction = DirectionHandle(self._client, self._turn)
        self._handle = WrenchHandle(scene, "/robot/wrench", self._pull)
        self.pulled: Grip | None = None
        """What of the wrench is in the user's hand; None for nothing."""
        self.pulled_newtons = 1.0
        """Force of an arrow of 0.1 m and size 1 while the wrench is in the user's hand [N]."""
        self._newtons_before = 1.0
        self._fins: list[ActuatorNode] = []
        self.dragged: int | None = None
        self._moves: list[Motion] = []
        self._works: list[bool] = []
        self._size = view_size(session.state.layout)
        self._arrow_size = 1.0
        self._thickness = 1.0
        self._top = 0.0
        self._flaps = ""
        self._halo = self._asked = ""
        """Scripts that tell the page where outlines end; empty where it knows."""
        shows = (
            self._thicken,
            self._show_stage,
            self._place,
            self._push,
            self._show_wrench,
            self._animate,
            self._show_sets,
        )
        for show in (*shows, self._offer):
            board.act(show)
        self.look_from("3D")

    def hide(self) -> None:
        """What stands there may be another robot's."""
        set_properties(self.root, visible=False)

    def show(self, swimmer: Swimmer | None, pair: Pair | None = None) -> None:
        """A robot that does not swim stands on a floor of its own; it is hidden where two others
        stand beside each other."""
        set_properties(self.root, visible=pair is None)
        set_properties(self._stage.floor, visible=swimmer is None and pair is None)
        if swimmer is None:
            set_properties(self.root, position=np.zeros(3), wxyz=np.array([1.0, 0.0, 0.0, 0.0]))

    def look_from(self, view: str) -> None:
        """Move the camera to one of `CAMERAS`."""
        self._size = view_size(self._session.state.layout)
        position = self._size * np.array(CAMERAS[one_of(view, "view", CAMERAS)])
        # Lower than the robot's middle: below it stands the legend.
        self.aim(position, np.array([0.0, 0.0, -0.04 * self._size]))

    def aim(self, position: Array, target: Array) -> None:
        """Let the camera see from a place (3,) to another one (3,) [m]."""
        aim_camera(self._client, position, target)

    @property
    def camera(self) -> tuple[Array, Array]:
        """Where the camera stands (3,), and what it looks at (3,) [m]."""
        return np.array(self._client.camera.position), np.array(self._client.camera.look_at)

    def frame(self) -> None:
        """Bring the selected fin, or the whole robot, into the middle of the view, seen from where
        it is."""
        session = self._session
        position, target = self.camera
        layout = session.state.layout
        hull = hull_of(layout)
        center = np.array(hull.center)
        size = 2.6 * float(np.linalg.norm(hull.half))
        if session.selected is not None:
            place_of = layout.position[layout.index(session.selected)]
            center = place_of
            size = 0.55 * min(arrow_size(layout), 2.0 * part_size(layout))
        way = position - target
        self.aim(center + way / max(float(np.linalg.norm(way)), 1e-6) * size, center)

    def _show_stage(
        self,
        visible_layout: Layout,
        display: Display,
        dragged: int | None,
        task: str,
        shows_swim: bool,
        pair: Pair | None,
    ) -> None:
        if dragged is not None:  # a hull that breathes with the fin one drags is hard to aim at
            return
        # Glass within glass is not drawn; inside an attainable set the hull is a net.
        net = display.drawn != "none" and task == "Design"
        size = arrow_size(visible_layout)
        self._stage.refresh(
            hull_of(visible_layout),
            display.dark,
            display.shadows,
            net,
            has_inside(visible_layout),
            size,
        )
        if pair is not None:  # the camera sees both
            return
        if (
            not shows_swim and not 0.75 < view_size(visible_layout) / self._size < 1.34
        ):  # another robot
            self.look_from("3D")

    def _place(
        self,
        visible_layout: Layout,
        selection: tuple[str, ...],
        selected: str | None,
        task: str,
        lost: tuple[str, ...],
        damage: Damage,
        dragged: int | None,
        shows_swim: bool,
        follows: str,
    ) -> None:
        hull = hull_of(visible_layout)
        sizes = (part_size(visible_layout), arrow_size(visible_layout))
        self._arrow_size = sizes[1]
        self._top = hull_top(visible_layout)
        while len(self._fins) < visible_layout.n:
            self._fins.append(
                ActuatorNode(self._client.scene, len(self._fins), self._clicked, self._drag)
            )
        for node in self._fins[visible_layout.n :]:
            node.hide()
        edited = selected if task == "Design" and not (shows_swim or follows) else None
        stuck = () if shows_swim else damage.stuck
        for i, actuator in enumerate(visible_layout.actuators):
            remark = (
                ""
                if shows_swim or actuator.name in lost
                else damage_words(damage, actuator.name, actuator.KIND.sticks_at_angle)
            )
            named = actuator.name if shows_swim else _named(actuator)  # one that swims is elsewhere
            words = (str(i + 1), named if actuator.name in selection else "", remark)
            label = " ".join([word for word in words if word])
            moved = actuator.name == edited
            pinned = actuator.name in stuck
            self._fins[i].place(actuator, hull, sizes, moved, label, pinned, i == dragged)
        self._forces.place(visible_layout, hull, sizes)
        self._works = []
        if edited is None:
            self._direction.show(None, np.zeros(3), 1.0, LIGHT.line)
        else:
            index = visible_layout.index(edited)
            actuator = visible_layout.actuators[index]
            color = fin_color(index)
            self._direction.show(
                np.array(actuator.position), np.array(actuator.direction), sizes[1], color
            )

    def _push(
        self,
        visible_layout: Layout,
        lost: tuple[str, ...],
        shown_allocation: Allocation | None,
        scale: Scale,
        moment: Moment | None,
        pair: Pair | None,
        display: Display,
    ) -> None:
        if pair is not None:  # this robot is hidden
            return
        idle = lost if moment is None else moment.lost
        if moment is not None:
            commands = moment.motion
            forces = moment.force
        elif shown_allocation is not None:
            commands = shown_allocation.command
            forces = shown_allocation.forces
        else:
            commands = np.full((visible_layout.n, 3), np.nan)
            forces = np.zeros((visible_layout.n, 3))
        self._forces.paint(display.dark)
        scaled = display.arrow_length * LENGTH / scale.actuator
        works, moves = motions(visible_layout, commands, idle)
        self._moves = moves
        if works != self._works:
            self._works = works
            for node, alive in zip(self._fins, works, strict=False):
                node.command(alive)
        arrows = forces * (scaled * self._arrow_size)
        if not display.arrows:
            arrows[:] = 0.0
        elif False in works:
            arrows[~np.array(works)] = 0.0
        swept = [move.amplitude if alive else 0.0 for move, alive in zip(moves, works, strict=True)]
        self._halo = self._forces.command(arrows, swept, [move.angle for move in moves])
        if visible_layout.interaction is not None or self._jets.drawn:
            robot = (
                shown_allocation.layout
                if shown_allocation is not None and moment is None
                else visible_layout
            )
            jets = None if visible_layout.interaction is None else robot
            self._jets.refresh(jets, forces, scaled, self._arrow_size)

    def _animate(
        self,
        visible_layout: Layout,
        shown_allocation: Allocation | None,
        lost: tuple[str, ...],
        moment: Moment | None,
        display: Display,
        swim: SwimSettings,
        paused: bool,
        target: tuple[float, ...],
        scale: Scale,
        task: str,
        shows_swim: bool,
        pulled: Grip | None,
        pair: Pair | None,
        follows: str,
    ) -> None:
        """What the page moves itself (`frames.js`), in one message: outlines of arrows, the fins,
        and the handle."""
        script = self._halo + self._asked
        self._halo = self._asked = ""
        if pair is None:
            script += self._flapping(moment, display, swim, paused)
        else:
            self._flaps = ""
        size = self._arrow_size
        if pulled is None:
            self._newtons_before = self.pulled_newtons = scale.newtons
        # The foot of the arrow is that of the wrench's nodes.
        per_newton = size * display.arrow_length * LENGTH / scale.newtons
        Fx, Fy, Fz = target[:3]
        tip = per_newton * Fx, per_newton * Fy, per_newton * Fz
        is_visible = display.handle and task == "Allocate" and not shows_swim and pair is None
        is_visible = is_visible and not display.presents
        is_visible = is_visible and not follows
        commanded = visible_layout.commanded.tolist()
        script += self._handle.show(target, tip, size, commanded, is_visible)
        if script:
            run_script(self._client.gui, script)

    def _flapping(
        self, moment: Moment | None, display: Display, swim: SwimSettings, paused: bool
    ) -> str:
        """A script that tells the page the commands of all fins, and how fast they beat; empty
        where it knows them."""
        speed, still = (
            (SPEED, display.frozen) if moment is None else (swim.speed, paused or moment.done)
        )
        moves = msgspec.json.encode([self._moves, speed, still]).decode()[1:-1]
        if moves == self._flaps:
            return ""
        self._flaps = moves
        return f"finlabFrames.flap({moves});"

    def _thicken(self, display: Display) -> None:
        """Thick arrows are seen from the last row."""
        factor = PRESENTED if display.presents else 1.0
        if factor != self._thickness:
            self._thickness = factor
            self._forces.thicken(factor)
            self._wrench.thicken(factor)

    def _show_wrench(
        self,
        visible_layout: Layout,
        target: tuple[float, ...],
        shown_allocation: Allocation | None,
        scale: Scale,
        moment: Moment | None,
        pair: Pair | None,
        display: Display,
    ) -> None:
        if pair is not None:
            return
        # An axis that the robot does not command takes what comes.
        demanded: Sequence[float] = (np.array(target) * visible_layout.commanded).tolist()
        delivered = missing = NO_WRENCH
        if moment is not None:
            demanded = (moment.asked * FORCES_ONLY).tolist()
            delivered = (moment.delivered * FORCES_ONLY).tolist()
        elif shown_allocation is not None:
            delivered = shown_allocation.wrench.tolist()
            missing = missing_part(shown_allocation)
        length = display.arrow_length * LENGTH
        lengths = length / scale.newtons, length / scale.torque
        self._asked = self._wrench.refresh(
            demanded, delivered, missing, self._top, *lengths, self._arrow_size
        )

    def _pull(self, phase: str, grip: Grip, tip: Array, angle: float) -> None:
        session = self._session
        self.pulled = self._handle.grip
        if phase == "start":
            session.history.end_merge()
            return
        state = session.state
        reach = lone_reach(state.able, state.lost, state.flow).tolist()
        target = list(state.target)
        if grip.ring is None:
            size = arrow_size(state.layout)
            length = session.display.arrow_length * LENGTH
            pull = pulled_force(tip, grip, self._newtons_before, size, reach[:3], length)
            target[:3] = pull.force
            self.pulled_newtons = pull.newtons
        else:
            axis = 3 + grip.ring
            target[axis] = turned_torque(angle, grip.target[axis], reach[axis])
        self._do(partial(session.pull, target))
        if phase == "end":
            session.history.end_merge()

    def _show_sets(
        self,
        analysis: Analysis | None,
        growing: AttainableSet | None,
        display: Display,
        target: tuple[float, ...],
        task: str,
        visible_layout: Layout,
    ) -> None:
        visible_analysis = analysis if display.drawn != "none" and task == "Design" else None
        better = growing if growing is not None and growing.kind == DRAWN[display.drawn] else None
        self._attainable.refresh(visible_analysis, better, np.array(target), self._arrow_size)

    def _offer(
        self,
        improvement: Improvement | None,
        progress: Progress | None,
        layout: Layout,
        shows_swim: bool,
    ) -> None:
        """The actuators that a search would put elsewhere, where it would put them so far."""
        is_improved = improvement is not None and improvement.improved
        offer = improvement if is_improved else progress
        moved: list[Actuator] = []
        if offer is not None and not shows_swim and offer.layout.name == layout.name:
            present = {
                actuator.name: (actuator.position, actuator.frame) for actuator in layout.actuators
            }
            for actuator in offer.layout.actuators:
                if present.get(actuator.name) != (actuator.position, actuator.frame):
                    moved.append(actuator)
        set_properties(self._offered.node, visible=bool(moved))
        if moved:
            self._offered.show(offered_mesh, tuple(moved), part_size(layout))

    def _clicked(self, index: int, also: bool) -> None:
        self._do(partial(self._select, index, also))

    def _select(self, index: int, also: bool) -> None:
        """Select an actuator in the view; `also` beside those that are selected."""
        facts = self._board.facts
        if facts is None:
            return
        name = facts["visible_layout"].names[index]
        if also:
            self._session.select_also(name)
        else:
            self._session.select(name)

    def _drag(self, index: int, phase: str, position: tuple[float, float, float]) -> None:
        session = self._session
        if index >= session.state.layout.n:
            return
        self.dragged = None if phase == "end" else index
        if phase == "start":
            session.history.end_merge()
            return
        drag = session.end_drag if phase == "end" else session.drag
        self._do(partial(drag, session.state.layout.names[index], position))

    def _turn(self, phase: str, aim: Array) -> None:
        session = self._session
        name = session.selected
        x, y, z = (float(v) for v in aim)
        if name is not None:
            self._do(partial(session.point, name, (x, y, z), held=True))
        if phase == "end":
            session.history.end_merge()


def _named(actuator: Actuator) -> str:
    # Rounded first, so that no −0.000 stands there.
    position = ", ".join([f"{round(value, 3) + 0.0:.3f}" for value in actuator.position])
    name = actuator.name
    if len(name) > LONGEST_NAME:
        name = f"{name[:LONGEST_NAME]}…"
    return f"{name}, {position} m".replace("-", "−")
