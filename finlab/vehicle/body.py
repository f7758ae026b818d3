"""What the body of a robot is, where its layout does not say everything."""

from dataclasses import fields, replace
from functools import cache

from finlab.errors import LayoutError
from finlab.layout import Body, Layout, load_layout
from finlab.vehicle.fossen import Dynamics

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""


@cache
def ucat_body() -> Body:
    """The body of the shipped layout `ucat`, where U-CAT's numbers stand, each with its source."""
    body = load_layout("ucat").body
    assert body is not None
    return body


def complete_body(layout: Layout) -> Body:
    """The body of a robot; what its layout leaves out is U-CAT's, but for buoyancy, which is then neutral."""
    if layout.body is None:
        return ucat_body()
    said = {field.name: getattr(layout.body, field.name) for field in fields(Body)}
    given = {name: value for name, value in said.items() if value is not None}
    return replace(ucat_body(), **{"buoyancy_n": None, **given})


def dynamics_of(body: Body) -> Dynamics[tuple[float, ...], float]:
    """The numbers of a body in the equations of motion; what it does not say is zero, buoyancy the weight.

    Raises:
        LayoutError: the body has no mass or no inertia.
    """
    if body.mass_kg is None or body.inertia_kgm2 is None:
        raise LayoutError("a vehicle needs a body with mass_kg and inertia_kgm2")
    zeros = (0.0,) * 6
    own = (*(body.mass_kg,) * 3, *body.inertia_kgm2)
    weight = body.mass_kg * GRAVITY
    return Dynamics(
        inertia=tuple(a + b for a, b in zip(own, body.added_mass or zeros, strict=True)),
        linear=tuple(body.linear_damping or zeros),
        quadratic=tuple(body.quadratic_damping or zeros),
        weight=weight,
        lift=weight if body.buoyancy_n is None else body.buoyancy_n,
        center=tuple(body.center_of_buoyancy_m or (0.0, 0.0, 0.0)),
    )
