"""The whole 3D view of one browser."""

import json
from functools import partial

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.layout import Layout
from webapp.handles import put
from webapp.markup.words import damage_words, missing_part
from webapp.scene.fin_node import FinNode, Flapping, motion
from webapp.scene.meshes.hull import has_inside, hull_of
from webapp.scene.meshes.mesh import LONGEST_TURN
from webapp.scene.overlays import Offered
from webapp.scene.stage import Stage, aim_camera
from webapp.scene.wrench_nodes import LENGTH, AttainableNodes, WrenchNodes, fitting_newtons, fitting_torque
from webapp.session.state import State, can_be_edited, chosen
from webapp.tasks.analyst import Findings
from webapp.tasks.context import Context
from webapp.theme import HALF_TURN
from webapp.viser_internals import run_script

CAMERAS = {
    "3D": (0.42, 0.40, 0.51),
    "Top": (-0.001, 0.0, 1.35),
    "Side": (0.0, -1.3, 0.1),
    "Front": (1.3, 0.0, 0.1),
}
"""Where the camera stands in each view [m]."""
SPEED = 0.5
"""Time of the flapping per real time."""


class RobotScene:
    """Draws a session, and makes intents of clicks and drags."""

    def __init__(self, context: Context) -> None:
        self._client, self._session, self._do = context.client, context.session, context.do
        scene, session = self._client.scene, self._session
        self._root = scene.add_frame("/robot", show_axes=False)
        self._stage = Stage(scene, hull_of(session.state.layout))
        self._wrench = WrenchNodes(scene)
        self._offered = Offered(scene)
        self._attainable = AttainableNodes(scene)
        self._fins: list[FinNode] = []
        self.dragged: int | None = None
        """Place of the fin in the user's hand."""
        self.editing = False
        """Whether the selected fin has its gizmos: while the layout is edited."""
        self._flapping, self._flaps = Flapping(), ""
        self.newtons = 1.0
        """Force [N] that an arrow of 0.1 m stands for at the moment."""
        self.torque = 1.0
        """Torque [N m] that half a turn of a ring stands for at the moment."""
        self.cut = False
        """Whether a ring is cut off."""
        self.look_from("3D")

    def show(self, visible: bool) -> None:
        """Show the robot that is designed, or make room for one that swims."""
        put(self._root, visible=visible)
        self._stage.show_floor(visible)

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

    def refresh(
        self,
        allocation: Allocation | None,
        findings: Findings | None = None,
        offered: Layout | None = None,
    ) -> None:
        """Show the session's layout, and the answer to it if there is one for this very layout.

        Args:
            allocation: the answer.
            findings: what the layout can attain, where that is to be shown.
            offered: a better layout, whose fins are shown beside the present ones.
        """
        state, display = self._session.state, self._session.display
        hull = hull_of(state.layout)
        if self.dragged is None:  # a hull that breathes with the fin one drags is hard to aim at
            # Glass within glass is not drawn; inside an attainable set the hull is a net.
            net = display.drawn != "none"
            self._stage.refresh(hull, display.dark, display.shadows, net, has_inside(state.layout))
        while len(self._fins) < state.layout.n:
            self._fins.append(FinNode(self._client.scene, len(self._fins), self._clicked, self._drag))
        for node in self._fins[state.layout.n :]:
            node.hide()
        self.newtons = fitting_newtons(_largest(state, allocation), self.newtons)
        scale = LENGTH / self.newtons
        fits = allocation is not None and allocation.layout.names == state.layout.names
        moves = (
            motion(state.layout.actuators, allocation.command) if fits and allocation is not None else None
        )
        for i, part in enumerate(state.layout.actuators):
            selected = part.name == self._session.selected
            label = _label(state, i, part.name in self._session.selection)
            gizmos = selected and self.editing and can_be_edited(state.layout)
            self._fins[i].place(part, hull, gizmos, label, i == self.dragged)
            if part.name in state.failed or allocation is None:
                self._fins[i].command(None, np.zeros(3), np.eye(3))
            elif moves is not None and np.isfinite(moves[i, 0]):
                force = allocation.forces[i]
                # The force belongs to the answer's own axes, which a drag may have left behind.
                frame = allocation.layout.frames[i]
                self._fins[i].command(moves[i], force * scale, frame)
        if moves is not None:
            self._flapping.take(moves)
        self._offered.show(offered, state.layout)
        target = np.array(state.target)
        self._attainable.refresh(findings if display.drawn != "none" else None, target)
        given = None if allocation is None else allocation.wrench
        missing = np.zeros(6) if allocation is None else missing_part(allocation)
        top = hull.center[2] + hull.half[2]
        torques = [target[3:], missing[3:], *([] if given is None else [given[3:]])]
        most = float(max(np.linalg.norm(torque) for torque in torques))
        self.torque = fitting_torque(most, self.torque)
        self.cut = HALF_TURN * most / self.torque > LONGEST_TURN
        self._wrench.refresh(target, given, missing, top, scale, HALF_TURN / self.torque)

    def flap(self) -> None:
        """Let the page move the fins (`frames.js`): commands of all, and how fast."""
        fins = [row if np.isfinite(row[0]) else None for row in self._flapping.command.tolist()]
        told = json.dumps([fins, SPEED, self._session.display.frozen])[1:-1]
        if told != self._flaps:
            self._flaps = told
            run_script(self._client.gui, f"finlabFrames.flap({told});")

    def _clicked(self, index: int, also: bool) -> None:
        select = self._session.select_also if also else self._session.select
        self._do(partial(select, self._session.state.layout.names[index]))

    def _drag(self, index: int, phase: str, position: tuple[float, float, float], angle: float) -> None:
        session = self._session
        if index >= session.state.layout.n:
            return
        self.dragged = None if phase == "end" else index
        if phase == "start":
            session.history.end_merge()
            return
        drag = session.end_drag if phase == "end" else session.drag_fin
        self._do(partial(drag, session.state.layout.names[index], position, angle))


def _label(state: State, index: int, selected: bool) -> str:
    """A fin's number; its name while it is selected; what is wrong with it."""
    name = state.layout.names[index]
    told = damage_words(state, name) if name not in state.failed else ""
    return " ".join([str(index + 1), *([name] if selected else []), *([told] if told else [])])


def _largest(state: State, allocation: Allocation | None) -> float:
    """Largest force that an arrow has to show [N]."""
    forces = [np.array(state.target[:3])]
    if allocation is not None:
        forces += [allocation.wrench[:3], *allocation.forces]
    return float(max(np.linalg.norm(force) for force in forces))
