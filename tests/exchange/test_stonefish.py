"""Robots of the simulator Stonefish: numbers by hand, from its equations of thrust."""

import math

import numpy as np
import pytest

from finlab.errors import LayoutError
from finlab.exchange import Exchange, read_robot
from finlab.layout import Azimuth, Layout, Thruster

BOX = (
    '<base_link name="hull" type="box" physics="submerged"><dimensions xyz="1 0.4 0.3"/>'
    '<origin xyz="0.1 0 0.02" rpy="0 0 0"/><mass value="40"/></base_link>'
)
"""A hull of 40 kg whose centre is 0.1 m ahead and 0.02 m below its origin."""
MODEL = (
    '<specs max_setpoint="${2*pi*15}" inverted_setpoint="false" normalized_setpoint="true"/>'
    '<propeller diameter="0.15" right="true"/><rotor_dynamics type="first_order"><time_constant '
    'value="0.2"/></rotor_dynamics><thrust_model type="fluid_dynamics"><thrust_coeff forward="0.3" '
    'reverse="0.25"/><torque_coeff value="0.02"/></thrust_model>'
)
"""A thruster of fifteen revolutions per second."""


def thruster(name: str = "port", model: str = MODEL, link: str = "hull") -> str:
    """A thruster on the left of a hull, a little above its middle, turned 30 degrees inwards."""
    return (
        f'<actuator name="{name}" type="thruster"><link name="{link}"/><origin '
        f'xyz="-0.4 -0.2 -0.05" rpy="0 0 {math.radians(30)}"/>{model}</actuator>'
    )


def robot(*parts: str, base: str = BOX) -> str:
    """A robot with a base link and what else is given."""
    return (
        f'<scenario><robot name="sub" fixed="false" self_collisions="false">{base}'
        f'{"".join(parts)}<world_transform xyz="0 0 1" rpy="0 0 0"/></robot></scenario>'
    )


def read(text: str, **said: object) -> tuple[Layout, str]:
    """The layout of a file, and the notes on it."""
    exchange = Exchange(**said)  # type: ignore[arg-type]
    return read_robot(text, "robot.scn", exchange), " ".join(exchange.notes)


def only_thruster(text: str) -> Thruster:
    """The one thruster of a file."""
    (part,) = read(text)[0].actuators
    assert isinstance(part, Thruster)
    return part


def test_places_forces_and_torques() -> None:
    layout, notes = read(robot(thruster()))
    (port,) = layout.actuators
    assert isinstance(port, Thruster) and layout.body is not None and layout.body.mass_kg == 40
    # Left and above the centre of gravity, which is 0.1 m ahead; right and down count as plus there.
    np.testing.assert_allclose(port.position, [-0.5, 0.2, 0.07], atol=1e-12)
    np.testing.assert_allclose(port.axis, [math.cos(0.5235988), -0.5, 0.0], atol=1e-7)
    newtons = 1000 * 0.15**4 * 15**2  # rho D^4 n^2
    np.testing.assert_allclose(port.force, [-0.25 * newtons, 0.3 * newtons])
    assert port.torque_per_newton == pytest.approx(-0.15 * 0.02 / 0.3)
    assert port.time_constant == 0.2
    assert "Robot sub of Stonefish was read, x forward, y right, z down" in notes


def test_what_is_sent_may_have_the_other_sign() -> None:
    left = MODEL.replace('right="true"', 'right="false"')
    both = left.replace('inverted_setpoint="false"', 'inverted_setpoint="true"')
    layout, notes = read(robot(thruster("a", left), thruster("b", both), thruster("c")))
    a, b, c = layout.actuators
    assert a.axis == b.axis == c.axis  # type: ignore[attr-defined]
    assert a.torque_per_newton == -c.torque_per_newton  # type: ignore[attr-defined]
    assert "A positive setpoint of a pushes backwards" in notes


@pytest.mark.parametrize(
    ("model", "force"),
    [
        (
            '<specs thrust_coeff="0.4" thrust_coeff_backward="0.3" max_rpm="600"/><propeller '
            'diameter="0.1" right="true"/>',
            (-3.0, 4.0),
        ),
        ('<specs lower_thrust_limit="-10" upper_thrust_limit="12"/>', (-10.0, 12.0)),
        (
            '<specs lower_thrust_limit="-10" upper_thrust_limit="12" inverted="true"/>',
            (-12.0, 10.0),
        ),
        (
            '<specs max_setpoint="100"/><thrust_model type="quadratic"><thrust_coeff '
            'value="0.002"/></thrust_model>',
            (-20.0, 20.0),
        ),
        (
            '<specs max_setpoint="100"/><thrust_model type="deadband"><thrust_coeff '
            'forward="0.002" reverse="0.001"/><deadband lower="-100" upper="200"/></thrust_model>',
            (-9.9, 19.6),
        ),
        (
            '<specs max_setpoint="100"/><thrust_model type="linear_interpolation"><input '
            'value="-100 0 100"/><output value="-7 0 9"/></thrust_model>',
            (-7.0, 9.0),
        ),
        (
            '<specs max_setpoint="50"/><propeller right="false"/><thrust_model '
            'type="linear_interpolation"><input value="-100 0 100"/><output value="-7 0 9"/>'
            "</thrust_model>",
            (-4.5, 3.5),
        ),
        ("", (-39.91, 51.44)),
        (MODEL.replace("first_order", "bessa"), (-39.91, 51.44)),
    ],
)
def test_models_of_thrust(model: str, force: tuple[float, float]) -> None:
    np.testing.assert_allclose(only_thruster(robot(thruster(model=model))).force, force)


