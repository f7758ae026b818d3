"""The search in force space: exact where exact is possible, inside the limits, cheaper than least squares."""

import numpy as np
import pytest

from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.allocation.learned.prepared import Prepared
from finlab.forces.force_space import Planar, _gram, _project, descend, realize
from finlab.layout import Layout, random_layout


def robots(limits: str, n_fins: int | tuple[int, int] = (2, 5)) -> list[Layout]:
    return [
        random_layout(np.random.default_rng(seed), n_fins=n_fins, limits=limits)  # type: ignore[arg-type]
        for seed in range(5000, 5012)
    ]


def reachable(prepared: Prepared, n: int = 20) -> np.ndarray:
    """Normalized wrenches (n, 6) of random commands."""
    rng = np.random.default_rng(7)
    lower, upper = prepared.lower, prepared.upper
    command = lower + rng.uniform(size=(n, *lower.shape)) * (upper - lower)
    return np.asarray(prepared.commands.wrench(command))


def full_thrust(prepared: Prepared, rows: int) -> np.ndarray:
    return np.tile(prepared.planar.curves.maximum, (rows, 1))


def test_reaches_what_can_be_reached(learned: LearnedAllocator) -> None:
    error = []
    for layout in robots("nominal"):
        prepared = learned.pipeline.prepare(layout)
        target = reachable(prepared)
        planar = descend(prepared.planar, target, full_thrust(prepared, len(target)), 30)
        error.append(np.linalg.norm(planar.residual, axis=1))
    assert np.quantile(np.concatenate(error), 0.95) < 1e-3


@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_the_residual_is_what_the_forces_leave(limits: str, learned: LearnedAllocator) -> None:
    for layout in robots(limits):
        prepared = learned.pipeline.prepare(layout)
        target = reachable(prepared)
        planar = descend(prepared.planar, target, full_thrust(prepared, len(target)), 6)
        unit = np.stack([np.cos(planar.direction), np.sin(planar.direction)], axis=-1)
        given = np.einsum("rnc,nci->ri", planar.thrust[..., None] * unit, prepared.planar.columns)
        np.testing.assert_allclose(planar.residual, target - given, atol=1e-7)


@pytest.mark.parametrize("scale", [0.0, 1.0, 50.0])
@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_forces_keep_the_limits_wherever_the_target_lies(
    limits: str, scale: float, learned: LearnedAllocator
) -> None:
    for layout in robots(limits):
        prepared = learned.pipeline.prepare(layout)
        problem = prepared.planar
        target = scale * reachable(prepared)
        planar = descend(problem, target, full_thrust(prepared, len(target)), 6)
        assert (planar.thrust >= problem.curves.minimum).all()
        assert (planar.thrust <= problem.curves.maximum).all()
        command, energy = realize(problem, planar)
        assert np.isfinite(command).all() and np.isfinite(energy).all()
        turned = np.remainder(command[..., 2] - problem.middle + np.pi, 2 * np.pi) - np.pi
        assert (np.abs(turned) <= problem.half + 1e-9).all()
        assert (command[..., :2] >= prepared.lower[:, :2] - 1e-9).all()
        assert (command[..., :2] <= prepared.upper[:, :2] + 1e-9).all()


def test_is_cheaper_than_the_pseudo_inverse(learned: LearnedAllocator) -> None:
    ratio = []
    for layout in robots("nominal", n_fins=(4, 5)):
        prepared = learned.pipeline.prepare(layout)
        problem = prepared.planar
        target = 0.5 * reachable(prepared)
        columns = problem.columns.reshape(-1, 6)
        force = (target @ np.linalg.pinv(columns)).reshape(len(target), -1, 2)
        thrust = np.linalg.norm(force, axis=-1)
        left = target - force.reshape(len(target), -1) @ columns
        least_squares = Planar(thrust, np.arctan2(force[..., 1], force[..., 0]), left)
        planar = descend(problem, target, thrust, 10)
        inside = ((thrust >= problem.curves.minimum) & (thrust <= problem.curves.maximum)).all(1)
        exact = np.linalg.norm(planar.residual, axis=1) < 1e-3
        change = realize(problem, planar)[1] / realize(problem, least_squares)[1]
        ratio.append(change[inside & exact])
    ratios = np.concatenate(ratio)
    assert len(ratios) > 100
    assert ratios.max() < 1.02 and ratios.mean() < 0.9


