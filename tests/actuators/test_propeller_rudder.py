"""A propeller with a rudder in its slipstream: its forces beside momentum theory written out, what
it steers at rest and in a flow beside a search over its commands, and how a file's thruster and
rudder become one.

The judge of forces and power is `tests/oracle_plant.py`.
"""

import json
import math
import subprocess
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab.actuators.propeller_rudder import PropellerRudder
from finlab.analysis.prove import prove
from finlab.arrays import Array
from finlab.cli import main
from finlab.deploy.c_sources import c_sources, write_c
from finlab.deploy.deployed_robot import DeployedRobot, load_robot
from finlab.deploy.serve import Server
from finlab.errors import LayoutError
from finlab.layout import Damage, Layout, layout_to_dict, load_layout, save_layout
from finlab.layout.load import parse_layout
from finlab.physics.plant import plant_of
from tests.oracle_plant import OraclePlant

DENSITY = 1000.0
"""Of the water [kg/m^3]."""
UNIT: Mapping[str, Any] = {
    "name": "screw",
    "type": "propeller_rudder",
    "position_m": [-0.45, 0.0, 0.0],
    "shaft": [0.0, 0.0, 1.0],
    "zero": [1.0, 0.0, 0.0],
    "force_n": [-6.0, 10.0],
    "model": {"type": "power_law", "forward": 1.0, "reverse": 1.5},
    "diameter_m": 0.07,
    "area_m2": 0.003,
    "aspect_ratio": 1.5,
    "slipstream": 0.8,
    "deflection_deg": [-25.0, 25.0],
}
"""A propeller of 7 cm before a rudder of 30 cm^2."""
THRUSTER: Mapping[str, Any] = {
    "name": "screw",
    "type": "thruster",
    "position_m": [-0.35, 0.0, 0.0],
    "axis": [1.0, 0.0, 0.0],
    "force_n": [-6.0, 10.0],
    "model": {"type": "power_law", "forward": 1.0, "reverse": 1.5},
}
RUDDER: Mapping[str, Any] = {
    "name": "rudder",
    "type": "rudder",
    "position_m": [-0.45, 0.0, 0.0],
    "shaft": [0.0, 0.0, 1.0],
    "zero": [1.0, 0.0, 0.0],
    "area_m2": 0.004,
    "deflection_deg": [-35.0, 35.0],
    "aspect_ratio": 1.5,
}
"""A rudder 10 cm behind a screw."""
JOINED = "rudder stands in the slipstream of screw: both are one actuator, screw"
"""What is said of the two."""


def boat_of(*actuators: Mapping[str, Any]) -> dict[str, Any]:
    """A boat in the plane, as the mapping of a layout file."""
    return {
        "format": "finlab-layout",
        "version": 2,
        "name": "boat",
        "axes": ["Fx", "Tz"],
        "actuators": list(actuators),
    }


@pytest.fixture(scope="module")
def boat() -> Layout:
    """The boat with the one propeller and its rudder."""
    return parse_layout(boat_of(UNIT))


def force_by_momentum_theory(deflection: float, T: float, V: float) -> tuple[float, float]:
    """Force ahead and aside [N] of `UNIT` below stall, step by step.

    The slipstream of a disc of area A is as fast as V_inf = sqrt(V^2 + 2 T / (rho A)).
    """
    A = math.pi * 0.07**2 / 4.0
    V_inf = math.sqrt(V**2 + 2.0 * T / (DENSITY * A))
    q_flow = 0.5 * DENSITY * V**2
    q_slipstream = 0.5 * DENSITY * V_inf**2
    q = q_flow + 0.8 * (q_slipstream - q_flow)
    lift_slope = 1.8 * math.pi * 1.5 / (math.sqrt(1.5**2 + 4.0) + 1.8)
    CL = lift_slope * deflection
    CD = 0.0065 + CL**2 / (0.9 * math.pi * 1.5)
    return T - q * 0.003 * CD, q * 0.003 * CL


