"""The laws of single fins: numbers, directions, derivatives, precision."""

import math

import numpy as np
import pytest
import torch
from scipy.special import j1

from finlab.layout import FinModelSpec
from finlab.layout.fin_model import MODEL_DEFAULTS
from finlab.physics import Drag, Lighthill, make_fin_model
from finlab.physics.lighthill import bessel_j1

MODELS = [Drag(), Lighthill()]


def commands(n, seed=0, dtype=torch.float64):
    generator = torch.Generator().manual_seed(seed)
    unit = torch.rand(n, 3, generator=generator, dtype=dtype)
    return torch.tensor([0.05, 0.1, -math.pi], dtype=dtype) + unit * torch.tensor(
        [1.4, 3.0, 2 * math.pi], dtype=dtype
    )


def test_drag_thrust_is_4_737_f2_sin2_a():
    u = commands(100)
    thrust = Drag().thrust(u[:, 0], u[:, 1])
    torch.testing.assert_close(thrust, 4.737 * u[:, 1] ** 2 * torch.sin(u[:, 0]) ** 2, rtol=1e-4, atol=0.0)
    printed = 2 * 1000 * 0.15 * 0.02 * 0.1**2 * (2 * math.pi * u[:, 1]) ** 2 * (1 - torch.cos(2 * u[:, 0]))
    torch.testing.assert_close(thrust, printed, rtol=1e-12, atol=1e-12)


def test_lighthill_thrust_is_the_formula_with_the_bessel_function():
    u = commands(100)
    mass = math.pi / 4 * 1000 * 0.10**2
    amplitude, frequency = u[:, 0].numpy(), u[:, 1].numpy()
    expected = 0.5 * mass * 0.20**2 * (2 * math.pi * frequency) ** 2 * amplitude * j1(amplitude)
    np.testing.assert_allclose(Lighthill().thrust(u[:, 0], u[:, 1]).numpy(), expected, rtol=1e-13)
    # At small angles about 3.10 (A f)^2 N.
    small = Lighthill().thrust(torch.tensor(0.01), torch.tensor(1.0)).item()
    assert small == pytest.approx(3.10e-4, rel=1e-3)


def test_bessel_series_is_exact_where_it_says():
    x = torch.linspace(-4, 4, 2001, dtype=torch.float64)
    np.testing.assert_allclose(bessel_j1(x).numpy(), j1(x.numpy()), atol=2e-15)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_force_points_where_the_zero_direction_points_and_never_along_the_shaft(model):
    u = commands(200)
    force = model.force(u)
    assert not force[:, 0].any()
    torch.testing.assert_close(torch.atan2(force[:, 2], force[:, 1]), u[:, 2])
    torch.testing.assert_close(force.norm(dim=-1), model.thrust(u[:, 0], u[:, 1]))


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_gradients_agree_with_differences_once_and_twice(model):
    u = commands(5).requires_grad_()
    assert torch.autograd.gradcheck(model.force, u)
    assert torch.autograd.gradgradcheck(model.force, u)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_float32_and_any_batch_shape(model):
    u = commands(24)
    force = model.force(u.float())
    assert force.dtype == torch.float32
    torch.testing.assert_close(force.double(), model.force(u), rtol=1e-5, atol=1e-5)
    torch.testing.assert_close(model.force(u.reshape(2, 3, 4, 3)), model.force(u).reshape(2, 3, 4, 3))


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_thrust_grows_with_amplitude_and_with_the_square_of_frequency(model):
    amplitude = torch.linspace(0.0, math.pi / 2, 50, dtype=torch.float64)
    thrust = model.thrust(amplitude, torch.ones_like(amplitude))
    assert thrust[0] == 0.0 and (thrust.diff() > 0).all()
    torch.testing.assert_close(model.thrust(amplitude, torch.full_like(amplitude, 3.0)), 9.0 * thrust)


def test_models_are_made_from_their_description():
    made = make_fin_model(FinModelSpec("drag", (("area", 0.04),)))
    u = commands(3)
    torch.testing.assert_close(made.force(u), 2.0 * Drag().force(u))
    torch.testing.assert_close(make_fin_model(FinModelSpec("lighthill")).force(u), Lighthill().force(u))
    assert {make_fin_model(FinModelSpec(name)).name for name in MODEL_DEFAULTS if name != "table"} == {
        "drag",
        "lighthill",
    }
