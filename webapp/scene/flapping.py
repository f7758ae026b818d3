"""The motion of the fins: each flaps about its zero direction with its own amplitude and frequency."""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

APART = 1.9
"""Between the phases of one fin and the next [rad]: different phases look alive, and the mean force does not
depend on them."""
LIMP = math.pi / 2
"""Where the blade of a failed fin hangs [rad]: down."""


class Flapping:
    """Where each blade is at the moment."""

    def __init__(self) -> None:
        """No fins yet."""
        self._phase: NDArray[np.floating] = np.zeros(0)
        self._command: Array = np.zeros((0, 3))

    def take(self, command: Array) -> None:
        """Other commands (n, 3), NaN for failed fins; the fins go on from where they are."""
        if len(command) != len(self._command):
            self._phase = np.arange(len(command)) * APART
        self._command = command

    def angles(self, elapsed: float, frozen: bool) -> list[float]:
        """Angle of each blade [rad] after some more time [s]; at its zero direction if `frozen`."""
        amplitude, frequency, direction = self._command.T
        alive = np.isfinite(amplitude)
        if frozen:
            return [float(a) for a in np.where(alive, direction, LIMP)]
        turned = self._phase + 2 * np.pi * np.where(alive, frequency, 0.0) * elapsed
        self._phase = turned % (2 * np.pi)
        swung = direction + amplitude * np.sin(self._phase)
        return [float(a) for a in np.where(alive, swung, LIMP)]
