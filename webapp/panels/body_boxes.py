"""Labels, hints and steps of the boxes in the inspector of the robot as a whole."""

from typing import NamedTuple


class NumberBox(NamedTuple):
    """The box of a field of `Body` that is one number."""

    label: str
    step: float
    """Between two values of its arrows."""
    hint: str


class VectorBoxes(NamedTuple):
    """Three boxes for three numbers of a field of `Body`."""

    label: str
    first: int
    """Index of the first of these numbers in the field."""
    hint: str


NUMBERS = {
    "mass_kg": NumberBox("Mass [kg]", 0.5, "From the hull: of the water that it displaces."),
    "buoyancy_n": NumberBox(
        "Buoyancy [N]", 1.0, "As much as the robot weighs where nothing is said."
    ),
}
"""Field of `Body` -> its box."""
VECTORS: dict[str, tuple[VectorBoxes, ...]] = {
    "inertia_kgm2": (
        VectorBoxes("Inertia [kg m²]", 0, "About x, y, z. From the hull: a solid of one density."),
    ),
    "added_mass": (
        VectorBoxes(
            "Added mass [kg]",
            0,
            "Along x, y, z. From the hull: its ellipsoid after Lamb, art. 114.",
        ),
        VectorBoxes(
            "turning [kg m²]",
            3,
            "About x, y, z. From the hull: its ellipsoid after Lamb, art. 115.",
        ),
    ),
    "linear_damping": (
        VectorBoxes(
            "Drag ∝ v [N s/m]", 0, "Along x, y, z. From the hull: Blasius' friction at 0.2 m/s."
        ),
        VectorBoxes("turning [N m s]", 3, "About x, y, z. From the hull: by the same friction."),
    ),
    "quadratic_damping": (
        VectorBoxes(
            "Drag ∝ v² [N s²/m²]",
            0,
            "Along x, y, z. From the hull: ½ ρ A 0.44 d/l, Hoerner's blunt bodies.",
        ),
        VectorBoxes(
            "turning [N m s²]",
            3,
            "About x, y, z. From the hull: strips in cross-flow but for the round core.",
        ),
    ),
    "center_of_buoyancy_m": (
        VectorBoxes(
            "Buoyancy at [m]", 0, "Its centre, from that of gravity; above it, it rights the robot."
        ),
    ),
}
"""Field of `Body` that is 3 or 6 numbers -> its boxes, three numbers each."""
