"""The maker of random robots: of fins, as in training, and of actuators of each kind.

For training data (of the teacher in `mdn/training/teacher.py`, and of `paper/training/samples.py`),
the splits of experiments, and tests. The numbers that define the training distribution (box, fin
counts, spread of limits) are here and nowhere else. A robot is a function of the generator that is
handed in: whoever changes the order of draws changes every split.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from finlab.actuators.actuator import Actuator
from finlab.actuators.azimuth import Azimuth, Tilt
from finlab.actuators.fin.fin import Fin
from finlab.actuators.fin.fin_model import FinModelSpec, Limits
from finlab.actuators.thrust_model import PowerLaw
from finlab.actuators.thruster import Thruster
from finlab.arrays import Array
from finlab.axes import wrapped
from finlab.errors import DataError
from finlab.layout.body import Body, Hull
from finlab.layout.layout import Layout

TRAINING_BOX = (0.3, 0.3, 0.1)
"""Largest |x|, |y|, |z| of a fin in training and in split `id` [m]."""
TRAINING_FINS = (2, 5)
"""Least and most fins of a layout in training and in split `id`."""
AMPLITUDE_MAX_RANGE = (0.3, 0.8)
"""Where a varied amplitude maximum is drawn from [rad]."""
FREQUENCY_MAX_RANGE = (1.0, 3.0)
"""Where a varied frequency maximum is drawn from [Hz]."""
ARC_SHARE = 1.0 / 3.0
"""Share of fins with varied limits whose zero direction is confined to an arc."""
ARC_RANGE = (math.pi / 2, 1.5 * math.pi)
"""Where the width of such an arc is drawn from [rad]; the arc lies within [-pi, pi]."""


def random_layout(
    rng: np.random.Generator,
    name: str = "random",
    n_fins: int | tuple[int, int] = TRAINING_FINS,
    box: tuple[float, float, float] = TRAINING_BOX,
    limits: Literal["nominal", "varied"] = "nominal",
    outside: tuple[float, float, float] | None = None,
) -> Layout:
    """Returns a random layout with fins `fin_1`, `fin_2`, ...

    Positions are uniform in the box and angles in [-pi, pi). With `limits="varied"` every fin gets
    its own limits as in split `limits`. Raises DataError: `outside` is not smaller than `box` in
    any direction, so no such layout exists.

    Args:
        rng: source of randomness.
        name: of the layout.
        n_fins: the fin count, or its least and most (uniform).
        box: largest |x|, |y|, |z| [m].
        limits: see above.
        outside: when given, at least one fin lies outside this smaller box.
    """
    least, most = (n_fins, n_fins) if isinstance(n_fins, int) else n_fins
    extent = np.array(box)
    if outside is not None and not np.any(extent > np.array(outside)):
        raise DataError(f"no fin within {box} can lie outside {outside}; make the first box larger")
    # As many fins are drawn as there could be, so that a seed's layouts stay what they are.
    count = int(rng.integers(least, most + 1, size=1)[0])
    while True:
        position = rng.uniform(-1.0, 1.0, (most, 3)) * extent
        if outside is None or (np.abs(position[:count]) > np.array(outside)).any():
            break
    angle = rng.uniform(-math.pi, math.pi, most)
    fin_limits = _varied_limits(rng, most) if limits == "varied" else [Limits()] * most
    fins = []
    for i in range(count):
        fins.append(Fin(f"fin_{i + 1}", _vector(position[i]), float(angle[i]), fin_limits[i]))
    return Layout(name=name, actuators=tuple(fins))


def _varied_limits(rng: np.random.Generator, count: int) -> list[Limits]:
    """Limits of so many fins as in split `limits`, each its own."""
    amplitude = rng.uniform(*AMPLITUDE_MAX_RANGE, count)
    frequency = rng.uniform(*FREQUENCY_MAX_RANGE, count)
    width = rng.uniform(*ARC_RANGE, count)
    center = rng.uniform(-1.0, 1.0, count) * (math.pi - width / 2)
    arc = rng.uniform(size=count) < ARC_SHARE
    nominal = Limits()
    result = []
    for i in range(count):
        zero_direction = nominal.zero_direction
        if arc[i]:
            half = width[i] / 2
            zero_direction = float(center[i] - half), float(center[i] + half)
        result.append(
            Limits(
                amplitude=(nominal.amplitude[0], float(amplitude[i])),
                frequency=(nominal.frequency[0], float(frequency[i])),
                zero_direction=zero_direction,
            )
        )
    return result


EXTENT = (0.3, 0.3, 0.15)
"""Largest |x|, |y|, |z| of an actuator [m]."""
STRENGTH = (4.0, 30.0)
"""Largest force of a thruster [N], times the robot's size from `SIZE`."""
SIZE = (0.3, 3.0)
"""From where the logarithm of a robot's size is drawn; a factor of all its forces."""
ONE_WAY_SHARE = 0.1
"""Share of thrusters that push one way only."""
SYMMETRIC_SHARE = 0.1
"""Share of thrusters that push as much in reverse as ahead."""
REACTION = 0.03
"""Largest reaction torque of a propeller per newton [m]; half of them have one."""
ARC = (math.radians(20.0), math.radians(300.0))
"""Width of the arc of an azimuth [rad], where it has one, as half of them do."""
TILT = (math.radians(20.0), math.radians(120.0))
"""Width of the arc of a tilt [rad]."""

