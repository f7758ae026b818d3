"""The view of one page: the robot that is designed, or the one that swims in its water."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import viser

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.swim.hull.mesh_file import Mesh
from webapp.board import Board
from webapp.handles import set_properties
from webapp.intents import Intents
from webapp.scene.actuator_shapes import NOTHING, force_arrow, joined, tube
from webapp.scene.robot_scene import RobotScene
from webapp.scene.stage import Shape, add_floor, aim_camera, paint_floor, view_size
from webapp.scene.two_robots import PairScene, pair_scale
from webapp.scene.wrench_nodes import Scale, fitting_scale, fixed_scale, swim_scale
from webapp.session import Session
from webapp.session.files import file_stem
from webapp.session.lessons import Stop
from webapp.session.looking import Display
from webapp.session.swim_plan import SwimSettings
from webapp.session.targets import axis_reach, full_thrust
from webapp.session.two_robots import Pair
from webapp.tasks.swimmer import PLACE, Moment, Swimmer
from webapp.tasks.swimming import Swimming
from webapp.theme import ASKED, BRAND, DELIVERED, WATER
from webapp.viser_internals import run_script

INITIAL_SCALE = Scale(1.0, 1.0, 1.0)


class Scenery:
    """Both scenes of one page, of which one is shown, and the theme."""

    def __init__(
        self,
        client: viser.ClientHandle,
        session: Session,
        swimming: Swimming,
        board: Board,
        intents: Intents,
    ) -> None:
        """`board` lets it show the facts, `intents` takes what a user does in the view."""
        self._client = client
        self._session = session
        self._swimming = swimming
        self._stop: Stop | None = None
        self._camera = (np.zeros(3), np.zeros(3))
        """Where the camera stood before the tour or lesson, and looked at."""
        self._fault = intents.fault
        self._scale = self._swam = self._of_pair = INITIAL_SCALE
        self._robot: tuple[str, tuple[str, ...]] | None = None
        """Name of the robot that the scale is of, and those of its actuators."""
        self._swimmer: Swimmer | None = None
        """The robot that is seen to swim."""
        self._is_answered = False
        """Whether the scale fits an answer of that robot."""
        self._is_fixed = False
        """Whether the scale is that of the most that the robot can give."""
        self._fitted: tuple[Sequence[float], Allocation | None] | None = None
        board.group(self._fail, is_view=True)
        board.act(self._show)
        self.robot = RobotScene(client, session, board, intents)
        self.swim = SwimScene(self._client, swimming, self.robot.root)
        board.act(self.swim.refresh)
        self.two_robots = PairScene(client, board)
        board.act(self._leave_pair)

    def _show(self, display: Display, swimmer: Swimmer | None, pair: Pair | None) -> None:
        """The theme, and the robot that is designed unless one swims, or two stand beside each
        other."""
        self.robot.show(swimmer, pair)
        if display.dark != self._dark:
            self._dark = display.dark
            self._client.gui.configure_theme(
                dark_mode=self._dark, show_logo=False, show_share_button=False, brand_color=BRAND
            )

    _dark: bool | None = None

    def _leave_pair(self, pair: Pair | None) -> None:
        """Where two robots have been looked at, the camera goes back to the one."""
        if pair is not None:
            self._was_pair = True
        elif self._was_pair:
            self._was_pair = False
            self.robot.look_from("3D")

    _was_pair = False

    def look_from(self, view: str) -> None:
        """Move the camera to one of `CAMERAS`, where it sees the robot, or both that stand beside
        each other."""
        if self.two_robots.is_open:
            self.two_robots.look_from(view)
        else:
            self.robot.look_from(view)

    def frame(self) -> None:
        """Bring what is selected, or the whole robot, into the middle of the view; of two robots
        both."""
        if self.two_robots.is_open:
            self.two_robots.look_from("3D")
        else:
            self.robot.frame()

    def fit(
        self,
        target: Sequence[float],
        shown_allocation: Allocation | None,
        swimmer: Swimmer | None = None,
        pair_allocations: Sequence[Allocation | None] = (),
    ) -> Scale:
        """What arrows and rings stand for, given a target (6,) and what is shown of it, in a swim
        that is seen, or of two robots beside each other, whose answers are given."""
        if swimmer is None and self._swimmer is not None and self._swimming.active:
            self.robot.look_from("3D")  # the robot of the page, where the swim was seen
        self._swimmer = swimmer
        if swimmer is not None:
            self._swam = swim_scale(swimmer, self._swam)
            return self._swam
        self._swam = INITIAL_SCALE
        if pair_allocations:
            self._of_pair = pair_scale(target, pair_allocations, self._of_pair)
            return self._of_pair
        self._of_pair = INITIAL_SCALE
        layout = self._session.state.layout
        robot = layout.name, layout.names
        if robot != self._robot:  # what fits another robot says nothing of this one
            self._robot = robot
            self._fitted = None
            self._scale = INITIAL_SCALE
            self._is_answered = False
        if self._is_fixed != self._session.display.fixed_scale:
            self._is_fixed = self._session.display.fixed_scale
            self._fitted = None
        fitted = self._fitted
        if fitted is None or fitted[0] != target or fitted[1] is not shown_allocation:
            if not self._is_answered:  # what fits the first answer is not what fitted before it
                self._scale = INITIAL_SCALE
                self._is_answered = shown_allocation is not None
            try:
                self._scale = self._fitting(target, shown_allocation)
                self._fitted = (target, shown_allocation)
            except Exception as error:
                self._scale = INITIAL_SCALE
                self._fault(error)
        if self.robot.pulled is not None:  # the arrow ends in the hand
            self._fitted = None
            self._scale = self._scale._replace(newtons=self.robot.pulled_newtons)
        return self._scale

    def _fitting(self, target: Sequence[float], shown_allocation: Allocation | None) -> Scale:
        """The scale of what is shown, or of the most that the robot can give."""
        state = self._session.state
        if not self._is_fixed:
            commanded = (np.array(target) * state.layout.commanded).tolist()
            return fitting_scale(commanded, shown_allocation, self._scale)
        reach = axis_reach(state.able, state.lost, state.flow).tolist()
        most = float(full_thrust(state.able, state.flow).max())
        return fixed_scale(reach, most, self._scale)

    def _fail(self, error: Exception | None) -> None:
        if error is None:
            pair = None if self._swimming.active else self._session.two_robots.pair
            self.robot.show(self._swimmer, pair)
        else:
            self.robot.hide()
            self.two_robots.hide()

    def animate(self, elapsed: float) -> None:
        """Let time pass [s]: robots that swim move on."""
        if self._swimming.active:
            self._swimming.tick(elapsed)
            self.swim.animate(elapsed)

    def save(self) -> None:
        """Let the page save the view as a picture."""
        name = file_stem(self._session.state.layout.name)
        run_script(self._client.gui, f"finlabFrames.picture({json.dumps(name + '.png')});")

    def end_swim(self) -> None:
        """Go back from the robot that swims to the one that is designed."""
        if self._swimming.active:
            self._swimming.halt()
            self.robot.look_from("3D")

    def follow_guide(self) -> None:
        """The robot fills the view at each stop of the tour and in each lesson, and swims at some;
        to come to one, or to leave, ends a swim. At its end the camera stands where it stood
        before."""
        session = self._session
        old_stop = self._stop
        stop = self._stop = session.guide.stop
        if stop is old_stop:
            return
        self.end_swim()
        if old_stop is None:
            self._camera = self.robot.camera
        if stop is None:
            self.robot.aim(*self._camera)
            return
        self.robot.look_from("3D")
        self.robot.frame()
        if stop.swims:
            self._swimming.start(SwimSettings().plan(session.state))


FLOW_S = 6.0
"""The arrow of the water is as long as its way in this time [s]."""
BEYOND_M = 0.3
"""How far it begins beyond the path [m]."""
DEPTH_BELOW = 0.6
"""How far the floor is below the deepest point of the way [m]."""
NO_LINE = np.zeros((1, 2, 3), dtype=np.float32)
TRAIL_POINTS = 250


class SwimScene:
    """Draws a swim; nothing of it is there while no robot swims."""

    def __init__(
        self, client: viser.ClientHandle, swimming: Swimming, root: viser.FrameHandle
    ) -> None:
        """`root` carries the robot."""
        self._client = client
        self._swimming = swimming
        self._root = root
        scene = client.scene
        self._goal = Shape(
            scene, "/swim/goal", ASKED, opacity=0.45, visible=False, cast_shadow=False
        )
        self._reference = scene.add_icosphere(
            "/swim/reference", 0.035, color=ASKED, visible=False, cast_shadow=False
        )
        fade: dict[str, Any] = {"fade_distance": 14.0, "fade_strength": 1.4, "shadow_opacity": 0.18}
        self._water = Shape(
            scene, "/swim/water", WATER, opacity=0.9, visible=False, cast_shadow=False
        )
        self._floor = add_floor(scene, "/swim/floor", 14.0, 0.25, 1.0, visible=False, **fade)
        self._trail = scene.add_line_segments(
            "/swim/trail",
            NO_LINE,
            DELIVERED,
            thickness=3.5,
            thickness_units="screen",
            visible=False,
        )
        self._shown: Swimmer | None = None
        self._behind: Moment | None = None
        self._ahead: Moment | None = None
        self._clock = 0.0

    def refresh(self, swimmer: Swimmer | None, moment: Moment | None, display: Display) -> None:
        """Show the newest moment."""
        for node in (self._goal.node, self._reference, self._floor, self._water.node, self._trail):
            set_properties(node, visible=swimmer is not None)
        paint_floor(self._floor, display.dark)
        if swimmer is None or moment is None:
            if self._shown is not None:
                run_script(self._client.gui, "finlabFrames.follow(null);")
            self._shown = self._ahead = None
            return
        if swimmer is not self._shown:
            self._begin(swimmer)
        self._behind = self._ahead or moment
        self._ahead = moment
        self._clock = self._behind.time
        set_properties(self._reference, position=moment.reference)
        path = swimmer.path
        flow = swimmer.visible_moment.flow
        position = np.array(
            [path[:, 0].min() - BEYOND_M, path[:, 1].max() + BEYOND_M, path[:, 2].mean()]
        )
        self._water.show(force_arrow, np.round(FLOW_S * flow, 2), position, 0.03)
        positions = moment.record[:, PLACE : PLACE + 3]
        positions = positions[:: max(1, len(positions) // TRAIL_POINTS)]
        points = (
            np.stack([positions[:-1], positions[1:]], axis=1).astype(np.float32)
            if len(positions) > 1
            else NO_LINE
        )
        set_properties(self._trail, points=points, colors=np.array(DELIVERED, dtype=np.uint8))

    def _begin(self, swimmer: Swimmer) -> None:
        """Another swim: its way, the robot at its start, and the camera where all of it can be
        seen."""
        self._shown = swimmer
        self._ahead = None
        self._goal.show(_goal, swimmer.path)
        set_properties(
            self._floor, position=np.array([0.0, 0.0, swimmer.path[:, 2].min() - DEPTH_BELOW])
        )
        start = swimmer.visible_moment.pose
        self._pose(start)
        self._look(swimmer.path, start[:3], view_size(swimmer.layout))
        run_script(self._client.gui, f"finlabFrames.follow({start[:3].tolist()});")

    def _look(self, path: Array, start: Array, size: float) -> None:
        """Show the robot, of a size, and much of the path (N, 3); `frames.js` lets the camera go
        along."""
        extent = float(np.linalg.norm(np.ptp(path, axis=0)[:2]))
        distance = max(0.18 * extent, 0.9 * size)
        position = start + distance * np.array([-0.6, -0.75, 0.8])
        aim_camera(self._client, position, start + distance * np.array([0.1, 0.0, -0.05]))

    def _pose(self, pose: Array) -> None:
        set_properties(self._root, position=pose[:3], wxyz=pose[3:] / np.linalg.norm(pose[3:]))

    def animate(self, elapsed: float) -> None:
        """Move on by some time on the wall [s], towards the last moment and never beyond it."""
        swimming = self._swimming
        behind = self._behind
        ahead = self._ahead
        if (
            behind is None
            or ahead is None
            or swimming.swimmer is not self._shown
            or self._clock >= ahead.time
        ):
            return
        self._clock = min(
            self._clock + elapsed * (swimming.pace.rate or swimming.pace.speed), ahead.time
        )
        fraction = (self._clock - behind.time) / (ahead.time - behind.time)
        start = behind.pose
        end = ahead.pose.copy()
        if start[3:] @ end[3:] < 0:
            end[3:] *= -1.0
        self._pose((1 - fraction) * start + fraction * end)


def _goal(path: Array) -> Mesh:
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    points_apart = path[np.concatenate([[True], steps > 1e-6])]
    return joined(tube(points_apart, 0.006, 8)) if len(points_apart) > 1 else NOTHING
