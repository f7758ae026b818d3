"""IPOPT, and the model-based methods on strong fins and long levers, or when their time is up."""

import math
import time
import warnings
from dataclasses import replace

import numpy as np
import pytest

from finlab.actuators.response import Plane, RadialTable, price_grid
from finlab.allocation import Allocator
from finlab.allocation.baselines.ipopt import _PlaneProgram
from finlab.errors import AllocationError
from finlab.layout import Fin, FinModelSpec, Layout, Limits, load_layout
from finlab.physics import Plant, plant_of
from finlab.research.random_layouts import random_layout
from tests.allocator_cache import AllocatorCache
from tests.random_robots import load, random_flow, random_plant, random_robot, within
from tests.sampled_cases import crossed, sampled

casadi = pytest.importorskip("casadi", reason="method ipopt is an optional extra")
UNEVEN = FinModelSpec("soft", (("d", 0.12), ("e", 0.15), ("p", 1.5), ("phi_e", 0.4)))
"""A soft fin whose force is not the same in all directions."""


def reachable_wrenches(layout: Layout, count: int = 3) -> np.ndarray:
    """Wrenches (count, 6), 0.6 times those of random commands of a robot."""
    plant = plant_of(layout)
    return 0.6 * plant.wrench(plant.sample(np.random.default_rng(1), (count,)))