Numbers = dict[str, tuple[float, float]]
"""Names of a fin model's numbers, and from where each is drawn."""
LOGARITHMIC = ("area", "lever", "length", "width", "k")
"""Numbers whose logarithm is uniform; the others are uniform themselves."""
FAMILIES: dict[str, Numbers] = {
    "drag": {"area": (0.005, 0.04), "lever": (0.05, 0.15)},
    "lighthill": {"length": (0.1, 0.3), "width": (0.05, 0.15)},
    "soft": {
        "k": (1.0, 8.0),
        "p": (1.0, 2.0),
        "x0": (0.6, 1.5),
        "q": (3.0, 6.0),
        "e": (0.0, 0.2),
        "phi_e": (-math.pi, math.pi),
        "d": (-0.15, 0.15),
    },
}
"""Fin model -> its numbers; what is not named stays as it is by default."""

FIN_COUNTS = dict(zip(range(2, 13), (1, 2, 8, 9, 9, 8, 8, 7, 7, 7, 7), strict=True))
"""Number of fins to learn from -> how often it is drawn; with 2 or 3 there is next to nothing to
choose."""
WIDE_BOX = (1.5 * TRAINING_BOX[0], 1.5 * TRAINING_BOX[1], 2.0 * TRAINING_BOX[2])
"""Largest |x|, |y|, |z| of a fin [m]: as far as split `ood` goes."""
WIDE: dict[str, Numbers] = {
    "drag": {"area": (0.003, 0.06), "lever": (0.04, 0.2)},
    "lighthill": {"length": (0.08, 0.4), "width": (0.04, 0.2)},
    "soft": {
        "e": (0.0, 0.3),
        "k": (0.5, 12.0),
        "p": (0.7, 2.5),
        "x0": (0.4, 2.0),
        "q": (2.0, 8.0),
        "phi_e": (-math.pi, math.pi),
        "d": (-0.3, 0.3),
    },
}
"""Families of fins to learn from: wider than any fin that is evaluated."""

HULL = (0.3, 0.2, 0.15)
"""Half axes of the hull of a robot with jets [m], times a factor of its own."""
DIAMETER = (0.05, 0.12)
"""Diameters of its propellers [m]."""

FinKind = tuple[FinModelSpec, Limits]
"""A fin, wherever it is mounted."""

ActuatorMaker = Callable[[np.random.Generator, str, float], Actuator]
"""From a generator, a name and the robot's size to an actuator."""


def random_robot(
    rng: np.random.Generator,
    name: str,
    count: tuple[int, int],
    kinds: Sequence[ActuatorMaker],
    each: bool = False,
) -> Layout:
    """Returns a robot of random actuators `a1`, `a2`, ...

    Args:
        rng: source of randomness.
        name: of the layout.
        count: least and most actuators.
        kinds: what they are drawn of, each kind as often.
        each: whether there is at least one of each kind.
    """
    n = int(rng.integers(count[0], count[1] + 1))
    size = log_uniform(rng, *SIZE)
    chosen = [kinds[k] for k in rng.integers(len(kinds), size=n)]
    if each:
        chosen[: len(kinds)] = kinds
    return Layout(name, tuple(make(rng, f"a{i + 1}", size) for i, make in enumerate(chosen)))


