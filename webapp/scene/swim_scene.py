"""The water while robots swim: the way to go, where the robot should be, and the robot."""

from typing import Any

import numpy as np
import viser

from finlab.arrays import Array
from webapp.handles import put
from webapp.scene.meshes.mesh import force_arrow
from webapp.scene.shape import Shape
from webapp.scene.stage import add_floor, aim_camera, paint_floor
from webapp.scene.swim_robot import SwimRobot, goal
from webapp.scene.wrench_nodes import LENGTH
from webapp.session.display import Display
from webapp.tasks.moment import Moment
from webapp.tasks.swimmer import Swimmer
from webapp.tasks.swimming import Swimming
from webapp.theme import ASKED, WATER

ARROWS_N = 1.0
"""Force that an arrow of 0.1 m stands for while robots swim [N]: one for all, so that they compare."""
SCALE = LENGTH / ARROWS_N
"""Length of arrows [m/N]."""
FLOW_S = 6.0
"""The arrow of the water is as long as its way in this time [s]."""
BEYOND_M = 0.3
"""How far it begins beyond the path [m]."""
DEPTH_BELOW = 0.6
"""How far the floor is below the deepest point of the way [m]."""


class SwimScene:
    """Draws a swim; nothing of it is there while no robot swims."""

    def __init__(self, client: viser.ClientHandle, swimming: Swimming) -> None:
        self._client, self._swimming = client, swimming
        scene = client.scene
        self._goal = Shape(scene, "/swim/goal", ASKED, opacity=0.45, visible=False, cast_shadow=False)
        self._reference = scene.add_icosphere(
            "/swim/reference", 0.035, color=ASKED, visible=False, cast_shadow=False
        )
        fade: dict[str, Any] = {"fade_distance": 14.0, "fade_strength": 1.4, "shadow_opacity": 0.18}
        self._water = Shape(scene, "/swim/water", WATER, opacity=0.9, visible=False, cast_shadow=False)
        self._floor = add_floor(scene, "/swim/floor", 14.0, 0.25, 1.0, visible=False, **fade)
        self._robot = SwimRobot(scene, "/swim/robot0")
        self._shown: Swimmer | None = None

    def refresh(self, swimmer: Swimmer | None, moment: Moment | None, display: Display) -> None:
        """Show the newest moment."""
        for node in (self._goal.node, self._reference, self._floor, self._water.node):
            put(node, visible=swimmer is not None)
        paint_floor(self._floor, display.dark)
        if swimmer is None or moment is None:
            self._robot.hide()
            self._shown = None
            return
        if swimmer is not self._shown:
            self._begin(swimmer)
        put(self._reference, position=moment.reference)
        self._draw_water(swimmer)
        self._robot.take(moment, SCALE)

    def _begin(self, swimmer: Swimmer) -> None:
        """Another swim: its robot, its way, and the camera where all of it can be seen."""
        self._shown = swimmer
        self._robot.begin(swimmer.layout, swimmer.shown)
        self._goal.show(goal, swimmer.path)
        put(self._floor, position=np.array([0.0, 0.0, swimmer.path[:, 2].min() - DEPTH_BELOW]))
        self._look(swimmer.path)

    def _draw_water(self, swimmer: Swimmer) -> None:
        """An arrow for the velocity of the water, beyond the path."""
        path, flow = swimmer.path, swimmer.shown.flow
        place = np.array([path[:, 0].min() - BEYOND_M, path[:, 1].max() + BEYOND_M, path[:, 2].mean()])
        self._water.show(force_arrow, np.round(FLOW_S * flow, 2), place, 0.03)

    def _look(self, path: Array) -> None:
        """Let the camera stand where the whole path (N, 3) can be seen."""
        low, high = path.min(axis=0), path.max(axis=0)
        distance = max(0.75 * float(np.linalg.norm((high - low)[:2])), 1.2)
        # The lower part of the view is behind the plots, so the path belongs into the upper one.
        middle = (low + high) / 2 + distance * np.array([-0.1, -0.22, 0.0])
        place = middle + distance * np.array([-0.35, -0.75, 0.75])
        aim_camera(self._client, place, middle - np.array([0.0, 0.0, 0.1]))

    def animate(self, elapsed: float) -> None:
        """Let the robot move by some time on the wall [s]."""
        swimming = self._swimming
        if swimming.swimmer is not None and swimming.swimmer is self._shown:
            self._robot.animate(elapsed * (swimming.pace.rate or swimming.pace.speed))
