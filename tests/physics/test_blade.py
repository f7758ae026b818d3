"""The power of a beating plate, against its torque integrated over a beat."""

import numpy as np
import pytest

from finlab.actuators.law import OWN_INERTIA, Blade
from finlab.layout import FinModelSpec
from finlab.physics import make_law

BLADES = [
    Blade(),
    Blade(0.12, 0.05),
    Blade(0.3, 0.15, 1025.0, 1.2),
    Blade(0.05, 0.2),
    Blade(drag_coefficient=1e-6),
]
BEATS = [(0.01, 0.1), (0.05, 2.1), (0.3, 1.0), (0.6, 2.1), (1.2, 0.5), (1.5, 3.0)]


def integrated(blade: Blade, amplitude: float, frequency: float) -> float:
    """Mean of what driving takes [W] over a beat of A sin(2 pi f t)."""
    turn = 2.0 * np.pi * (np.arange(400_000) + 0.5) / 400_000
    rate = 2.0 * np.pi * frequency
    speed = amplitude * rate * np.cos(turn)
    torque = -blade.inertia * amplitude * rate**2 * np.sin(turn) + blade.drag * speed * np.abs(speed)
    return float(np.maximum(torque * speed, 0.0).mean())


@pytest.mark.parametrize("beat", BEATS)
@pytest.mark.parametrize("blade", BLADES)
def test_power_is_what_driving_takes_over_a_beat(blade: Blade, beat: tuple[float, float]) -> None:
    assert blade.power(*map(np.float64, beat)) == pytest.approx(integrated(blade, *beat), rel=1e-8)


def test_the_plate_of_the_robot() -> None:
    """Its own inertia, that of the water within the circle of its width, and drag of a flat plate."""
    blade = Blade()
    assert blade.own_inertia == OWN_INERTIA
    water = np.linspace(0.0, 0.2, 100_001)
    carried = np.trapezoid(np.pi / 4.0 * 1000.0 * 0.1**2 * water**2, water)
    assert blade.inertia - OWN_INERTIA == pytest.approx(carried, rel=1e-6)
    drag = np.trapezoid(0.5 * 1000.0 * 2.0 * 0.1 * water**3, water)
    assert blade.drag == pytest.approx(drag, rel=1e-6)
    assert Blade(0.4, 0.3).own_inertia == pytest.approx(24.0 * OWN_INERTIA)


@pytest.mark.parametrize("blade", BLADES)
def test_slopes_are_differences(blade: Blade) -> None:
    a, f = (np.array(values) for values in zip(*BEATS, strict=True))
    by_a, by_f = blade.power_gradient(a, f)
    h = 1e-6
    ahead, behind = (blade.power(a * (1.0 + s * h), f) for s in (1, -1))
    np.testing.assert_allclose(by_a, (ahead - behind) / (2.0 * h * a), rtol=2e-8)
    ahead, behind = (blade.power(a, f * (1.0 + s * h)) for s in (1, -1))
    np.testing.assert_allclose(by_f, (ahead - behind) / (2.0 * h * f), rtol=2e-8)


@pytest.mark.parametrize(
    ("spec", "blade"),
    [
        (FinModelSpec(), Blade(0.2, 0.1)),
        (FinModelSpec("drag", (("area", 0.03), ("lever", 0.12))), Blade(0.24, 0.125)),
        (FinModelSpec("lighthill", (("length", 0.14), ("width", 0.08))), Blade(0.14, 0.08)),
        (FinModelSpec("soft"), Blade()),
    ],
)
def test_each_law_knows_its_plate(spec: FinModelSpec, blade: Blade) -> None:
    """A rectangle of the area whose centre lies at the lever, one edge on the shaft."""
    law = make_law(spec)
    command = np.random.default_rng(0).uniform([0.05, 0.1, -3.0], [0.6, 2.1, 3.0], (20, 3))
    expected = blade.power(command[:, 0], command[:, 1])
    np.testing.assert_allclose(law.power(command), expected, rtol=1e-12)
    jacobian = law.power_gradient(command)
    np.testing.assert_array_equal(jacobian[:, 2], 0.0)
    by = blade.power_gradient(command[:, 0], command[:, 1])
    np.testing.assert_allclose(jacobian[:, :2].T, by, rtol=1e-12)
