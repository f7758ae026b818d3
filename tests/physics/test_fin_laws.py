"""The laws of single fins: numbers, directions, derivatives, precision, for arrays, tensors and
symbols."""

import math

import casadi
import numpy as np
import pytest
import torch
from scipy.special import j0, j1

from finlab.actuators.fin.fin_laws import PLANAR_LAWS, bessel_j0, bessel_j1
from finlab.actuators.fin.fin_model import FIN_MODELS
from finlab.actuators.law import OWN_INERTIA, Blade
from finlab.layout import FinModelSpec
from finlab.physics import make_law

DRAG = make_law(FinModelSpec("drag"))
"""The law of drag with its default constants."""
LIGHTHILL = make_law(FinModelSpec("lighthill"))
"""Lighthill's law with its default constants."""
SOFT = make_law(FinModelSpec("soft"))
"""The law of a soft fin with its default constants."""
UNEVEN = make_law(
    FinModelSpec(
        "soft", (("d", 0.1), ("e", 0.2), ("k", 2.0), ("p", 1.7), ("phi_e", 2.0), ("q", 3.0))
    )
)
"""A soft fin whose thrust depends on the zero direction and is turned from it."""
LAWS = {name: make_law(FinModelSpec(name)) for name in PLANAR_LAWS} | {"uneven": UNEVEN}
"""Name -> law, of all formulas and one that is uneven."""
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
"""Runs a test with each of these laws."""


def random_commands(n, seed=0):
    """Commands (n, 3) of a fin."""
    unit = np.random.default_rng(seed).random((n, 3))
    return np.array([0.05, 0.1, -math.pi]) + unit * np.array([1.4, 3.0, 2 * math.pi])


def test_drag_thrust_is_4_737_f2_sin2_a():
    a, f, _ = random_commands(100).T
    np.testing.assert_allclose(DRAG.thrust(a, f), 4.737 * f**2 * np.sin(a) ** 2, rtol=1e-4)
    printed = 2 * 1000 * 0.15 * 0.02 * 0.1**2 * (2 * math.pi * f) ** 2 * (1 - np.cos(2 * a))
    np.testing.assert_allclose(DRAG.thrust(a, f), printed, rtol=1e-12)


def test_lighthill_thrust_is_the_formula_with_the_bessel_function():
    a, f, _ = random_commands(100).T
    mass = math.pi / 4 * 1000 * 0.10**2
    expected = 0.5 * mass * 0.20**2 * (2 * math.pi * f) ** 2 * a * j1(a)
    np.testing.assert_allclose(LIGHTHILL.thrust(a, f), expected, rtol=1e-13)
    # At small angles about 3.10 (A f)^2 N.
    assert LIGHTHILL.thrust(0.01, 1.0) == pytest.approx(3.10e-4, rel=1e-3)


def test_bessel_series_are_exact_where_they_say():
    x = np.linspace(-4, 4, 2001)
    np.testing.assert_allclose(bessel_j0(x), j0(x), atol=2e-15)
    np.testing.assert_allclose(bessel_j1(x), j1(x), atol=2e-15)


def test_soft_thrust_is_the_contract_by_hand():
    assert SOFT.thrust(0.4, 2.5, 0.0) == pytest.approx(3.6 / (1 + (1 / 1.3) ** 5))
    # Beating fast it thrusts less at a larger amplitude.
    assert SOFT.thrust(0.6, 2.5, 0.0) < SOFT.thrust(0.4, 2.5, 0.0)
    x = 0.5 * 1.2
    by_hand = 2.0 * x**1.7 / (1 + (x / 1.3) ** 3) * (1 + 0.2 * math.cos(0.7 - 2.0))
    assert UNEVEN.thrust(0.5, 1.2, 0.7) == pytest.approx(by_hand, rel=1e-14)
    force = UNEVEN.force(np.array([0.5, 1.2, 0.7]))
    np.testing.assert_allclose(
        force, by_hand * np.array([0.0, math.cos(0.8), math.sin(0.8)]), atol=1e-14
    )


