"""What fins really do while a robot swims, by name: the truth that methods and fits are held against."""

import math

import numpy as np

from finlab.actuators.fin.blade import Blade
from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout import Layout
from finlab.layout.angles import wrapped
from finlab.layout.arrays import moved_effectiveness
from finlab.physics import plant_of
from finlab.vehicle.fin_motion import FinMotion

CENTER = (-0.016, 0.012, 0.0)
"""The true centre of gravity of `offset` as the layout's frame sees it [m]: 2 cm off."""
ASKEW = math.radians(5.0)
"""How far the fins of `offset` are turned about the vertical [rad], one this way and the next that way."""


class MeanForce:
    """The fin law of the layout: no ripple."""

    step_s = 0.02
    """Longest step that resolves the force [s]."""

    def __init__(self, layout: Layout) -> None:
        self._plant = plant_of(layout)
        self.effectiveness = self._plant.effectiveness
        """Wrench (n, 3, 6) of 1 N along each fin's shaft, zero and shaft x zero, about the true centre of
        gravity."""

    def step(self, motion: FinMotion, dt: float) -> Array:
        """Force (n, 3) of each fin in its own frame [N], the mean over the step `dt` [s] that has just been
        taken."""
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

    def step(self, motion: FinMotion, dt: float) -> Array:
        length = self.blade.length
        force = super().step(motion, dt) * (1.0 - np.cos(2 * motion.phase))[:, None]
        angle, speed = motion.angle + math.pi, motion.speed
        normal = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
        momentum = 0.5 * self.blade.virtual_mass * length**2 * speed[:, None] * normal
        drag = self.blade.force_drag * speed * np.abs(speed)
        force[:, 1:] -= (momentum - self._momentum) / dt + drag[:, None] * normal
        self._momentum = momentum
        return force


class OffsetForce(MeanForce):
    """The fins of a robot that is not built as drawn: its centre of gravity lies elsewhere, and its fins are
    mounted askew.

    The robot is ballasted to lie level all the same, so its centre of buoyancy is where the layout says, seen
    from the true centre of gravity.
    """

    def __init__(self, layout: Layout) -> None:
        super().__init__(layout)
        turn = ASKEW * (-1.0) ** np.arange(layout.n_fins)
        x, y, z = np.moveaxis(layout.frames, -1, 0)
        cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
        frames = np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1)
        self.effectiveness = moved_effectiveness(layout, layout.position - np.array(CENTER), frames)


PLANTS = {"mean": MeanForce, "ripple": RippleForce, "offset": OffsetForce}
"""`mean`: the layout's fin law. `ripple`: the same within the cycle. `offset`: what no layout says, a
robot that is not built as drawn."""


def make_plant(name: str, layout: Layout) -> MeanForce:
    """The fin force model called `name`; a `FinlabError` where there is none."""
    if name not in PLANTS:
        raise FinlabError(f"plant: expected one of {', '.join(PLANTS)}, got {name!r:.60}")
    return PLANTS[name](layout)
