"""From unknowns to what a robot does: the wrenches of its fins over a swim, and the body that they move."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from finlab.arrays import Array
from finlab.fit.robot.swim import STEP_S, Swim
from finlab.fit.robot.swing import swing_forces
from finlab.fit.robot.unknowns import SENSORS, Unknowns, blocks_of
from finlab.layout import Layout
from finlab.layout.arrays import force_effectiveness
from finlab.physics import plant_of
from finlab.vehicle.body import complete_body, dynamics_of
from finlab.vehicle.fossen import Dynamics
from finlab.vehicle.many_bodies import Bodies

TYPICAL_SPEED = np.array([0.2, 0.2, 0.2, 0.5, 0.5, 0.5])
"""At which linear and quadratic damping are compared [m/s, rad/s]."""
DAMPING_DOUBT = 0.5
"""How far damping may be off, as a share of what the layout says."""


class RobotModel:
    """One layout, and the swims from which it is learned, M steps in all."""

    def __init__(self, layout: Layout, swims: Sequence[Swim], doubts: Mapping[str, float]) -> None:
        """Takes the robot as it is believed to be, and by what factors some blocks may be farther off."""
        self.layout, self.body = layout, complete_body(layout)
        self.dynamics = Dynamics(*map(np.array, dynamics_of(self.body)))
        """Of that body; arrays."""
        known = self.dynamics
        at_speed = known.linear + known.quadratic * TYPICAL_SPEED
        at_speed = np.maximum(at_speed, 0.1 * known.inertia * TYPICAL_SPEED)
        doubt = DAMPING_DOUBT * np.stack([at_speed, at_speed / TYPICAL_SPEED])
        self.blocks = {
            name: replace(block, scale=block.scale * doubts.get(name, 1.0))
            for name, block in blocks_of(layout.names, doubt).items()
        }
        plant = plant_of(layout)
        self.motion = np.concatenate([swim.motion for swim in swims])
        working = (self.motion[..., 0] > 0.0) & (self.motion[..., 1] > 0.0)
        self.alone = np.where(working[..., None], plant.forces(self.motion), 0.0)
        """What each fin gives by the layout's law (M, SUBSTEPS, n, 3) [N], in its own frame."""
        self.middle = [float(np.median(self.motion[..., k][working])) for k in range(2)]
        """Amplitude [rad] and frequency [Hz] at which a fin has the strength that is given."""
        ends = [np.quantile(self.motion[..., k][working], (0.005, 0.995)) for k in range(2)]
        self.seen = [(max(float(low), 1e-3), max(float(high), 2e-3)) for low, high in ends]
        """Amplitudes and frequencies between which nearly all were; the law is fitted no further."""
        self._shapes = self.shape_terms(self.motion)
        self._beat = np.concatenate([swing_forces(layout, swim.command) for swim in swims])
        self.late = [0] * len(SENSORS)
        """Whole steps by which each sensor is late, as far as is known."""

    def shape_terms(self, command: Array) -> Array:
        """Terms (..., 5) of the logarithm of a fin's true law over the layout's, for commands (..., 3): a
        polynomial, so that it ends somewhere where fins hardly beat."""
        (low_a, high_a), (low_f, high_f) = self.seen
        a = np.clip(command[..., 0], low_a, high_a) / self.middle[0]
        f = np.clip(command[..., 1], low_f, high_f) / self.middle[1]
        p, q = a - 1.0, f - 1.0
        return np.stack([p, q, p * p, p * q, q * q], axis=-1)

    def wrench(self, unknowns: Unknowns, vector: Array) -> Array:
        """Mean wrench (M, 6) of each step for one vector (size,) of unknowns."""
        layout, force = self.layout, deflected(self.alone, unknowns.of("lean", vector))
        share = np.exp(unknowns.of("strength", vector)) * np.ones(force.shape[:-1])
        shape = unknowns.part("shape", vector)
        if shape is not None:
            share *= shape_factor(self._shapes, shape)
        position = layout.position - unknowns.of("center", vector)
        columns = force_effectiveness(position, layout.mounting_angle + unknowns.of("mounting", vector))
        mean = (force * share[..., None]).mean(axis=1)
        beat = unknowns.part("beat", vector)
        if beat is not None:
            mean -= beat[-1] * np.gradient(mean, STEP_S, axis=0)
            mean[..., 1:] += self._beat @ beat[:-1]
        wrench: Array = mean.reshape(len(mean), -1) @ columns.reshape(-1, 6)
        wrench[:, [0, 1, 5]] += unknowns.of("bias", vector)
        return wrench

    def bodies(self, unknowns: Unknowns, vectors: Array) -> Bodies:
        """The bodies (..., B) of B vectors (B, size)."""
        known = self.dynamics
        return Dynamics(
            (known.inertia * np.exp(unknowns.of("inertia", vectors))).T,
            np.maximum(known.linear + unknowns.of("linear", vectors), 0.0).T,
            np.maximum(known.quadratic + unknowns.of("quadratic", vectors), 0.0).T,
            np.full(len(vectors), known.weight),
            known.lift + unknowns.of("lift", vectors)[:, 0],
            (known.center + unknowns.of("buoyancy", vectors)).T,
        )

    def sensed(self, unknowns: Unknowns, vectors: Array, state: Array) -> Array:
        """What late sensors say of states (L, 12, B, W) of L steps under B vectors (B, size): where the robot
        was `late` steps before, and from there on along its slope."""
        slope, said, step = np.gradient(state, STEP_S, axis=0), np.empty_like(state), np.arange(len(state))
        delays = unknowns.of("delay", vectors).T
        for delay, late, channels in zip(delays, self.late, SENSORS.values(), strict=True):
            before = np.clip(step - late, 0, len(state) - 1)
            rest = delay - STEP_S * (step - before)[:, None]
            for k in channels:
                said[:, k] = state[before, k] - rest[..., None] * slope[before, k]
        return said


def deflected(force: Array, deflection: Array) -> Array:
    """Forces (..., n, 3) in fin frames, turned about the shafts by (n,) [rad]."""
    cos, sin = np.cos(deflection), np.sin(deflection)
    y, z = force[..., 1], force[..., 2]
    return np.stack([force[..., 0], cos * y - sin * z, sin * y + cos * z], axis=-1)


def shape_factor(terms: Array, shape: Array) -> Array:
    """What thrust is multiplied by, from terms (..., 5) and their coefficients (5,)."""
    result: Array = np.exp(np.clip(terms @ shape, -2.0, 2.0))
    return result
