"""Evidence of jumps against brute force: a Kalman filter that is told of the jump, and integrals
over its size."""

import math
from typing import NamedTuple

import numpy as np

from finlab.arrays import Array
from finlab.layout import load_layout
from finlab.swim.control.hypotheses import Hypotheses
from finlab.swim.control.jump_evidence import LOST, PAIR_SHARE, TARGETS
from finlab.swim.control.monitor_settings import MonitorSettings
from finlab.swim.control.motion_model import FIRST_ACTUATOR, MotionModel

PERIOD_S = 0.1
"""Of the filter [s]."""
JUMPED = 3
"""Which actuator is another one from `ONSET` on."""
ONSET = 12
"""Tick at which it jumps."""
TICKS = 30
"""Of the whole record."""
R = np.array([1e-4] * 3 + [1.4e-4] * 2)
"""Variance of a measurement of rates and tilt."""


def log_likelihood_ratio(Lambda: Array, eta: Array, mean: Array, variance: Array) -> float:
    """Of a jump with the prior N(m, C), C diagonal, to none, by the textbook:

    eta^T m - m^T Lambda m / 2 + r^T (1 + C Lambda)^-1 C r / 2 - log det(1 + C Lambda) / 2
    """
    C = np.diag(variance)
    r = eta - Lambda @ mean
    inner = np.eye(len(eta)) + C @ Lambda
    linear = eta @ mean - 0.5 * mean @ Lambda @ mean
    quadratic = 0.5 * r @ np.linalg.solve(inner, C @ r)
    return float(linear + quadratic - 0.5 * np.linalg.slogdet(inner)[1])


class Record(NamedTuple):
    """Commands and measurements of a robot."""

    commands: Array
    measured: Array


def recorded() -> Record:
    """What a robot measures by a model of its own, one of whose actuators is lost on the way."""
    rng = np.random.default_rng(4)
    layout = load_layout("bluerov2_heavy")
    model = MotionModel(layout)
    z = np.zeros(model.size)
    z[model.strength] = 1.0
    commands = np.zeros((TICKS, layout.n, 3))
    measured = np.zeros((TICKS, 5))
    for tick in range(TICKS):
        commands[tick, :, 0] = 3.0 * np.sin(0.3 * tick + np.arange(layout.n))
        if tick == ONSET:
            z[FIRST_ACTUATOR + JUMPED] = 0.0
        z = model.step(z, 0.0, commands[tick], PERIOD_S).state
        measured[tick] = z[3:8] + np.sqrt(R) * rng.normal(size=5)
    return Record(commands, measured)


def filtered(record: Record, jump: float) -> tuple[float, Hypotheses]:
    """The logarithm of the likelihood of a record where the strength of an actuator jumps by so
    much, by a filter along the same linearization, and the filter without the jump."""
    model = MotionModel(load_layout("bluerov2_heavy"))
    hypotheses = Hypotheses(model, MonitorSettings())
    rows = np.zeros((5, model.size))
    rows[range(5), range(3, 8)] = 1.0
    offset = np.zeros(model.size)  # by how much the state of the filter that knows is another one
    total = 0.0
    for tick in range(TICKS):
        if tick == ONSET:
            offset[FIRST_ACTUATOR + JUMPED] = jump
            hypotheses.forget_jumps()  # the onset of this tick is the first
        step = model.step(hypotheses.state, 0.0, record.commands[tick], PERIOD_S)
        hypotheses.predict(step, PERIOD_S)
        offset[:9] = step.transition @ offset
        innovation = record.measured[tick] - hypotheses.state[3:8]
        S = rows @ hypotheses.covariance @ rows.T + np.diag(R)
        K = hypotheses.covariance @ rows.T @ np.linalg.inv(S)
        if tick >= ONSET:
            own = innovation - rows @ offset
            total -= 0.5 * float(own @ np.linalg.solve(S, own))
        offset = offset - K @ (rows @ offset)
        hypotheses.update(rows, innovation, R)
    return total, hypotheses


def test_the_ratio_of_a_jump_is_that_of_two_filters() -> None:
    """Lambda and eta say for every size of the jump what a filter that knows of it finds."""
    record = recorded()
    without, hypotheses = filtered(record, 0.0)
    onset = 0
    assert hypotheses.onset_age[onset] * (1.0 + 1e-9) >= PERIOD_S * (TICKS - ONSET) - 1e-9
    slot = hypotheses._slots[onset]
    eta = hypotheses._jumps.score.array[slot, JUMPED]
    Lambda = hypotheses._jumps.information.array[slot, JUMPED, JUMPED]
    for jump in (-1.0, -0.3, 0.5):
        with_jump, _ = filtered(record, jump)
        expected = with_jump - without
        np.testing.assert_allclose(eta * jump - 0.5 * Lambda * jump**2, expected, rtol=1e-6)


