"""Thrusters and pods that hang at a command: it is the only one that they have, and the others make
up for it, whatever the method, by the laws of the whole robot."""

import math

import numpy as np
import pytest

from finlab import Azimuth, PowerLaw, PowerTable, Thruster
from finlab.actuators.actuator import Actuator
from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.cli import main
from finlab.errors import AllocationError, LayoutError
from finlab.interaction.jets import Jets
from finlab.layout import Damage, Layout, load_layout
from finlab.layout.load import parse_layout
from finlab.layout.save import layout_to_dict
from finlab.physics import plant_of
from tests.terminal import refused

MEASURED_TABLE = PowerTable(
    (
        (1100.0, -40.0, 300.0),
        (1300.0, -10.0, 50.0),
        (1500.0, 0.0, 1.0),
        (1700.0, 15.0, 60.0),
        (1900.0, 50.0, 400.0),
    )
)
"""A measured thruster, by rows of width of pulse [us], force [N] and power [W]."""
MET = 1e-6
"""Error over the wrench scale, of a target that is met."""


def random_direction(rng: np.random.Generator) -> Array:
    """A random direction (3,)."""
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))


def random_thruster(rng: np.random.Generator, name: str, dead_band: float) -> Thruster:
    """A random thruster with a dead band [N]."""
    model = (
        MEASURED_TABLE
        if rng.random() < 0.3
        else PowerLaw(rng.uniform(0.5, 2.0), rng.uniform(0.5, 2.0))
    )
    position = tuple(rng.uniform(-0.4, 0.4, 3).tolist())
    force = -float(rng.uniform(10.0, 40.0)), float(rng.uniform(10.0, 50.0))
    return Thruster(name, position, tuple(random_direction(rng).tolist()), force, model, dead_band)


def random_pod(rng: np.random.Generator, name: str, dead_band: float) -> Azimuth:
    """A random pod with a dead band [N], three of five of which push either way."""
    axis = random_direction(rng)
    zero = np.cross(axis, random_direction(rng))
    zero /= np.linalg.norm(zero)
    position = tuple(rng.uniform(-0.4, 0.4, 3).tolist())
    least = -float(rng.uniform(5.0, 20.0)) if rng.random() < 0.6 else 0.0
    force = least, float(rng.uniform(10.0, 50.0))
    arc = (-math.pi, math.pi) if rng.random() < 0.5 else (-0.8, 1.1)
    model = PowerLaw(rng.uniform(0.5, 2.0), rng.uniform(0.5, 2.0))
    turn_axis = tuple(axis.tolist())
    ahead = tuple(zero.tolist())
    return Azimuth(name, position, turn_axis, ahead, force, model, arc, dead_band)


def robot(rng: np.random.Generator) -> Layout:
    """Eight thrusters and pods; the first one may have a dead band."""
    parts: list[Actuator] = []
    for i in range(8):
        make = random_thruster if rng.random() < 0.6 else random_pod
        parts.append(make(rng, f"a{i}", 2.0 if i == 0 and rng.random() < 0.5 else 0.0))
    return Layout("random", tuple(parts))


def kept_force(rng: np.random.Generator, part: Thruster | Azimuth) -> float:
    """One force of those that it can give: any, the least, none, or one in the dead band."""
    least, most = part.force
    inside = 0.5 * part.dead_band * rng.choice([-1.0, 1.0])
    choices = (rng.uniform(least, most), least, 0.0, inside)
    return float(np.clip(choices[rng.integers(4)], least, most))


def hangs(rng: np.random.Generator, part: Actuator) -> tuple[Damage, Array]:
    """Damage of one actuator, and the command (3,) that it then keeps."""
    assert isinstance(part, Thruster | Azimuth)
    force = kept_force(rng, part)
    if isinstance(part, Azimuth):
        angle = float(rng.uniform(*part.arc))
        return Damage(running={part.name: (angle, force)}), np.array([angle, force, 0.0])
    damage = (
        Damage(stuck={part.name: force})
        if rng.random() < 0.5
        else Damage(running={part.name: (force,)})
    )
    return damage, np.array([force, 0.0, 0.0])


