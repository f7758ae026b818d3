"""What a vehicle weighs, drags and displaces: read from a layout's body, U-CAT's where it does not say.

U-CAT's own numbers, each with its source, stand in the shipped layout file `ucat.yaml` and nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from finlab.assets import layouts_dir
from finlab.layout import Body, Layout, load_layout

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""
SIX_ZEROS = (0.0,) * 6


@dataclass(frozen=True)
class VehicleParameters:
    """Rigid body and hydrodynamics in the body frame (FLU), origin at the centre of gravity."""

    mass: float
    """Mass [kg]."""
    inertia: tuple[float, ...]
    """Moments of inertia about x, y, z (3,) [kg m^2]."""
    added_mass: tuple[float, ...] = SIX_ZEROS
    """Diagonal of the added mass (6,) [kg, kg m^2], at least 0."""
    linear_damping: tuple[float, ...] = SIX_ZEROS
    """Diagonal of the linear damping (6,) [N s/m, N m s], at least 0."""
    quadratic_damping: tuple[float, ...] = SIX_ZEROS
    """Diagonal of the quadratic damping (6,) [N s^2/m^2, N m s^2], at least 0."""
    center_of_buoyancy: tuple[float, ...] = (0.0, 0.0, 0.0)
    """Where buoyancy acts (3,) [m]."""
    buoyancy: float | None = None
    """Buoyant force [N]; None is neutral, equal to the weight."""

    @property
    def weight(self) -> float:
        """Weight [N]."""
        return self.mass * GRAVITY

    @property
    def lift(self) -> float:
        """Buoyant force [N]."""
        return self.weight if self.buoyancy is None else self.buoyancy


@cache
def ucat_body() -> Body:
    """The body of the shipped layout `ucat`."""
    body = load_layout(layouts_dir() / "ucat.yaml").body
    assert body is not None
    return body


def vehicle_parameters(layout: Layout) -> VehicleParameters:
    """The parameters of a robot; what its layout leaves out is U-CAT's."""
    own, other = layout.body, ucat_body()

    def pick(name: str) -> tuple[float, ...]:
        value = getattr(own, name, None)
        return tuple(getattr(other, name) if value is None else value)

    mass = own.mass_kg if own is not None and own.mass_kg is not None else other.mass_kg
    assert mass is not None
    return VehicleParameters(
        mass=mass,
        inertia=pick("inertia_kgm2"),
        added_mass=pick("added_mass"),
        linear_damping=pick("linear_damping"),
        quadratic_damping=pick("quadratic_damping"),
        center_of_buoyancy=pick("center_of_buoyancy_m"),
        buoyancy=own.buoyancy_n if own is not None else other.buoyancy_n,
    )
