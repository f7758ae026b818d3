"""The judges of least watts agree with each other and with published figures of a BlueROV2
Heavy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from finlab.actuators.thrust_model import PowerLaw
from finlab.actuators.thruster import Thruster
from finlab.allocation import Allocator, Policy
from finlab.allocation.baselines.autopilots import PX4_ORDER
from finlab.allocation.dual.compiled import Compiled
from finlab.axes import AXES
from finlab.layout import Layout, load_layout
from finlab.research.evaluation.experiments.thrusters import _draws, misses_more, missing_by_group
from tests.core.internal_functions import dual_function
from tests.oracle_optima import conic_optimum, farthest, least_known, least_miss, lower_bound
from tests.oracle_plant import OraclePlant
from tests.random_robots import KINDS, bluerov2_heavy, random_plant, within

HEAVY = OraclePlant(bluerov2_heavy())
"""The judge's model of a BlueROV2 Heavy."""


@pytest.mark.parametrize(
    ("wrench", "forces"),
    [
        ((20, 0, 0, 0, 0, 0), (-7.0711, -7.0711, 7.0711, 7.0711, 0.4661, 0.4661, -0.4661, -0.4661)),
        ((0, 20, 0, 0, 0, 0), (-7.2202, 7.2202, -6.9219, 6.9219, -0.2558, 0.2558, -0.2558, 0.2558)),
        ((0, 0, 20, 0, 0, 0), (0, 0, 0, 0, -5, -5, -5, -5)),
        ((0, 0, 0, 2, 0, 0), (0, 0, 0, 0, 2.3256, -2.3256, 2.3256, -2.3256)),
        ((0, 0, 0, 0, 2, 0), (0, 0, 0, 0, 4.2373, 4.2373, -4.2373, -4.2373)),
        ((0, 0, 0, 0, 0, 2), (-2.9836, 2.9836, 2.9836, -2.9836, 0, 0, 0, 0)),
        (
            (30, 15, -20, 0, 1, 3),
            (-20.4971, -0.7161, 9.8905, 11.3227, 7.6259, 8.0097, 1.9903, 2.3741),
        ),
    ],
)
def test_the_pseudo_inverse_of_a_heavy(
    wrench: tuple[float, ...], forces: tuple[float, ...]
) -> None:
    np.testing.assert_allclose(np.linalg.pinv(HEAVY.effectiveness) @ wrench, forces, atol=6e-5)
    assert np.linalg.cond(HEAVY.effectiveness) == pytest.approx(8.48, abs=5e-3)


@pytest.mark.parametrize(
    ("axis", "most", "least"),
    [
        (0, 129.2, 129.2),
        (1, 126.5, 126.5),
        (2, 159.6, 205.8),
        (3, 34.3, 34.3),
        (4, 18.8, 18.8),
        (5, 30.6, 30.6),
    ],
)
def test_the_reach_of_a_heavy(axis: int, most: float, least: float) -> None:
    for sign, expected in ((1.0, most), (-1.0, least)):
        assert farthest(HEAVY, sign * np.eye(6)[axis]) == pytest.approx(expected, abs=0.051)


def test_three_ways_to_the_least_watts_of_a_heavy() -> None:
    for seed in range(3):
        wrench = within(HEAVY, np.random.default_rng(seed))
        watts, forces = conic_optimum(HEAVY, wrench)
        np.testing.assert_allclose(HEAVY.effectiveness @ forces, wrench, atol=1e-6)
        assert lower_bound(HEAVY, wrench) == pytest.approx(watts, rel=1e-6)
        assert least_known(HEAVY, wrench, 2) == pytest.approx(watts, rel=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_bound_and_best_known_meet(kind: str) -> None:
    """Where the bound by prices equals what is found, both are the optimum; wide arcs and holes
    included."""
    plant = random_plant(kind, 0, 1)
    rng = np.random.default_rng(0)
    wrench = within(plant, rng)
    best = least_known(plant, wrench, 1)
    assert best is not None
    assert lower_bound(plant, wrench) == pytest.approx(best, rel=2e-5)
    assert farthest(plant, wrench) >= 0.9999


def test_beyond_the_farthest_the_bound_says_so() -> None:
    wrench = within(HEAVY, np.random.default_rng(3))
    assert np.isfinite(lower_bound(HEAVY, 0.999 * farthest(HEAVY, wrench) * wrench))
    assert lower_bound(HEAVY, 1.01 * farthest(HEAVY, wrench) * wrench) == np.inf


def test_least_miss_of_a_heavy() -> None:
    """Against least squares with bounds."""
    wrench = 2.0 * farthest(HEAVY, np.ones(6)) * np.ones(6)
    low, high = np.array([each.limits for each in HEAVY.actuators])[:, :, 0].T
    ends = lsq_linear(
        HEAVY.effectiveness / HEAVY.scales[:, None], wrench / HEAVY.scales, (low, high), tol=1e-14
    )
    assert least_miss(HEAVY, wrench) == pytest.approx(np.sqrt(2.0 * ends.cost), rel=1e-5)


def test_costly_reverse_is_within_reach() -> None:
    model = PowerLaw(1.0, 5.0)
    thrusters = [
        Thruster(name, (0.0, 0.0, 0.0), axis, (-10.0, 10.0), model)
        for name, axis in (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)), ("z", (0.0, 0.0, 1.0)))
    ]
    robot = Compiled.of(Layout("three", tuple(thrusters)))
    wrench = np.array([-9.0, -9.0, -9.0, 0.0, 0.0, 0.0])
    answer = robot.core.answer_one(wrench, None)
    lambda_reduced = np.append(
        robot.basis.T @ (robot.axis_scale * answer.multipliers[0]), np.zeros(3)
    )
    assert answer.is_attainable[0]
    dual_value = dual_function(robot.block, wrench, lambda_reduced)[1]
    np.testing.assert_allclose(dual_value, 3 * 5.0 * 9.0**1.5, rtol=1e-9)
    np.testing.assert_allclose(answer.command[0, :, 0], -9.0, atol=1e-9)


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_on_a_surveyed_frame_a_priority_misses_no_more_than_px4(lost: int) -> None:
    policy = Policy("priority", order=PX4_ORDER)
    for layout, edge in _draws("surveyed", lost, 3, 6, 3):
        for share in (1.2, 2.0):
            ours, theirs = (
                Allocator(layout, name).allocate_batch(share * edge, **how)
                for name, how in (("dual", {"policy": policy}), ("px4", {}))
            )
            mine, own = (
                missing_by_group(each.unallocated / each.scale, PX4_ORDER)
                for each in (ours, theirs)
            )
            assert not misses_more(mine, own).any(), np.stack([mine, own], 1)[
                misses_more(mine, own)
            ]


@pytest.mark.parametrize(
    "order",
    [Policy.order, (("Tz",), ("Fx", "Fz")), (("Fx", "Tz"), ("Fz",)), (("Fz", "Fx"), ("Tz",))],
)
def test_an_axis_that_nothing_drives_holds_up_no_other(order: tuple[tuple[str, ...], ...]) -> None:
    allocator = Allocator(replace(load_layout("no_yaw"), axes=AXES))
    answer = allocator.allocate(
        [1.0, 0.0, 0.5, 0.0, 0.0, 0.2], policy=Policy("priority", order=order)
    )
    np.testing.assert_allclose(answer.unallocated, [0.0, 0.0, 0.0, 0.0, 0.0, 0.2], atol=1e-4)