def test_a_mount_that_turns_and_other_actuators() -> None:
    pod = (
        '<link name="pod" type="sphere"/><joint name="turn" type="revolute"><parent name="hull"/>'
        '<child name="pod"/><origin xyz="-0.6 0 0" rpy="0 0 0"/><axis xyz="0 0 1"/><limits '
        'min="-0.5" max="0.7"/></joint><actuator name="push" type="thruster"><link name="pod"/>'
        f'<origin xyz="-0.1 0 0" rpy="0 0 0"/>{MODEL}</actuator>'
        '<actuator name="servo" type="servo"/>'
    )
    layout, notes = read(robot(pod))
    (push,) = layout.actuators
    assert isinstance(push, Azimuth)
    np.testing.assert_allclose(push.turn_axis, [0, 0, -1])
    np.testing.assert_allclose(push.arc, [-0.5, 0.7])
    np.testing.assert_allclose(push.position, [-0.6, 0, 0])
    assert "servo (servo)" in notes and "the origin is that of the base link" in notes


def test_parts_with_masses_have_a_centre_of_gravity() -> None:
    parts = "".join(
        f'<internal_part name="p{i}" type="sphere"><dimensions radius="0.1"/><origin xyz="0 0 0" '
        f'rpy="0 0 0"/><mass value="{mass}"/><compound_transform xyz="{x} 0 0" rpy="0 0 0"/>'
        "</internal_part>"
        for i, (mass, x) in enumerate([(10, 0.3), (30, -0.1)])
    )
    base = f'<base_link name="hull" type="compound">{parts}</base_link>'
    layout, _ = read(robot(thruster(), base=base))
    assert layout.actuators[0].position == pytest.approx((-0.4, 0.2, 0.05))
    assert layout.body is not None and layout.body.mass_kg == 40
    layout, _ = read(robot(thruster(), base=base), origin="base")
    assert layout.body is None and layout.description == "Origin at the frame of its base link."


def test_arguments_and_names() -> None:
    text = robot('<arg name="side" default="-0.2"/>', thruster("$(param name)/port")).replace(
        "-0.4 -0.2 -0.05", "-0.4 $(arg side) -0.05"
    )
    layout, _ = read(text.replace('name="sub"', 'name="$(param name)"'))
    assert layout.name == "robot" and layout.actuators[0].name == "port"
    assert layout.actuators[0].position[1] == pytest.approx(0.2)


def test_limits_that_the_file_does_not_say_are_named() -> None:
    _, notes = read(robot(thruster()).replace("${2*pi*15}", "$(param max_rpm)"))
    assert "Limits of port are not read: specs@max_setpoint of actuator 'port' has $(param" in notes
    assert "those of a T200 at 16 V are taken" in notes


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (robot(), "Stonefish without an actuator of type thruster"),
        (robot(thruster(link="arm")), "thruster 'port' is on link 'arm', which is not there"),
        (
            robot(thruster()).replace("-0.4 -0.2", "$(arg x) -0.2"),
            r"<origin> has \$\(arg x\), whose value this file of Stonefish does not say",
        ),
        (robot(thruster()).replace("-0.4 -0.2", "${open('x')} 0"), "calls open, which opens files"),
        (robot(thruster()).replace("-0.4 -0.2", "${9**9**9} 0"), "9"),
        (robot(thruster()).replace("-0.4 -0.2", "nan -0.2"), "xyz of <origin> is not 3 numbers"),
        (
            robot(
                '<joint name="a" type="fixed"><parent name="hull"/><child name="b"/></joint>'
                '<joint name="c" type="fixed"><parent name="b"/><child name="hull"/></joint>',
                thruster(),
            ),
            "'hull' hangs on itself",
        ),
        ('<scenario><include file="$(find x)/y/rov.scn"/></scenario>', "includes rov.scn, which"),
    ],
)
def test_refusals_name_stonefish_or_the_value(text: str, said: str) -> None:
    with pytest.raises(LayoutError, match=said):
        read(text)