def answered(
    allocator: AllocatorCache, layout: Layout, targets: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Power and error of the answers."""
    answers = [allocator.allocate(layout, target) for target in targets]
    return np.array([a.power for a in answers]), np.array([a.err_norm for a in answers])


@pytest.mark.parametrize("name", sampled(["ucat", "hexa", "restricted"], 3))
def test_it_agrees_with_the_search_on_shipped_robots(name: str) -> None:
    layout = load_layout(name)
    targets = reachable_wrenches(layout)
    least, _ = answered(AllocatorCache(), layout, targets)
    power, error = answered(AllocatorCache("ipopt"), layout, targets)
    assert error.max() < 1e-3
    np.testing.assert_allclose(power, least, rtol=2e-3)


@pytest.mark.parametrize(
    ("arc", "model"),
    crossed(
        [(-np.pi, np.pi), (-1.0, 0.6), (0.3, 0.3), (-2.5, 2.0)],
        [FinModelSpec("drag"), FinModelSpec("lighthill"), UNEVEN],
        every=5,
    ),
)
def test_it_agrees_with_the_search_on_any_fin_and_arc(
    model: FinModelSpec, arc: tuple[float, float]
) -> None:
    layout_of_five = random_layout(np.random.default_rng(5), n_fins=5)
    fins = [
        replace(fin, model=model, limits=Limits(zero_direction=arc)) for fin in layout_of_five.fins
    ]
    layout = replace(
        layout_of_five, actuators=(*fins[:2], replace(fins[2], limits=Limits()), *fins[3:])
    )
    targets = reachable_wrenches(layout)
    least, missed = answered(AllocatorCache(), layout, targets)
    power, error = answered(AllocatorCache("ipopt"), layout, targets)
    exact = missed < 1e-4
    assert exact.any() and error[exact].max() < 5e-3
    np.testing.assert_allclose(power[exact], least[exact], rtol=0.01)


@pytest.mark.parametrize("kind", ["thrusters", "azimuths", "wide arcs", "rudders", "mixed"])
def test_it_agrees_with_the_search_on_any_actuators_and_in_any_flow(kind: str) -> None:
    for number in range(2):
        plant = random_plant(kind, number, 7)
        flow = random_flow(kind, number, 7)
        layout = load(random_robot(kind, number, 7))
        targets = np.array([within(plant, np.random.default_rng([7, k])) for k in range(2)])
        best = Allocator(layout).allocate_batch(targets, flow=flow)
        batch = Allocator(layout, "ipopt").allocate_batch(targets, flow=flow)
        assert batch.err_norm.max() < 1e-4
        np.testing.assert_allclose(batch.power, best.power, rtol=2e-3)


def test_it_delivers_exactly_what_power_would_pull_aside() -> None:
    """On a robot that is nearly blind on an axis a small error would save many watts."""
    layout = load_layout("bluerov2_heavy")
    low = [(part, part.position) for part in layout.actuators[:4]]
    flat = replace(
        layout, actuators=tuple(replace(part, position=(x, 0.1 * y, z)) for part, (x, y, z) in low)
    )
    target = plant_of(flat).wrench(
        np.array([[20.0, 0, 0], [-5.0, 0, 0], [10.0, 0, 0], [8.0, 0, 0]])
    )
    answer = Allocator(flat, "ipopt").allocate(target)
    assert answer.err_norm < 1e-6
    assert answer.power == pytest.approx(Allocator(flat).allocate(target).power, rel=1e-4)


def test_it_keeps_watts_least_and_nothing_else() -> None:
    with pytest.raises(AllocationError, match="objective: method 'ipopt' has no choice"):
        Allocator(load_layout("A"), "ipopt", objective="effort")


def test_out_of_reach_it_comes_as_near_as_the_search() -> None:
    layout = load_layout("ucat")
    out_of_reach = 20.0 * reachable_wrenches(layout)
    _, nearest = answered(AllocatorCache(), layout, out_of_reach)
    _, error = answered(AllocatorCache("ipopt"), layout, out_of_reach)
    np.testing.assert_allclose(error, nearest, rtol=1e-3, atol=1e-3)


def strong(n_fins: int, angle: float = 1.0) -> Layout:
    """Fins of thousands of newton at one place, 9 m from the centre of gravity."""
    limits = Limits((0.0, 1.5), (0.0, 20.0))
    model = FinModelSpec("drag", (("area", 0.2), ("lever", 0.5)))
    return Layout(
        "strong",
        tuple(Fin(f"f{i}", (8.0, 5.0, 1.0), 0.3 + angle * i, limits, model) for i in range(n_fins)),
    )


@pytest.mark.parametrize(
    "layout", [strong(1), strong(2, 0.0), strong(4)], ids=["one", "twins", "four"]
)
def test_strong_fins_on_long_levers_are_no_singular_problem(layout: Layout) -> None:
    targets = np.concatenate(
        [np.random.default_rng(0).normal(size=(4, 6)) * 10.0**k for k in range(-12, 7, 3)]
    )
    targets = np.concatenate(
        [targets, Plant(layout).wrench(Plant(layout).sample(np.random.default_rng(1), (4,)))]
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        command = Allocator(layout, "sqp").allocate_batch(np.clip(targets, -1e6, 1e6)).command
    assert ((command >= layout.lower) & (command <= layout.upper)).all()


def many_fins() -> tuple[Layout, np.ndarray]:
    """A robot on which every one of the methods takes long, and a wrench within its reach."""
    arc = Limits((0.05, 0.6), (0.1, 2.1), (-1.0, 0.5))
    rng = np.random.default_rng(0)
    fins = (
        Fin(f"f{i}", tuple(rng.uniform(-0.3, 0.3, 3).tolist()), float(rng.uniform(-3, 3)), arc)
        for i in range(16)
    )
    layout = Layout("many", tuple(fins))
    return layout, Plant(layout).wrench(Plant(layout).sample(rng, ()))


def test_when_the_time_is_up_the_best_so_far_is_the_answer() -> None:
    layout, target = many_fins()
    start = time.thread_time()
    hasty = Allocator(layout, "sqp", time_limit_s=1e-6).allocate(target)
    assert time.thread_time() - start < 0.3
    assert ((hasty.command >= layout.lower) & (hasty.command <= layout.upper)).all()
    patient = Allocator(layout, "sqp", time_limit_s=60.0).allocate(target)
    assert patient.err_norm < 1e-5 and patient.power < hasty.power


PLANES = [
    (-np.pi, np.pi, 0.0, False),
    (-1.0, 0.6, 0.0, False),
    (-2.5, 2.0, 0.0, False),
    (0.3, 0.3, 0.0, False),
    (-np.pi, np.pi, 0.05, True),
    (-0.7, 1.0, 0.1, True),
]
"""Arcs [rad], least shares of the largest force, and whether forces are uneven."""


def plane_of(low: float, high: float, least: float, is_uneven: bool) -> Plane:
    """A plane of forces up to 20 N at F^1.5 watts."""
    top = 1.5 * np.sqrt(20.0)
    force = np.clip((price_grid(top) / 1.5) ** 2, 20.0 * least, 20.0)
    table = RadialTable.of_forces(top, force, (20.0 * least) ** 1.5)
    middle = 0.5 * (low + high)
    half = 0.5 * (high - low)
    around = np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False)
    gauge = 1.0 + 0.1 * np.cos(around - 0.5) if is_uneven else None
    return Plane(np.eye(2, 6), table, sector_center=middle, sector_half_angle=half, gauge=gauge)


@pytest.mark.parametrize("case", PLANES)
def test_the_conditions_of_a_plane_hold_for_its_forces_alone(
    case: tuple[float, float, float, bool],
) -> None:
    plane = plane_of(*case)
    least = case[2]
    share = casadi.MX.sym("share", 2)
    part = _PlaneProgram(casadi, plane, share)
    told = casadi.Function(
        "told", [share], [part.power, *(value for value, _, _ in part.constraints)]
    )
    strongest = 1.0 if plane.gauge is None else float(plane.gauge.max())
    assert part.full_power == pytest.approx(20.0**1.5, rel=1e-3)
    rng = np.random.default_rng(1)
    verdicts = set[bool]()
    for _ in range(300):
        angle = plane.sector_center + rng.uniform(-1.0, 1.0) * min(
            1.5 * plane.sector_half_angle + 0.1, np.pi
        )
        size = rng.uniform(0.0, 1.3)
        cost, *values = (
            float(each) for each in told(size * np.array([np.cos(angle), np.sin(angle)]))
        )
        radius = 1.0 if plane.gauge is None else 1.0 + 0.1 * np.cos(angle - 0.5)
        of_most = size * strongest / radius
        off = (
            abs(math.remainder(angle - plane.sector_center, 2.0 * np.pi)) - plane.sector_half_angle
        )
        outside = max(of_most - 1.0, least - of_most if least else -1.0, size * off)
        if abs(outside) < 0.02:
            continue  # too near to an edge to tell
        is_allowed = all(
            low - 1e-6 <= one <= high + 1e-6
            for one, (_, low, high) in zip(values, part.constraints, strict=True)
        )
        assert is_allowed == (outside < 0.0), (angle, size)
        verdicts.add(is_allowed)
        if is_allowed:
            assert cost == pytest.approx((20.0 * of_most) ** 1.5, rel=1e-2, abs=0.05)
    assert False in verdicts


@pytest.mark.parametrize("case", PLANES)
def test_random_starts_of_a_plane_are_anywhere_in_its_arc(
    case: tuple[float, float, float, bool],
) -> None:
    plane = plane_of(*case)
    part = _PlaneProgram(casadi, plane, casadi.MX.sym("share", 2))
    rng = np.random.default_rng(2)
    forces = np.array([part.random(rng) for _ in range(300)])
    off = [math.remainder(math.atan2(y, x) - plane.sector_center, 2.0 * np.pi) for x, y in forces]
    assert np.abs(off).max() <= plane.sector_half_angle + 1e-9
    assert min(off) <= -0.9 * plane.sector_half_angle and max(off) >= 0.9 * plane.sector_half_angle
    size = np.hypot(*forces.T)
    assert size.max() <= 1.0 and size.max() > 0.9 and size.min() < 0.1


@pytest.mark.parametrize("kind", ["thrusters", "rudders", "azimuths", "fins"])
def test_power_is_measured_by_that_of_all_actuators_at_full_load(kind: str) -> None:
    layout = load(random_robot(kind, 1, 7))
    flow = random_flow(kind, 1, 7)
    program = AllocatorCache("ipopt").method(layout).at(flow)._program
    most = AllocatorCache().method(layout).at(flow).compiled.largest_power
    assert sum(part.full_power for part in program._actuators) == pytest.approx(most, rel=0.02)


@pytest.mark.parametrize("case", PLANES)
def test_power_and_conditions_of_a_plane_have_slopes_at_rest(
    case: tuple[float, float, float, bool],
) -> None:
    """IPOPT may begin there: it needs finite values and derivatives."""
    plane = plane_of(*case)
    share = casadi.MX.sym("share", 2)
    part = _PlaneProgram(casadi, plane, share)
    values = casadi.vertcat(part.power, *(value for value, _, _ in part.constraints))
    told = casadi.Function("told", [share], [values, casadi.jacobian(values, share)])
    for at_rest in ([0.0, 0.0], [1e-5, -1e-5]):
        for each in told(at_rest):
            assert np.isfinite(np.array(each)).all()


def test_a_program_takes_its_own_shares_of_each_actuator() -> None:
    """The answer to the wrench of known forces is these forces, where no others give it."""
    layout = load_layout("bluerov2_heavy")
    six = replace(layout, actuators=(*layout.actuators[:3], *layout.actuators[4:7]))
    plant = plant_of(six)
    rng = np.random.default_rng(4)
    assert np.linalg.matrix_rank(plant.effectiveness[:, 0], tol=1e-6) == 6
    force = rng.uniform(-15.0, 15.0, 6)
    command = np.stack([force, np.zeros(6), np.zeros(6)], axis=1)
    answer = Allocator(six, "ipopt").allocate(plant.wrench(command))
    np.testing.assert_allclose(answer.command[:, 0], force, atol=1e-3)
