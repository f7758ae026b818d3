"""Fossen's equations of motion in six degrees of freedom and their Jacobian, for one body or for
many.

With eta the pose, nu the velocity and nu_r the velocity relative to the water (T. I. Fossen,
Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., chapters 6 to 8 and 10):

    M nu_r' + C(nu_r) nu_r + D(nu_r) nu_r + g(eta) = tau,   M = M_RB + M_A diagonal

The Coriolis terms are written by momenta (Kirchhoff): the linear momentum p = M_lin v_r and the
angular momentum h = M_ang omega give C(nu_r) nu_r = (omega x p, omega x h + v_r x p). Order of six:
surge, sway, heave, roll, pitch, yaw; x forward, y left, z up.

Numbers may be plain floats, or arrays that broadcast; vectors are sequences of them. The core has
`accelerations` of one body in C (finlab/core/src/vehicle.c), for `vehicle.py`.
"""

from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

from finlab.errors import LayoutError
from finlab.layout import Body, Layout, load_layout

Vector = Any
"""A sequence of numbers: a tuple of floats, or an array whose first axis it is."""
Number = Any
"""A float, or an array of floats."""


class Dynamics(NamedTuple):
    """The numbers of a body, or of many, in the equations of motion."""

    inertia: Vector
    """Diagonal of M (6): mass and moments with those of the water that goes along [kg, kg m^2]."""
    linear_damping: Vector
    """Damping (6) per speed [N s/m, N m s]."""
    quadratic_damping: Vector
    """Damping (6) per speed times its size [N s^2/m^2, N m s^2]."""
    weight: Number
    """[N]."""
    buoyancy: Number
    """Buoyant force [N]."""
    center_of_buoyancy: Vector
    """(3) as seen from the centre of gravity [m]."""


def accelerations(body: Dynamics, nu_r: Any, up: Any, tau: Any) -> Any:
    """Returns nu_r' = M^-1 (tau - C(nu_r) nu_r - D(nu_r) nu_r - g(eta)), six numbers.

    Args:
        body: its numbers.
        nu_r: velocity through the water and angular rates (6), body frame [m/s, rad/s].
        up: the world's z axis (3) in the body frame: all that g depends on.
        tau: wrench (6), body frame [N, N m].

    Returns:
        Accelerations (6) along and about the body's axes [m/s^2, rad/s^2].
    """
    u, v, w, p, q, r = nu_r
    mx, my, mz, ix, iy, iz = body.inertia
    # Momenta of the body with the water that goes along.
    px = mx * u
    py = my * v
    pz = mz * w
    hx = ix * p
    hy = iy * q
    hz = iz * r
    # D(nu_r) nu_r = (d_1 + d_2 |nu_r|) nu_r
    d_1 = body.linear_damping
    d_2 = body.quadratic_damping
    # g(eta): the buoyant force less the weight along `up`, and the moment of the buoyant force.
    buoyancy = body.buoyancy
    net_buoyancy = buoyancy - body.weight
    bx, by, bz = body.center_of_buoyancy
    ax, ay, az = up
    righting_x = buoyancy * (by * az - bz * ay)
    righting_y = buoyancy * (bz * ax - bx * az)
    righting_z = buoyancy * (bx * ay - by * ax)

    force_x = tau[0] - (q * pz - r * py) - (d_1[0] + d_2[0] * abs(u)) * u + net_buoyancy * up[0]
    force_y = tau[1] - (r * px - p * pz) - (d_1[1] + d_2[1] * abs(v)) * v + net_buoyancy * up[1]
    force_z = tau[2] - (p * py - q * px) - (d_1[2] + d_2[2] * abs(w)) * w + net_buoyancy * up[2]
    damped_x = (d_1[3] + d_2[3] * abs(p)) * p
    damped_y = (d_1[4] + d_2[4] * abs(q)) * q
    damped_z = (d_1[5] + d_2[5] * abs(r)) * r
    torque_x = tau[3] - (q * hz - r * hy) - (v * pz - w * py) - damped_x + righting_x
    torque_y = tau[4] - (r * hx - p * hz) - (w * px - u * pz) - damped_y + righting_y
    torque_z = tau[5] - (p * hy - q * hx) - (u * py - v * px) - damped_z + righting_z
    return (force_x / mx, force_y / my, force_z / mz, torque_x / ix, torque_y / iy, torque_z / iz)


