"""What the robot is to do over time: a trajectory to follow, or a speed and a depth to keep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from finlab.control import Setpoint

Array = NDArray[np.float64]


class Task(Protocol):
    """A setpoint for every time, and where to begin."""

    @property
    def name(self) -> str:
        """What it is called in logs and tables."""
        ...

    @property
    def duration_s(self) -> float:
        """When it is over [s]."""
        ...

    def setpoint(self, time: float) -> Setpoint:
        """Where to be, or how fast, at `time` [s]; after the end as at the end."""
        ...

    def start(self) -> tuple[Array, float]:
        """Position (3,) [m] and heading [rad] to begin with."""
        ...


@dataclass(frozen=True)
class Cruise:
    """Keep a speed and a depth, from rest."""

    speed: float
    """Surge speed [m/s]."""
    depth: float = 1.0
    """Below the world's origin [m]."""
    duration_s: float = 30.0
    """How long [s]."""

    @property
    def name(self) -> str:
        """Speed in words."""
        return f"cruise at {self.speed:g} m/s"

    def setpoint(self, time: float) -> Setpoint:
        """The same at all times."""
        return Setpoint(np.array([np.nan, np.nan, -self.depth]), self.speed)

    def start(self) -> tuple[Array, float]:
        """At depth, heading along x."""
        return np.array([0.0, 0.0, -self.depth]), 0.0
