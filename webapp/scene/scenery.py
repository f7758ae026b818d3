"""What is seen beside the panel: the robot that is designed, or those that swim."""

from collections.abc import Callable, Sequence

import numpy as np

from finlab.allocation.allocation import Allocation
from webapp.board import Board
from webapp.scene.robot_scene import RobotScene
from webapp.scene.swim_scene import SwimScene
from webapp.scene.wrench_nodes import Scale, fitting_scale, swim_scale
from webapp.session.lessons import Stop
from webapp.session.looking import Display
from webapp.session.swim_plan import SwimSettings
from webapp.tasks.context import Context
from webapp.tasks.swimmer import Swimmer
from webapp.tasks.swimming import Swimming
from webapp.theme import BRAND

FIRST = Scale(1.0, 1.0, False)


class Scenery:
    """Both scenes of one page, of which one is shown, and the theme."""

    def __init__(
        self, context: Context, swimming: Swimming, board: Board, fault: Callable[[Exception], None]
    ) -> None:
        """`board` lets it show the facts, `fault` tells of what went wrong with that."""
        self._client, self._session, self._swimming = context.client, context.session, swimming
        self._stop: Stop | None = None
        self._camera = (np.zeros(3), np.zeros(3))
        """Where the camera stood before the tour or lesson, and looked at."""
        self._fault = fault
        self._scale = self._swam = FIRST
        self._fitted: tuple[Sequence[float], Allocation | None] | None = None
        board.group(self._fail)
        board.act(self._show)
        self.robot = RobotScene(context, board)
        self.swim = SwimScene(self._client, swimming, self.robot.root)
        board.act(self.swim.refresh)

    def _show(self, display: Display, swimmer: Swimmer | None) -> None:
        """The theme, and the robot that is designed unless one swims."""
        self.robot.show(swimmer)
        if display.dark != self._dark:
            self._dark = display.dark
            self._client.gui.configure_theme(
                dark_mode=self._dark, show_logo=False, show_share_button=False, brand_color=BRAND
            )

    _dark: bool | None = None

    def fit(self, target: Sequence[float], shown: Allocation | None) -> Scale:
        """What arrows and rings stand for, given a target (6,) and what is shown of it, or in a swim."""
        swimmer = self._swimming.swimmer
        if swimmer is not None:
            self._swam = swim_scale(swimmer, self._swam)
            return self._swam
        self._swam = FIRST
        if (target, shown) != self._fitted:
            try:
                self._scale, self._fitted = fitting_scale(target, shown, self._scale), (target, shown)
            except Exception as error:
                self._scale = FIRST
                self._fault(error)
        return self._scale

    def _fail(self, error: Exception | None) -> None:
        if error is None:
            self.robot.show(self._swimming.swimmer)
        else:
            self.robot.hide()
            self._fault(error)

    def animate(self, elapsed: float) -> None:
        """Let time pass [s]: robots that swim move on."""
        if self._swimming.active:
            self._swimming.tick(elapsed)
            self.swim.animate(elapsed)

    def end_swim(self) -> None:
        """Go back from the robot that swims to the one that is designed."""
        if self._swimming.active:
            self._swimming.stop()
            self.robot.look_from("3D")

    def follow_guide(self) -> None:
        """The robot fills the view at each stop of the tour and in each lesson, and swims at some; to come to
        one, or to leave, ends a swim. At its end the camera stands where it stood before."""
        session, before = self._session, self._stop
        stop = self._stop = session.guide.stop
        if stop is before:
            return
        self.end_swim()
        if before is None:
            self._camera = self.robot.camera
        if stop is None:
            self.robot.aim(*self._camera)
            return
        self.robot.look_from("3D")
        self.robot.frame()
        if stop.swims:
            self._swimming.start(SwimSettings().plan(session.state))
