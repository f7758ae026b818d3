"""Changes of what a layout says of the body. Each takes a layout and returns another one."""

from collections.abc import Callable
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
from finlab.errors import FinlabError
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
"""Fields of `Body` that a simulation takes."""
DIGITS = 4
"""Significant digits of an estimate."""


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


def estimated(layout: Layout, what: str) -> Layout:
    """The layout with an estimate from its hull: `what` is a key of `ESTIMATES`.

    Raises:
        FinlabError: the hull encloses nothing, or the inertia is asked for without a mass.
    """
    chosen(what, "estimate", ESTIMATES)
    solid, density = solid_of(hull_of(layout)), water_density(layout)
    return with_dynamics(layout, **ESTIMATES[what](solid, density, layout.body or Body()))


def _mass(solid: HullSolid, density: float, _body: Body) -> dict[str, Any]:
    return {"mass_kg": rounded(density * solid.volume), "buoyancy_n": None}


def _inertia(solid: HullSolid, _density: float, body: Body) -> dict[str, Any]:
    if body.mass_kg is None:
        raise FinlabError("the inertia of the hull needs the mass; give it first, or estimate it, too")
    return {"inertia_kgm2": tuple(map(rounded, solid.inertia(body.mass_kg)))}


def _added_mass(solid: HullSolid, density: float, _body: Body) -> dict[str, Any]:
    return {"added_mass": tuple(map(rounded, ellipsoid_added_mass(solid.ellipsoid(), density)))}


def _damping(solid: HullSolid, density: float, _body: Body) -> dict[str, Any]:
    return {
        "linear_damping": tuple(map(rounded, friction_damping(solid, density=density))),
        "quadratic_damping": tuple(map(rounded, pressure_damping(solid.ellipsoid(), density))),
    }


def _buoyancy(solid: HullSolid, density: float, _body: Body) -> dict[str, Any]:
    x, y, z = (round(value, 4) + 0.0 for value in solid.center)
    return {
        "buoyancy_n": rounded(density * GRAVITY * solid.volume),
        "center_of_buoyancy_m": (x, y, z),
    }


def _all(solid: HullSolid, density: float, body: Body) -> dict[str, Any]:
    """All that is not known yet of the mass, and the rest."""
    mass = {} if body.mass_kg is not None else _mass(solid, density, body)
    heavy = replace(body, **mass)
    parts = (_inertia, _added_mass, _damping, _buoyancy)
    found = {key: value for part in parts for key, value in part(solid, density, heavy).items()}
    if mass:
        found["buoyancy_n"] = None  # neutral, whatever the last digit
    return {**mass, **found}


ESTIMATES: dict[str, Callable[[HullSolid, float, Body], dict[str, Any]]] = {
    "mass": _mass,
    "inertia": _inertia,
    "added mass": _added_mass,
    "damping": _damping,
    "buoyancy": _buoyancy,
    "all": _all,
}
"""What can be estimated from a hull."""


def rounded(value: float) -> float:
    """A number with as many digits as an estimate deserves."""
    return float(f"{value:.{DIGITS}g}")
