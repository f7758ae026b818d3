"""What fins keep of their thrust in each other's jets and at speed, with derivatives.

`finlab.layout.interaction` says what is what. The fit to a swim computes with the same terms (`jet_terms`,
`inflow_terms`) that a plant then uses.
"""

import math

import numpy as np

from finlab.arrays import Array
from finlab.layout.fin import Fin
from finlab.layout.interaction import Interaction
from finlab.layout.layout import Layout

WIDE_AND_NARROW = np.array([1.0, 4.0])
"""How narrow the two jets of a fin are, beside the interaction's `narrowness`."""
SLOW = 0.05
"""Speed [m/s] of a tip below which the advance ratio no longer grows."""
LEAST = 1e-9
"""Thrust [N] below which a fin has no direction."""


class Coupling:
    """The interaction of one robot's fins, among n actuators; the others keep their forces."""

    def __init__(self, layout: Layout, interaction: Interaction, effectiveness: Array, length: Array) -> None:
        """Takes the columns (n, 3, 6) of the plant and the lengths [m] of the fins alone."""
        self.half_thrust = interaction.half_thrust_n
        self.kappa = interaction.narrowness * WIDE_AND_NARROW
        self.taken = np.array(interaction.inflow)
        """Coefficients p and q of what speed takes."""
        place = {name: i for i, name in enumerate(layout.names)}
        self.share = np.zeros((layout.n, layout.n, 2))
        """What the jet of fin j (first) takes from fin i (second)."""
        for jet in interaction.jets:
            self.share[place[jet.source], place[jet.target]] = jet.share
        self.way = jet_ways(layout.position, effectiveness)
        self.is_fin = np.array([isinstance(actuator, Fin) for actuator in layout.actuators])
        self.length = np.ones(layout.n)
        self.length[self.is_fin] = length

    def kept(self, force: Array, command: Array, inflow: Array | None = None) -> Array:
        """Share (..., n) that fins keep of the forces (..., n, 3) that each gives by itself, in its frame,
        where their places move with `inflow` (..., n, 3) [m/s]."""
        met = jet_terms(force, self.way, self.half_thrust, self.kappa)
        lost = np.einsum("...jik,jik->...i", met, self.share)
        if inflow is not None:
            lost = lost + (inflow_terms(force, command, inflow, self.length) @ self.taken) * self.is_fin
        result: Array = 1.0 - lost
        return result

    def kept_and_jacobian(
        self, force: Array, jacobian: Array, command: Array, inflow: Array | None = None
    ) -> tuple[Array, Array]:
        """`kept`, and its derivatives (..., n, 3, n) by the commands of fin j, of what fin i keeps.

        Args:
            force: (..., n, 3) by the fins alone.
            jacobian: their derivatives (..., n, 3 commands, 3 axes).
            command: (..., n, 3).
            inflow: velocities (..., n, 3) of their places [m/s], own frames; None at rest.
        """
        thrust = np.sqrt((force * force).sum(-1))
        unit = force / np.maximum(thrust, LEAST)[..., None]
        strength = thrust / (thrust + self.half_thrust)
        cosine = -np.einsum("jia,...ja->...ji", self.way, unit)
        bump = np.exp(self.kappa * (cosine[..., None] - 1.0)) * self.share
        wide, steep = bump.sum(-1), bump @ self.kappa
        lost = np.einsum("...ji,...j->...i", wide, strength)
        # By the force: the direction turns across it, the strength grows along it.
        across = -self.way - cosine[..., None] * unit[..., None, :]
        over = 1.0 / (thrust + self.half_thrust)
        along = (self.half_thrust * over * over)[..., None, None] * unit[..., None, :]
        by_force = (steep * over[..., None])[..., None] * across + wide[..., None] * along
        by_command = -np.einsum("...jka,...jia->...jki", jacobian, by_force)
        kept = 1.0 - lost
        if inflow is not None:
            taken, own = self._inflow_and_jacobian(unit, thrust, jacobian, command, inflow)
            kept, own = kept - taken * self.is_fin, own * self.is_fin[:, None]
            n = np.arange(force.shape[-2])
            by_command = np.broadcast_to(by_command, (*kept.shape, 3, len(n))).copy()
            by_command[..., n, :, n] -= np.moveaxis(own, -2, 0)
        return kept, by_command

    def _inflow_and_jacobian(
        self, unit: Array, thrust: Array, jacobian: Array, command: Array, inflow: Array
    ) -> tuple[Array, Array]:
        """What speed takes (..., n), and its derivatives (..., n, 3) by each fin's own command."""
        speed = np.einsum("...na,...na->...n", inflow, unit)
        beat = 2.0 * math.pi * self.length
        tip = beat * command[..., 0] * command[..., 1]
        pace = np.sqrt(tip * tip + SLOW**2)
        t = np.tanh(speed / pace)
        p, q = self.taken
        outer = (p + 2.0 * q * t) * (1.0 - t * t)
        turn = (inflow - speed[..., None] * unit) / np.maximum(thrust, LEAST)[..., None]
        by = np.einsum("...nka,...na->...nk", jacobian, turn) / pace[..., None]
        fall = -speed * tip / pace**3 * beat
        by[..., 0] += fall * command[..., 1]
        by[..., 1] += fall * command[..., 0]
        return p * t + q * t * t, outer[..., None] * by


def jet_ways(position: Array, effectiveness: Array) -> Array:
    """Unit vectors (n, n, 3) from fin j (first) to fin i (second), in the frame of fin j; zero where two fins
    share a place."""
    way = position[None] - position[:, None]
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    unit = np.where(distance > LEAST, way / np.maximum(distance, LEAST), 0.0)
    result: Array = np.einsum("jib,jab->jia", unit, effectiveness[..., :3])
    return result


def jet_terms(force: Array, way: Array, half_thrust: float, kappa: Array) -> Array:
    """How much a wide and a narrow jet of fin j meet fin i (..., n, n, 2), for forces (..., n, 3); see
    `finlab.layout.interaction` for the thrust [N] and the two jets' narrowness (2,)."""
    thrust = np.sqrt((force * force).sum(-1))
    cosine = -np.einsum("jia,...ja->...ji", way, force) / np.maximum(thrust, LEAST)[..., None]
    strength = thrust / (thrust + half_thrust)
    result: Array = np.exp(kappa * (cosine[..., None] - 1.0)) * strength[..., None, None]
    return result


def inflow_terms(force: Array, command: Array, inflow: Array, length: Array) -> Array:
    """tanh J and its square (..., n, 2), for forces, commands and `inflow_of` (..., n, 3)."""
    thrust = np.sqrt((force * force).sum(-1))
    speed = (inflow * force).sum(-1) / np.maximum(thrust, LEAST)
    tip = 2.0 * math.pi * length * command[..., 0] * command[..., 1]
    t = np.tanh(speed / np.sqrt(tip * tip + SLOW**2))
    return np.stack([t, t * t], axis=-1)
