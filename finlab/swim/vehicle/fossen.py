"""Fossen's equations of motion in six degrees of freedom and their Jacobian, for one body or for
many.

With nu_r the velocity relative to the water (T. I. Fossen, Handbook of Marine Craft Hydrodynamics
and Motion Control, 2nd ed., chapters 6 to 8 and 10):

    M nu_r' + C(nu_r) nu_r + D(nu_r) nu_r + g = tau,   M = M_RB + M_A diagonal

The Coriolis terms are written by momenta (Kirchhoff): p = M_lin v_r, h = M_ang omega give -omega x
p and
-omega x h - v_r x p. Order of six: surge, sway, heave, roll, pitch, yaw; x forward, y left, z up.

Numbers may be plain floats, which for one body are several times faster than arrays, or arrays that
broadcast; vectors are sequences of them.
"""

from dataclasses import replace
from functools import cache
from typing import Any, Generic, NamedTuple, TypeVar

from finlab.errors import LayoutError
from finlab.layout import Body, Layout, load_layout

Vector = TypeVar("Vector")
"""A sequence of numbers: a tuple of floats, or an array whose first axis it is."""
Number = TypeVar("Number")


class Dynamics(NamedTuple, Generic[Vector, Number]):
    """The numbers of a body, or of many."""

    inertia: Vector
    """Diagonal of M (6): mass and moments with those of the water that goes along [kg, kg m^2]."""
    linear: Vector
    """Damping (6) per speed."""
    quadratic: Vector
    """Damping (6) per speed times its size."""
    weight: Number
    """[N]."""
    lift: Number
    """Buoyant force [N]."""
    center: Vector
    """Centre of buoyancy (3) as seen from the centre of gravity [m]."""


def accelerations(body: Dynamics[Any, Any], flow: Any, up: Any, wrench: Any) -> Any:
    """Returns M^-1 (tau - C nu_r - D nu_r - g), six numbers [m/s^2, rad/s^2].

    Args:
        body: its numbers.
        flow: nu_r (6), velocity through the water and rates, body frame [m/s, rad/s].
        up: the world's z axis (3) in the body frame.
        wrench: tau (6), body frame [N, N m].
    """
    u, v, w, p, q, r = flow
    mx, my, mz, ix, iy, iz = body.inertia
    px = mx * u
    py = my * v
    pz = mz * w
    hx = ix * p
    hy = iy * q
    hz = iz * r
    lin = body.linear
    quad = body.quadratic
    lift = body.lift
    net = lift - body.weight
    bx, by, bz = body.center
    ax, ay, az = up
    rx = lift * (by * az - bz * ay)
    ry = lift * (bz * ax - bx * az)
    rz = lift * (bx * ay - by * ax)
    return (
        (wrench[0] - (q * pz - r * py) - (lin[0] + quad[0] * abs(u)) * u + net * up[0]) / mx,
        (wrench[1] - (r * px - p * pz) - (lin[1] + quad[1] * abs(v)) * v + net * up[1]) / my,
        (wrench[2] - (p * py - q * px) - (lin[2] + quad[2] * abs(w)) * w + net * up[2]) / mz,
        (wrench[3] - (q * hz - r * hy) - (v * pz - w * py) - (lin[3] + quad[3] * abs(p)) * p + rx)
        / ix,
        (wrench[4] - (r * hx - p * hz) - (w * px - u * pz) - (lin[4] + quad[4] * abs(q)) * q + ry)
        / iy,
        (wrench[5] - (p * hy - q * hx) - (u * py - v * px) - (lin[5] + quad[5] * abs(r)) * r + rz)
        / iz,
    )


def jacobian(body: Dynamics[Any, Any], flow: Any) -> list[list[Any]]:
    """Returns the derivatives (6, 6) of `accelerations` by `flow`."""
    u, v, w, p, q, r = flow
    mx, my, mz, ix, iy, iz = body.inertia
    munk_x = (my - mz) / ix
    munk_y = (mz - mx) / iy
    munk_z = (mx - my) / iz
    gyro_x = (iy - iz) / ix
    gyro_y = (iz - ix) / iy
    gyro_z = (ix - iy) / iz
    dx, dy, dz, dp, dq, dr = (-slope for slope in damping_jacobian(body, flow))
    return [
        [dx, my * r / mx, -mz * q / mx, 0.0 * u, -mz * w / mx, my * v / mx],
        [-mx * r / my, dy, mz * p / my, mz * w / my, 0.0 * u, -mx * u / my],
        [mx * q / mz, -my * p / mz, dz, -my * v / mz, mx * u / mz, 0.0 * u],
        [0.0 * u, munk_x * w, munk_x * v, dp, gyro_x * r, gyro_x * q],
        [munk_y * w, 0.0 * u, munk_y * u, gyro_y * r, dq, gyro_y * p],
        [munk_z * v, munk_z * u, 0.0 * u, gyro_z * q, gyro_z * p, dr],
    ]


def damping_rates(body: Dynamics[Any, Any], flow: Any) -> list[Any]:
    """Returns the decelerations (6) by damping at `flow` (6), over that [1/s]."""
    terms = zip(body.linear, body.quadratic, flow, body.inertia, strict=True)
    return [(linear + quadratic * abs(speed)) / m for linear, quadratic, speed, m in terms]


def damping_jacobian(body: Dynamics[Any, Any], flow: Any) -> list[Any]:
    """Returns the derivatives (6) of those decelerations, each by its own speed [1/s]: minus the
    diagonal of the Jacobian. The quadratic part counts twice, as at twice the speed."""
    return damping_rates(body, [2.0 * speed for speed in flow])


GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""


@cache
def ucat_body() -> Body:
    """The body of the shipped layout `ucat`, where U-CAT's numbers stand, each with its source."""
    body = load_layout("ucat").body
    assert body is not None
    return body


def complete_body(layout: Layout) -> Body:
    """The body of a robot; what its layout leaves out is U-CAT's, but for buoyancy, which is then
    neutral."""
    if layout.body is None:
        return ucat_body()
    said = {name: value for name, value in vars(layout.body).items() if value is not None}
    return replace(ucat_body(), **{"buoyancy_n": None, **said})


def dynamics_of(body: Body) -> Dynamics[tuple[float, ...], float]:
    """The numbers of a body in the equations of motion; what it does not say is zero, buoyancy the
    weight. Raises LayoutError: the body has no mass or no inertia."""
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
