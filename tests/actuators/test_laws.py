"""Laws of thrusters, azimuths and rudders: derivatives, published figures, and what a plant makes
of them."""

import math
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.actuators.azimuth import Azimuth, AzimuthLaw
from finlab.actuators.fin.fin import Fin
from finlab.actuators.law import ActuatorLaw
from finlab.actuators.rudder import Rudder, RudderLaw
from finlab.actuators.thrust_model import PowerLaw, PowerTable
from finlab.actuators.thrust_power import PowerLaws, TableCurves
from finlab.actuators.thruster import Thruster, ThrusterLaw
from finlab.arrays import Array
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant
from tests.t200 import t200_rows

LAW = PowerLaw(0.997, 1.449)
"""Power of a T200 thruster at 16 V, as a law: P = 0.997 F^1.449."""
T200 = PowerTable(t200_rows(16), "us")
"""The same thruster as its maker measured it."""
REMUS_RUDDER = {"area": 6.65e-3, "deflection": (-0.24, 0.24)}
"""Area [m2] and deflections [rad] of a rudder of the REMUS, as Prestero (2001) gives them."""


def thruster(name: str = "t", model: Any = LAW, **changes: Any) -> Thruster:
    """A thruster with some of its fields changed."""
    fields = {
        "position": (0.1, 0.2, 0.3),
        "axis": (0.0, 0.6, 0.8),
        "force": (-39.0, 51.0),
        **changes,
    }
    return Thruster(name=name, model=model, **fields)


def azimuth(name: str = "a", model: Any = LAW, **changes: Any) -> Azimuth:
    """A pod with some of its fields changed."""
    fields = {
        "turn_axis": (0.0, 0.0, 1.0),
        "zero": (1.0, 0.0, 0.0),
        "force": (0.0, 40.0),
        **changes,
    }
    return Azimuth(name=name, position=(-0.5, 0.1, 0.0), model=model, **fields)


def rudder(name: str = "r", **changes: Any) -> Rudder:
    """A rudder of the REMUS with some of its fields changed."""
    fields = {
        "shaft": (0.0, 0.0, 1.0),
        "zero": (1.0, 0.0, 0.0),
        "aspect_ratio": 2.21,
        **REMUS_RUDDER,
        **changes,
    }
    return Rudder(name=name, position=(-0.638, 0.0, 0.0), **fields)


def random_commands(low: Array, high: Array) -> Array:
    """Commands (50, ...) between limits."""
    rng = np.random.default_rng(3)
    return low + rng.uniform(size=(50, *low.shape)) * (high - low)


@pytest.mark.parametrize(
    ("law", "parts"),
    [
        (ThrusterLaw, [thruster(), thruster(force=(0.0, 5.0))]),
        (
            ThrusterLaw,
            [thruster(model=T200), thruster(model=PowerTable(t200_rows(12)), force=(-20.0, 30.0))],
        ),
        (AzimuthLaw, [azimuth(), azimuth(force=(3.0, 20.0))]),
        (AzimuthLaw, [azimuth(model=T200)] * 2),
        (AzimuthLaw, [azimuth(force=(-30.0, 40.0), dead_band=15.0), azimuth(dead_band=8.0)]),
        (ThrusterLaw, [thruster(dead_band=20.0), thruster(model=T200, dead_band=6.0)]),
        (RudderLaw, [rudder(deflection=(-1.2, 1.2)), rudder(drag=0.1, stall=0.3)]),
    ],
)
def test_derivatives_are_those_of_finite_differences(law: type[Any], parts: list[Any]) -> None:
    actuator_law: ActuatorLaw = law(parts)
    command = random_commands(
        np.array([p.lower for p in parts]), np.array([p.upper for p in parts])
    )
    inflow = np.random.default_rng(4).normal(0.0, 2.0, command.shape)
    force, jacobian = actuator_law.force_and_jacobian(command, inflow)
    np.testing.assert_array_equal(force, actuator_law.force(command, inflow))
    gradient = actuator_law.power_gradient(command, inflow)
    step = 1e-6
    for k in range(3):
        move = step * np.eye(3)[k]
        by_force = (
            actuator_law.force(command + move, inflow) - actuator_law.force(command - move, inflow)
        ) / (2.0 * step)
        ahead, back = (actuator_law.power(command + s * move, inflow) for s in (1.0, -1.0))
        scale = 1.0 + np.abs(force).max()
        np.testing.assert_allclose(jacobian[..., k, :], by_force, atol=2e-6 * scale)
        np.testing.assert_allclose(
            gradient[..., k], (ahead - back) / (2.0 * step), atol=1e-4, rtol=1e-4
        )


def test_commands_within_the_dead_band_give_no_force_and_take_no_power() -> None:
    law = ThrusterLaw([thruster(dead_band=0.5)])
    command = np.array([[[0.4, 0, 0]], [[-0.4, 0, 0]], [[0.5, 0, 0]]])
    np.testing.assert_array_equal(law.force(command)[:, 0, 0], [0.0, 0.0, 0.5])
    np.testing.assert_allclose(law.power(command)[:, 0], [0.0, 0.0, 0.997 * 0.5**1.5])


