"""What is dragged in the 3D view becomes intents, and handles to drag the asked wrench like a joystick."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from webapp.handles import put
from webapp.session import Session

Array = NDArray[np.float64]
SIZE = 0.16
"""Length of a handle's arrows [m]."""
LIFT = np.array([0.0, 0.0, 0.16])
"""Where the torque's handle stands while nothing is asked, above the force's one [m]."""
TORQUE_LENGTH = 0.4
"""Way of the torque's handle per torque [m/(N m)]."""


class Dragging:
    """Hears from the handles in the view."""

    def __init__(self, session: Session, do: Callable[[Callable[[], object]], None]) -> None:
        """`do` carries out an intent on the event loop."""
        self._session, self._do = session, do

    def fin(self, name: str, phase: str, position: tuple[float, float, float], angle: float) -> None:
        """A fin is at a position [m] under a mounting angle [rad]; `phase` is start, update or end."""
        if phase == "start":
            self._session.history.end_merge()
        elif phase == "end":
            self._do(partial(self._session.end_drag, name, position, angle))
        else:
            self._do(partial(self._session.drag_fin, name, position, angle))

    def wrench(self, first: int, phase: str, vector: NDArray[np.float64]) -> None:
        """Force (`first` 0) or torque (3) of the target is at a vector (3,) [N] or [N m]."""
        if phase == "start":
            self._session.history.end_merge()
        else:
            self._do(partial(self._session.drag_target, first, vector.tolist(), phase == "end"))


class Grips:
    """Two gizmos, hidden until they are wanted."""

    def __init__(self, scene: viser.SceneApi, on_drag: Callable[[int, str, Array], None]) -> None:
        """Build them.

        Args:
            scene: the client's scene.
            on_drag: called with the first axis (0 of the force, 3 of the torque), the phase (`start`,
                `update`, `end`) and the new vector (3,) [N or N m].
        """
        self._on_drag = on_drag
        self._base = [np.zeros(3), np.zeros(3)]
        self._length = [1.0, TORQUE_LENGTH]
        self.dragged: int | None = None
        """Which of them is in the user's hand: 0 force, 1 torque."""
        self._gizmos = [
            scene.add_transform_controls(
                f"/robot/grip/{name}",
                SIZE,
                line_width=4.0,
                depth_test=False,
                disable_rotations=True,
                active_axes=(False,) * 3,
                visible=False,
            )
            for name in ("force", "torque")
        ]
        self._labels = [
            scene.add_label(f"/robot/grip/{name}/label", name, anchor="bottom-center", font_screen_scale=0.8)
            for name in ("force", "torque")
        ]
        for k, gizmo in enumerate(self._gizmos):

            @gizmo.on_update
            async def _dragged(event: Any, k: int = k) -> None:
                if event.client is not None:
                    self._moved(k, event.phase)

    def _moved(self, k: int, phase: str) -> None:
        self.dragged = None if phase == "end" else k
        vector = (np.array(self._gizmos[k].position) - self._base[k]) / self._length[k]
        self._on_drag(3 * k, phase, vector)

    def refresh(self, wanted: bool, target: Array, hub: Array, scale: float) -> None:
        """Show the handles of a target (6,) on the arrows that begin at `hub` (3,), `scale` [m/N] long."""
        self._base = [hub, hub + LIFT]
        self._length = [scale, TORQUE_LENGTH]
        for k, gizmo in enumerate(self._gizmos):
            put(gizmo, visible=wanted, active_axes=(wanted,) * 3)
            if self.dragged != k:
                vector = target[3 * k : 3 * k + 3]
                put(gizmo, position=np.asarray(self._base[k] + vector * self._length[k]))
