"""The formula of jets beside published tests, its derivatives beside differences, and what speed
takes."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from finlab import Azimuth, Body, Fin, Layout, PowerLaw, Thruster
from finlab.arrays import Array
from finlab.interaction.interaction import Interaction
from finlab.interaction.jets import Jets
from finlab.layout import FinModelSpec, Hull
from finlab.layout.jet_geometry import jet_geometry_of
from finlab.physics import Plant
from finlab.research.random_layouts import random_jet_robot
from tests.interaction import oracle

DIAMETER_M = 0.1
"""Diameter of a jet [m]."""
LAW = PowerLaw(1.0)
"""Power over force of the actuators."""


def tandem(apart: float, turned: float = 0.0, **constants: float) -> Layout:
    """Two pods in line, `apart` diameters; the front one turned by `turned` degrees."""
    front, back = (
        Azimuth(
            name,
            (x, 0.0, 0.0),
            (0.0, 0.0, 1.0),
            (1.0, 0.0, 0.0),
            (0.0, 40.0),
            LAW,
            diameter=DIAMETER_M,
        )
        for name, x in (("front", 0.0), ("back", -apart * DIAMETER_M))
    )
    return Layout("tandem", (front, back), interaction=Jets(**constants))


def thrust_left(apart: float, turned: float) -> float:
    """Share of its thrust that the hind one of two keeps."""
    plant = Plant(tandem(apart))
    command = np.array([[math.radians(turned), 10.0, 0.0], [0.0, 10.0, 0.0]])
    front = np.array([10.0 * math.cos(math.radians(turned)), 10.0 * math.sin(math.radians(turned))])
    return float((plant.wrench(command)[0] - front[0]) / 10.0)


@pytest.mark.parametrize("apart", [2.0, 4.0, 8.0, 16.0])
def test_two_in_line_as_dang_and_laheij_measured(apart: float) -> None:
    alone = 1.0 - 0.8 ** (apart ** (2.0 / 3.0))
    assert abs(thrust_left(apart, 0.0) - alone) < 0.05
    turned = alone + (1.0 - alone) * 1000.0 / (130.0 / alone**3 + 1000.0)
    assert abs(thrust_left(apart, 10.0) - turned) < 0.05


def test_far_aside_nothing_is_lost() -> None:
    assert thrust_left(4.0, 60.0) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("seed", range(8))
def test_the_core_says_what_the_formula_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    known = Jets(2.5, 2.9, 30.0, 0.7, 0.8, 0.25, 0.1, 0.55)
    geometry = jet_geometry_of(random_jet_robot(rng, "r", (2, 9)))
    n = len(geometry.position)
    force = rng.normal(size=(5, n, 3)) * 10.0 ** rng.uniform(-4, 2, (5, n, 1))
    inflow = rng.normal(size=(n, 3))
    expected = [oracle.offset(known, geometry, own, inflow) for own in force]
    assert_allclose(known.of(geometry).offset(force, inflow), expected, rtol=1e-9, atol=1e-9)


def differs(known: Interaction, force: Array, inflow: Array | None = None) -> float:
    """By how much derivatives by forces (n, 3) differ at most from differences, exact answers
    included."""
    offset, slope = known.effect(force, inflow)
    assert_allclose(offset, known.offset(force, inflow), atol=1e-12)
    steps = 1e-5 * np.eye(force.size).reshape(*force.shape, *force.shape)
    change = known.offset(force + steps, inflow) - known.offset(force - steps, inflow)
    return float(np.abs(slope - change / 2e-5).max())


@pytest.mark.parametrize("seed", range(4))
def test_derivatives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    known = Jets().of(jet_geometry_of(random_jet_robot(rng, "robot", (2, 6))))
    n = len(known.geometry.position)
    assert differs(known, 8.0 * rng.normal(size=(n, 3)), rng.normal(size=(n, 3))) < 1e-6


def test_what_rests_takes_and_gives_nothing() -> None:
    plant = Plant(tandem(3.0, housing=0.0))
    assert_allclose(plant.wrench(np.zeros((2, 3))), 0.0, atol=1e-9)


def test_a_jet_on_the_hull_pushes_back() -> None:
    thruster = Thruster(
        "bow", (0.6, 0.0, 0.0), (1.0, 0.0, 0.0), (-30.0, 30.0), LAW, diameter=DIAMETER_M
    )
    hull = Body(hull=Hull("ellipsoid", (0.6, 0.4, 0.3)))
    plant = Plant(Layout("one", (thruster,), body=hull, interaction=Jets(hull=0.5)))
    astern, ahead = (plant.wrench(np.array([[f, 0.0, 0.0]]))[0] for f in (-20.0, 20.0))
    assert ahead == pytest.approx(10.0, rel=0.02)  # its jet flows astern, onto the hull
    assert astern == pytest.approx(-20.0, rel=0.02)


def open_water(force: float, speed: float, kt: float, none_at: float) -> float:
    """Thrust at a speed of advance along Kt = Kt0 (1 - J / J0), at the rate that gives `force` at
    rest."""
    rate = math.sqrt(force / (1000.0 * kt * DIAMETER_M**4))
    return 1000.0 * rate**2 * DIAMETER_M**4 * kt * (1.0 - speed / (rate * DIAMETER_M * none_at))


@pytest.mark.parametrize("force", [10.0, 20.0, 40.0])
@pytest.mark.parametrize(("kt", "none_at"), [(0.4, 0.8), (0.3, 1.1), (0.5, 0.6)])
def test_speed_takes_what_the_open_water_line_says(force: float, kt: float, none_at: float) -> None:
    one = Thruster(
        "stern",
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0),
        (-50.0, 50.0),
        LAW,
        diameter=DIAMETER_M,
        open_water=(kt, none_at),
    )
    plant = Plant(Layout("one", (one,), interaction=Jets()))
    got = plant.wrench(np.array([[force, 0.0, 0.0]]), flow=np.array([1.0, 0, 0, 0, 0, 0]))[0]
    assert got == pytest.approx(open_water(force, 1.0, kt, none_at), rel=0.05, abs=0.05)


@pytest.mark.parametrize("area", [0.02, 0.01])
def test_a_fin_s_jet_is_as_wide_as_it_sweeps(area: float) -> None:
    fin = Fin("fin", (0.0, 0.0, 0.0), 0.0, model=FinModelSpec("drag", (("area", area),)))
    assert math.pi / 4.0 * fin.jet**2 == pytest.approx(area)
