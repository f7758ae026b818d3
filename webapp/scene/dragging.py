"""What is dragged in the 3D view becomes intents: one step of undo from the first touch to the last."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from webapp.session import Session


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
