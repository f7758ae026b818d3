"""What real fins do within a beat, which no method here is given: a swim whose fins' forces
swing."""

import math

import numpy as np

from finlab.actuators.law import Blade
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.swim.simulation import ClosedLoop
from finlab.swim.simulation.devices import ActuatorForce
from finlab.swim.vehicle.fin_motion import FinMotion, FinSteps


class RippleForce(ActuatorForce):
    """The mean force in two pulses per cycle, and a ripple of mean zero on top.

    The ripple is what a rigid plate of `Blade` feels normal to itself: the momentum of the water
    that it carries, m L^2/2 theta', and the drag of its strips, 1/6 rho Cd W L^3 theta' |theta'|.
    Over a cycle both have mean zero, so the mean force stays the fin law's. The fin points away
    from its thrust.
    """

    step_s = 0.01
    blade = Blade()

    def __init__(self, layout: Layout, fins: FinMotion) -> None:
        super().__init__(layout, fins)
        self._momentum = np.zeros((layout.n_fins, 2))

    def of_fins(self, steps: FinSteps, dt: float) -> Array:
        """See `ActuatorForce`."""
        length = self.blade.length
        force = super().of_fins(steps, dt) * (1.0 - np.cos(2 * steps.phase))[..., None]
        angle = steps.angle + math.pi
        normal = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
        speed = steps.speed[..., None]
        momentum = 0.5 * self.blade.virtual_mass * length**2 * speed * normal
        drag = self.blade.drag_per_length * length**3 / 3.0 * speed * np.abs(speed)
        change = np.diff(momentum, axis=0, prepend=self._momentum[None])
        force[..., 1:] -= change / dt + drag * normal
        self._momentum = momentum[-1]
        return force


def rippled(loop: ClosedLoop) -> ClosedLoop:
    """The swim, at its start, with fins whose forces swing."""
    loop._forces = RippleForce(loop.layout, loop.fin_motion)
    loop.motion = loop._forces.motion
    return loop
