"""What is dragged in the 3D view: gizmos, and those that move the asked wrench like a joystick."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import viser

from finlab.arrays import Array
from webapp.handles import put
from webapp.session import Session

SIZE = 0.16
"""Length of a handle's arrows [m]."""
LIFT = np.array([0.0, 0.0, 0.16])
"""Where the torque's handle stands while nothing is asked, above the force's one [m]."""
TORQUE_LENGTH = 0.4
"""Way of the torque's handle per torque [m/(N m)]."""


def add_gizmo(
    scene: viser.SceneApi, name: str, size: float, on_drag: Callable[[str], None], **options: Any
) -> viser.TransformControlsHandle:
    """A gizmo that shows through everything, idle at first; `on_drag` gets `start`, `update` and `end`."""
    gizmo = scene.add_transform_controls(name, size, depth_test=False, active_axes=(False,) * 3, **options)

    @gizmo.on_update
    async def _dragged(event: Any) -> None:
        if event.client is not None:
            on_drag(event.phase)

    return gizmo


class Grips:
    """Two gizmos, hidden until they are wanted."""

    def __init__(
        self, scene: viser.SceneApi, session: Session, do: Callable[[Callable[[], object]], None]
    ) -> None:
        """Build them; `do` carries out an intent about the target of `session`."""
        self._session, self._do = session, do
        self._base = [np.zeros(3), np.zeros(3)]
        self._length = [1.0, TORQUE_LENGTH]
        self.dragged: int | None = None
        """Which of them is in the user's hand: 0 force, 1 torque."""
        self._gizmos = [
            add_gizmo(
                scene,
                f"/robot/grip/{name}",
                SIZE,
                partial(self._moved, k),
                line_width=4.0,
                disable_rotations=True,
                visible=False,
            )
            for k, name in enumerate(("force", "torque"))
        ]
        for name in ("force", "torque"):
            scene.add_label(f"/robot/grip/{name}/label", name, anchor="bottom-center", font_screen_scale=0.8)

    def _moved(self, k: int, phase: str) -> None:
        self.dragged = None if phase == "end" else k
        if phase == "start":
            self._session.history.end_merge()
            return
        vector = (np.array(self._gizmos[k].position) - self._base[k]) / self._length[k]
        self._do(partial(self._session.drag_target, 3 * k, vector.tolist(), phase == "end"))

    def refresh(self, wanted: bool, target: Array, hub: Array, scale: float) -> None:
        """Show the handles of a target (6,) on the arrows that begin at `hub` (3,), `scale` [m/N] long."""
        self._base = [hub, hub + LIFT]
        self._length = [scale, TORQUE_LENGTH]
        for k, gizmo in enumerate(self._gizmos):
            put(gizmo, visible=wanted, active_axes=(wanted,) * 3)
            if self.dragged != k:
                vector = target[3 * k : 3 * k + 3]
                put(gizmo, position=np.asarray(self._base[k] + vector * self._length[k]))
