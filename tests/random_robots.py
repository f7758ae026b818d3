"""Seeded random robots of all kinds of actuator as layout files, and wrenches within reach and
beyond.

Written apart from the library's makers (`finlab/research/random_layouts.py`): these robots are
mappings of layout files, which the library reads by its loader and `tests/oracle_plant.py` by
itself, so that a fault in a maker, the loader or a law cannot stand in both. They have what no
training needs: rudders, dead bands, rates, fins that cannot rest.
"""

import math
from collections.abc import Callable, Mapping
from itertools import product
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.load import parse_layout
from tests.oracle_optima import farthest
from tests.oracle_plant import LIMIT_KEYS, NOMINAL, OraclePlant, edge_forces

DOMAIN = 0x3A11
"""Leads the seed of every robot."""
KINDS = (
    "thrusters",
    "azimuths",
    "fins",
    "fins any shaft",
    "fins uneven",
    "wide arcs",
    "holes",
    "rudders",
    "mixed",
    "all",
    "slipstreams",
)
"""Kinds of robot; in `holes` fins cannot rest, their least force is up to 5 % of the largest; in
`slipstreams` propellers have a rudder behind them."""
T200 = {"type": "power_law", "forward": 0.997, "reverse": 1.449, "exponent": 1.5}
"""A T200 thruster at 16 V: watts over N^1.5."""
T200_FORCE = [-39.91, 51.44]
"""Its least and largest force [N]."""


def load(layout: Mapping[str, Any]) -> Layout:
    """A layout file's mapping as the library reads it."""
    return parse_layout(layout)


def random_robot(kind: str, number: int, seed: int) -> dict[str, Any]:
    """Robot `number` of a seed, of one of `KINDS`, as the mapping of a layout file."""
    rng = np.random.default_rng([DOMAIN, KINDS.index(kind), seed, number])
    while True:
        makers = _makers(kind, rng, number)
        scale = 10.0 ** rng.uniform(-0.5, 0.5)
        actuators = [make(rng, f"a{i + 1}", scale) for i, make in enumerate(makers)]
        layout = {
            "format": "finlab-layout",
            "version": 2,
            "name": kind.replace(" ", "_"),
            "actuators": actuators,
        }
        if kind not in ("thrusters", "azimuths") or len(makers) < 6 or _condition(layout) < 100.0:
            return layout


def fins_with_a_tail(number: int, seed: int) -> dict[str, Any]:
    """Robot `number` of a seed, with 2 to 5 fins of mixed laws within nominal limits: the old
    default method was at times a fifth dearer than needed on such robots."""
    rng = np.random.default_rng([DOMAIN, 99, seed, number])
    fins = []
    for i in range(2 + number % 4):
        model = _fin_model(rng)
        if model["type"] == "soft":
            model["e"] = float(rng.uniform(0.0, 0.2))
        fins.append(_any_fin(rng, f"a{i + 1}", model, None))
        fins[-1]["position_m"] = (rng.uniform(-1.0, 1.0, 3) * [0.3, 0.3, 0.1]).tolist()
        nominal = [list(ends) for ends in NOMINAL]
        fins[-1]["limits"] = dict(zip(LIMIT_KEYS, nominal, strict=True))
    return layout_of("tail", fins)


def random_flow(kind: str, number: int, seed: int) -> Array | None:
    """Velocity (6,) through the water [m/s, rad/s] for a robot with rudders; None for others."""
    if kind != "rudders" and not (kind == "slipstreams" and number % 2):
        return None
    rng = np.random.default_rng([DOMAIN, KINDS.index(kind), seed, number, 1])
    along: Array = rng.uniform(0.3, 2.0) * np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    return along + 0.03 * rng.normal(size=6)


def random_plant(kind: str, number: int, seed: int) -> OraclePlant:
    """The own plant of `random_robot` in its `random_flow`."""
    return OraclePlant(random_robot(kind, number, seed), random_flow(kind, number, seed))


def within(
    plant: OraclePlant, rng: np.random.Generator, low: float = 0.2, high: float = 1.0
) -> Array:
    """A wrench (6,) within reach: that of a random command whose sizes are up to 0.2 to 1 of their
    range."""
    wrench: Array = plant.wrench(plant.draw(rng, float(rng.uniform(low, high))))
    return wrench


