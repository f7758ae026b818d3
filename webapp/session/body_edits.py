"""Changes of what a layout says of the body. Each takes a layout and returns another one."""

from dataclasses import replace
from functools import lru_cache
from typing import Any

from finlab.analysis.hull_hydrodynamics import (
    WATER,
    HullSolid,
    ellipsoid_added_mass,
    friction_damping,
    pressure_damping,
)
from finlab.layout import Body, Layout
from finlab.vehicle.body import GRAVITY
from webapp.scene.meshes.hull import AnyHull, hull_of
from webapp.session.state import chosen

DYNAMICS = (
    "mass_kg",
    "inertia_kgm2",
    "added_mass",
    "linear_damping",
    "quadratic_damping",
    "center_of_buoyancy_m",
    "buoyancy_n",
)
DIGITS = 4
DOUBTFUL = 0.1
"""Share of the water in the hull's place by which a body may be heavier or lighter."""


def with_dynamics(layout: Layout, **values: Any) -> Layout:
    """The layout with other fields of `DYNAMICS`; None forgets one.

    Raises:
        FinlabError: there is no such field, or not with this value.
    """
    for key in values:
        chosen(key, "field of the body", DYNAMICS)
    return replace(layout, body=replace(layout.body or Body(), **values))


def described(layout: Layout, name: str, description: str) -> Layout:
    """The layout with another name and description, without outer blanks.

    Raises:
        LayoutError: it is none, or too long.
    """
    return replace(layout, name=name.strip(), description=description.strip())


def water_density(layout: Layout) -> float:
    """Density of the water that the fins count with [kg/m^3]; fresh water where none says it."""
    given = (fin.model.values().get("density") for fin in layout.fins)
    return next((float(value) for value in given if value is not None), WATER)


@lru_cache(maxsize=8)
def solid_of(hull: AnyHull) -> HullSolid:
    """The body that a hull encloses, body frame.

    Raises:
        FinlabError: it encloses nothing.
    """
    mesh = hull.mesh()
    return HullSolid.of(mesh.vertices[mesh.faces])


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
    mass = body.mass_kg if body.mass_kg is not None else rounded(density * solid.volume)
    return with_dynamics(
        layout,
        mass_kg=mass,
        inertia_kgm2=tuple(map(rounded, solid.inertia(mass))),
        added_mass=tuple(map(rounded, ellipsoid_added_mass(solid.ellipsoid(), density))),
        linear_damping=tuple(map(rounded, friction_damping(solid, density=density))),
        quadratic_damping=tuple(map(rounded, pressure_damping(solid.ellipsoid(), density))),
        # Neutral where the mass is that of the water, whatever the last digit.
        buoyancy_n=None if body.mass_kg is None else rounded(density * GRAVITY * solid.volume),
        center_of_buoyancy_m=tuple(round(value, 4) + 0.0 for value in solid.center),
    )


def rounded(value: float) -> float:
    """A number with as many digits as an estimate deserves."""
    return float(f"{value:.{DIGITS}g}")
