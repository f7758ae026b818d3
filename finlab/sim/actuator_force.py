"""Forces of all actuators of a robot that swims, by their own laws, in the water that meets them just now."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.layout import Layout
from finlab.layout.effectiveness import own_effectiveness
from finlab.physics import plant_of
from finlab.vehicle.actuator_motion import ActuatorMotion
from finlab.vehicle.fin_motion import FinMotion, fin_power

STEP_S = 0.02
"""Longest step that resolves the forces [s]."""


class Push(NamedTuple):
    """What n actuators do in a step."""

    force: Array
    """Forces (n, 3) in own frames [N]."""
    power: Array
    """Inertial and driving power (2, n) [W]; of what is no fin, none and that of its law."""


class ActuatorForce:
    """The actuators of one layout, the true one."""

    step_s = STEP_S

    def __init__(self, layout: Layout, fins: FinMotion) -> None:
        """Takes the true robot and how its fins move."""
        self.motion, self._beat = ActuatorMotion(layout, fins), fins
        of_fins, of_others = self.motion.of_fins, self.motion.of_others
        self.effectiveness = own_effectiveness(layout)
        """Wrench (n, 3, 6) of 1 N along each own axis, about the true centre of gravity."""
        if len(of_fins):
            self._fins = plant_of(layout.fins_alone)
        if len(of_others):
            others = tuple(layout.actuators[i] for i in of_others)
            self._others = plant_of(replace(layout, actuators=others))

    def step(self, command: Array, dt: float, water: Array, share: Array) -> Push:
        """Follows a command (n, 3) for `dt` [s].

        Args:
            command: NaN rows are lost and give nothing.
            dt: length of the step [s].
            water: how the robot moves through the water (6,) [m/s, rad/s], body frame.
            share: of its force that each actuator gives (n,).
        """
        motion = self.motion
        motion.step(command, dt)
        fins, fin_watts = np.zeros((0, 3)), np.zeros((2, 0))
        others, watts = np.zeros((0, 3)), np.zeros((2, 0))
        if len(motion.of_fins):
            fins = self.of_fins(dt) * share[motion.of_fins, None]
            fin_watts = np.array(fin_power(*self._beat.speed_and_acceleration(), self._fins.blade))
        if len(motion.of_others):
            mean = 0.5 * (motion.others.before + motion.others.value)
            works = share[motion.of_others] * motion.pushes[motion.of_others]
            others = self._others.force(mean, flow=water) * works[:, None]
            spent = self._others.power(mean, flow=water) * motion.pushes[motion.of_others]
            watts = np.array([0.0 * spent, spent])
        return Push(motion.joined(fins, others), motion.joined(fin_watts.T, watts.T).T)

    def of_fins(self, dt: float) -> Array:
        """Force (n, 3) of each fin in its own frame [N], the mean over the step `dt` [s] that has just been
        taken."""
        command = self._beat.mean_command
        command[:, 2] = wrapped(command[:, 2])
        # One that does not beat gives nothing, whatever its law.
        beats = (command[:, 0] > 0.0) & (command[:, 1] > 0.0)
        return self._fins.force(command) * beats[:, None]