def random_jet_robot(
    rng: np.random.Generator,
    name: str,
    count: tuple[int, int],
    kinds: Sequence[ActuatorMaker] | None = None,
) -> Layout:
    """Returns a robot whose jets meet each other and its hull, an ellipsoid.

    Args:
        rng: source of randomness.
        name: of the layout.
        count: least and most actuators, on or near the hull.
        kinds: what they are drawn of; by default one of several kinds, or all of them.
    """
    if not kinds:
        every: list[ActuatorMaker] = [random_thruster, random_azimuth, random_shaft_fin]
        k = int(rng.integers(4))
        kinds = [every[k]] if k < 3 else every
    robot = random_robot(rng, name, count, kinds)
    half = np.array(HULL) * rng.uniform(0.7, 1.4)
    parts = []
    for part in robot.actuators:
        position = _vector(rng.uniform(1.0, 1.8) * half * _unit(rng))
        jet = {} if isinstance(part, Fin) else {"diameter": log_uniform(rng, *DIAMETER)}
        parts.append(replace(part, position=position, **jet))
    hull = Hull("ellipsoid", _vector(2.0 * half))
    return replace(robot, actuators=tuple(parts), body=Body(hull=hull))


def random_thruster(rng: np.random.Generator, name: str, size: float) -> Thruster:
    """Returns a thruster in any direction, with forces and a power law of its own."""
    most = size * rng.uniform(*STRENGTH)
    reverse = rng.choice(
        [0.0, 1.0, rng.uniform(0.2, 1.2)],
        p=[ONE_WAY_SHARE, SYMMETRIC_SHARE, 1.0 - ONE_WAY_SHARE - SYMMETRIC_SHARE],
    )
    reaction = rng.uniform(-REACTION, REACTION) * rng.integers(2)
    return Thruster(
        name,
        _position(rng),
        _vector(_unit(rng)),
        (-float(reverse * most), most),
        _law(rng),
        torque_per_newton=float(reaction),
    )


def random_azimuth(rng: np.random.Generator, name: str, size: float) -> Azimuth:
    """Returns an azimuth about any axis, half of them within an arc."""
    arc = _arc(rng, *ARC) if rng.integers(2) else (-math.pi, math.pi)
    return Azimuth(
        name,
        _position(rng),
        *_across(rng),
        (0.0, size * rng.uniform(*STRENGTH)),
        _law(rng),
        arc=arc,
    )


def random_tilt(rng: np.random.Generator, name: str, size: float) -> Tilt:
    """Returns a tilt about any axis."""
    force = 0.0, size * rng.uniform(*STRENGTH)
    return Tilt(name, _position(rng), *_across(rng), force, _law(rng), arc=_arc(rng, *TILT))


def random_shaft_fin(rng: np.random.Generator, name: str, size: float) -> Fin:
    """Returns a fin of a random model with a shaft in any direction; its size is its own."""
    shaft, zero = _across(rng)
    return Fin(name, _position(rng), model=random_fin_model(rng), shaft=shaft, zero=zero)


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Returns a number whose logarithm is uniform between those of two numbers above 0."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def random_fin_model(
    rng: np.random.Generator, kind: str | None = None, families: dict[str, Numbers] = FAMILIES
) -> FinModelSpec:
    """Returns a fin model with random numbers.

    Args:
        rng: source of randomness.
        kind: a key of `families`; None for each equally often.
        families: kind to the ranges of its numbers; what it does not name stays as by default.
    """
    kind = kind or str(rng.choice(list(families)))
    numbers: list[tuple[str, float]] = []
    for name, ends in families[kind].items():
        is_logarithmic = name in LOGARITHMIC
        value = log_uniform(rng, *ends) if is_logarithmic else float(rng.uniform(*ends))
        numbers.append((name, value))
    return FinModelSpec(kind, tuple(numbers))


def _position(rng: np.random.Generator) -> tuple[float, float, float]:
    """A position within `EXTENT` [m]."""
    return _vector(rng.uniform(-1.0, 1.0, 3) * EXTENT)


def _vector(values: Array) -> tuple[float, float, float]:
    """An array (3,) as the tuple that a layout holds."""
    x, y, z = values.tolist()
    return x, y, z


def _unit(rng: np.random.Generator) -> Array:
    """A unit vector (3,) in any direction."""
    normal = rng.normal(size=3)
    return np.asarray(normal / np.linalg.norm(normal))