@pytest.mark.parametrize("volts", [12, 16, 20])
def test_the_makers_tables_are_met_and_convex(volts: int) -> None:
    table = PowerTable(t200_rows(volts), "us")
    _, force, power = table.columns
    watts, _ = TableCurves(table).power_and_marginal_cost(force)
    np.testing.assert_allclose(watts, power, atol=0.35)
    fine = np.linspace(force[0], force[-1], 20001)
    watts, marginal = TableCurves(table).power_and_marginal_cost(fine)
    assert (np.diff(marginal) > 0.0).all()
    np.testing.assert_allclose(
        np.gradient(watts, fine)[1:-1], marginal[1:-1], atol=0.05 * marginal.max()
    )


@pytest.mark.parametrize(
    ("volts", "forward", "reverse", "rms"),
    [
        (12, 0.912, 1.315, (1.3, 2.5)),
        (16, 0.997, 1.449, (5.0, 9.5)),
        (20, 1.163, 1.774, (8.5, 10.5)),
    ],
)
def test_power_laws_of_the_t200_meet_its_tables(
    volts: int, forward: float, reverse: float, rms: tuple[float, float]
) -> None:
    """Published fits of F^1.5, and the root of the mean square of what they miss [W]."""
    _, force, power = PowerTable(t200_rows(volts)).columns
    power_by_law, _ = PowerLaws([PowerLaw(forward, reverse)]).power_and_marginal_cost(
        force[:, None]
    )
    missed = power_by_law[:, 0] - power
    for side, most in zip((force > 0.0, force < 0.0), rms, strict=True):
        assert math.sqrt((missed[side] ** 2).mean()) <= most


def test_a_table_answers_a_price_with_the_force_whose_marginal_cost_it_is() -> None:
    curve = TableCurves(T200).sides[0].curve
    price = np.linspace(0.0, 13.0, 300)
    size = curve.response(price)
    power, marginal_cost = curve.power_and_marginal_cost(size)
    np.testing.assert_allclose(marginal_cost, price, atol=1e-9)
    grid = np.linspace(0.0, 51.44, 4001)
    power_on_grid, _ = curve.power_and_marginal_cost(grid)
    conjugate = (price[:, None] * grid - power_on_grid).max(axis=1)
    assert (price * size - power >= conjugate - 1e-9).all()


def test_a_rudder_at_zero_inflow_angle_is_the_fin_of_a_torpedo() -> None:
    """Fin of Fossen's Python Vehicle Simulator: 1/2 rho A CL delta U^2 across the fin."""
    law = RudderLaw([rudder(lift_slope=0.5, drag=0.0, stall=1.2)])
    for delta, speed in ((0.1, 1.0), (-0.26, 2.5)):
        force = law.force(
            np.array([[delta, 0.0, 0.0]]), np.array([[speed, 0.0, 0.0]])[:, [1, 0, 2]]
        )
        expected = 0.5 * 1000.0 * 6.65e-3 * 0.5 * delta * speed**2
        assert force[0, 2] == pytest.approx(expected, rel=1e-12) and force[0, 0] == 0.0