def beyond(plant: OraclePlant, rng: np.random.Generator, times: float) -> Array:
    """A wrench (6,) so many times as far as what is pushed at most along its direction."""
    wrench = plant.wrench(plant.draw(rng))
    return times * farthest(plant, wrench) * wrench


def bluerov2_heavy() -> dict[str, Any]:
    """BlueROV2 Heavy: positions about its centre of gravity, T200 at 16 V, directions of
    ArduSub."""
    s = math.sqrt(0.5)
    places = [(0.14, -0.092), (0.14, 0.092), (-0.15, -0.092), (-0.15, 0.092)]
    axes = [(-s, -s), (-s, s), (s, -s), (s, s)]
    rows = [((x, y, -0.011), (*axis, 0.0)) for (x, y), axis in zip(places, axes, strict=True)]
    for x, y in product((0.118, -0.118), (-0.215, 0.215)):
        rows.append(((x, y, 0.053), (0.0, 0.0, -1.0)))
    thrusters = [
        {"name": f"t{i}", "type": "thruster", "position_m": list(position), "axis": list(axis)}
        | {"force_n": T200_FORCE, "model": T200}
        for i, (position, axis) in enumerate(rows, 1)
    ]
    return layout_of("heavy", thrusters)


def layout_of(name: str, actuators: list[dict[str, Any]]) -> dict[str, Any]:
    """The mapping of a layout file."""
    return {"format": "finlab-layout", "version": 2, "name": name, "actuators": actuators}


def _condition(layout: Mapping[str, Any]) -> float:
    """Condition number of a robot's scaled effectiveness."""
    plant = OraclePlant(layout)
    return float(np.linalg.cond(plant.effectiveness / plant.scales[:, None]))


Maker = Callable[[np.random.Generator, str, float], dict[str, Any]]
"""Makes an actuator of a layout file of a generator, a name and a scale of forces."""


def _makers(kind: str, rng: np.random.Generator, number: int = 0) -> list[Maker]:
    """What robot `number` of a kind is made of."""
    if kind == "thrusters":
        return [_thruster] * int(rng.integers(4, 11))
    if kind == "azimuths":
        return [_azimuth] * int(rng.integers(3, 7))
    if kind == "rudders":
        return [_rudder] * int(rng.integers(2, 5)) + [_thruster] * int(rng.integers(4, 8))
    if kind == "slipstreams":
        steered = [_steered_in_flow if number % 2 else _steered]
        return steered * int(rng.integers(2, 5)) + [_thruster] * int(rng.integers(3, 6))
    if kind == "wide arcs":
        wide = int(rng.integers(1, 3))
        return (
            [_wide_fin] * wide
            + [_azimuth] * int(rng.integers(0, 2))
            + [_fin] * int(rng.integers(2, 5))
        )
    fins = {"fins any shaft": _shaft_fin, "fins uneven": _uneven_fin, "holes": _restless_fin}
    if kind in ("fins", *fins):
        return [fins.get(kind, _fin)] * int(rng.integers(3, 9))
    few: list[Maker] = [_fin, _shaft_fin, _thruster, _azimuth]
    if kind == "all":
        few += [_uneven_fin, _wide_fin, _restless_fin]
    chosen = [few[k] for k in rng.integers(len(few), size=int(rng.integers(4, 10)))]
    return chosen[:1] + [_thruster, _azimuth] + chosen[1:]


def _position(rng: np.random.Generator) -> list[float]:
    """A random position [m]."""
    place: list[float] = (rng.uniform(-1.0, 1.0, 3) * [0.3, 0.3, 0.15]).tolist()
    return place


def _unit(rng: np.random.Generator) -> Array:
    """A random direction (3,)."""
    drawn = rng.normal(size=3)
    return np.asarray(drawn / np.linalg.norm(drawn))


def _plane(rng: np.random.Generator) -> tuple[list[float], list[float]]:
    """A shaft and a zero direction across it."""
    shaft = _unit(rng)
    zero = np.cross(shaft, _unit(rng))
    return shaft.tolist(), (zero / np.linalg.norm(zero)).tolist()