def water_wrench(body: Dynamics, rigid_inertia: Vector, nu_r: Any, up: Any, tau: Any) -> Any:
    """Returns what the water gives a body whose rigid part and whose weight somebody else accounts
    for, six numbers [N, N m] in the body frame.

    The rigid body alone, of mass m and moments I, moves by M_RB nu_r' + C_RB(nu_r) nu_r, which
    `tau` and the water give together, the weight compensated:

        -(M_A nu_r' + C_A(nu_r) nu_r + D(nu_r) nu_r + g(eta)) = M_RB nu_r' + C_RB(nu_r) nu_r - tau

    with nu_r' of the whole, so that the added mass is felt in the same moment. A current that is
    steady in the world moves this frame at a constant velocity (property 8.1 of Fossen).

    Args:
        body: numbers of the whole, added mass and net buoyancy included.
        rigid_inertia: m and the three moments of the rigid body (4) [kg, kg m^2].
        nu_r: velocity through the water and angular rates (6), body frame [m/s, rad/s].
        up: the world's z axis (3) in the body frame.
        tau: wrench (6) of all else, body frame [N, N m].
    """
    u, v, w, p, q, r = nu_r
    m, ix, iy, iz = rigid_inertia
    u_dot, v_dot, w_dot, p_dot, q_dot, r_dot = accelerations(body, nu_r, up, tau)
    # m (v_r' + omega x v_r) and I omega' + omega x I omega
    force_x = m * (u_dot + q * w - r * v)
    force_y = m * (v_dot + r * u - p * w)
    force_z = m * (w_dot + p * v - q * u)
    torque_x = ix * p_dot + (iz - iy) * q * r
    torque_y = iy * q_dot + (ix - iz) * r * p
    torque_z = iz * r_dot + (iy - ix) * p * q
    return (
        force_x - tau[0],
        force_y - tau[1],
        force_z - tau[2],
        torque_x - tau[3],
        torque_y - tau[4],
        torque_z - tau[5],
    )


def jacobian(body: Dynamics, nu_r: Any) -> list[list[Any]]:
    """Returns the derivatives (6, 6) of `accelerations` by nu_r.

    Args:
        body: its numbers.
        nu_r: velocity through the water and angular rates (6), body frame [m/s, rad/s].
    """
    u, v, w, p, q, r = nu_r
    mx, my, mz, ix, iy, iz = body.inertia
    # Munk's moments v_r x p, and gyroscopic ones omega x h, by the moment of inertia.
    munk_x = (my - mz) / ix
    munk_y = (mz - mx) / iy
    munk_z = (mx - my) / iz
    gyro_x = (iy - iz) / ix
    gyro_y = (iz - ix) / iy
    gyro_z = (ix - iy) / iz
    dx, dy, dz, dp, dq, dr = (-slope for slope in damping_jacobian(body, nu_r))
    zero = 0.0 * u
    return [
        [dx, my * r / mx, -mz * q / mx, zero, -mz * w / mx, my * v / mx],
        [-mx * r / my, dy, mz * p / my, mz * w / my, zero, -mx * u / my],
        [mx * q / mz, -my * p / mz, dz, -my * v / mz, mx * u / mz, zero],
        [zero, munk_x * w, munk_x * v, dp, gyro_x * r, gyro_x * q],
        [munk_y * w, zero, munk_y * u, gyro_y * r, dq, gyro_y * p],
        [munk_z * v, munk_z * u, zero, gyro_z * q, gyro_z * p, dr],
    ]


def damping_rates(body: Dynamics, nu_r: Any) -> list[Any]:
    """Returns the decelerations (6) by damping at nu_r (6), over nu_r: M^-1 D(nu_r) [1/s]."""
    rates = []
    for d_1, d_2, speed, m in zip(
        body.linear_damping, body.quadratic_damping, nu_r, body.inertia, strict=True
    ):
        rates.append((d_1 + d_2 * abs(speed)) / m)
    return rates


def damping_jacobian(body: Dynamics, nu_r: Any) -> list[Any]:
    """Returns the derivatives (6) of those decelerations, each by its own speed [1/s]: minus the
    diagonal of the Jacobian. The quadratic part counts twice, as at twice the speed."""
    return damping_rates(body, [2.0 * speed for speed in nu_r])


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
    given = {name: value for name, value in vars(layout.body).items() if value is not None}
    return replace(ucat_body(), **{"buoyancy_n": None, **given})


def dynamics_of(body: Body) -> Dynamics:
    """Returns the numbers of a body in the equations of motion.

    Args:
        body: what it does not say is zero, its buoyancy the weight.

    Raises:
        LayoutError: the body has no mass or no inertia.
    """
    if body.mass_kg is None or body.inertia_kgm2 is None:
        raise LayoutError("a vehicle needs a body with mass_kg and inertia_kgm2")
    zeros = (0.0,) * 6
    rigid_body = (*(body.mass_kg,) * 3, *body.inertia_kgm2)  # diagonal of M_RB
    added = body.added_mass or zeros  # diagonal of M_A
    weight = body.mass_kg * GRAVITY
    return Dynamics(
        inertia=tuple(a + b for a, b in zip(rigid_body, added, strict=True)),
        linear_damping=tuple(body.linear_damping or zeros),
        quadratic_damping=tuple(body.quadratic_damping or zeros),
        weight=weight,
        buoyancy=weight if body.buoyancy_n is None else body.buoyancy_n,
        center_of_buoyancy=tuple(body.center_of_buoyancy_m or (0.0, 0.0, 0.0)),
    )
