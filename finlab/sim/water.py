"""How the water moves in which a robot swims: not at all, as a current, in waves, or as one of these
that becomes another.

World frame, z up, the still water's surface at z = 0. A robot is small beside what the water does, so it
feels the velocity at its own place, without shear or rotation.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.vehicle.body import GRAVITY

Vector = tuple[float, float, float]
REST: Vector = (0.0, 0.0, 0.0)
"""No velocity [m/s], or no acceleration [m/s^2]."""


class Flow(NamedTuple):
    """The water at one place and time, in the world."""

    velocity: Vector
    """[m/s]."""
    acceleration: Vector
    """Rate of change of the velocity there [m/s^2]."""


class Water(Protocol):
    """What a `ClosedLoop` can be given."""

    @property
    def name(self) -> str:
        """What it is called in logs."""
        ...

    def flow(self, position: Sequence[float], time: float) -> Flow:
        """The water at a position (3,) in the world [m] and a time [s]."""
        ...


@dataclass(frozen=True)
class Still:
    """A pool."""

    name = "still"

    def flow(self, position: Sequence[float], time: float) -> Flow:
        """Nothing moves."""
        return Flow(REST, REST)


@dataclass(frozen=True)
class SteadyCurrent:
    """The same velocity everywhere and at all times."""

    velocity: Sequence[float]
    """(3,) [m/s]."""

    name = "current"

    def __post_init__(self) -> None:
        object.__setattr__(self, "velocity", _vector(self.velocity))

    def flow(self, position: Sequence[float], time: float) -> Flow:
        """That velocity."""
        return Flow(self.velocity, REST)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Changing:
    """Water that becomes another one on the way, as a gust comes and goes: a smoothstep."""

    before: "Water"
    after: "Water"
    time_s: float
    """When it begins to change [s]."""
    over_s: float = 4.0
    """How long that takes [s], above 0."""

    def __post_init__(self) -> None:
        _finite("time_s", self.time_s)
        _positive("over_s", self.over_s)

    @property
    def name(self) -> str:
        """That of the water it becomes."""
        return self.after.name

    def flow(self, position: Sequence[float], time: float) -> Flow:
        """Some of both."""
        share, rate = _smoothstep((time - self.time_s) / self.over_s)
        rate /= self.over_s
        old, new = self.before.flow(position, time), self.after.flow(position, time)
        pairs = list(zip(old.velocity, new.velocity, strict=True))
        x, y, z = (a + share * (b - a) for a, b in pairs)
        ax, ay, az = (
            p + share * (q - p) + rate * (b - a)
            for (a, b), p, q in zip(pairs, old.acceleration, new.acceleration, strict=True)
        )
        return Flow((x, y, z), (ax, ay, az))


@dataclass(frozen=True)
class Waves:
    """Irregular waves on deep water, and a steady current besides.

    Linear theory: the sum of waves of Bretschneider's spectrum (ITTC), each with as much energy as any other;
    headings are normally distributed about the world's x. Their motion decays with depth as exp(k z), with
    k = (2 pi / T)^2 / g. Second-order drift, and what waves do to a pressure sensor, are left out.
    """

    height_m: float = 0.2
    """Significant height [m]: mean of the highest third, crest to trough."""
    period_s: float = 3.0
    """Period of the peak of the spectrum [s]."""
    spread_rad: float = 0.35
    """Standard deviation of the components' headings [rad]; 0 for long crests."""
    current: Sequence[float] = REST
    """Velocity of the water without waves (3,) [m/s]."""
    components: int = 20
    seed: int = 0
    """Of phases and headings."""

    name = "waves"

    def __post_init__(self) -> None:
        object.__setattr__(self, "current", _vector(self.current))
        _positive("height_m", self.height_m)
        _positive("period_s", self.period_s)
        if not (math.isfinite(self.spread_rad) and self.spread_rad >= 0.0):
            raise FinlabError(f"water: spread_rad: expected a number from 0, got {self.spread_rad}")
        if not self.components >= 1:
            raise FinlabError(f"water: components: expected 1 or more, got {self.components}")

    @cached_property
    def _parts(self) -> tuple[Array, Array, Array, Array]:
        """Angular frequencies (N,) [rad/s], speeds at the surface (N,) [m/s], wave vectors (3, N) [1/m] whose
        last row counts upwards, and phases (N,) [rad]."""
        rng, n = np.random.default_rng(self.seed), self.components
        # Waves slower than w have the share exp(-5/4 (w_p / w)^4) of the energy; equal shares, their middles.
        share = (np.arange(n) + 0.5) / n
        pace = 2 * math.pi / self.period_s * (1.25 / -np.log(share)) ** 0.25
        speed = pace * 0.25 * self.height_m * math.sqrt(2.0 / n)
        number = pace**2 / GRAVITY
        heading = self.spread_rad * rng.standard_normal(n)
        vectors = np.stack([number * np.cos(heading), number * np.sin(heading), number])
        return pace, speed, vectors, rng.uniform(0.0, 2 * math.pi, n)

    def flow(self, position: Sequence[float], time: float) -> Flow:
        """The orbital motion of all waves, and the current."""
        pace, speed, vectors, phase = self._parts
        x, y, z = position
        angle = x * vectors[0] + y * vectors[1] - time * pace + phase
        size = speed * np.exp(min(z, 0.0) * vectors[2])
        cosine, sine = size * np.cos(angle), size * np.sin(angle)
        ways = vectors[:2] / vectors[2]
        u, v = (ways @ cosine).tolist()
        du, dv = (ways @ (pace * sine)).tolist()
        cx, cy, cz = self.current
        velocity = u + cx, v + cy, float(sine.sum()) + cz
        return Flow(velocity, (du, dv, -float(pace @ cosine)))


def _smoothstep(x: float) -> tuple[float, float]:
    """From 0 at x = 0 to 1 at x = 1, and its slope."""
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x)


def _vector(value: Sequence[float]) -> Vector:
    found = tuple(float(item) for item in value)
    if len(found) != 3 or not all(math.isfinite(item) for item in found):
        raise FinlabError(f"water: expected a velocity of three finite numbers, got {value!r:.60}")
    return found


def _finite(key: str, value: float) -> None:
    if not math.isfinite(value):
        raise FinlabError(f"water: {key}: expected a finite number, got {value}")


def _positive(key: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise FinlabError(f"water: {key}: expected a number above 0, got {value}")
