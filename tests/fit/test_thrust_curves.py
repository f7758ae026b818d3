"""What pictures of a fit draw, beside the law that was measured"""

import numpy as np
import pytest

from finlab.fit.fin_fit import FinFit, fit_fin
from finlab.fit.thrust_curves import thrust_curves
from tests.fit.cell import commands, measured, samples, soft

LAW = soft(k=4.0, p=1.4, x0=0.9, q=4.0, e=0.15, phi_e=1.0, d=0.12)


@pytest.fixture(scope="module")
def fit() -> FinFit:
    """150 samples with 2 % noise."""
    command = commands(150)
    return fit_fin(samples(command, measured(LAW, command, 0.02)))


def truth(amplitude: float, frequency: float) -> float:
    """The law's thrust averaged over all zero directions."""
    turn = np.linspace(-np.pi, np.pi, 24, endpoint=False)
    command = np.stack([np.full(24, amplitude), np.full(24, frequency), turn], axis=-1)
    return float(np.linalg.norm(LAW.force(command), axis=-1).mean())


def test_curves_are_the_laws_and_samples_stand_by_them(fit: FinFit) -> None:
    curves = thrust_curves(fit, 3)
    assert [curve.frequency for curve in curves] == sorted(curve.frequency for curve in curves)
    for curve in curves:
        assert 49 <= len(curve.samples) <= 52 and curve.band[0] <= curve.frequency <= curve.band[1]
        expected = [truth(a, curve.frequency) for a in curve.amplitude]
        np.testing.assert_allclose(curve.thrust, expected, atol=0.05 * fit.largest)
        own = np.interp(curve.samples[:, 0], curve.amplitude, curve.thrust)
        assert np.abs(curve.samples[:, 1] - own).max() < 0.1 * fit.largest
        assert curve.deviation[0] == 0.0 and (curve.deviation[1:] > 0.0).all()
