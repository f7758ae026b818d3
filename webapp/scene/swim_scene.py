"""The water while robots swim: the way to go, where they should be, and up to two of them."""

from typing import Any

import numpy as np
import viser

from finlab.layout import Layout
from webapp.handles import put
from webapp.scene.meshes.mesh import force_arrow
from webapp.scene.shape import Shape
from webapp.scene.stage import add_floor, aim_camera, paint_floor
from webapp.scene.swim_robot import SwimRobot, goal
from webapp.scene.wrench_nodes import LENGTH
from webapp.tasks.moment import Moment
from webapp.tasks.swimmer import Swimmer
from webapp.tasks.swimming import Swimming
from webapp.theme import ASKED, DELIVERED, OTHER, WATER

ARROWS_N = 1.0
"""Force that an arrow of 0.1 m stands for while robots swim [N]: one for all, so that they compare."""
ROBOTS = ((DELIVERED, None), (OTHER, 0.45))
"""Colours of the robots' trails, and how opaque the robots are."""
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
        self._robots: dict[int, SwimRobot] = {}
        self._shown: tuple[Swimmer, ...] = ()

    def refresh(self, dark: bool) -> None:
        """Show the moment that is looked at."""
        swimming = self._swimming
        swimmers = swimming.swimmers
        visible = bool(swimmers)
        put(self._goal.node, visible=visible)
        put(self._reference, visible=visible)
        put(self._floor, visible=visible)
        put(self._water.node, visible=visible)
        paint_floor(self._floor, dark)
        if not visible:
            for robot in self._robots.values():
                robot.hide()
            self._shown = ()
            return
        moments = swimming.seen
        if swimmers != self._shown:
            self._begin(moments)
        put(self._reference, position=moments[0].reference)
        self._draw_water(moments[0].flow)
        for k, moment in enumerate(moments):
            if swimming.at is None:
                self._robots[k].take(moment, SCALE)
            else:
                self._robots[k].stand(moment, SCALE)

    def _begin(self, moments: tuple[Moment, ...]) -> None:
        """Another swim: its robots, its way, and the camera where all of it can be seen."""
        self._shown = self._swimming.swimmers
        for k, robot in self._robots.items():
            if k >= len(self._shown):
                robot.hide()
        for k, (swimmer, moment) in enumerate(zip(self._shown, moments, strict=True)):
            self._robot(k, swimmer.layout, moment)
        path = self._shown[0].path
        self._goal.show(goal, path)
        put(self._floor, position=np.array([0.0, 0.0, path[:, 2].min() - DEPTH_BELOW]))
        self._look()

    def _robot(self, k: int, layout: Layout, moment: Moment) -> SwimRobot:
        """A robot at its start; it is made when it is first needed."""
        if k not in self._robots:
            self._robots[k] = SwimRobot(self._client.scene, f"/swim/robot{k}", *ROBOTS[k])
        self._robots[k].begin(layout, moment)
        return self._robots[k]

    def _draw_water(self, flow: np.ndarray) -> None:
        """An arrow for the velocity of the water, beyond the path."""
        path = self._shown[0].path
        place = np.array([path[:, 0].min() - BEYOND_M, path[:, 1].max() + BEYOND_M, path[:, 2].mean()])
        self._water.show(force_arrow, np.round(FLOW_S * flow, 2), place, 0.03)

    def _look(self) -> None:
        """Let the camera stand where the whole path can be seen."""
        path = self._shown[0].path
        low, high = path.min(axis=0), path.max(axis=0)
        distance = max(0.75 * float(np.linalg.norm((high - low)[:2])), 1.2)
        # The lower part of the view is behind the plots, so the path belongs into the upper one.
        middle = (low + high) / 2 + distance * np.array([-0.1, -0.22, 0.0])
        place = middle + distance * np.array([-0.35, -0.75, 0.75])
        aim_camera(self._client, place, middle - np.array([0.0, 0.0, 0.1]))

    def animate(self, elapsed: float) -> None:
        """Let the robots move by some time on the wall [s]."""
        swimming = self._swimming
        if not swimming.swimmers or swimming.swimmers != self._shown:
            return
        rate = swimming.pace.rate or swimming.pace.speed
        for robot in self._robots.values():
            robot.animate(elapsed * rate)
