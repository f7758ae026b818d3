"""Random plants of several families, of which a prior of the interaction is learned.

A plant is a random choice of how jets spread, how much of its thrust an actuator in a jet loses,
and how a jet meets the hull; its constants are random as well. None of them is the formula of
`finlab.interaction.jets`. A robot of a prior's data gets a plant of its own, so how much the
weights of robots differ is how much water, hulls and propellers do.

The choices are what the literature on jets and thrusters in jets names: profiles that are Gaussian
behind a core, cosine or flat with a rim (Rajaratnam, 1976), decay as one over the distance, swirl,
loss by velocity met (Dang and Laheij, 2004), momentum of the water taken in from the side, drag of
housings, jets that push the hull (Nienhuis, 1992) or cling to it (Coanda), jets turned by a cross
flow.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.interaction.interaction import lever_of
from finlab.layout.effectiveness import body_force
from finlab.layout.jet_geometry import jet_geometry_of
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant
from finlab.research.random_layouts import log_uniform

SEA_WATER = 1025.0
"""Density of the water [kg/m^3]."""
TINY = 1e-9
"""Keeps lengths that are divisors above 0."""
PROFILES = ("gaussian", "cosine", "flat")
"""How the velocity falls off the axis of a jet."""
LOSSES = ("saturating", "one_by_one", "exponential", "tanh")
"""How thrust falls by the velocity met."""
STEEPNESS = 5.0
"""Exponent by which a squared cosine ends like a Gaussian: widths mean the same in all profiles."""


@dataclass(frozen=True)
class RandomPlant:
    """One plant. All numbers are ratios [1].

    Args:
        profile: of `PROFILES`.
        loss: of `LOSSES`.
        core: length of a jet's core, in diameters.
        spreading: growth of a jet's half width by distance.
        start: half width where a jet begins, in diameters.
        speed: of a jet over that of an actuator disc.
        onset: distance over which a jet begins, in diameters.
        swirl: velocity around a jet's axis over that along it.
        taken: loss of thrust by a velocity met that is small over that of the own jet.
        limit: of that loss, by a velocity met that is large.
        side: share of the momentum taken in from the side.
        housing: drag coefficient of what stands in a jet.
        push: share of the thrust with which a jet pushes the hull along itself.
        turned: share of that push which is only the part along the hull's normal where the jet
            meets it, since the jet goes on along the hull.
        lift: share of the thrust along the normal of the hull.
        cling: share of the thrust with which a jet that passes by is drawn to the hull.
        rim: width of a jet's rim on the hull.
        bend: how far a cross flow takes a jet along, over what it would without a jet's speed.
        advance: loss of thrust by speed, over that of the layout's open-water line.
        advance_squared: the same by its square.
        drift: share of the momentum of the water taken in across the way of a robot that moves.
    """

    profile: str
    loss: str
    core: float
    spreading: float
    start: float
    speed: float
    onset: float
    swirl: float
    taken: float
    limit: float
    side: float
    housing: float
    push: float
    turned: float
    lift: float
    cling: float
    rim: float
    bend: float
    advance: float
    advance_squared: float
    drift: float

    def __call__(self, layout: Layout, command: Array, flow: Array | None = None) -> Array:
        """Returns wrenches.

        Args:
            layout: the robot.
            command: (K, n, 3).
            flow: velocities (K, 6) of the body through the water [m/s, rad/s]; None at rest.

        Returns:
            (K, 6) [N, N m], body frame.
        """
        plant = Plant(layout)
        own = plant.force(command)
        force = body_force(own, layout.frames)
        velocity = None if flow is None else plant.point_velocity(flow)
        geometry = jet_geometry_of(layout)
        change = self.further_force(
            force, geometry.position, geometry.diameter, geometry.advance, geometry.hull, velocity
        )
        offset = np.einsum("kib,ibw->kw", change, lever_of(geometry.position))
        return np.asarray(plant.wrench_of(own) + offset)

    def further_force(
        self,
        force: Array,
        position: Array,
        diameter: Array,
        advance: Array,
        hull: Array,
        velocity: Array | None,
    ) -> Array:
        """Returns the forces that come beside forces.

        Args:
            force: (K, n, 3) [N], body frame.
            position: points (n, 3) [m].
            diameter: of the jets (n,) [m].
            advance: loss of thrust (n,) per speed over the jet's speed.
            hull: centre and half axes (2, 3) [m].
            velocity: of the points through the water (K, n, 3) [m/s]; None at rest.

        Returns:
            (K, n, 3) [N], body frame.
        """
        jets = _jets(force, diameter, self.speed)
        met = self._met(jets, position, diameter, velocity)
        water = met.sum(axis=1)
        change = -self._lost(jets, met)[..., None] * force
        area = 0.25 * np.pi * diameter**2
        against = (water * jets.course).sum(axis=-1, keepdims=True)
        across = water - against * jets.course
        mass_flow = (SEA_WATER * area * jets.speed)[..., None]
        change += self.side * mass_flow * across
        drag = 0.5 * SEA_WATER * self.housing * area[:, None]
        change += drag * np.linalg.norm(water, axis=-1, keepdims=True) * water
        if hull[1].all():
            change += self._by_hull(jets, position - hull[0], hull[1])
        if velocity is not None:
            along = -(velocity * jets.course).sum(axis=-1) / np.maximum(jets.speed, 0.1)
            lost = self.advance * advance * along
            lost += self.advance_squared * advance * along * np.abs(along)
            change -= np.clip(lost, -0.8, 1.0)[..., None] * force
            with_jet = (velocity * jets.course).sum(axis=-1, keepdims=True) * jets.course
            change -= self.drift * mass_flow * (velocity - with_jet)
        return np.asarray(change)

    def _met(
        self, jets: "_Jets", position: Array, diameter: Array, velocity: Array | None
    ) -> Array:
        """Velocities (K, n, n, 3) [m/s] of the jets (second axis) at actuators (third one)."""
        way = position[None, :] - position[:, None]
        way = np.broadcast_to(way, (len(jets.thrust), *way.shape))
        width = np.maximum(diameter, TINY)[None, :, None]
        course = jets.course[:, :, None]
        along = (way * course).sum(axis=-1)
        if velocity is not None:
            # Water that was at the outlet is taken along by the flow while the jet gets there.
            time = np.maximum(along, 0.0) / np.maximum(jets.speed, 0.1)[:, :, None]
            way = way + self.bend * time[..., None] * velocity[:, :, None]
            along = (way * course).sum(axis=-1)
        radial = way - along[..., None] * course
        radius = np.sqrt((radial**2).sum(axis=-1) + TINY)
        x = along / width
        half_width = self.start + self.spreading * np.maximum(x, 0.0)
        r = radius / width / half_width
        if self.profile == "gaussian":
            shape = np.exp(-(r**2))
        elif self.profile == "cosine":
            shape = np.cos(0.5 * np.pi * np.clip(r / 2.0, 0.0, 1.0)) ** STEEPNESS
        else:
            shape = 0.5 * (1.0 - np.tanh((r - 1.0) / 0.35))
        decay = (1.0 + np.maximum(x / self.core, 0.0) ** 4) ** -0.25
        onset = 0.5 * (1.0 + np.tanh(x / self.onset))
        axial = jets.speed[:, :, None] * shape * decay * onset
        axial = np.where((diameter > 0.0)[None, :, None], axial, 0.0)
        n = len(position)
        axial[:, np.arange(n), np.arange(n)] = 0.0
        outward = radial / radius[..., None]
        around = np.cross(np.broadcast_to(course, outward.shape), outward)
        turning = self.swirl * axial * np.minimum(r, 1.0)
        return np.asarray(axial[..., None] * course + turning[..., None] * around)

    def _lost(self, jets: "_Jets", met: Array) -> Array:
        """Shares (K, n) of thrust that velocities (K, n, n, 3) take."""
        speed = np.maximum(jets.speed, 0.03)
        each = np.einsum("ksrb,krb->ksr", met, jets.course) / speed[:, None]
        share = each.sum(axis=1)
        if self.loss == "one_by_one":
            left = 1.0 - self.taken * each / (1.0 + self.taken / self.limit * np.abs(each))
            return np.asarray(1.0 - np.prod(np.maximum(left, 0.0), axis=1))
        if self.loss == "exponential":
            size = self.limit * (1.0 - np.exp(-self.taken / self.limit * np.abs(share)))
            return np.asarray(np.sign(share) * size)
        if self.loss == "tanh":
            return np.asarray(self.limit * np.tanh(self.taken / self.limit * share))
        return np.asarray(self.taken * share / (1.0 + self.taken / self.limit * np.abs(share)))

    def _by_hull(self, jets: "_Jets", position: Array, half: Array) -> Array:
        """Forces (K, n, 3) [N] of the hull, where the jets meet it or pass it by."""
        place = position / half
        heading = jets.course / half
        heading = heading / np.maximum(np.linalg.norm(heading, axis=-1, keepdims=True), TINY)
        towards = -(place * heading).sum(axis=-1)
        miss = np.sqrt(np.maximum((place**2).sum(axis=-1) - towards**2, 0.0))
        ahead = 0.5 * (1.0 + np.tanh(towards / 0.15))
        share = ahead / (1.0 + np.exp((miss - 1.0) / self.rim))
        passing = ahead * np.exp(-(((miss - 1.15) / 0.2) ** 2))
        normal = place / half
        normal = normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), TINY)
        depth = np.sqrt(np.maximum(1.0 - miss**2, 0.0))
        met = (place + (towards - depth)[..., None] * heading) / half
        met = met / np.maximum(np.linalg.norm(met, axis=-1, keepdims=True), TINY)
        onto = (jets.course * met).sum(axis=-1, keepdims=True) * met
        momentum = (1.0 - self.turned) * jets.course + self.turned * onto
        pushed = (share * self.push)[..., None] * momentum
        lifted = (share * self.lift + passing * self.cling)[..., None] * normal
        return np.asarray(jets.thrust[..., None] * (pushed - lifted))


class _Jets(NamedTuple):
    """The jets of forces."""

    thrust: Array
    """(K, n) [N]."""
    course: Array
    """Where they flow (K, n, 3)."""
    speed: Array
    """At the outlet (K, n) [m/s]."""


def _jets(force: Array, diameter: Array, speed: float) -> _Jets:
    """The jets of forces (K, n, 3) [N] from discs (n,) [m], with the plant's share of the speed of
    an actuator disc."""
    thrust = np.linalg.norm(force, axis=-1)
    course = -force / np.maximum(thrust, TINY)[..., None]
    area = 0.25 * np.pi * diameter**2 + TINY
    disc = np.sqrt(2.0 * thrust / (SEA_WATER * area))
    return _Jets(thrust, course, speed * np.where(diameter > 0.0, disc, 0.0))


def random_plant(rng: np.random.Generator) -> RandomPlant:
    """Returns a plant of a random family, with constants within what the literature has."""
    return RandomPlant(
        profile=str(rng.choice(PROFILES)),
        loss=str(rng.choice(LOSSES)),
        core=log_uniform(rng, 1.8, 5.0),
        spreading=log_uniform(rng, 0.08, 0.25),
        start=log_uniform(rng, 0.4, 0.7),
        speed=log_uniform(rng, 0.8, 1.3),
        onset=log_uniform(rng, 0.1, 0.6),
        swirl=float(rng.uniform(-0.3, 0.3)),
        taken=log_uniform(rng, 0.7, 1.8),
        limit=log_uniform(rng, 0.7, 1.6),
        side=float(rng.uniform(0.1, 0.5)),
        housing=log_uniform(rng, 0.02, 0.25),
        push=float(rng.uniform(0.3, 0.9)),
        turned=float(rng.uniform(0.0, 1.0)),
        lift=float(rng.uniform(-0.1, 0.3)),
        cling=float(rng.uniform(0.0, 0.15)),
        rim=log_uniform(rng, 0.08, 0.25),
        bend=float(rng.uniform(0.5, 1.5)),
        advance=log_uniform(rng, 0.7, 1.4),
        advance_squared=float(rng.uniform(-0.3, 0.3)),
        drift=float(rng.uniform(0.0, 0.5)),
    )