def _across(
    rng: np.random.Generator,
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """A unit vector, and one across it."""
    axis = _unit(rng)
    across = np.cross(axis, _unit(rng))
    return _vector(axis), _vector(across / np.linalg.norm(across))


def _arc(rng: np.random.Generator, least: float, most: float) -> tuple[float, float]:
    """An arc within [-pi, pi] that is least to most wide [rad]."""
    width = rng.uniform(least, most)
    start = rng.uniform(-math.pi, math.pi - width)
    return start, start + width


def _law(rng: np.random.Generator) -> PowerLaw:
    """Half of the laws are those of an ideal propeller at rest."""
    exponent = float(rng.choice([1.5, rng.uniform(1.2, 2.5)]))
    forward = log_uniform(rng, 0.3, 3.0) * 20.0 ** (1.5 - exponent)
    return PowerLaw(forward, forward * rng.uniform(0.8, 3.0), exponent)


def random_fin_kinds(rng: np.random.Generator, count: int) -> tuple[list[FinKind], list[FinKind]]:
    """Returns `count` fins with nominal limits, and as many with limits drawn as in split `limits`;
    half of the soft ones push alike in all directions. Few, since compiling one takes as long as
    many answers."""
    models = [random_fin_model(rng, None, WIDE) for _ in range(2 * count)]
    # Half of the soft ones have no unevenness (`e` = 0, see `Soft`): fins that push alike in all
    # directions, which a uniform draw of `e` would never give. A change here makes other data of
    # the teacher, see `write_answers` in `mdn/training/teacher.py`.
    for k, model in enumerate(models):
        if model.type == "soft" and rng.random() < 0.5:
            models[k] = FinModelSpec("soft", tuple({**dict(model.parameters), "e": 0.0}.items()))
    varied = [random_layout(rng, n_fins=1, limits="varied").fins[0].limits for _ in range(count)]
    nominal = [(model, Limits()) for model in models[:count]]
    return nominal, list(zip(models[count:], varied, strict=True))


def random_fin_robot(
    rng: np.random.Generator, kinds: tuple[list[FinKind], list[FinKind]], n: int
) -> Layout:
    """Returns a robot of n fins to learn from; none is one that is evaluated.

    Fins are of one kind or each of its own, half of the robots have limits of their own, and a
    third are symmetric, where fins are equals and only chance can tell them apart.

    Args:
        rng: source of randomness.
        kinds: fins with nominal and with varied limits, as `random_fin_kinds` gives them.
        n: number of fins.
    """
    symmetric = rng.random() < 1 / 3
    position, angle = _symmetric_mountings(rng, n) if symmetric else _mountings(rng, n)
    source = kinds[not symmetric and rng.random() < 0.5]
    one_kind = symmetric or rng.random() < 0.5
    if one_kind:
        chosen = np.full(n, rng.integers(len(source)))
    else:
        chosen = rng.integers(len(source), size=n)
    fins = []
    for i in range(n):
        model, limits = source[chosen[i]]
        fins.append(Fin(f"fin_{i + 1}", _vector(position[i]), float(angle[i]), limits, model=model))
    return Layout("random", tuple(fins))


def _mountings(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Positions (n, 3) [m] and angles (n,) [rad] of a robot without symmetry, some of them flat."""
    box = np.array(TRAINING_BOX if rng.random() < 0.6 else WIDE_BOX)
    if rng.random() < 0.3:
        box[2] = 0.0
    return rng.uniform(-1.0, 1.0, (n, 3)) * box, rng.uniform(-math.pi, math.pi, n)


def _symmetric_mountings(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """The same with mirrored pairs, stacked pairs, or fins evenly around the hull."""
    kind = rng.integers(3)
    if kind == 0:  # evenly around
        azimuth = 2.0 * math.pi * np.arange(n) / n + rng.uniform(0.0, 2.0 * math.pi)
        radius = rng.uniform(0.08, 0.35)
        position = np.stack(
            [radius * np.cos(azimuth), radius * np.sin(azimuth), np.zeros(n)], axis=-1
        )
        turn = rng.choice([0.0, rng.uniform(-math.pi, math.pi)])
        return position, np.asarray(wrapped(azimuth + turn))
    half = n // 2
    position, angle = _mountings(rng, n - half)
    if kind == 1:  # port and starboard: the mirror image of a shaft's azimuth is its negative
        mirrored = position[:half] * np.array([1.0, -1.0, 1.0])
        mirrored_angle = -angle[:half]
    else:  # one above the other
        position[:half, 2] = rng.uniform(0.0, 0.1)
        mirrored = position[:half] * np.array([1.0, 1.0, -1.0])
        mirrored_angle = angle[:half]
    order = rng.permutation(n)
    positions = np.concatenate([position, mirrored])
    angles = np.concatenate([angle, mirrored_angle])
    return positions[order], np.asarray(wrapped(angles))[order]
