"""Changes of what a layout says of the body. Each takes a layout and returns another one."""

from dataclasses import replace
from typing import Any

from finlab.layout import Body, Layout
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
