"""Pods that push either way: exact, and cheapest of all angles and signs, beside scans and other
searches."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from finlab import Allocator
from finlab.actuators.azimuth import Tilt
from finlab.actuators.thrust_model import PowerLaw, PowerTable
from finlab.arrays import Array
from finlab.layout import Azimuth, Layout, Thruster, load_layout
from finlab.layout.save import save_layout
from finlab.physics.plant import Plant
from tests.sampled_cases import sampled

ARC_HALF_ANGLE = math.radians(45.0)
"""Half of the arc that a pod can turn within [rad]."""
FORCE_MIN = -100.0
"""Force of a pod in reverse [N]."""
FORCE_MAX = 250.0
"""Force of a pod ahead [N]."""


def table(
    forward: float, reverse: float, least: float = FORCE_MIN, most: float = FORCE_MAX
) -> PowerTable:
    """A table of watts over F^1.5, with another factor in reverse."""
    force = np.concatenate(
        [least * np.linspace(1.0, 0.02, 50), [0.0], most * np.linspace(0.02, 1.0, 50)]
    )
    watts = np.where(force < 0.0, reverse, forward) * np.abs(force) ** 1.5
    return PowerTable(tuple(zip(range(101), force.tolist(), watts.tolist(), strict=True)))


def pair(model: PowerLaw | PowerTable) -> Layout:
    """Two pods at the stern, within 45 degrees of ahead."""
    sides = (("left", 0.5), ("right", -0.5))
    ends = (FORCE_MIN, FORCE_MAX)
    arc = (-ARC_HALF_ANGLE, ARC_HALF_ANGLE)
    return Layout(
        "pair",
        tuple(
            Tilt(name, (-1.0, y, 0.0), (0, 0, 1), (1, 0, 0), ends, model, arc) for name, y in sides
        ),
    )


def scanned(wrench: Array, factors: tuple[float, float]) -> float:
    """Least power of the pair for surge, sway and yaw, over the sway of the left pod."""
    surge, sway, yaw = wrench[[0, 1, 5]]
    apart = -(sway + yaw) / 0.5  # yaw = -sway - (left's surge - right's surge) / 2
    force_left = np.linspace(-FORCE_MAX, FORCE_MAX, 400_001)
    total = np.zeros(len(force_left))
    for ahead, aside in (
        (0.5 * (surge + apart), force_left),
        (0.5 * (surge - apart), sway - force_left),
    ):
        size = np.hypot(ahead, aside)
        least = np.full(len(force_left), np.inf)
        for sign, most, factor in ((1.0, FORCE_MAX, factors[0]), (-1.0, -FORCE_MIN, factors[1])):
            inside = (np.abs(np.arctan2(sign * aside, sign * ahead)) <= ARC_HALF_ANGLE + 1e-9) & (
                size <= most
            )
            least = np.where(inside, np.minimum(least, factor * size**1.5), least)
        total += least
    return float(total.min())


@pytest.mark.parametrize(
    "model",
    [PowerLaw(0.05), PowerLaw(0.05, 0.11), PowerLaw(0.05, 0.03), table(0.05, 0.11)],
    ids=["alike", "dearer", "cheaper", "table"],
)
def test_two_pods_take_the_least_power_of_a_scan(model: PowerLaw | PowerTable) -> None:
    allocator = Allocator(pair(model))
    plant = Plant(pair(model))
    factors = (0.05, 0.11) if isinstance(model, PowerTable) else (0.05, model.reverse or 0.05)
    given = plant.wrench(plant.sample(np.random.default_rng(7), (6,)))
    for wrench in np.concatenate([[[-60.0, 0, 0, 0, 0, 0], [60.0, 0, 0, 0, 0, 0]], given]):
        answer = allocator.allocate(wrench)
        least = scanned(wrench, factors)
        assert answer.reachable
        np.testing.assert_allclose(plant.wrench(answer.command), wrench, atol=1e-6)
        assert answer.power == pytest.approx(least, rel=2e-4)
        assert answer.bound is not None and answer.bound <= answer.power


def test_surge_astern_turns_both_propellers_round() -> None:
    answer = Allocator(pair(PowerLaw(0.05))).allocate([-60, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(answer.command, [[0, -30, 0]] * 2, atol=1e-6)


def random_pods(rng: np.random.Generator) -> Layout:
    """One to three pods that push either way in arcs of any width, and up to two thrusters, in a
    plane."""
    parts: list[Azimuth | Thruster] = []
    for i in range(rng.integers(1, 4)):
        most = rng.uniform(20.0, 200.0)
        ends = -rng.uniform(0.1, 1.4) * most, most
        half = rng.choice([rng.uniform(0.05, 1.5), rng.uniform(1.6, 3.0), math.pi])
        middle = rng.uniform(-1, 1)
        arc = (-math.pi, math.pi) if half == math.pi else (middle - half, middle + half)
        forward = 10.0 ** rng.uniform(-2.0, 0.0)
        reverse = rng.uniform(0.6, 2.5)
        law = PowerLaw(forward, forward * reverse, rng.choice([1.5, rng.uniform(1.2, 2.5)]))
        model = law if rng.random() < 0.6 else table(forward, forward * reverse, *ends)
        position = (rng.uniform(-1, 1), rng.uniform(-1, 1), 0.0)
        parts.append(Azimuth(f"p{i}", position, (0, 0, 1), (1, 0, 0), ends, model, arc))
    for i in range(rng.integers(0, 3)):
        angle = rng.uniform(-3, 3)
        position = (rng.uniform(-1, 1), rng.uniform(-1, 1), 0.0)
        axis = (math.cos(angle), math.sin(angle), 0.0)
        parts.append(Thruster(f"t{i}", position, axis, (-40.0, 50.0), PowerLaw(0.3)))
    return Layout("pods", tuple(parts))


@pytest.mark.parametrize("seed", sampled(range(40), 10))
def test_random_pods_give_what_they_can_and_nobody_finds_less_power(seed: int) -> None:
    rng = np.random.default_rng(seed)
    layout = random_pods(rng)
    plant = Plant(layout)
    allocator = Allocator(layout)
    commands = plant.sample(rng, (4,))
    targets = plant.wrench(commands)
    together = allocator.allocate_batch(targets)
    for row, (target, command) in enumerate(zip(targets, commands, strict=True)):
        answer = allocator.allocate(target)
        assert answer.reachable and answer.err_norm <= 1e-6
        assert answer.bound is not None and answer.bound <= answer.power
        assert together.power[row] == pytest.approx(answer.power, rel=1e-6)

        others = searched(plant, target, answer.scale, answer.power, rng)
        assert answer.power <= min(others, float(plant.power(command).sum())) * (1.0 + 1e-4)


def searched(
    plant: Plant, target: Array, scale: Array, power: float, rng: np.random.Generator
) -> float:
    """Least power of SLSQP on commands from a few starts; infinite where none ends well."""
    used = plant.width > 0.0
    least = np.inf

    def command(share: Array) -> Array:
        full = plant.lower.copy()
        full[used] += share * plant.width[used]
        return full

    def missing(share: Array) -> Array:
        return np.asarray((plant.wrench(command(share)) - target) / scale)

    for _ in range(3):
        best = minimize(
            lambda share: float(plant.power(command(share)).sum()) / power,
            rng.uniform(size=used.sum()),
            bounds=[(0.0, 1.0)] * int(used.sum()),
            constraints={"type": "eq", "fun": missing},
            method="SLSQP",
        )
        if np.abs(missing(best.x)).max() <= 1e-7:
            least = min(least, float(best.fun) * power)
    return least


@pytest.mark.parametrize("policy", ["closest", "direction", "priority"])
def test_beyond_reach_pods_give_as_much_as_forward_and_reverse_allow(policy: str) -> None:
    allocator = Allocator(pair(PowerLaw(0.05, 0.11)))
    answer = allocator.allocate([-900.0, 0, 0, 0, 0, 0], policy=policy)
    np.testing.assert_allclose(answer.wrench, [2.0 * FORCE_MIN, 0, 0, 0, 0, 0], atol=1e-3)


def test_from_tick_to_tick_a_pod_goes_through_rest_to_reverse() -> None:
    layout = pair(PowerLaw(0.05))
    slow = replace(
        layout,
        actuators=tuple(replace(part, turn_rate=1.0, rate=400.0) for part in layout.actuators),
    )
    allocator = Allocator(slow, period_s=0.1)
    before = np.array([[0.1, 60.0, 0.0]] * 2)
    for _ in range(12):
        answer = allocator.allocate([-60, 0, 0, 0, 0, 0], previous=before)
        assert (np.abs(answer.command - before) <= [0.1 + 1e-9, 40.0 + 1e-6, 0.0]).all()
        before = answer.command
    np.testing.assert_allclose(answer.wrench, [-60, 0, 0, 0, 0, 0], atol=1e-5)


def test_a_pod_that_reverses_is_kept_by_its_file(tmp_path: Path) -> None:
    layout = pair(table(0.05, 0.11))
    save_layout(layout, tmp_path / "pair.yaml")
    assert load_layout(tmp_path / "pair.yaml").actuators == layout.actuators
