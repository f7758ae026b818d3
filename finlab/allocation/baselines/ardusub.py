"""Method `ardusub`: the motor factors of ArduSub with its scaling by groups, for robots of thrusters.

Each thruster's output is the sum of six factors times six demands, whatever the geometry. Roll, pitch and
throttle are one group and yaw, forward and lateral the other; each is scaled down until no output of its own
exceeds the limits, then the two are added and clipped (ArduSub, `AP_Motors6DOF`, frame VECTORED_6DOF). It is
posed at full strength: the demand of an axis alone gives the wrench that is asked for, up to the thrusters'
limits in newton, and failed thrusters are taken out. Factors are those of the frame of ArduSub that the
thrusters make; of any other robot they are those that its geometry suggests: shares of the strongest.
"""

from typing import ClassVar

import numpy as np
from scipy.optimize import linear_sum_assignment

from finlab.allocation.method import LeastErrorMethod
from finlab.allocation.policy import AXES as WRENCH_AXES
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.exchange.motor_factors import AXES, FRAMES, SIGNS

COLUMNS = np.array([WRENCH_AXES.index(axis) for axis in AXES])
"""Axis of the wrench for each column of factors."""
GROUPS = ((0, 1, 3), (2, 4, 5))
"""Columns that are scaled together: roll, pitch and throttle; yaw, forward and lateral."""
ORDER = (("Tx", "Ty", "Fz"), ("Tz", "Fx", "Fy"))
"""The same as groups of axes; neither is meant to give way to the other."""
SMALL = 0.15
"""Share of the strongest thruster on an axis below which geometry suggests no factor, and of the strongest
force or torque below which a frame of ArduSub does not serve an axis."""
ALIKE = 0.3
"""By how much each factor of a frame may differ from what geometry suggests."""


class ArduSub(LeastErrorMethod):
    """Factors times demands, scaled by groups; see the module."""

    name = "ardusub"
    takes = "thrusters"
    order: ClassVar = ORDER

    def prepare(self) -> None:
        effectiveness = self.plant.effectiveness[:, 0, COLUMNS] * SIGNS
        self.factors = frame_factors(effectiveness)
        """Factors (n, 6)."""
        given = (effectiveness * self.factors).sum(axis=0)
        # Newton per unit of the wrench; an axis that the factors do not serve is left out.
        self._per = np.divide(self.factors, given, out=np.zeros_like(self.factors), where=given > 1e-9)

    def _solve(self, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        lower, upper = self.plant.lower[:, 0], self.plant.upper[:, 0]
        force = np.zeros((len(targets), self.plant.n))
        for group in GROUPS:
            columns = list(group)
            part = (SIGNS * targets[:, COLUMNS])[:, columns] @ self._per[:, columns].T
            room = np.where(part < 0.0, lower, upper)
            share = np.divide(room, part, out=np.full_like(part, np.inf), where=np.abs(part) > 1e-12)
            share[share <= 0.0] = np.inf  # a thruster that cannot reverse is clipped, and holds nobody back
            force += part * np.minimum(share.min(axis=1, keepdims=True), 1.0)
        command = np.zeros((*force.shape, 3))
        command[..., 0] = force
        return Solution(self.plant.feasible(command))


def frame_factors(effectiveness: Array) -> Array:
    """Factors (n, 6) for thrusters with these wrenches (n, 6) per newton, in ArduSub's columns and signs.

    A frame is known by its thrusters in any order, each of which may be mounted the other way round, and some
    of which may be lost.
    """
    strongest = np.abs(effectiveness).max(axis=0)
    suggested: Array = effectiveness / np.maximum(strongest, 1e-9)
    suggested[np.abs(suggested) < SMALL] = 0.0
    forces, torques = (np.isin(COLUMNS, part) for part in ([0, 1, 2], [3, 4, 5]))
    most = np.where(forces, strongest[forces].max(), strongest[torques].max())
    served = np.where(strongest >= SMALL * most, suggested, 0.0)
    for frame in sorted(FRAMES.values(), key=len):
        if len(frame) < len(suggested):
            continue
        known = frame / np.maximum(np.abs(frame).max(axis=0), 1e-9)
        apart = np.abs(served - np.array([known, -known])[:, :, None])  # (2, frame, own, 6)
        distance = apart.max(axis=-1)
        row, own = linear_sum_assignment(distance.min(axis=0))
        if distance.min(axis=0)[row, own].max() <= ALIKE:
            sign = np.where(distance[0, row, own] <= distance[1, row, own], 1.0, -1.0)
            found: Array = np.empty_like(served)
            found[own] = sign[:, None] * frame[row]
            return found
    return suggested
