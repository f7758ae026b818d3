"""Noisy sequences: the noise is what it says, and changes of commands are counted."""

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.evaluation.experiments.noisy_sequences import noisy_path, noisy_sequence_rows
from finlab.evaluation.experiments.steadiness import smooth_path
from finlab.layout import load_layout


def test_noise_is_white_and_of_its_size() -> None:
    layout, sigma = load_layout("A"), np.ones(6)
    smooth, noisy = smooth_path(layout, sigma, 7, 400), noisy_path(layout, sigma, 7, 400, 0.2)
    noise = (noisy - smooth) / np.sqrt(np.mean(smooth**2, axis=0))
    np.testing.assert_allclose(noise.std(axis=0), 0.2, rtol=0.2)
    assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.15
    np.testing.assert_array_equal(noisy, noisy_path(layout, sigma, 7, 400, 0.2))


def test_the_search_keeps_to_the_rates_that_jumps_break() -> None:
    layout = load_layout("A")
    methods = {name: load_allocator(name) for name in ("search", "qp")}
    ours, jumpy = noisy_sequence_rows(methods, [layout], n_paths=1, ticks=40, seed=3)
    assert (ours["method"], jumpy["method"], ours["ticks"]) == ("search", "qp", 40)
    servo = layout.fins[0].servo
    rates = servo.amplitude_rate, servo.frequency_rate, servo.direction_rate
    for what, rate in zip(("amplitude", "frequency", "turn"), rates, strict=True):
        assert 0.0 < ours[f"{what}_mean"] < ours[f"{what}_p99"] <= 0.1 * rate * (1 + 1e-9)
    assert jumpy["turn_p99"] > ours["turn_p99"]
    assert jumpy["err_norm_mean"] == pytest.approx(0.0, abs=1e-3)
