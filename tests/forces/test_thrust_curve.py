"""Thrust curves: monotone, true to the fin, and as cheap as a search of all amplitudes and frequencies."""

import math

import numpy as np
import pytest

from finlab.forces.thrust_curve import ThrustCurves, thrust_curves
from finlab.inference.learned_fin import LearnedFin
from finlab.physics.energy import fin_energy

LIMITS = {
    "nominal": ((0.05, 0.1, -math.pi), (0.6, 2.1, math.pi)),
    "strong": ((0.05, 0.1, -1.0), (0.8, 3.0, 2.0)),
    "weak and slow": ((0.05, 0.1, 0.5), (0.3, 1.0, 2.0)),
    "fast and narrow": ((0.3, 0.5, -math.pi), (0.35, 2.5, math.pi)),
}
LOWER, UPPER = (np.array([limits[end] for limits in LIMITS.values()]) for end in (0, 1))


@pytest.fixture(scope="module")
def curves(learned_fin: LearnedFin) -> ThrustCurves:
    return thrust_curves(learned_fin, LOWER, UPPER)


def thrust_of(fin: LearnedFin, amplitude: np.ndarray, frequency: np.ndarray, direction: float) -> np.ndarray:
    command = np.stack(np.broadcast_arrays(amplitude, frequency, direction), axis=-1).astype(np.float64)
    return np.asarray(np.linalg.norm(fin.force(command)[..., 1:], axis=-1))


def levels(curves: ThrustCurves, n: int = 60) -> np.ndarray:
    """Thrusts (n, fins) from the least to the most of each fin."""
    share = np.linspace(0.0, 1.0, n)[:, None] ** 2
    return curves.minimum + share * (curves.maximum - curves.minimum)


def test_ends_are_what_the_limits_allow(curves: ThrustCurves, learned_fin: LearnedFin) -> None:
    for i in range(len(LIMITS)):
        direction = min(max(0.0, LOWER[i, 2]), UPPER[i, 2])
        for got, end in ((curves.minimum[i], LOWER[i]), (curves.maximum[i], UPPER[i])):
            expected = thrust_of(learned_fin, end[0], end[1], direction)
            assert got == pytest.approx(float(expected), rel=1e-6, abs=1e-9)


def test_more_thrust_takes_no_less_of_anything(curves: ThrustCurves) -> None:
    found = curves.lookup(levels(curves))
    assert (np.diff(found[..., 2], axis=0) > 0).all()
    assert (np.diff(found[..., :2], axis=0) > -2e-3).all()


def test_commands_keep_their_limits(curves: ThrustCurves) -> None:
    found = curves.lookup(levels(curves))[..., :2]
    assert (found >= LOWER[:, :2] - 1e-12).all() and (found <= UPPER[:, :2] + 1e-12).all()


def test_commands_give_the_thrust_that_was_asked_for(curves: ThrustCurves, learned_fin: LearnedFin) -> None:
    asked = levels(curves)
    found = curves.lookup(asked)
    for i in range(len(LIMITS)):
        direction = min(max(0.0, LOWER[i, 2]), UPPER[i, 2])
        given = thrust_of(learned_fin, found[:, i, 0], found[:, i, 1], direction)
        np.testing.assert_allclose(given, asked[:, i], rtol=0.01, atol=0.003 * curves.maximum[i])


def test_no_other_command_is_cheaper(curves: ThrustCurves, learned_fin: LearnedFin) -> None:
    asked = levels(curves, 25)[1:-1]
    found = curves.lookup(asked)
    for i in range(len(LIMITS)):
        # Brute force: for each amplitude the frequency that gives the thrust, by interpolation.
        direction = min(max(0.0, LOWER[i, 2]), UPPER[i, 2])
        amplitudes = np.linspace(LOWER[i, 0], UPPER[i, 0], 150)
        frequencies = np.linspace(LOWER[i, 1], UPPER[i, 1], 300)
        thrust = thrust_of(learned_fin, amplitudes[:, None], frequencies[None], direction)
        for k, level in enumerate(asked[:, i]):
            frequency = np.array([np.interp(level, row, frequencies) for row in thrust])
            possible = (thrust[:, 0] <= level) & (level <= thrust[:, -1])
            command = np.stack([amplitudes, frequency, np.zeros_like(frequency)], axis=-1)
            best = fin_energy(command, UPPER[i])[possible].min()
            assert found[k, i, 2] == pytest.approx(best, rel=0.02, abs=2e-3)


def test_energy_is_that_of_the_command(curves: ThrustCurves) -> None:
    found = curves.lookup(levels(curves))
    command = np.concatenate([found[..., :2], np.zeros_like(found[..., :1])], axis=-1)
    np.testing.assert_allclose(found[..., 2], fin_energy(command, UPPER), rtol=5e-3, atol=1e-3)


def test_thrust_out_of_reach_is_clamped(curves: ThrustCurves) -> None:
    ends = curves.lookup(np.stack([curves.minimum, curves.maximum]))
    np.testing.assert_array_equal(curves.lookup(np.zeros((1, 4))), ends[:1])
    np.testing.assert_array_equal(curves.lookup(np.full((1, 4), 1e3)), ends[1:])


def test_limits_of_almost_no_width_give_finite_curves(learned_fin: LearnedFin) -> None:
    lower = np.array([[0.4, 1.5, 0.3], [0.0, 0.0, -1.0]])
    upper = np.array([[0.4, 1.5, 0.3], [1e-9, 1e-9, 1.0]])
    curves = thrust_curves(learned_fin, lower, upper)
    found = curves.lookup(np.array([[1.0, 1.0], [0.0, 0.0]]))
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[:, 0, :2], [[0.4, 1.5], [0.4, 1.5]])
