"""The body of a robot as its layout describes it: hull, mass, drag and buoyancy, all optional.

Allocation needs none of this; the app draws the hull, and `finlab.swim.vehicle` simulates the
dynamics. Hydrodynamic derivatives are positive magnitudes on the diagonal, in the order surge,
sway, heave, roll, pitch, yaw. A diagonal is the same in FLU and in the NED frame of most
publications, because half a turn about x only flips signs in pairs.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from msgspec import Meta

from finlab.errors import LayoutError
from finlab.files.schema import Checked

HULL_SHAPES = ("box", "ellipsoid", "torpedo", "ucat")
"""Parametric hulls that can be drawn without a mesh file."""
if TYPE_CHECKING:  # mypy takes no tuple of names for a `Literal`
    HullShape = str
else:
    HullShape = Literal[HULL_SHAPES]

MESH_SUFFIXES = (".stl", ".obj", ".glb", ".ply")
"""Ends of the names of mesh files that a hull may name."""

# Bounds of the numbers in a file: far beyond any robot of this kind, they catch a wrong unit.
Length = Annotated[float, Meta(ge=0.01, le=1000.0)]
"""A length of a hull [m]."""
Coordinate = Annotated[float, Meta(ge=-1000.0, le=1000.0)]
"""A component of a point, body frame [m]."""
Mass = Annotated[float, Meta(ge=1e-3, le=1e9)]
"""A mass [kg]."""
InertiaMoment = Annotated[float, Meta(ge=1e-9, le=1e13)]
"""A moment of inertia [kg m^2]."""
Coefficient = Annotated[float, Meta(ge=0.0, le=1e13)]
"""A hydrodynamic derivative, in the unit of its key, or a buoyant force [N]."""
PerAxis = Meta(min_length=3, max_length=3)
"""One number for each of x, y and z."""
PerDegreeOfFreedom = Meta(min_length=6, max_length=6)
"""One number for each of surge, sway, heave, roll, pitch and yaw."""


@dataclass(frozen=True)
class Hull(Checked):
    """The hull's looks: a parametric shape with a size, or a mesh file. Checked on construction.

    Raises:
        LayoutError: a value is out of bounds, or there is not exactly one of a shape with a size
            and a mesh; the message names the argument.
    """

    shape: HullShape | None = None
    """One of `HULL_SHAPES`; None when a mesh is given."""
    size_m: Annotated[tuple[Length, ...], PerAxis] | None = None
    """Length (x), width (y), height (z) [m] of a parametric shape; None when a mesh is given."""
    mesh: Annotated[str, Meta(min_length=1, max_length=4096)] | None = None
    """Path of a mesh file, absolute once loaded from a layout file; None when a shape is given."""
    scale: Annotated[float, Meta(ge=1e-6, le=1e4)] = 1.0
    """Metres per unit of the mesh file (0.001 for millimetres)."""
    center_m: Annotated[tuple[Coordinate, ...], PerAxis] = (0.0, 0.0, 0.0)
    """The hull's centre as seen from the centre of gravity, body frame [m]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.shape is None) == (self.mesh is None):
            raise LayoutError("give either a shape with its size_m, or a mesh, not both or neither")
        if self.shape is not None and self.size_m is None:
            raise LayoutError("required key is missing beside shape", "size_m")
        if self.mesh is not None and self.size_m is not None:
            raise LayoutError("a mesh has its own size; use scale instead", "size_m")
        if self.mesh is not None and Path(self.mesh).suffix.lower() not in MESH_SUFFIXES:
            raise LayoutError(
                f"expected a {', '.join(MESH_SUFFIXES)} file, got {self.mesh[-40:]!r}", "mesh"
            )


@dataclass(frozen=True)
class Body(Checked):
    """Hull, mass and hydrodynamics, each None where the layout does not say. Checked on
    construction.

    Raises:
        LayoutError: a value is out of bounds; the message names the argument.
    """

    hull: Hull | None = None
    """What the hull looks like."""
    mass_kg: Mass | None = None
    """Mass [kg]."""
    inertia_kgm2: Annotated[tuple[InertiaMoment, ...], PerAxis] | None = None
    """Moments of inertia about x, y, z through the centre of gravity [kg m^2]."""
    added_mass: Annotated[tuple[Coefficient, ...], PerDegreeOfFreedom] | None = None
    """Added mass of the water that moves with the body, 3 in [kg] then 3 in [kg m^2]."""
    linear_damping: Annotated[tuple[Coefficient, ...], PerDegreeOfFreedom] | None = None
    """Damping per speed, 3 in [N s/m] then 3 in [N m s]."""
    quadratic_damping: Annotated[tuple[Coefficient, ...], PerDegreeOfFreedom] | None = None
    """Damping per speed times its magnitude, 3 in [N s^2/m^2] then 3 in [N m s^2]."""
    center_of_buoyancy_m: Annotated[tuple[Coordinate, ...], PerAxis] | None = None
    """Centre of buoyancy as seen from the centre of gravity, body frame [m]."""
    buoyancy_n: Coefficient | None = None
    """Buoyant force when submerged [N]; None means neutral, equal to the weight."""