@pytest.mark.parametrize("V", [0.0, 0.4, 1.5])
@pytest.mark.parametrize("T", [0.5, 3.0, 10.0])
def test_forces_are_those_of_momentum_theory(boat: Layout, V: float, T: float) -> None:
    flow = np.array([V, 0.0, 0.0, 0.0, 0.0, 0.0])
    for deflection in (-0.3, -0.1, 0.0, 0.05, 0.3):
        command = np.array([[deflection, T, 0.0]])
        ahead, aside = force_by_momentum_theory(deflection, T, V)
        wrench = plant_of(boat).at(flow).wrench(command)
        assert wrench[0] == pytest.approx(ahead, rel=0.01, abs=1e-3 * T)
        assert wrench[1] == pytest.approx(aside, rel=0.01, abs=1e-9)
        assert wrench[5] == pytest.approx(-0.45 * aside, rel=0.01, abs=1e-9)


def test_astern_nothing_meets_the_rudder(boat: Layout) -> None:
    wrench = plant_of(boat).wrench(np.array([[0.3, -4.0, 0.0]]))
    np.testing.assert_allclose(wrench, [-4.0, 0.0, 0.0, 0.0, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("V", [0.0, 0.7])
def test_derivatives_are_those_of_differences(boat: Layout, V: float) -> None:
    inflow = np.array([[0.0, V, 0.1]])
    law = type(boat.actuators[0]).KIND.law(boat.actuators)
    step = 1e-6
    for deflection, T in ((0.2, 3.0), (-0.42, 8.0), (0.1, -3.0), (0.6, 1.0)):
        command = np.array([[deflection, T, 0.0]])
        _, jacobian = law.force_and_jacobian(command, inflow)
        gradient = law.power_gradient(command, inflow)
        for k in (0, 1):
            change = step * np.eye(3)[k]
            ahead = law.force(command + change, inflow)
            back = law.force(command - change, inflow)
            np.testing.assert_allclose(jacobian[0, k], (ahead - back)[0] / (2 * step), atol=1e-6)
            rise = law.power(command + change) - law.power(command - change)
            assert gradient[0, k] == pytest.approx(rise[0] / (2 * step), abs=1e-5)


def least_power_by_search(plant: OraclePlant, Tz: float) -> float:
    """Least power [W] of the commands of a boat of one unit that give a torque, surge being free:
    of each deflection the thrust that gives it, up to 99.5 % of the largest lift."""
    unit = plant.actuators[0]
    low, high = unit.limits
    deflection = np.linspace(low[0], high[0], 20001)
    none = unit.steered(deflection, np.zeros(20001))[:, 1]
    per_newton = unit.steered(deflection, np.ones(20001))[:, 1] - none
    with np.errstate(divide="ignore", invalid="ignore"):
        thrust = (Tz / unit.position[0] - none) / per_newton
    is_used = np.abs(per_newton) <= 0.995 * np.abs(per_newton).max()
    is_possible = (thrust >= 0.0) & (thrust <= high[1]) & is_used
    return float(unit.propeller_watts(thrust[is_possible]).min())


@pytest.mark.parametrize("Tz", [0.4, -0.4, 0.05, 1.2])
def test_it_steers_at_rest_at_the_least_power(boat: Layout, Tz: float) -> None:
    answer = finlab.Allocator(boat).allocate([0, 0, 0, 0, 0, Tz], free=("Fx",))
    plant = OraclePlant(boat_of(UNIT))
    assert plant.wrench(answer.command)[5] == pytest.approx(Tz, rel=1e-6)
    assert math.copysign(1.0, answer.command[0, 0]) == -math.copysign(1.0, Tz)
    assert answer.power == pytest.approx(least_power_by_search(plant, Tz), rel=1e-3)
    assert answer.bound is not None and answer.bound <= answer.power


def test_ahead_astern_and_beyond(boat: Layout) -> None:
    allocator = finlab.Allocator(boat)
    ahead = allocator.allocate([6, 0, 0, 0, 0, 0.5])
    np.testing.assert_allclose(ahead.wrench[[0, 5]], (6.0, 0.5), atol=1e-6)
    astern = allocator.allocate([-3, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(astern.wrench[[0, 5]], (-3.0, 0.0), atol=1e-6)
    assert astern.commands["screw"].force == pytest.approx(-3.0)
    sideways = allocator.allocate([-3, 0, 0, 0, 0, 0.5])
    assert not sideways.reachable
    beyond = allocator.allocate([100, 0, 0, 0, 0, 0], policy="direction")
    assert beyond.commands["screw"].force == pytest.approx(10.0)


def test_many_and_ticks_give_the_answers_of_one(boat: Layout) -> None:
    rng = np.random.default_rng(5)
    allocator = finlab.Allocator(boat)
    plant = plant_of(boat)
    targets = plant.wrench(plant.sample(rng, (30,))) * boat.commanded
    batch = allocator.allocate_batch(targets)
    previous = np.array([[0.0, 1.0, 0.0]])
    for row, target in enumerate(targets):
        one = allocator.allocate(target)
        np.testing.assert_allclose(batch.command[row], one.command, rtol=1e-9, atol=1e-9)
        # without rates a tick is the same question
        tick = allocator.allocate(target, previous=previous)
        assert tick.err_norm <= one.err_norm + 1e-6
        assert tick.power <= one.power * (1.0 + 1e-6) + 1e-9


def test_damage(boat: Layout) -> None:
    allocator = finlab.Allocator(boat)
    stuck = allocator.allocate(
        [0, 0, 0, 0, 0, -0.3], free=("Fx",), damage=Damage(stuck={"screw": 0.2})
    )
    assert stuck.command[0, 0] == pytest.approx(0.2)
    assert stuck.wrench[5] == pytest.approx(-0.3, abs=1e-6)
    weak = allocator.allocate([10, 0, 0, 0, 0, 0], damage=Damage(weak={"screw": 0.5}))
    assert weak.command[0, 1] == pytest.approx(5.0)
    running = allocator.allocate([0] * 6, damage=Damage(running={"screw": (0.1, 2.0)}))
    np.testing.assert_allclose(running.command, [[0.1, 2.0, 0.0]])


def test_a_mirrored_one_gives_the_mirrored_wrench(boat: Layout) -> None:
    unit = boat.actuators[0]
    assert isinstance(unit, PropellerRudder)
    uneven = PropellerRudder(**{**vars(unit), "deflection": (-0.1, 0.3)})
    image = uneven.image()
    assert image.value("deflection") == pytest.approx((-0.3, 0.1))

    def wrench(actuator: Any, deflection: float) -> Array:
        layout = Layout("one", (actuator,))
        return plant_of(layout).wrench(np.array([[deflection, 5.0, 0.0]]))

    signs = np.array([1, -1, 1, -1, 1, -1])
    np.testing.assert_allclose(wrench(image, -0.2), signs * wrench(uneven, 0.2), atol=1e-9)


def test_a_rudder_behind_a_screw_is_read_as_one_actuator() -> None:
    """A file's rudder that lies in a screw's slipstream steers at rest."""
    layout = parse_layout(boat_of(THRUSTER, RUDDER))
    (unit,) = layout.actuators
    assert isinstance(unit, PropellerRudder) and unit.name == "screw"
    assert unit.position == (-0.45, 0.0, 0.0) and unit.force == (-6.0, 10.0)
    answer = finlab.Allocator(layout).allocate([0, 0, 0, 0, 0, 0.4], free=("Fx",))
    assert answer.wrench[5] == pytest.approx(0.4, abs=1e-6)
    assert answer.commands["screw"].deflection < -0.1
    assert JOINED in answer.notes and JOINED in str(layout)

    # At speed the whole rudder is met by the flow: as the rudder alone, the screw at no thrust.
    flow = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    alone = OraclePlant(boat_of(THRUSTER, RUDDER), flow)
    force_apart = alone.wrench(np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]]))
    together = plant_of(layout).at(flow).wrench(np.array([[0.2, 0.0, 0.0]]))
    np.testing.assert_allclose(together, force_apart, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    "change",
    [
        {"position_m": [-0.35, 0.2, 0.0]},
        {"position_m": [-0.9, 0.0, 0.0]},
        {"axis": [0.0, 1.0, 0.0]},
        {"torque_per_newton_m": 0.01},
        {"dead_band_n": 0.5},
    ],
)
def test_others_stay_two(change: dict[str, Any]) -> None:
    layout = parse_layout(boat_of({**THRUSTER, **change}, RUDDER))
    assert [actuator.type for actuator in layout.actuators] == ["thruster", "rudder"]


def test_a_rudder_of_two_screws_stays_alone() -> None:
    twin = {**THRUSTER, "name": "twin", "position_m": [-0.36, 0.0, 0.0]}
    layout = parse_layout(boat_of(THRUSTER, twin, RUDDER))
    assert layout.names == ("screw", "twin", "rudder")


def test_files_bundles_and_other_formats(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    layout = parse_layout(boat_of(THRUSTER, RUDDER))
    saved = tmp_path / "boat.yaml"
    save_layout(layout, saved)
    assert load_layout(saved) == layout
    assert main(["export", str(saved), "-o", str(tmp_path / "bundle")]) == 0
    robot = load_robot(tmp_path / "bundle")
    wrench = [0.0, 0.0, 0.0, 0.0, 0.0, 0.4]
    on_board = robot.allocate(wrench, free=("Fx",))
    answer = finlab.Allocator(layout).allocate(wrench, free=("Fx",))
    np.testing.assert_allclose(on_board.command, answer.command, atol=1e-9)
    assert main(["layout", "convert", str(saved), str(tmp_path / "boat.urdf")]) == 2
    assert "urdf has no place for a propeller_rudder" in capsys.readouterr().err
    result = prove(layout, [1.0, 0.0, 0.0, 0.0, 0.0, 0.1])
    assert result.verdict not in ("proved", "refuted")
    assert "nothing certain is known of a propeller_rudder" in result.reason


def test_a_rudder_that_is_to_stay_alone_does() -> None:
    data = boat_of(THRUSTER, {**RUDDER, "alone": True})
    layout = parse_layout(data)
    assert layout.names == ("screw", "rudder") and layout.parts_notes == ()
    assert parse_layout(layout_to_dict(layout)) == layout


def test_the_name_of_the_rudder_is_that_of_nothing_else() -> None:
    layout = parse_layout(boat_of(THRUSTER, RUDDER))
    unit = layout.actuators[0]
    assert unit.parts == ("rudder",)
    for others in (
        (unit.copied("rudder"),),
        (replace(unit, name="second"),),  # with a rudder of the same name
    ):
        with pytest.raises(LayoutError, match=r"its part 'rudder' has the name of a"):
            replace(layout, actuators=(unit, *others))
    with pytest.raises(LayoutError, match=r"its part 'screw' has the name of actuator 1"):
        layout.replace_actuator("screw", rudder_name="screw")


def test_a_question_about_the_rudder_is_told_what_to_ask(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the sentence says to write is answered: the rudder held, the screw still pushing."""
    file = tmp_path / "boat.json"
    file.write_text(json.dumps(boat_of(THRUSTER, RUDDER)), "utf-8")
    assert main(["layout", "check", str(file)]) == 0
    assert JOINED in capsys.readouterr().out
    wrench = ["--wrench", "2", "0", "0", "0", "0", "0"]
    for option in (["--lost", "rudder"], ["--stuck", "rudder=5"]):
        assert main(["allocate", str(file), *wrench, *option]) == 2
        error = capsys.readouterr().err
        assert JOINED in error and "stuck screw=0 amidships" in error
    assert main(["allocate", str(file), *wrench, "--stuck", "screw=0"]) == 0
    assert JOINED in capsys.readouterr().out
    with pytest.raises(LayoutError, match="both are one actuator, screw"):
        finlab.Allocator(load_layout(file)).allocate([0] * 6, lost=("rudder",))


def test_buses_and_mirror_pairs_may_name_the_rudder() -> None:
    """A rudder takes no power, and its image is that of its screw."""
    units = []
    for side, y in (("left", 0.2), ("right", -0.2)):
        for part in (THRUSTER, RUDDER):
            x = part["position_m"][0]
            units.append({**part, "name": f"{part['name']}_{side}", "position_m": [x, y, 0.0]})
    data = boat_of(*units)
    data["buses"] = {
        "main": {"power_w": 30.0, "actuators": ["screw_left", "rudder_left", "screw_right"]},
        "steering": {"power_w": 5.0, "actuators": ["rudder_right"]},
    }
    data["mirror_pairs"] = [["screw_left", "screw_right"], ["rudder_left", "rudder_right"]]
    layout = parse_layout(data)
    assert [bus.actuators for bus in layout.buses] == [("screw_left", "screw_right")]
    assert layout.mirror_pairs == (("screw_left", "screw_right"),)
    assert parse_layout(layout_to_dict(layout)) == layout


def test_a_flow_that_steers_alone_costs_nothing() -> None:
    """A torque that the flow on the rudder gives takes no thrust, ahead or astern."""
    layout = parse_layout(boat_of(THRUSTER, RUDDER))
    flow = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    allocator = finlab.Allocator(layout)
    for Tz in (0.4, -0.2, 0.05):
        answer = allocator.allocate([0, 0, 0, 0, 0, Tz], free=("Fx",), flow=flow)
        assert answer.wrench[5] == pytest.approx(Tz, abs=1e-6)
        assert answer.command[0, 1] >= 0.0
        assert answer.power < 1e-6
        tick = allocator.allocate(
            [0, 0, 0, 0, 0, Tz], free=("Fx",), flow=flow, previous=answer.command
        )
        assert tick.err_norm < 1e-6 and tick.power < 1e-6


def test_the_loop_on_board_names_its_numbers() -> None:
    layout = parse_layout(boat_of(THRUSTER, RUDDER))
    server = Server(DeployedRobot(finlab.Allocator(layout)))
    request = {"wrench": [3, 0, 0, 0, 0, 0.3]}
    (reply,) = server.answers(json.dumps(request).encode())
    answer = finlab.Allocator(layout).allocate([3, 0, 0, 0, 0, 0.3])
    assert reply["status"] == "ok"
    (unit,) = reply["actuators"]
    assert (unit["name"], unit["type"]) == ("screw", "propeller_rudder")
    assert unit["command"] == {
        "deflection_rad": pytest.approx(answer.command[0, 0], abs=1e-9),
        "force_n": pytest.approx(answer.command[0, 1], abs=1e-9),
    }
    (refusal,) = server.answers(json.dumps({**request, "lost": ["rudder"]}).encode())
    assert refusal["status"] == "error" and "both are one actuator, screw" in refusal["error"]


def test_the_exported_allocator_gives_the_same(tmp_path: Path) -> None:
    """The self-test of the C sources, of two sides in a flow, in both precisions."""
    twin = {**UNIT, "name": "other", "position_m": [-0.45, 0.3, 0.0]}
    layout = parse_layout(boat_of({**UNIT, "position_m": [-0.45, -0.3, 0.0]}, twin))
    write_c(c_sources(layout, 40, (0.8, 0.0, 0.0, 0.0, 0.0, 0.0)), str(tmp_path))
    for single in ("", "-DFL_SINGLE"):
        words = f"gcc -std=c99 -O0 {single} *.c -lm -o it && ./it"
        done = subprocess.run(words, shell=True, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        assert done.stdout.startswith("0 of 40 ")


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.5])
def test_two_coupled_pods_are_one_in_the_middle(angle: float) -> None:
    """The wrench of a linkage's two equal pods is that of one of twice the force between them, at
    the watts of both: in yaw, too, as their couples cancel."""
    c = 1.3
    e = 1.5
    pods = []
    for name, y, force, factor in (
        ("left", 0.3, 20.0, c),
        ("right", -0.3, 20.0, c),
        ("both", 0.0, 40.0, 2.0 ** (1.0 - e) * c),
    ):
        pods.append(
            {
                "name": name,
                "type": "azimuth",
                "position_m": [-0.5, y, -0.1],
                "turn_axis": [0.0, 0.0, 1.0],
                "zero": [1.0, 0.0, 0.0],
                "force_n": [0.0, force],
                "model": {"type": "power_law", "forward": factor, "exponent": e},
            }
        )
    two = OraclePlant(boat_of(*pods[:2]))
    middle = parse_layout(boat_of(pods[2]))
    target = two.wrench(np.array([[angle, 8.0, 0.0], [angle, 8.0, 0.0]]))
    answer = finlab.Allocator(middle).allocate(target)
    assert answer.command[0, :2] == pytest.approx([angle, 16.0], abs=1e-5)
    np.testing.assert_allclose(answer.wrench, target, atol=1e-5)
    assert answer.power == pytest.approx(2.0 * c * 8.0**e, rel=1e-6)


def test_more_than_the_momentum_of_the_slipstream_is_refused() -> None:
    with pytest.raises(LayoutError, match="more than the slipstream's momentum allows"):
        parse_layout(boat_of({**UNIT, "area_m2": 0.02}))


def test_the_json_of_an_answer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    saved = tmp_path / "boat.json"
    saved.write_text(json.dumps(boat_of(UNIT)), "utf-8")
    arguments = ["--wrench", "0", "0", "0", "0", "0", "0.4", "--free", "Fx", "--json"]
    assert main(["allocate", str(saved), *arguments]) == 0
    (row,) = json.loads(capsys.readouterr().out)["actuators"]
    assert row["type"] == "propeller_rudder"
    assert set(row["command"]) == {"deflection_rad", "force_n"}