def test_the_ratio_over_a_prior_is_its_integral() -> None:
    """Against a sum over a grid of sizes, for one number and for two."""
    mean = np.array([-1.0, 0.4])
    std = np.array([0.3, 0.2])
    factor = np.array([[2.0, 0.5], [0.3, 1.5]])
    Lambda = factor @ factor.T
    eta = np.array([-2.0, 1.0])
    axes = [np.linspace(m - 8.0 * s, m + 8.0 * s, 801) for m, s in zip(mean, std, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    exponent = grid @ eta - 0.5 * np.einsum("...i,ij,...j->...", grid, Lambda, grid)
    exponent -= 0.5 * np.square((grid - mean) / std).sum(axis=-1)
    cell = np.prod([axis[1] - axis[0] for axis in axes])
    integral = np.exp(exponent).sum() * cell / (2.0 * math.pi * std.prod())
    ratio = log_likelihood_ratio(Lambda, eta, mean, std**2)
    np.testing.assert_allclose(ratio, math.log(integral), rtol=1e-9)
    # A number that is known exactly is no unknown.
    known = log_likelihood_ratio(Lambda, eta, mean, np.array([std[0] ** 2, 0.0]))
    line = exponent[:, 400] + 0.5 * ((grid[:, 400, 1] - mean[1]) / std[1]) ** 2
    of_line = np.exp(line).sum() * (axes[0][1] - axes[0][0]) / (math.sqrt(2.0 * math.pi) * std[0])
    np.testing.assert_allclose(known, math.log(of_line), rtol=1e-9)


def test_the_evidence_of_each_target_is_that_of_its_prior() -> None:
    """What is computed for all at once is what the formula says of each."""
    _, hypotheses = filtered(recorded(), 0.0)
    hypotheses.misfit = 1.0  # else all ratios are divided by what the noise is more than assumed
    evidence = hypotheses.evidence()
    columns = hypotheses._own_columns[JUMPED]
    spans = -np.diff(np.append(hypotheses.onset_age, 0.0))
    for onset in (0, 3):
        slot = hypotheses._slots[onset]
        Lambda = hypotheses._jumps.information.array[slot]
        eta = hypotheses._jumps.score.array[slot]
        for target in range(len(TARGETS)):
            ratio = log_likelihood_ratio(
                Lambda[np.ix_(columns, columns)],
                eta[columns],
                evidence.mean[onset, JUMPED, target, : len(columns)],
                evidence.variance[onset, JUMPED, target, : len(columns)],
            )
            odds = evidence.log_odds[onset, JUMPED, target]
            if not np.isfinite(odds):
                continue
            rate = hypotheses.settings.failures * TARGETS[target].share
            expected = ratio + math.log(rate) + math.log(max(spans[onset], 0.05))
            np.testing.assert_allclose(odds, expected, rtol=1e-9)


def test_the_evidence_of_pairs_and_of_a_wrench_is_that_of_their_priors() -> None:
    _, hypotheses = filtered(recorded(), 0.0)
    hypotheses.misfit = 1.0
    settings = hypotheses.settings
    evidence = hypotheses.evidence()
    onset = 2
    slot = hypotheses._slots[onset]
    Lambda = hypotheses._jumps.information.array[slot]
    eta = hypotheses._jumps.score.array[slot]
    span = evidence.span[onset]
    two = [1, JUMPED]
    lost = -hypotheses._jumps.strength.array[slot, two]
    ratio = eta[two] @ lost - 0.5 * lost @ Lambda[np.ix_(two, two)] @ lost
    rate = math.log(settings.failures * TARGETS[0].share * PAIR_SHARE)
    np.testing.assert_allclose(evidence.both[onset, 1, JUMPED], ratio + rate + span, rtol=1e-9)
    assert evidence.both[onset, JUMPED, 1] == -math.inf, "each pair counts once"
    of_wrench = slice(hypotheses._n_columns - 6, None)
    ratio = log_likelihood_ratio(
        Lambda[of_wrench, of_wrench], eta[of_wrench], np.zeros(6), hypotheses._jolt_variance
    )
    expected = ratio + math.log(settings.jolts) + span
    np.testing.assert_allclose(evidence.jolt[onset], expected, rtol=1e-9)


def test_odds_of_kinds_and_pairs_are_sums_over_all_moments() -> None:
    _, hypotheses = filtered(recorded(), 0.0)
    evidence = hypotheses.evidence()
    for kind in range(5):
        of_kind = [j for j, target in enumerate(TARGETS) if target.kind == kind]
        odds = evidence.log_odds[:, JUMPED][:, of_kind]
        expected = np.logaddexp.reduce(odds, axis=None)
        np.testing.assert_allclose(evidence.by_kind[JUMPED, kind], expected, rtol=1e-12)
    expected = np.logaddexp.reduce(evidence.both[:, 0, JUMPED])
    np.testing.assert_allclose(evidence.of_pairs[0, JUMPED], expected, rtol=1e-12)


def test_a_jump_that_is_adopted_moves_state_and_covariance_to_those_who_knew() -> None:
    record = recorded()
    _, hypotheses = filtered(record, 0.0)
    evidence = hypotheses.evidence()
    before = hypotheses.state.copy()
    along = hypotheses._sensitivity.array[:, hypotheses._slots[0], JUMPED].copy()
    hypotheses.adopt(0, JUMPED, evidence.mean[0, JUMPED, LOST], evidence.variance[0, JUMPED, LOST])
    moved = hypotheses.state - before
    np.testing.assert_allclose(moved, along * (moved @ along) / (along @ along), atol=1e-6)
    assert abs(hypotheses.strength[JUMPED]) < 0.1
    assert not len(hypotheses.onset_age), "all jumps begin anew"
    assert np.linalg.eigvalsh(hypotheses.covariance).min() > -1e-9
