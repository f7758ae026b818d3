"""Loads and thrust of DNV-ST-0111, level 1, beside values worked out by hand and published."""

from pathlib import Path

import numpy as np
import pytest

from finlab.analysis.dnv_loads import WEATHER, total_load, wave_load, wind_load
from finlab.analysis.dnv_thrust import LOSSES, ship_sets, ship_thrusters, thrust_left
from finlab.analysis.ship_file import Ship, read_ship
from finlab.layout import load_layout
from tests.analysis.supply_vessel import write_vessel
from tests.analysis.test_capability import ship_of


@pytest.fixture(scope="module")
def vessel(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Ship]:
    """Layout file and particulars of the published vessel."""
    layout, ship = write_vessel(tmp_path_factory.mktemp("vessel"), retractable=True)
    return layout, read_ship(ship)


def test_loads_of_the_published_case(vessel: tuple[Path, Ship]) -> None:
    load = total_load(vessel[1], WEATHER[6], np.deg2rad([0.0, 90.0, 180.0])) / 1e3
    expected = [[-62.1, 0.0, 0.0], [-5.5, 358.0, 509.0], [64.0, 0.0, 0.0]]
    assert load == pytest.approx(np.array(expected), abs=0.06)
    assert total_load(vessel[1], WEATHER[0], np.array([1.0])).tolist() == [[0.0, 0.0, 0.0]]


def test_wind_by_hand() -> None:
    # q = 61.3 Pa; 0.7 x 200 m2 ahead, 0.9 x 800 m2 abeam; the lever abeam is that of the area.
    load = wind_load(ship_of("{}"), 10.0, np.deg2rad([0.0, 90.0]))
    assert load[0] == pytest.approx((-8582.0, 0.0, 0.0))
    assert load[1] == pytest.approx((0.0, 44136.0, 5.0 * 44136.0), abs=1e-6)


def test_waves_by_hand() -> None:
    ship = ship_of("{}")
    short = wave_load(ship, 2.0, 3.5 / 1.4049, np.deg2rad([0.0, 90.0, 135.0, 270.0]))
    assert short[0] == pytest.approx((-18752.48, 0.0, 0.0), rel=1e-4)
    assert short[1] == pytest.approx((-3424.59, 155807.13, -423795.39), rel=1e-4)
    assert short[2] == pytest.approx((13367.27, 110172.28, -631287.15), rel=1e-4)
    assert short[3, 1:] == pytest.approx(-short[1, 1:])
    long = wave_load(ship, 4.0, 10.0 / 1.4049, np.deg2rad([0.0, 90.0]))
    assert long[0, 0] == pytest.approx(-27034.28, rel=1e-4)
    assert long[1, 1:] == pytest.approx((138411.52, -376479.34), rel=1e-4)


def test_nominal_thrust_of_the_published_case(vessel: tuple[Path, Ship]) -> None:
    thrusters = ship_thrusters(load_layout(vessel[0]), vessel[1])
    thrust = [thruster.forward / 1e3 for thruster in thrusters]
    assert thrust == pytest.approx([377.52, 377.52, 135.77, 126.89, 97.20], abs=0.006)
    assert thrusters[2].reverse == thrusters[2].forward
    assert thrusters[0].reverse == 0.0


@pytest.mark.parametrize(
    ("actuator", "number", "heading", "left"),
    [
        (0, 6, 0.0, 0.9896), (0, 6, 90.0, 0.9849), (0, 11, 0.0, 0.8389), (0, 11, 90.0, 0.7248),
        (2, 6, 90.0, 0.9989), (2, 11, 270.0, 0.8611), (3, 11, 0.0, 0.9538),
    ],
)  # fmt: skip
def test_ventilation_of_the_published_case(
    vessel: tuple[Path, Ship], actuator: int, number: int, heading: float, left: float
) -> None:
    thruster = ship_thrusters(load_layout(vessel[0]), vessel[1])[actuator]
    angle = np.deg2rad([heading])
    found = thrust_left(thruster, vessel[1], WEATHER[number], angle, ventilation=True)
    assert found[0] / 0.9 == pytest.approx(left, abs=6e-5)


def test_forbidden_and_lossy_directions_of_an_azimuth(vessel: tuple[Path, Ship]) -> None:
    thrusters = ship_thrusters(load_layout(vessel[0]), vessel[1])
    port = ship_sets(thrusters, vessel[1], (), LOSSES)[0]
    thrust = thrusters[0].forward
    half = np.rad2deg(np.arctan(0.1 + 3.0 / 11.0))

    def holds(angle: float, size: float) -> bool:
        turn = np.deg2rad(angle)
        force = size * thrust * np.array([[np.cos(turn), np.sin(turn)]])
        return any(part.contains(force)[0] for part in port.parts)

    # Thrust to port throws the race onto the other azimuth.
    assert not holds(90.0, 0.5)
    assert not holds(90.0 + half - 0.1, 0.5) and holds(90.0 + half + 0.1, 0.5)
    assert not holds(90.0 - half + 0.1, 0.5) and holds(90.0 - half - 0.1, 0.9)
    assert holds(0.0, 0.9999) and not holds(0.0, 1.0001)
    # Most is lost where the race just passes the skeg.
    jet = np.arctan(0.6 * 3.0 / np.hypot(4.0, 5.5))
    worst = np.pi / 2 + np.arctan(4.0 / 5.5) + jet
    left = 2.0 * worst / np.pi - 1.0
    assert holds(np.rad2deg(worst), left - 1e-3) and not holds(np.rad2deg(worst), left + 1e-3)
    # The set without losses covers all of it.
    assert all(port.cover.contains(np.array([part.corners[0]]))[0]
               for part in port.parts if part.corners is not None)  # fmt: skip
