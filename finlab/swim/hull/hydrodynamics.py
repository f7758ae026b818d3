"""First estimates of a robot's dynamics from its hull: mass, inertia, added mass, damping,
buoyancy.

Every figure is that of a simple body: a solid of one density, or the ellipsoid that stands for the
hull. They are where a design starts; a swim (`finlab fit robot`) tells the truth. Order of six:
surge, sway, heave, roll, pitch, yaw.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import elliprd
from trimesh.triangles import area, mass_properties

from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.layout import Body, Layout
from finlab.swim.hull.surface import Surface, hull_of
from finlab.swim.vehicle.fossen import GRAVITY

WATER = 1000.0
"""Density of fresh water [kg/m^3]."""
VISCOSITY = 1.0e-6
"""Kinematic viscosity of water at 20 degrees [m^2/s]."""
DESIGN_SPEED = 0.2
"""Speed at which friction is made linear [m/s]: that of a robot with fins at work."""
SPHERE_DRAG = 0.44
"""Drag coefficient of a sphere's pressure."""
DISC_DRAG = 1.17
"""Drag coefficient of a disc across the flow, which nothing exceeds."""


@dataclass(frozen=True, eq=False)
class HullSolid:
    """The body that a closed surface encloses, in the frame of its corners."""

    volume: float
    """[m^3]."""
    center: Array
    """Centre of the volume (3,), where buoyancy acts [m]."""
    moments: Array
    """Mean squares of x, y and z (3,) about that centre [m^2]."""
    area: float
    """Wetted surface [m^2]."""
    surface_moments: Array
    """Mean squares of x, y and z (3,) over that surface about the centre [m^2]."""

    @staticmethod
    def of(corners: ArrayLike) -> "HullSolid":
        """The solid in a closed surface of triangles (F, 3, 3) [m]. Raises FinlabError: it encloses
        nothing."""
        points = np.asarray(corners, dtype=float)
        solid = mass_properties(points)
        volume = float(solid.volume)
        inertia = np.diag(np.asarray(solid.inertia))
        if not volume > 1e-9:
            raise FinlabError(
                f"the hull encloses {volume:.3g} m^3; expected a closed surface, outside out"
            )
        sizes = area(points)
        local = points - solid.center_mass
        spread = ((local**2).sum(axis=1) + local.sum(axis=1) ** 2) / 12.0
        moments = (0.5 * inertia.sum() - inertia) / volume
        wetted = float(sizes.sum())
        return HullSolid(volume, solid.center_mass, moments, wetted, sizes @ spread / wetted)

    def inertia(self, mass: float) -> Array:
        """Moments of inertia (3,) [kg m^2] about the centre of the volume of a solid of this mass
        [kg] and of one density: m (y^2 + z^2) and so on, in the mean over the volume."""
        return np.asarray(mass * (self.moments.sum() - self.moments))

    def ellipsoid(self) -> Array:
        """Half axes (3,) [m] of the ellipsoid that stands for the hull: of its volume, its axes to
        each other as the hull spreads along x, y and z. For an ellipsoid it is the hull itself."""
        spread = np.sqrt(self.moments)
        size = (self.volume / (4.0 / 3.0 * math.pi * spread.prod())) ** (1.0 / 3.0)
        return np.asarray(size * spread)


def ellipsoid_added_mass(half: ArrayLike, density: float = WATER) -> Array:
    """Added mass [kg] and added inertia [kg m^2] (6,) of an ellipsoid in unbounded ideal fluid.

    H. Lamb, Hydrodynamics, 6th ed. (1932), art. 114 and 115; the integrals alpha_0, beta_0, gamma_0
    are Carlson's R_D. A sphere has half of its displaced mass, and none that turns with it.

    Args:
        half: half axes (3,) along x, y and z [m].
        density: of the water [kg/m^3].
    """
    squares = np.square(half)
    product = math.sqrt(squares.prod())
    volume = 4.0 / 3.0 * math.pi * product
    R_D = [float(elliprd(squares[k - 2], squares[k - 1], squares[k])) for k in range(3)]
    alpha = 2.0 / 3.0 * product * np.array(R_D)  # alpha_0, beta_0, gamma_0
    along = alpha / (2.0 - alpha)
    about = []
    for axis in range(3):
        # About x: (b^2 - c^2)^2 (gamma_0 - beta_0) / (2 (b^2 - c^2) - (b^2 + c^2)
        # (gamma_0 - beta_0)) / 5, and so on.
        second, third = np.delete(np.arange(3), axis)
        difference = squares[second] - squares[third]
        total = squares[second] + squares[third]
        alpha_difference = alpha[third] - alpha[second]
        denominator = 2.0 * difference - total * alpha_difference
        # Round about the axis, nothing is pushed aside; the quotient would be zero over zero.
        is_round = abs(difference) < 1e-9 * total
        about.append(0.0 if is_round else difference**2 * alpha_difference / denominator / 5.0)
    return density * volume * np.append(along, about)


