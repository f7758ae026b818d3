"""The hull and the mass, drag and buoyancy of the robot that carries the fins. All of it is optional.

Allocation needs none of this; the app draws the hull, and a simulation takes the dynamics. Derivatives are
given as positive magnitudes on the diagonal, in the order surge, sway, heave, roll, pitch, yaw; a diagonal
is the same in FLU and in the NED frame of most publications, because turning about x by half a turn only
flips signs in pairs.
"""

from dataclasses import dataclass, fields
from pathlib import Path

from finlab.errors import LayoutError
from finlab.layout.rules import number, numbers, text

HULL_SHAPES = ("box", "ellipsoid", "torpedo", "ucat")
"""Parametric hulls that can be drawn without a mesh file."""

MESH_SUFFIXES = (".stl", ".obj", ".glb", ".ply")
"""Mesh files a hull may name."""


@dataclass(frozen=True)
class Hull:
    """The hull's looks: a parametric shape with a size, or a mesh file. Checked on construction."""

    shape: str | None = None
    """One of `HULL_SHAPES`; None when a mesh is given."""
    size_m: tuple[float, ...] | None = None
    """Length (x), width (y), height (z) [m] of a parametric shape; None when a mesh is given."""
    mesh: str | None = None
    """Path of a mesh file, absolute once loaded from a layout file; None when a shape is given."""
    scale: float = 1.0
    """Metres per unit of the mesh file (0.001 for millimetres)."""
    center_m: tuple[float, ...] = (0.0, 0.0, 0.0)
    """The hull's centre as seen from the centre of gravity, body frame [m]."""

    def __post_init__(self) -> None:
        if (self.shape is None) == (self.mesh is None):
            raise LayoutError("give either a shape with its size_m, or a mesh, not both or neither")
        if self.shape is not None:
            if self.shape not in HULL_SHAPES:
                raise LayoutError(
                    f"expected one of {', '.join(HULL_SHAPES)}, got {self.shape!r:.60}", "shape"
                )
            if self.size_m is None:
                raise LayoutError("required key is missing beside shape", "size_m")
            object.__setattr__(self, "size_m", numbers(self.size_m, "size_m", 3, 0.01, 20.0))
        else:
            if self.size_m is not None:
                raise LayoutError("a mesh has its own size; use scale instead", "size_m")
            mesh = text(self.mesh, "mesh", 4096)
            if Path(mesh).suffix.lower() not in MESH_SUFFIXES:
                raise LayoutError(f"expected a {', '.join(MESH_SUFFIXES)} file, got {mesh[-40:]!r}", "mesh")
        object.__setattr__(self, "scale", number(self.scale, "scale", high=1e4, positive=True))
        object.__setattr__(self, "center_m", numbers(self.center_m, "center_m", 3, -20.0, 20.0))


@dataclass(frozen=True)
class Body:
    """Hull, mass and hydrodynamics, each None where the layout does not say. Checked on construction."""

    hull: Hull | None = None
    """What the hull looks like."""
    mass_kg: float | None = None
    """Mass [kg], above 0."""
    inertia_kgm2: tuple[float, ...] | None = None
    """Moments of inertia about x, y, z through the centre of gravity [kg m^2], each above 0."""
    added_mass: tuple[float, ...] | None = None
    """Added mass, 3 in [kg] then 3 in [kg m^2], each at least 0."""
    linear_damping: tuple[float, ...] | None = None
    """Damping per speed, 3 in [N s/m] then 3 in [N m s], each at least 0."""
    quadratic_damping: tuple[float, ...] | None = None
    """Damping per speed times its magnitude, 3 in [N s^2/m^2] then 3 in [N m s^2], each at least 0."""
    center_of_buoyancy_m: tuple[float, ...] | None = None
    """Centre of buoyancy as seen from the centre of gravity, body frame [m]."""
    buoyancy_n: float | None = None
    """Buoyant force when submerged [N], at least 0; None means neutral, equal to the weight."""

    def __post_init__(self) -> None:
        if self.mass_kg is not None:
            object.__setattr__(self, "mass_kg", number(self.mass_kg, "mass_kg", high=1e6, positive=True))
        if self.buoyancy_n is not None:
            object.__setattr__(self, "buoyancy_n", number(self.buoyancy_n, "buoyancy_n", 0.0, 1e7))
        sizes = {"inertia_kgm2": 3, "added_mass": 6, "linear_damping": 6, "quadratic_damping": 6}
        for key, count in sizes.items():
            if getattr(self, key) is not None:
                object.__setattr__(self, key, numbers(getattr(self, key), key, count, 0.0, 1e7))
        for i, moment in enumerate(self.inertia_kgm2 or ()):
            number(moment, f"inertia_kgm2[{i}]", positive=True)
        if self.center_of_buoyancy_m is not None:
            point = numbers(self.center_of_buoyancy_m, "center_of_buoyancy_m", 3, -20.0, 20.0)
            object.__setattr__(self, "center_of_buoyancy_m", point)


HULL_KEYS = tuple(field.name for field in fields(Hull))
"""Keys of `body.hull` in a layout file."""

BODY_KEYS = tuple(field.name for field in fields(Body))
"""Keys of `body` in a layout file."""
