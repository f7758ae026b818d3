"""Handles on the asked wrench: drag the tip of the force, or of the torque as a vector, like a joystick."""

from collections.abc import Callable
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from webapp.handles import put

Array = NDArray[np.float64]
SIZE = 0.16
"""Length of a handle's arrows [m]."""
LIFT = np.array([0.0, 0.0, 0.16])
"""Where the torque's handle stands while nothing is asked, above the force's one [m]."""
TORQUE_LENGTH = 0.4
"""Way of the torque's handle per torque [m/(N m)]."""


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