def pressure_damping(half: Array, density: float = WATER) -> Array:
    """Quadratic damping (6,) [N s^2/m^2], then [N m s^2], of an ellipsoid of half axes (3,) [m]:
    the pressure that is lost where the flow leaves a blunt stern.

    Along an axis 1/2 rho C A with C = 0.44 d / l, S. F. Hoerner, Fluid-Dynamic Drag (1965), chapter
    3 (bodies below the critical Reynolds number; 0.44 is the sphere), at most that of a disc across
    the flow, 1.17. l is the length along the flow, d = 2 sqrt(b c) across it. About an axis by
    strips, each in its own cross- flow (T. I. Fossen, Handbook of Marine Craft Hydrodynamics and
    Motion Control, 2nd ed., section 6.4): 1/2 rho C int |x|^3 2 h(x) dx. The round core, which
    turns without pushing water aside, is left out, so that a sphere has none."""
    areas = np.array([np.delete(half, axis).prod() for axis in range(3)])
    along = np.minimum(DISC_DRAG, SPHERE_DRAG * np.sqrt(areas) / half)
    about = []
    for axis in range(3):
        far, near = sorted({0, 1, 2} - {axis}, key=lambda k: -half[k])
        # int over the strip of |x|^3 2 h sqrt(1 - x^2 / a^2) dx = 8/15 h a^4
        strips = 8.0 / 15.0 * half[axis] * (half[far] ** 4 - half[near] ** 4)
        about.append(along[near] * strips)
    return 0.5 * density * np.append(math.pi * along * areas, about)


def friction_damping(
    solid: HullSolid, speed: float = DESIGN_SPEED, density: float = WATER
) -> Array:
    """Linear damping (6,) [N s/m], then [N m s], by the water's friction on the hull at a speed
    [m/s].

    1/2 rho C_f S U per speed with C_f = 1.328 / sqrt(Re) of a flat plate in laminar flow (H.
    Blasius, 1908), Re by the length of the ellipsoid; about an axis each bit of the surface counts
    with the square of its distance."""
    length = 2.0 * max(solid.ellipsoid())
    coefficient = 1.328 / math.sqrt(speed * length / VISCOSITY)
    per_speed = 0.5 * density * coefficient * solid.area * speed
    return per_speed * np.append(np.ones(3), solid.surface_moments.sum() - solid.surface_moments)


DIGITS = 4
"""Digits that an estimate deserves."""
DOUBTFUL = 0.1
"""Share of the water in the hull's place by which a body may be heavier or lighter."""


def water_density(layout: Layout) -> float:
    """Density of the water that the fins count with [kg/m^3]; fresh water where none says it."""
    densities = (fin.model.values().get("density") for fin in layout.fins)
    return next((float(value) for value in densities if value is not None), WATER)


@lru_cache(maxsize=8)
def solid_of(hull: Surface) -> HullSolid:
    """The body that a hull encloses, body frame. Raises FinlabError: it encloses nothing."""
    return HullSolid.of(hull.mesh.vertices[hull.mesh.faces])


def displaced(layout: Layout) -> float:
    """Returns the mass of the water in the hull's place [kg]. Raises FinlabError: the hull encloses
    nothing."""
    return water_density(layout) * solid_of(hull_of(layout)).volume


def lift_of(body: Body) -> float:
    """Returns the buoyant force [N]: the weight where none is given, 0 where no mass is known
    either."""
    return (body.mass_kg or 0.0) * GRAVITY if body.buoyancy_n is None else body.buoyancy_n


def contradicts(layout: Layout) -> bool:
    """Says whether the body's mass is known, and its buoyancy differs by more than a tenth from
    that of the hull. Raises FinlabError: the hull encloses nothing."""
    body = layout.body or Body()
    water = displaced(layout)
    return body.mass_kg is not None and abs(lift_of(body) / GRAVITY - water) > DOUBTFUL * water


def estimated(layout: Layout) -> Layout:
    """Returns the layout with what its hull says of the body, to four digits; a mass that is known
    stays. Raises FinlabError: the hull encloses nothing."""
    solid = solid_of(hull_of(layout))
    density = water_density(layout)
    body = layout.body or Body()
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
        center_of_buoyancy_m=tuple(round(value, 4) + 0.0 for value in solid.center.tolist()),
    )
    return replace(layout, body=changed)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
