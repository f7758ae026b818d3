"""What is seen beside the panel: the robot that is designed, or those that swim."""

import numpy as np

from webapp.markup.corner import legend, set_rows
from webapp.scene.robot_scene import RobotScene
from webapp.scene.swim_scene import SwimScene
from webapp.session.lessons import Lesson
from webapp.session.swim_plan import SwimSettings
from webapp.session.tour import STEPS
from webapp.tasks.analyst import Findings
from webapp.tasks.answering import Answering
from webapp.tasks.context import Context
from webapp.tasks.improving import Improver
from webapp.tasks.swimming import Swimming
from webapp.theme import BRAND

NOWHERE = (None, None)
"""Neither at a stop of the tour nor in a lesson."""


class Scenery:
    """Both scenes of one page, of which one is shown, and the theme."""

    def __init__(self, context: Context, swimming: Swimming) -> None:
        self._client, self._session, self._swimming = context.client, context.session, swimming
        self._dark: bool | None = None
        self._guide: tuple[int | None, Lesson | None] = NOWHERE
        self._camera = (np.zeros(3), np.zeros(3))
        """Where the camera stood before the tour or lesson, and looked at."""
        self.robot = RobotScene(context)
        self.swim = SwimScene(self._client, swimming)
        self.swims = False
        """Whether the robots that swim are on the screen."""
        self.legend = ""
        """What is drawn of the robot that is designed, as markup."""

    def refresh(self, answering: Answering, improver: Improver, findings: Findings | None) -> None:
        """Show what has been found for the session's state."""
        self._follow_guide()
        self._apply_theme()
        found = improver.findings
        offered = found.layout if found is not None and found.improved else None
        display = self._session.display
        self.robot.refresh(answering.shown, findings, offered)
        self.robot.flap()
        self.swims = self._swimming.swimmer is not None
        self.robot.show(not self.swims)
        drawn = set_rows(findings if display.drawn != "none" else None)
        self.legend = legend(self.robot.newtons, self.robot.torque, self.robot.cut, drawn)
        self.refresh_swim()

    def hide(self) -> None:
        """Nothing is shown of the robot that is designed: what stands there may be another one's."""
        self.robot.show(False)
        self.legend = ""

    def refresh_swim(self) -> None:
        """Show where the robots that swim are."""
        self.swim.refresh(self._session.display.dark)

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

    def _follow_guide(self) -> None:
        """The robot fills the view at each stop of the tour and in each lesson, and swims at some; to come to
        one, or to leave, ends a swim. At its end the camera stands where it stood before."""
        session, before = self._session, self._guide
        stop, _ = self._guide = session.stop, session.lesson
        if self._guide == before:
            return
        self.end_swim()
        if before == NOWHERE:
            self._camera = self.robot.camera
        if not session.guided:
            self.robot.aim(*self._camera)
            return
        self.robot.look_from("3D")
        self.robot.frame()
        if stop is not None and STEPS[stop].swims:
            self._swimming.start(SwimSettings().plan(session.state))

    def _apply_theme(self) -> None:
        """Light or dark."""
        if self._session.display.dark != self._dark:
            self._dark = self._session.display.dark
            self._client.gui.configure_theme(
                dark_mode=self._dark, show_logo=False, show_share_button=False, brand_color=BRAND
            )