def reached_targets(rng: np.random.Generator, layout: Layout, index: int, command: Array) -> Array:
    """Wrenches (4, 6) of small commands beside that of one actuator."""
    plant = plant_of(layout)
    commands = plant.sample(rng, (4,))
    for i, part in enumerate(layout.actuators):
        commands[:, i, part.KIND.force_number or 0] *= 0.4
    commands[:, index] = command
    return plant.wrench(commands)


@pytest.mark.parametrize("seed", range(24))
def test_the_others_make_up_for_what_hangs(seed: int) -> None:
    rng = np.random.default_rng([41, seed])
    layout = robot(rng)
    index = int(rng.integers(layout.n)) if seed % 2 else 0
    damage, kept = hangs(rng, layout.actuators[index])
    targets = reached_targets(rng, layout, index, kept)
    allocator = Allocator(layout)
    result = allocator.allocate(targets[0], damage=damage)
    tick = allocator.allocate(targets[0], damage=damage, previous=result)
    for answer in (result, tick):
        np.testing.assert_allclose(answer.command[index], kept, rtol=0.0, atol=1e-12)
        wrench = plant_of(layout).wrench(answer.command)
        np.testing.assert_allclose(wrench, targets[0], atol=MET * answer.scale.max())
    assert result.bound is not None and 0.0 <= result.bound <= result.power
    many = allocator.allocate_batch(targets, damage=damage)
    assert many.err_norm.max() < MET
    np.testing.assert_allclose(many.command[:, index], np.tile(kept, (4, 1)), rtol=0.0, atol=1e-12)
    result_out_of_reach = allocator.allocate(1e3 * targets[0], damage=damage, policy="direction")
    np.testing.assert_allclose(result_out_of_reach.command[index], kept, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("method", ["dual", "px4", "analytic", "ardusub", "ipopt"])
@pytest.mark.parametrize("force", [12.0, 0.0, -9.0])
def test_every_method_accounts_for_a_thruster_that_hangs(method: str, force: float) -> None:
    """As well as for one that is lost, whose force is taken off the target."""
    layout = load_layout("bluerov2_heavy")
    rng = np.random.default_rng(5)
    name = layout.names[2]
    targets = reached_targets(rng, layout, 2, np.array([force, 0.0, 0.0])) * 0.5
    kept = np.zeros((layout.n, 3))
    kept[2, 0] = force
    allocator = Allocator(layout, method)
    for target in targets:
        result = allocator.allocate(target, damage=Damage(stuck={name: force}))
        without = allocator.allocate(target - plant_of(layout).wrench(kept), lost=[name])
        assert result.command[2, 0] == pytest.approx(force, abs=1e-12)
        np.testing.assert_allclose(result.unallocated, without.unallocated, atol=1e-5)


def test_power_of_what_hangs_counts_as_it_is() -> None:
    layout = load_layout("bluerov2_heavy")
    name = layout.names[0]
    result = Allocator(layout).allocate([0.0] * 6, damage=Damage(stuck={name: 20.0}))
    power = float(plant_of(layout).power(result.command)[0])
    assert power == pytest.approx(0.997 * 20.0**1.5, rel=0.2) and result.power > power
    in_band = layout.replace_actuator(name, dead_band=3.0)
    result_of_stuck = Allocator(in_band).allocate([0.0] * 6, damage=Damage(stuck={name: 2.0}))
    assert (
        result_of_stuck.command[0, 0] == 2.0
        and not result_of_stuck.forces.any()
        and result_of_stuck.err_norm < MET
    )


def test_jets_of_one_that_hangs_count() -> None:
    layout = load_layout("bluerov2_heavy")
    jets = Layout(
        layout.name, layout.actuators, body=layout.body, axes=layout.axes, interaction=Jets()
    )
    banded = jets.replace_actuator(layout.names[0], dead_band=3.0)
    for robot_of, force in ((jets, 10.0), (jets, 0.0), (jets, -8.0), (banded, 2.0)):
        result = Allocator(robot_of).allocate(
            [5.0, 2.0, 3.0, 0.0, 0.1, 0.5], damage=Damage(stuck={layout.names[0]: force})
        )
        assert result.err_norm < 1e-5 and result.command[0, 0] == force
        np.testing.assert_allclose(
            plant_of(robot_of).wrench(result.command), result.wrench, atol=1e-12
        )


def test_a_propeller_that_hangs_is_the_same_propeller() -> None:
    layout = load_layout("bluerov2_heavy")
    name = layout.names[0]
    part = Damage(stuck={name: 0.0}).applied_to(layout).actuator(name)
    assert part.jet == pytest.approx(layout.actuator(name).jet)


def test_no_file_says_that_a_thruster_hangs() -> None:
    """A file of a robot that is damaged says its limits, which no whole thruster has."""
    layout = load_layout("bluerov2_heavy")
    data = layout_to_dict(Damage(stuck={layout.names[0]: 5.0}).applied_to(layout))
    assert data["actuators"][0]["force_n"] == [5.0, 5.0] and "hangs" not in data["actuators"][0]
    with pytest.raises(LayoutError, match="force_n of thruster .*: must include 0"):
        parse_layout(data)
    with pytest.raises(LayoutError, match="unknown key"):
        parse_layout(
            {**layout_to_dict(layout), "actuators": [{**data["actuators"][0], "hangs": True}]}
        )


def test_damage_known_of_a_thruster_that_sticks() -> None:
    layout = load_layout("bluerov2_heavy")
    first, second = layout.names[:2]
    damage = Damage.representing(layout, [], {first: 0.5, second: 0.8}, {first: 10.0})
    assert damage == Damage(weak={second: 0.8}, stuck={first: 5.0})


def test_texts_give_degrees_and_newtons_by_what_they_are_of() -> None:
    rng = np.random.default_rng(3)
    layout = Layout(
        "mixed",
        (
            random_thruster(rng, "screw", 0.0),
            random_pod(rng, "pod", 0.0),
            random_thruster(rng, "other", 0.0),
        ),
    )
    damage = Damage.parse(layout, stuck=["screw=-5", "pod=20"], running=["other=7"])
    assert damage == Damage(
        stuck={"screw": -5.0, "pod": math.radians(20.0)}, running={"other": (7.0,)}
    )
    running = Damage.parse(layout, running=["pod=-30,8"])
    assert running == Damage(running={"pod": (math.radians(-30.0), 8.0)})
    with pytest.raises(
        AllocationError, match=r"running: expected NAME=angle \[deg\],force \[N\] of the azim"
    ):
        Damage.parse(layout, running=["pod=1,2,3"])
    with pytest.raises(LayoutError, match="nobody"):
        Damage.parse(layout, stuck=["nobody=3"])


def test_the_command_line_takes_the_force_at_which_a_thruster_hangs(
    capsys: pytest.CaptureFixture[str],
) -> None:
    name = load_layout("bluerov2_heavy").names[0]
    words = ["allocate", "bluerov2_heavy", "--wrench", "5", "0", "3", "0", "0", "0"]
    assert main([*words, "--stuck", f"{name}=12"]) == 0
    assert "12.000 N" in capsys.readouterr().out
    assert main([*words, "--running", f"{name}=-9"]) == 0
    assert "-9.000 N" in capsys.readouterr().out
    assert "which is what this thruster can give, got 90 N" in refused(
        [*words, "--stuck", f"{name}=90"]
    )
    assert f"of the thruster '{name}', got '{name}=1,2'" in refused(
        [*words, "--running", f"{name}=1,2"]
    )