@every_law
def test_force_points_where_the_law_says_and_never_along_the_shaft(law):
    u = random_commands(200)
    force = law.force(u)
    assert not force[:, 0].any()
    turn = np.arctan2(force[:, 2], force[:, 1]) - u[:, 2] - law.offset
    np.testing.assert_allclose(np.exp(1j * turn), 1.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(force, axis=-1), law.thrust(*u.T), rtol=1e-12)


@every_law
def test_slopes_are_those_of_the_tensors_own_differentiation(law):
    u = torch.from_numpy(random_commands(50)).requires_grad_()
    force, jacobian = law.force_and_jacobian(u.detach().numpy())
    np.testing.assert_array_equal(force, law.force(u.detach().numpy()))
    tensor = law.force(u)
    np.testing.assert_allclose(force, tensor.detach().numpy(), rtol=1e-13, atol=1e-14)
    for axis in (1, 2):
        (by_command,) = torch.autograd.grad(tensor[:, axis].sum(), u, retain_graph=True)
        np.testing.assert_allclose(jacobian[..., axis], by_command.numpy(), rtol=1e-10, atol=1e-12)
    assert not jacobian[..., 0].any()


@every_law
def test_symbols_give_the_same_thrust(law):
    a = casadi.SX.sym("a")
    f = casadi.SX.sym("f")
    d = casadi.SX.sym("d")
    formula = casadi.Function("thrust", [a, f, d], [law.thrust(a, f, d)])
    for command in random_commands(10):
        assert float(formula(*command)) == pytest.approx(float(law.thrust(*command)), rel=1e-12)


@every_law
def test_a_fin_that_does_not_beat_gives_nothing_and_its_slopes_are_finite(law):
    for still in ([0.0, 1.0, 0.3], [0.4, 0.0, 0.3], [0.0, 0.0, 0.3]):
        force, jacobian = law.force_and_jacobian(np.array(still))
        assert not force.any() and np.isfinite(jacobian).all()


@pytest.mark.parametrize("name", PLANAR_LAWS)
def test_every_parameter_of_a_description_reaches_its_law(name):
    u = random_commands(7)
    for key, rule in FIN_MODELS[name].items():
        other = make_law(FinModelSpec(name, ((key, rule.default + 0.1),)))
        changed = np.abs(other.force(u) - make_law(FinModelSpec(name)).force(u)).max() > 1e-6
        assert changed or (name, key) == (
            "soft",
            "phi_e",
        )  # the angle of an unevenness that is zero
    doubled = make_law(FinModelSpec("drag", (("area", 0.04),)))
    np.testing.assert_allclose(doubled.force(u), 2.0 * DRAG.force(u))


BLADES = [
    Blade(),
    Blade(0.12, 0.05),
    Blade(0.3, 0.15, 1025.0, 1.2),
    Blade(0.05, 0.2),
    Blade(drag_coefficient=1e-6),
]
"""Blades of several sizes, densities and coefficients of drag."""
BEATS = [(0.01, 0.1), (0.05, 2.1), (0.3, 1.0), (0.6, 2.1), (1.2, 0.5), (1.5, 3.0)]
"""Amplitudes [rad] and frequencies [Hz], from a tremble to a full beat."""


def integrated(blade: Blade, amplitude: float, frequency: float) -> float:
    """Mean of what driving takes [W] over a beat of A sin(2 pi f t)."""
    turn = 2.0 * np.pi * (np.arange(400_000) + 0.5) / 400_000
    rate = 2.0 * np.pi * frequency
    speed = amplitude * rate * np.cos(turn)
    torque = -blade.inertia * amplitude * rate**2 * np.sin(turn) + blade.drag * speed * np.abs(
        speed
    )
    return float(np.maximum(torque * speed, 0.0).mean())


@pytest.mark.parametrize("beat", BEATS)
@pytest.mark.parametrize("blade", BLADES)
def test_power_is_what_driving_takes_over_a_beat(blade: Blade, beat: tuple[float, float]) -> None:
    assert blade.power(*map(np.float64, beat)) == pytest.approx(integrated(blade, *beat), rel=1e-8)


def test_the_plate_of_the_robot() -> None:
    """Its own inertia, that of the water within the circle of its width, and drag of a flat
    plate."""
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