def test_resting_fins_point_where_it_costs_least(learned: LearnedAllocator) -> None:
    prepared = learned.pipeline.prepare(robots("varied")[0])
    low = prepared.planar.curves.minimum[None]
    command, _ = realize(prepared.planar, Planar(low, np.full_like(low, 1.0), np.zeros((1, 6))))
    expected = np.clip(0.0, prepared.lower[:, 2], prepared.upper[:, 2])
    np.testing.assert_allclose(command[0, :, 2], expected)


@pytest.mark.parametrize("limits", ["nominal", "varied"])
def test_the_projection_is_the_nearest_force_and_knows_its_slope(
    limits: str, learned: LearnedAllocator
) -> None:
    rng = np.random.default_rng(1)
    for layout in robots(limits)[:6]:
        planar = learned.pipeline.prepare(layout).planar
        low, high = planar.curves.minimum, planar.curves.maximum
        wanted = rng.standard_normal((30, len(high), 2)) * high[:, None]
        target = rng.standard_normal((30, 6))
        found, slope = _project(planar, wanted, target)
        unit = np.stack([np.cos(found.direction), np.sin(found.direction)], axis=-1)
        force = unit * found.thrust[..., None]
        given = np.einsum("rnd,ndi->ri", force, planar.columns)
        np.testing.assert_allclose(found.residual, target - given, atol=1e-9)
        # No force that the fin can give is nearer; where the arc is not convex, none along its ends and rays.
        share = np.linspace(0.0, 1.0, 21)
        angle = planar.middle + (2 * share[:, None] - 1) * np.minimum(planar.half, np.pi)
        size = low + share[:, None] * (high - low)
        for i in range(len(high)):
            grid = np.array([[s * np.cos(a), s * np.sin(a)] for s in size[:, i] for a in angle[:, i]])
            least = np.linalg.norm(wanted[:, i, None] - grid, axis=-1).min(axis=1)
            assert (np.linalg.norm(wanted[:, i] - force[:, i], axis=-1) <= least + 1e-6 + low[i]).all()
        for k in range(2):
            step = np.zeros(2)
            step[k] = 1e-6
            ahead, behind = (_project(planar, wanted + sign * step, target)[0] for sign in (1.0, -1.0))
            moved = [
                f.thrust[..., None] * np.stack([np.cos(f.direction), np.sin(f.direction)], axis=-1)
                for f in (ahead, behind)
            ]
            difference = (moved[0] - moved[1]) / 2e-6
            close = np.isclose(slope[..., k], difference, atol=1e-3).all(axis=-1)
            assert close.mean() > 0.98  # but for the few that stand at a kink


def test_systems_are_sums_over_fins(learned: LearnedAllocator) -> None:
    planar = learned.pipeline.prepare(robots("varied", 4)[0]).planar
    rng = np.random.default_rng(2)
    weight, slope = rng.random((5, 4)), rng.standard_normal((5, 4, 2, 2))
    whole, bent = _gram(planar, weight), _gram(planar, weight, slope)
    for row in range(5):
        parts = [weight[row, i] * planar.columns[i].T @ planar.columns[i] for i in range(4)]
        np.testing.assert_allclose(whole[row], sum(parts), rtol=1e-6, atol=1e-7)
        parts = [weight[row, i] * planar.columns[i].T @ slope[row, i] @ planar.columns[i] for i in range(4)]
        np.testing.assert_allclose(bent[row], sum(parts), rtol=1e-6, atol=1e-7)