def _law(rng: np.random.Generator) -> dict[str, Any]:
    """A random law of power over force."""
    exponent = float(rng.choice([1.5, rng.uniform(1.2, 2.5)]))
    forward = float(10.0 ** rng.uniform(-0.5, 0.5)) * 20.0 ** (1.5 - exponent)
    return {
        "type": "power_law",
        "forward": forward,
        "reverse": forward * float(rng.uniform(0.8, 3.0)),
    } | {"exponent": exponent}


def _thruster(rng: np.random.Generator, name: str, scale: float) -> dict[str, Any]:
    """A random thruster."""
    high = float(scale * rng.uniform(4.0, 30.0))
    low = -high * float(rng.choice([0.0, 1.0, rng.uniform(0.2, 1.2)], p=[0.1, 0.1, 0.8]))
    spec: dict[str, Any] = {"name": name, "type": "thruster", "position_m": _position(rng)}
    spec |= {"axis": _unit(rng).tolist(), "force_n": [low, high], "model": _law(rng)}
    if rng.random() < 0.5:
        spec["torque_per_newton_m"] = float(rng.uniform(-0.03, 0.03))
    return spec


def with_dead_bands(layout: Mapping[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """A layout whose thrusters give no force below 0.1 to 1 N."""
    banded = [
        each | {"dead_band_n": float(rng.uniform(0.1, 1.0))} if each["type"] == "thruster" else each
        for each in layout["actuators"]
    ]
    return {**layout, "actuators": banded}


def with_rates(layout: Mapping[str, Any]) -> dict[str, Any]:
    """A layout whose thrusters and azimuths change no faster than through their range in a
    second."""
    rated = []
    for each in layout["actuators"]:
        more: dict[str, Any] = {}
        if each["type"] in ("thruster", "azimuth", "propeller_rudder"):
            more["rate_n_s"] = each["force_n"][1] - each["force_n"][0]
        if each["type"] in ("azimuth", "propeller_rudder"):
            more["turn_rate_deg_s"] = 180.0
        rated.append({**each, **more})
    return {**layout, "actuators": rated}


def _azimuth(rng: np.random.Generator, name: str, scale: float) -> dict[str, Any]:
    """A random pod."""
    axis, zero = _plane(rng)
    spec: dict[str, Any] = {
        "name": name,
        "type": "azimuth",
        "position_m": _position(rng),
        "turn_axis": axis,
    }
    spec |= {
        "zero": zero,
        "force_n": [0.0, float(scale * rng.uniform(4.0, 30.0))],
        "model": _law(rng),
    }
    if rng.random() < 0.5:
        spec["arc_deg"] = _arc(rng, 20.0, 170.0)
    return spec


def _rudder(rng: np.random.Generator, name: str, scale: float) -> dict[str, Any]:
    """A random rudder."""
    around = rng.uniform(-math.pi, math.pi)
    zero = [1.0, 0.0, 0.0]
    shaft = [0.0, math.cos(around), math.sin(around)]
    most = float(rng.uniform(10.0, 20.0))
    spec: dict[str, Any] = {
        "name": name,
        "type": "rudder",
        "position_m": _position(rng),
        "shaft": shaft,
    }
    spec |= {"zero": zero, "area_m2": float(0.005 * scale * rng.uniform(0.5, 2.0))}
    return spec | {"aspect_ratio": float(rng.uniform(1.0, 4.0)), "deflection_deg": [-most, most]}


def _steered(rng: np.random.Generator, name: str, scale: float) -> dict[str, Any]:
    """A random propeller with a rudder in its slipstream, at rest."""
    rudder = _rudder(rng, name, scale)
    diameter = float(rng.uniform(0.05, 0.12))
    share = float(rng.uniform(0.3, 1.0))
    disc = math.pi * diameter**2 / 4.0
    deflection = [-float(rng.uniform(10.0, 22.0)), float(rng.uniform(10.0, 22.0))]
    return rudder | {
        "type": "propeller_rudder",
        "deflection_deg": deflection,
        "diameter_m": diameter,
        "area_m2": disc * float(rng.uniform(0.2, 0.55)) / share,
        "slipstream": share,
        "force_n": [-float(scale * rng.uniform(2.0, 10.0)), float(scale * rng.uniform(4.0, 30.0))],
        "model": _law(rng),
    }


def _steered_in_flow(rng: np.random.Generator, name: str, scale: float) -> dict[str, Any]:
    """The same that pushes ahead alone, as all do in a flow."""
    spec = _steered(rng, name, scale)
    return spec | {"force_n": [0.0, spec["force_n"][1]]}


def _arc(rng: np.random.Generator, least: float, most: float) -> list[float]:
    """A random arc [deg] of a width between two."""
    width = float(rng.uniform(least, most))
    start = float(rng.uniform(-180.0, 180.0 - width))
    return [start, start + width]


def _fin_model(rng: np.random.Generator, uneven: float = 0.0) -> dict[str, Any]:
    """A random model of a fin, with an unevenness where one is given."""
    kind = ("drag", "lighthill", "soft")[rng.integers(3)] if not uneven else "soft"

    def log(low: float, high: float) -> float:
        return float(math.exp(rng.uniform(math.log(low), math.log(high))))

    if kind == "drag":
        return {"type": kind, "area": log(0.005, 0.04), "lever": log(0.05, 0.15)}
    if kind == "lighthill":
        return {"type": kind, "length": log(0.1, 0.3), "width": log(0.05, 0.15)}
    lean = float(rng.uniform(-0.15, 0.15))
    shape = {
        "k": log(1.0, 8.0),
        "p": float(rng.uniform(1.0, 2.0)),
        "x0": float(rng.uniform(0.6, 1.5)),
    }
    shape |= {"q": float(rng.uniform(3.0, 6.0)), "d": lean}
    return {"type": kind, **shape, "e": uneven, "phi_e": float(rng.uniform(-math.pi, math.pi))}


def _fin(rng: np.random.Generator, name: str, scale: float) -> dict[str, Any]:
    """A random fin with its shaft across the hull, two of five with an arc."""
    return _any_fin(
        rng, name, _fin_model(rng), _arc(rng, 30.0, 170.0) if rng.random() < 0.4 else None
    )


def _shaft_fin(rng: np.random.Generator, name: str, scale: float) -> dict[str, Any]:
    """A random fin with its shaft in any direction."""
    spec = _fin(rng, name, scale)
    del spec["mounting_angle_deg"]
    spec["shaft"], spec["zero"] = _plane(rng)
    return spec


def _uneven_fin(rng: np.random.Generator, name: str, scale: float) -> dict[str, Any]:
    """A random fin whose force is not the same in all directions."""
    return _any_fin(rng, name, _fin_model(rng, float(rng.uniform(0.02, 0.2))), None)


def _wide_fin(rng: np.random.Generator, name: str, scale: float) -> dict[str, Any]:
    """A random fin with an arc beyond half a circle."""
    return _any_fin(rng, name, _fin_model(rng), _arc(rng, 190.0, 340.0))


def _restless_fin(rng: np.random.Generator, name: str, scale: float) -> dict[str, Any]:
    """A fin whose least force is up to 5 % of its largest: it beats no slower than some
    frequency."""
    spec = _fin(rng, name, scale)
    share = float(rng.uniform(0.005, 0.05))
    limits = spec["limits"]
    limits["amplitude_rad"][0] = 0.3
    for frequency in np.linspace(0.1, 1.5, 141):
        limits["frequency_hz"][0] = float(frequency)
        size = np.linalg.norm(
            edge_forces(OraclePlant({"actuators": [spec]}).actuators[0], 3), axis=1
        )
        if size.min() >= share * size.max():
            break
    limits["frequency_hz"][0] = max(float(frequency) - 0.01, 0.1)
    return spec


def _any_fin(
    rng: np.random.Generator, name: str, model: dict[str, Any], arc: list[float] | None
) -> dict[str, Any]:
    """A fin with a model, and in an arc [deg] or all round."""
    directions = [-math.pi, math.pi] if arc is None else np.radians(arc).tolist()
    limits = {
        "amplitude_rad": [0.05, float(rng.uniform(0.4, 0.8))],
        "zero_direction_rad": directions,
    }
    limits["frequency_hz"] = [0.1, float(rng.uniform(1.0, 3.0))]
    spec: dict[str, Any] = {
        "name": name,
        "type": "fin",
        "position_m": _position(rng),
        "model": model,
    }
    return spec | {"mounting_angle_deg": float(rng.uniform(-180.0, 180.0)), "limits": limits}