def test_a_rudder_has_the_lift_of_remus() -> None:
    """Prestero (2001): lift slope 3.12 and area of one fin in sea water give 10.69 U^2 delta."""
    law = RudderLaw([rudder(lift_slope=3.12, density=1030.0)])
    force = law.force(np.array([[0.01, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]))
    assert force[0, 2] / 0.01 == pytest.approx(10.69, abs=0.01)


def test_lift_stands_across_the_flow_and_drag_against_it() -> None:
    law = RudderLaw([rudder(drag=0.02)])
    inflow = np.array([[0.3, 1.5, 0.4]])
    force = law.force(np.array([[math.atan2(0.4, 1.5), 0.0, 0.0]]), inflow)[0]
    pressure = 0.5 * 1000.0 * 6.65e-3 * (1.5**2 + 0.4**2)
    np.testing.assert_allclose(
        force, -0.02 * pressure * np.array([0, 1.5, 0.4]) / math.hypot(1.5, 0.4)
    )
    assert law.power(np.array([[math.atan2(0.4, 1.5), 0.0, 0.0]]), inflow)[0] == pytest.approx(
        0.02 * pressure * math.hypot(1.5, 0.4)
    )


def test_a_rudder_stalls_turns_its_sign_astern_and_rests_at_rest() -> None:
    law = RudderLaw([rudder(deflection=(-1.5, 1.5))])
    delta = np.linspace(-1.5, 1.5, 301)[:, None, None] * np.array([1.0, 0.0, 0.0])
    ahead = law.force(delta, np.array([0.0, 1.0, 0.0]))[:, 0]
    assert abs(delta[ahead[:, 2].argmax(), 0, 0] - 0.42) < 0.05
    np.testing.assert_allclose(ahead[:, 2], -ahead[::-1, 2], atol=1e-12)
    astern = law.force(delta, np.array([0.0, -1.0, 0.0]))[:, 0]
    np.testing.assert_allclose(astern[:, 1:], -ahead[:, 1:], atol=1e-12)
    assert not law.force(delta).any() and not law.power(delta).any()
    assert not law.force(delta, np.zeros(3)).any()


def coefficients_with_stall(
    slope: float, drag: float, induced: float, stall: float, a: float
) -> Array:
    """Coefficients (2,) of lift and drag by Beard and McLain (2012), section 4.2, with a sharpness
    of 50."""
    below = math.exp(-50.0 * (a - stall))
    above = math.exp(50.0 * (a + stall))
    sigma = (1.0 + below + above) / ((1.0 + below) * (1.0 + above))
    lift = slope * a
    plate = (
        2.0 * math.copysign(1.0, a) * math.sin(a) ** 2 * math.cos(a),
        drag + 2.0 * math.sin(a) ** 2,
    )
    smooth = lift, drag + induced * lift**2
    return (1.0 - sigma) * np.array(smooth) + sigma * np.array(plate)


def test_a_foil_stalls_as_its_source_says() -> None:
    rudders = [rudder(stall=0.3, drag=0.02), rudder(lift_slope=2.0, stall=0.6, aspect_ratio=4.0)]
    law = RudderLaw(rudders)
    for angle in np.linspace(-1.5, 1.5, 301):
        coefficients = law.coefficients(np.array([angle, angle]))
        for i, part in enumerate(rudders):
            expected = coefficients_with_stall(
                part.slope, part.drag, part.induced, part.stall, float(angle)
            )
            np.testing.assert_allclose(
                [coefficients.lift[i], coefficients.drag[i]], expected, rtol=1e-9, atol=1e-12
            )


def hybrid() -> Layout:
    """A robot that has every kind of actuator."""
    parts = (
        thruster("up", torque_per_newton=0.02),
        rudder(),
        Fin("fin", (0.2, 0.1, 0.0), 0.5),
        azimuth(torque_per_newton=-0.01),
        thruster("table", model=T200, axis=(1.0, 0.0, 0.0)),
    )
    return Layout("hybrid", parts)


def test_a_plant_judges_any_mix() -> None:
    plant = Plant(hybrid())
    command = plant.sample(np.random.default_rng(0), (6,))
    flow = np.array([1.2, 0.1, -0.1, 0.0, 0.2, 0.3])
    force = plant.body_forces(command, flow=flow)
    torque = np.cross(plant.layout.position, force)
    torque[:, 0] += 0.02 * force[:, 0]
    torque[:, 3] -= 0.01 * force[:, 3]
    wrench = plant.wrench(command, flow=flow)
    np.testing.assert_allclose(
        wrench, np.concatenate([force, torque], axis=-1).sum(axis=1), atol=1e-12
    )
    np.testing.assert_allclose(force[:, 0], command[:, 0, :1] * [0.0, 0.6, 0.8])
    angle = command[:, 3, 0]
    size = command[:, 3, 1]
    np.testing.assert_allclose(
        force[:, 3, :2], np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)
    )
    moved = plant.linearize(command, flow=flow)[1]
    step = 1e-6 * np.random.default_rng(1).normal(size=command.shape)
    change = plant.wrench(command + step, flow=flow) - plant.wrench(command - step, flow=flow)
    np.testing.assert_allclose(
        change, 2.0 * np.einsum("bwk,bk->bw", moved, step.reshape(6, -1)), atol=1e-8
    )
    assert plant.power(command, flow=flow).shape == (6, 5)
    assert plant.power(command)[:, 1] == pytest.approx(0.0)


def test_a_failed_actuator_of_any_kind_gives_nothing() -> None:
    plant = Plant(hybrid())
    command = plant.sample(np.random.default_rng(0), ())
    for i in range(plant.n):
        lost = command.copy()
        lost[i] = np.nan
        assert not plant.forces(lost, flow=np.ones(6))[i].any()
        assert np.isnan(plant.power(lost, flow=np.ones(6))[i])


def test_angles_of_azimuths_wrap_and_other_commands_end_at_their_limits() -> None:
    plant = Plant(Layout("two", (azimuth(), azimuth("b", arc=(-0.5, 0.5)), thruster())))
    brought = plant.feasible(np.array([[4.0, 50.0, 0.0], [4.0, 5.0, 0.0], [99.0, 0.0, 0.0]]))
    np.testing.assert_allclose(brought[:, 0], [4.0 - 2.0 * np.pi, 0.5, 51.0])
    assert brought[0, 1] == 40.0


def test_an_actuator_says_which_number_turns_all_round() -> None:
    """Programs that watch how far commands change ask it."""
    around = {
        actuator.type: actuator.ANGLE
        for name in ("A", "catamaran", "bluerov2", "torpedo")
        for actuator in finlab.load_layout(name).actuators
    }
    assert around == {"fin": 2, "azimuth": 0, "thruster": None, "rudder": None}
