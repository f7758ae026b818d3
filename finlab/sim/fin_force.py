"""Forces of moving fins on the hull: the cycle mean, or resolved within the cycle.

A fin force model keeps the momentum that it needs from step to step; `step` gives each fin's planar force.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from finlab.layout import Layout
from finlab.layout.angles import wrapped
from finlab.physics import plant_of
from finlab.sim.fin_motion import FinMotion

Array = NDArray[np.float64]


class FinShape(NamedTuple):
    """A fin as a plate; U-CAT's where nothing else is said."""

    length: float = 0.20
    """From the shaft to the tip [m]; U-CAT's robot description has 0.22, its simulator 0.18."""
    width: float = 0.10
    """Along the shaft [m]."""
    density: float = 1000.0
    """Of water [kg/m^3]."""
    drag_coefficient: float = 2.0
    """Of a plate broadside to the flow."""

    @property
    def virtual_mass(self) -> float:
        """Water moved per metre of length [kg/m]: pi/4 rho W^2."""
        return 0.25 * math.pi * self.density * self.width**2

    @property
    def drag_per_length(self) -> float:
        """Normal force per metre of length and squared speed [N s^2/m^3]: 1/2 rho Cd W."""
        return 0.5 * self.density * self.drag_coefficient * self.width


class FinForce(Protocol):
    """Fin motion to force."""

    step_s: float
    """Longest step that resolves the force [s]."""

    def step(self, motion: FinMotion, dt: float) -> Array:
        """Force (n, 3) of each fin in its own frame (shaft, e_h, e_z) [N], the mean over the step that has
        just been taken."""
        ...


class MeanForce:
    """The fin law of the layout with the motion of now: no ripple."""

    step_s = 0.02

    def __init__(self, layout: Layout) -> None:
        self._plant = plant_of(layout)

    def step(self, motion: FinMotion, dt: float) -> Array:
        command = motion.command
        command[:, 2] = wrapped(command[:, 2])
        result = self._plant.forces(command)
        result[(motion.amplitude <= 0.0) | (motion.frequency <= 0.0)] = 0.0
        return result


class RippleForce:
    """The mean force in two pulses per cycle, and a ripple of mean zero on top.

    The ripple is what a rigid plate of `FinShape` feels normal to itself: the momentum of the water that it
    carries, m L^2/2 theta', and the drag of its strips, 1/8 rho Cd W L^4 theta' |theta'|. Over a cycle both
    have mean zero, so the mean force stays the fin law's. The fin points away from its thrust.
    """

    step_s = 0.01

    def __init__(self, layout: Layout, shape: FinShape | None = None) -> None:
        self._mean = MeanForce(layout)
        self.shape = FinShape() if shape is None else shape
        self._momentum = np.zeros((layout.n_fins, 2))

    def step(self, motion: FinMotion, dt: float) -> Array:
        length = self.shape.length
        force = self._mean.step(motion, dt) * (1.0 - np.cos(2 * motion.phase))[:, None]
        angle, speed = motion.angle + math.pi, motion.speed
        normal = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
        momentum = 0.5 * self.shape.virtual_mass * length**2 * speed[:, None] * normal
        drag = 0.25 * self.shape.drag_per_length * length**4 * speed * np.abs(speed)
        force[:, 1:] -= (momentum - self._momentum) / dt + drag[:, None] * normal
        self._momentum = momentum
        return force
