"""Forces of moving fins on the hull: the cycle mean, resolved within the cycle, or of fins with soft tips.

A fin force model keeps the momentum that it needs from step to step; `step` gives each fin's planar force,
and `effectiveness` say what it does to the robot. `plants.py` names them all.
"""

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from finlab.actuators.fin.blade import Blade
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.angles import wrapped
from finlab.layout.arrays import own_effectiveness
from finlab.physics import plant_of
from finlab.vehicle.fin_motion import FinMotion

STILL = np.zeros(6)
"""Of a robot at rest in the water; see `FinForce.step`."""


class FinForce(Protocol):
    """Fin motion to force."""

    step_s: float
    """Longest step that resolves the force [s]."""
    effectiveness: Array
    """Wrench (n, 3, 6) of 1 N along each fin's shaft, e_h and e_z, about the true centre of gravity."""

    def step(self, motion: FinMotion, dt: float, water: Array = STILL) -> Array:
        """Force (n, 3) of each fin in its own frame (shaft, e_h, e_z) [N], the mean over the step that has
        just been taken; `water` (6,) is how the robot moves through the water [m/s, rad/s], body frame."""
        ...


class MeanForce:
    """The fin law of the layout: no ripple."""

    step_s = 0.02

    def __init__(self, layout: Layout) -> None:
        self._plant = plant_of(layout)
        self.effectiveness = self._plant.effectiveness

    def step(self, motion: FinMotion, dt: float, water: Array = STILL) -> Array:
        command = motion.mean_command
        command[:, 2] = wrapped(command[:, 2])
        result = self._plant.force(command)
        # One that does not beat gives nothing, whatever its law.
        result *= ((command[:, 0] > 0.0) & (command[:, 1] > 0.0))[:, None]
        return result


class RippleForce(MeanForce):
    """The mean force in two pulses per cycle, and a ripple of mean zero on top.

    The ripple is what a rigid plate of `Blade` feels normal to itself: the momentum of the water that it
    carries, m L^2/2 theta', and the drag of its strips, 1/6 rho Cd W L^3 theta' |theta'|. Over a cycle both
    have mean zero, so the mean force stays the fin law's. The fin points away from its thrust.
    """

    step_s = 0.01

    blade = Blade()

    def __init__(self, layout: Layout) -> None:
        super().__init__(layout)
        self._momentum = np.zeros((layout.n_fins, 2))

    def step(self, motion: FinMotion, dt: float, water: Array = STILL) -> Array:
        length = self.blade.length
        force = super().step(motion, dt) * (1.0 - np.cos(2 * motion.phase))[:, None]
        angle, speed = motion.angle + math.pi, motion.speed
        normal = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
        momentum = 0.5 * self.blade.virtual_mass * length**2 * speed[:, None] * normal
        drag = self.blade.force_drag * speed * np.abs(speed)
        force[:, 1:] -= (momentum - self._momentum) / dt + drag[:, None] * normal
        self._momentum = momentum
        return force


SUBSTEP_S = 0.0025
"""Longest step of the tip's equation [s]; a stiff tip swings at 4 Hz."""


@dataclass(frozen=True)
class SoftFin:
    """Dimensions and stiffness of a fin with a soft tip."""

    root: float = 0.08
    """Length of the driven part [m]."""
    stiffness: float = 3.0
    """Of the tip's spring [N m/rad]. The fins' stiffness is not published; at 3 the mean thrust at 1.5 Hz is
    near the fin law's."""
    damping: float = 0.02
    """Of the tip's spring [N m s/rad]."""
    blade: Blade = field(default_factory=Blade)


class FlexibleForce:
    """Forces of the fins of one layout; all fins are alike. Its `step` is that of `FinForce`."""

    step_s = 0.01

    def __init__(self, layout: Layout, fin: SoftFin | None = None) -> None:
        self.fin = SoftFin() if fin is None else fin
        self.effectiveness = own_effectiveness(layout)
        n = layout.n_fins
        self._tip_angle: Array | None = None
        self._tip_speed = np.zeros(n)
        self._root_angle, self._root_speed = np.zeros(n), np.zeros(n)
        self._momentum = np.zeros((n, 2))
        tip = self.fin.blade.length - self.fin.root
        nodes, weights = np.polynomial.legendre.leggauss(4)
        self._arm, self._weight = 0.5 * tip * (nodes + 1.0), 0.5 * tip * weights

    def step(self, motion: FinMotion, dt: float, water: Array = STILL) -> Array:
        angle, speed = motion.angle + math.pi, motion.speed  # the fin points away from its thrust
        if self._tip_angle is None:
            self._tip_angle, self._root_angle = angle.copy(), angle
        n_steps = max(1, math.ceil(dt / SUBSTEP_S - 1e-9))
        h = dt / n_steps
        acceleration = (speed - self._root_speed) / dt
        impulse = np.zeros_like(self._momentum)
        start = self._momentum
        root_angle, root_speed = self._root_angle, self._root_speed
        for _ in range(n_steps):
            root_speed = root_speed + acceleration * h
            root_angle = root_angle + root_speed * h
            impulse += self._substep(root_angle, root_speed, acceleration, h) * h
        self._root_angle, self._root_speed = angle, speed
        result = np.zeros((len(angle), 3))
        result[:, 1:] = (impulse - (self._momentum - start)) / dt
        return result

    def _substep(self, angle: Array, speed: Array, acceleration: Array, h: float) -> Array:
        """Moves the tips by `h` [s]; forces (n, 2) [N] along (e_h, e_z) but for the change of momentum."""
        assert self._tip_angle is not None
        fin, blade = self.fin, self.fin.blade
        a, b = fin.root, blade.length - fin.root
        mass, drag = blade.virtual_mass, blade.drag_per_length
        hessian = self._tip_angle - angle
        cosine, sine = np.cos(hessian), np.sin(hessian)
        across = a * speed * cosine
        strips = across[:, None] + self._arm * self._tip_speed[:, None]
        strip_drag = drag * strips * np.abs(strips) * self._weight
        moved = a * (acceleration * cosine - speed * sine * (2 * self._tip_speed - speed))
        torque = (
            -fin.stiffness * hessian
            - fin.damping * (self._tip_speed - speed)
            - 0.5 * mass * b**2 * moved
            - strip_drag @ self._arm
        )
        self._tip_speed = self._tip_speed + torque / (mass * b**3 / 3) * h
        self._tip_angle = self._tip_angle + self._tip_speed * h
        tangent = np.stack([np.cos(self._tip_angle), np.sin(self._tip_angle)], axis=-1)
        normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=-1)
        root_normal = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
        end = across + b * self._tip_speed
        slip = a * speed * sine
        root_drag = drag * speed * np.abs(speed) * a**3 / 3
        self._momentum = mass * (
            (0.5 * a**2 * speed)[:, None] * root_normal
            + (b * across + 0.5 * b**2 * self._tip_speed)[:, None] * normal
        )
        force: Array = (
            (mass * end * slip - strip_drag.sum(axis=1))[:, None] * normal
            - (0.5 * mass * end**2)[:, None] * tangent
            - root_drag[:, None] * root_normal
        )
        return force
