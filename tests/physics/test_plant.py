"""The plant against the contract's formula written out in numpy, and what it makes of odd
commands."""

import math

import numpy as np
import pytest
from scipy.special import j1

from finlab.assets import shipped_layouts
from finlab.errors import CommandError
from finlab.layout import Fin, FinModelSpec, Layout, load_layout
from finlab.physics import Plant, make_law, write_table
from tests.allocator_cache import FIN_ROBOTS
from tests.oracle_plant import OraclePlant
from tests.random_robots import KINDS, bluerov2_heavy, load, random_plant, with_dead_bands


def wrench_by_hand(layout, command):
    """The contract's text, one fin at a time."""
    total = np.zeros(6)
    for fin, (amplitude, frequency, direction) in zip(layout.fins, command, strict=True):
        p = fin.model.values()
        rate = 2 * math.pi * frequency
        if fin.model.type == "drag":
            inertia = 2 * p["density"] * p["drag_coefficient"] * p["area"] * p["lever"] ** 2
            thrust = inertia * rate**2 * (1 - math.cos(2 * amplitude))
        else:
            mass = math.pi / 4 * p["density"] * p["width"] ** 2
            thrust = 0.5 * mass * p["length"] ** 2 * rate**2 * amplitude * j1(amplitude)
        horizontal = np.array([-math.sin(fin.mounting_angle), math.cos(fin.mounting_angle), 0.0])
        force = thrust * (
            math.cos(direction) * horizontal + math.sin(direction) * np.array([0.0, 0.0, 1.0])
        )
        total += np.concatenate([force, np.cross(fin.position, force)])
    return total


def random_commands(layout, n, seed=0):
    """Commands (n, ...) within the limits of a robot."""
    lower = layout.lower
    upper = layout.upper
    return np.random.default_rng(seed).uniform(lower, upper, (n, *lower.shape))


@pytest.mark.parametrize("name", FIN_ROBOTS)
def test_the_plant_is_the_contract(name):
    layout = load_layout(shipped_layouts()[name])
    commands = random_commands(layout, 20)
    expected = [wrench_by_hand(layout, command) for command in commands]
    got = Plant(layout).wrench(commands)
    assert got.dtype == np.float64 and got.shape == (20, 6)
    np.testing.assert_allclose(got, expected, rtol=1e-10, atol=1e-12)


def test_forces_sum_to_the_wrench_and_are_in_the_body_frame():
    layout = load_layout(shipped_layouts()["mixed"])
    command = random_commands(layout, 1)[0]
    plant = Plant(layout)
    force = plant.body_forces(command)
    np.testing.assert_allclose(force.sum(0), plant.wrench(command)[:3], atol=1e-12)
    shaft = np.array(
        [[math.cos(fin.mounting_angle), math.sin(fin.mounting_angle), 0.0] for fin in layout.fins]
    )
    np.testing.assert_allclose((force * shaft).sum(-1), 0.0, atol=1e-12)


def test_a_row_of_nan_is_a_failed_fin():
    layout = load_layout(shipped_layouts()["A"])
    command = random_commands(layout, 7)
    command[:, 1] = np.nan
    rest = layout.without(["front_left"])
    np.testing.assert_allclose(
        Plant(layout).wrench(command), Plant(rest).wrench(command[:, [0, 2, 3]]), atol=1e-12
    )
    assert not Plant(layout).body_forces(command)[:, 1].any()


@pytest.fixture
def of_four_kinds(tmp_path):
    """A robot whose fins follow four kinds of law, two of them the same with other numbers."""
    grid = np.linspace(0.0, 0.7, 8), np.linspace(0.0, 2.4, 8), np.linspace(-math.pi, math.pi, 25)
    write_table(
        tmp_path / "fin.csv", make_law(FinModelSpec("soft", (("d", 0.1), ("e", 0.2)))), *grid
    )
    specs = [
        FinModelSpec("drag", (("area", 0.01),)),
        FinModelSpec("table", (("path", str(tmp_path / "fin.csv")),)),
        FinModelSpec("lighthill"),
        FinModelSpec("soft", (("phi_e", 1.0), ("e", 0.2))),
        FinModelSpec("drag"),
    ]
    place = np.random.default_rng(3).uniform(-0.3, 0.3, (len(specs), 3)).tolist()
    return Layout(
        "kinds", tuple(Fin(f"f{i}", tuple(place[i]), i - 2.0, model=s) for i, s in enumerate(specs))
    )


@pytest.mark.parametrize("name", ["A", "mixed", "restricted", "of_four_kinds"])
def test_derivatives_agree_with_differences(name, of_four_kinds):
    layout = of_four_kinds if name == "of_four_kinds" else load_layout(shipped_layouts()[name])
    plant = Plant(layout)
    command = random_commands(layout, 3)
    wrench, jacobian = plant.linearize(command)
    np.testing.assert_allclose(wrench, plant.wrench(command), atol=1e-13)
    matrix = jacobian.reshape(3, 6, layout.n_fins, 3)
    for fin in range(layout.n_fins):
        for entry in range(3):
            offset = np.zeros_like(command)
            offset[:, fin, entry] = 1e-6
            slope = (plant.wrench(command + offset) - plant.wrench(command - offset)) / 2e-6
            np.testing.assert_allclose(matrix[:, :, fin, entry], slope, rtol=1e-6, atol=2e-6)


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (np.zeros((3, 3)), r"expected commands \(..., 4, 3\) for layout A, got \(3, 3\)"),
        (np.zeros(12), "expected commands"),
        ([[1, 2, 3], [4]], "expected commands as three numbers"),
        (np.full((4, 3), np.inf), "NaN or infinite"),
        ([[0.1, np.nan, 0.0]] * 4, "a lost actuator has NaN in all three"),
    ],
)
def test_a_command_that_does_not_fit_is_refused(command, why):
    with pytest.raises(CommandError, match=why):
        Plant(load_layout(shipped_layouts()["A"])).wrench(command)


@pytest.mark.parametrize("number", range(3))
@pytest.mark.parametrize("kind", KINDS)
def test_wrench_and_watts_of_random_robots(kind: str, number: int) -> None:
    own = random_plant(kind, number, 5)
    rng = np.random.default_rng(number)
    plant = Plant(load(own.layout))
    commands = np.stack([own.draw(rng, share) for share in (0.0, 0.1, 0.5, 1.0)])
    wrench = own.wrench(commands)
    np.testing.assert_allclose(
        plant.wrench(commands, flow=own.flow), wrench, atol=1e-9 * own.scales.max()
    )
    watts = plant.power(commands, flow=own.flow).sum(axis=-1)
    np.testing.assert_allclose(watts, [own.power(each) for each in commands], rtol=1e-9, atol=1e-12)


def test_rudders_at_large_angles_and_astern() -> None:
    own = random_plant("rudders", 0, 5)
    for flow in np.random.default_rng(0).normal(size=(20, 6)):
        turned = OraclePlant(own.layout, flow)
        commands = turned.draw(np.random.default_rng(1))
        expected = turned.wrench(commands)
        given = Plant(load(own.layout)).wrench(commands, flow=flow)
        np.testing.assert_allclose(given, expected, atol=1e-9 * np.abs(expected).max())


def test_dead_bands() -> None:
    rng = np.random.default_rng(0)
    own = OraclePlant(with_dead_bands(bluerov2_heavy(), rng))
    commands = np.zeros((100, 8, 3))
    commands[:, :, 0] = rng.uniform(-1.5, 1.5, (100, 8))
    np.testing.assert_allclose(
        Plant(load(own.layout)).wrench(commands), own.wrench(commands), atol=1e-9
    )
