"""What a hull says of the body: mass, inertia, added mass, damping and buoyancy, as first estimates."""

from dataclasses import replace
from functools import lru_cache

from finlab.hull.hydrodynamics import (
    WATER,
    HullSolid,
    ellipsoid_added_mass,
    friction_damping,
    pressure_damping,
)
from finlab.hull.surface import Surface, hull_of
from finlab.layout import Body, Layout
from finlab.vehicle.body import GRAVITY

DIGITS = 4
"""Digits that an estimate deserves."""
DOUBTFUL = 0.1
"""Share of the water in the hull's place by which a body may be heavier or lighter."""


def water_density(layout: Layout) -> float:
    """Density of the water that the fins count with [kg/m^3]; fresh water where none says it."""
    given = (fin.model.values().get("density") for fin in layout.fins)
    return next((float(value) for value in given if value is not None), WATER)


@lru_cache(maxsize=8)
def solid_of(hull: Surface) -> HullSolid:
    """The body that a hull encloses, body frame.

    Raises:
        FinlabError: it encloses nothing.
    """
    return HullSolid.of(hull.mesh.vertices[hull.mesh.faces])


def displaced(layout: Layout) -> float:
    """Water in the hull's place [kg]."""
    return water_density(layout) * solid_of(hull_of(layout)).volume


def lift_of(body: Body) -> float:
    """The buoyant force [N]; that of a neutral robot where none is given."""
    return (body.mass_kg or 0.0) * GRAVITY if body.buoyancy_n is None else body.buoyancy_n


def contradicts(layout: Layout) -> bool:
    """Whether the body's mass is known, and its buoyancy is not that of the hull."""
    body, water = layout.body or Body(), displaced(layout)
    return body.mass_kg is not None and abs(lift_of(body) / GRAVITY - water) > DOUBTFUL * water


def estimated(layout: Layout) -> Layout:
    """The layout with what its hull says of the body; a mass that is known stays.

    Raises:
        FinlabError: the hull encloses nothing.
    """
    solid, density, body = solid_of(hull_of(layout)), water_density(layout), layout.body or Body()
    mass = body.mass_kg if body.mass_kg is not None else _rounded(density * solid.volume)
    changed = replace(
        body,
        mass_kg=mass,
        inertia_kgm2=tuple(map(_rounded, solid.inertia(mass))),
        added_mass=tuple(map(_rounded, ellipsoid_added_mass(solid.ellipsoid(), density))),
        linear_damping=tuple(map(_rounded, friction_damping(solid, density=density))),
        quadratic_damping=tuple(map(_rounded, pressure_damping(solid.ellipsoid(), density))),
        # Neutral where the mass is that of the water, whatever the last digit.
        buoyancy_n=None if body.mass_kg is None else _rounded(density * GRAVITY * solid.volume),
        center_of_buoyancy_m=tuple(round(value, 4) + 0.0 for value in solid.center),
    )
    return replace(layout, body=changed)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
