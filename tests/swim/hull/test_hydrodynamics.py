"""Estimates from a hull's shape against closed forms: box, sphere, spheroids."""

import math

import numpy as np
import pytest
import trimesh

from finlab.swim.hull.hydrodynamics import (
    HullSolid,
    ellipsoid_added_mass,
    friction_damping,
    pressure_damping,
)


def box_triangles(
    size: tuple[float, float, float], center: tuple[float, float, float] = (0, 0, 0)
) -> np.ndarray:
    """Triangles (N, 3, 3) of a box of a size [m]."""
    mesh = trimesh.creation.box(size)
    return np.asarray(mesh.vertices[mesh.faces] + np.array(center))


def spheroid_triangles(radii: tuple[float, float, float]) -> np.ndarray:
    """Triangles (N, 3, 3) of an ellipsoid with three radii [m]."""
    mesh = trimesh.creation.icosphere(subdivisions=5)
    return np.asarray((mesh.vertices * np.array(radii))[mesh.faces])


def test_a_box_has_the_inertia_of_every_textbook_wherever_it_stands() -> None:
    solid = HullSolid.of(box_triangles((0.6, 0.3, 0.2), (1.0, -2.0, 0.5)))
    assert solid.volume == pytest.approx(0.036)
    assert solid.center == pytest.approx((1.0, -2.0, 0.5))
    assert solid.inertia(12.0) == pytest.approx((0.09 + 0.04, 0.04 + 0.36, 0.36 + 0.09))
    assert solid.area == pytest.approx(2 * (0.18 + 0.12 + 0.06))
    # Faces at x = +-0.3 have x^2 = 0.09, all others 0.36 / 12 in the mean.
    assert solid.surface_moments[0] == pytest.approx((0.12 * 0.09 + 0.6 * 0.03) / 0.72)


def test_an_ellipsoid_stands_for_itself() -> None:
    solid = HullSolid.of(spheroid_triangles((0.3, 0.15, 0.1)))
    assert solid.ellipsoid() == pytest.approx((0.3, 0.15, 0.1), rel=2e-3)
    assert solid.inertia(5.0)[0] == pytest.approx(5.0 / 5 * (0.15**2 + 0.1**2), rel=4e-3)


def test_a_sphere_carries_half_of_its_displaced_mass_and_none_around() -> None:
    mass = ellipsoid_added_mass((0.2, 0.2, 0.2), 1025.0)
    assert mass[:3] == pytest.approx((0.5 * 1025.0 * 4 / 3 * math.pi * 0.2**3,) * 3)
    assert not mass[3:].any()


@pytest.mark.parametrize("slenderness", [1.0001, 1.5, 3.0, 10.0])
def test_prolate_spheroids_by_lambs_closed_forms(slenderness: float) -> None:
    b = 0.1
    a = slenderness * b
    e = math.sqrt(1 - (b / a) ** 2)
    logarithm = math.log((1 + e) / (1 - e))
    alpha = 2 * (1 - e**2) / e**3 * (0.5 * logarithm - e)
    beta = 1 / e**2 - (1 - e**2) / (2 * e**3) * logarithm
    displaced = 1000.0 * 4 / 3 * math.pi * a * b * b
    twist = e**4 * (beta - alpha) / (2 - e**2) / (2 * e**2 - (2 - e**2) * (beta - alpha))
    own = displaced / 5 * (a**2 + b**2)
    tolerance = (
        1e-3 if slenderness < 1.01 else 1e-9
    )  # the closed forms themselves cancel near the sphere
    expected = (
        displaced * alpha / (2 - alpha),
        *(displaced * beta / (2 - beta),) * 2,
        0.0,
        own * twist,
        own * twist,
    )
    assert ellipsoid_added_mass((a, b, b)) == pytest.approx(expected, rel=tolerance, abs=1e-6)


def test_a_spheres_drag_is_the_measured_one_and_none_around() -> None:
    # Re = 1e5, where a smooth sphere is measured to have C = 0.47
    radius = 0.25
    speed = 0.2
    quadratic = pressure_damping(np.full(3, radius))
    linear = friction_damping(HullSolid.of(spheroid_triangles((radius,) * 3)), speed)
    drag = quadratic[0] * speed**2 + linear[0] * speed
    assert drag / (0.5 * 1000.0 * math.pi * radius**2 * speed**2) == pytest.approx(0.47, abs=0.02)
    assert not quadratic[3:].any() and linear[3:].min() > 0.0
    assert linear[3] == pytest.approx(linear[0] * 2 / 3 * radius**2, rel=1e-2)
