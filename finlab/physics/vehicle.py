"""Fossen's equations of motion in six degrees of freedom, with a current.

State (13,): position in the world [m], quaternion (w, x, y, z), velocity over ground in the body frame [m/s],
angular rates in the body frame [rad/s]. With nu_r the velocity relative to the water (T. I. Fossen, Handbook
of Marine Craft Hydrodynamics and Motion Control, 2nd ed., chapters 6 to 8 and 10):

    M nu_r' + C(nu_r) nu_r + D(nu_r) nu_r + g = tau,   M = M_RB + M_A diagonal

The Coriolis terms are written by momenta (Kirchhoff): p = M_lin v_r, h = M_ang omega give -omega x p and
-omega x h - v_r x p. The water moves without rotation, so nu' = nu_r' - omega x (current in body) + (its
acceleration in body). Where it accelerates, it carries the body along by the pressure that it accelerates
itself with: M nu_r' says so of a body as heavy as the water in its place; the buoyant force leans with it.
Plain floats: at this size they are several times faster than arrays.
"""

import math
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.layout import Body, Layout, load_layout

STATE_SIZE = 13
GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""
LONGEST, MOST_STEPS = 1.5, 500
"""Times what is fastest in a motion that a step may last, well within what Runge-Kutta (2.8) and the midpoint
rule (2) bear; and into how many steps at most a period is cut for a body that water stops almost at once."""


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


def quaternion_of_yaw(yaw: float) -> tuple[float, float, float, float]:
    """The attitude of a level robot that heads `yaw` [rad] from the world's x, counter-clockwise."""
    return (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))


def quaternion_of(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """The attitude (w, x, y, z) after turns about z, then y, then x [rad]."""
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def to_world(velocity: Array, roll: float, pitch: float, yaw: float) -> Array:
    """A velocity in the body frame, the first three of an array, in the world (3,) [m/s]."""
    u, v, w = velocity[:3].tolist()
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    v, w = cr * v - sr * w, sr * v + cr * w
    u, w = cp * u + sp * w, -sp * u + cp * w
    return np.array([cy * u - sy * v, sy * u + cy * v, w])


def euler(quaternion: ArrayLike) -> Array:
    """Roll, pitch, yaw (..., 3) [rad], turned about z, then y, then x; pitch is positive nose down."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=np.float64), -1, 0)
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.stack([roll, pitch, yaw], axis=-1)


class Vehicle:
    """The dynamics of one vehicle; it holds no state."""

    def __init__(self, body: Body, current: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        """Takes a body and the water's velocity (3,) in the world [m/s]; what the body does not say is zero.

        Raises:
            LayoutError: the body has no mass or no inertia.
        """
        if body.mass_kg is None or body.inertia_kgm2 is None:
            raise LayoutError("a vehicle needs a body with mass_kg and inertia_kgm2")
        self.current = tuple(float(value) for value in current)
        """Velocity of the water (3,) in the world, here and now [m/s]."""
        self.acceleration = (0.0, 0.0, 0.0)
        """Its acceleration (3,) [m/s^2]."""
        zeros = (0.0,) * 6
        own = (*(body.mass_kg,) * 3, *body.inertia_kgm2)
        self.inertia = tuple(a + b for a, b in zip(own, body.added_mass or zeros, strict=True))
        """Diagonal of M (6,) [kg, kg m^2]."""
        self.weight = body.mass_kg * GRAVITY
        """Weight [N]."""
        self.lift = self.weight if body.buoyancy_n is None else body.buoyancy_n
        """Buoyant force [N]."""
        self._linear, self._quadratic = body.linear_damping or zeros, body.quadratic_damping or zeros
        self._center = body.center_of_buoyancy_m or (0.0, 0.0, 0.0)
        uneven = max(self.inertia[:3]) - min(self.inertia[:3])
        self._munk = math.sqrt(uneven / min(self.inertia[3:]))
        self._rate_at_rest = max(a / m for a, m in zip(self._linear, self.inertia, strict=True))
        quadratic = max(b / m for b, m in zip(self._quadratic, self.inertia, strict=True))
        self._rate_by_speed = 2.0 * quadratic + self._munk + 1.0

    def n_steps(self, motion: Sequence[float], dt: float) -> int:
        """Into how many equal steps `dt` [s] has to be cut so that integrating it stays stable.

        One for a robot as robots are; more where damping, Munk's moments or its own turning change the motion
        (6,) [m/s, rad/s] within `dt`, as of a light body that water holds fast, or of one that tumbles.

        Raises:
            LayoutError: even `MOST_STEPS` would not do.
        """
        cx, cy, cz = self.current
        stream = abs(cx) + abs(cy) + abs(cz)
        if dt * (self._rate_at_rest + self._rate_by_speed * (max(map(abs, motion)) + stream)) <= LONGEST:
            return 1  # as nearly always: known from a bound, which takes less time
        u, v, w, p, q, r = map(abs, motion)
        speeds = (u + stream, v + stream, w + stream, p, q, r)
        terms = zip(self._linear, self._quadratic, speeds, self.inertia, strict=True)
        damping = max((a + 2.0 * b * speed) / m for a, b, speed, m in terms)
        often = damping + self._munk * max(speeds[:3]) + max(speeds[3:])
        most = MOST_STEPS * LONGEST / dt
        if not often <= most:  # nor where it is no number any more
            got = f"{often:.2g} times a second" if math.isfinite(often) else "beyond all bounds"
            raise LayoutError(
                f"its motion changes {got}, at most {most:g} can be simulated; check mass, inertia, "
                "added mass, damping and buoyancy",
                "body",
            )
        return max(1, math.ceil(often * dt / LONGEST))

    def derivative(self, state: Sequence[float], wrench: Sequence[float]) -> list[float]:
        """Rate of change (13,) of a state under a wrench (6,) in the body frame [N, N m]."""
        _, _, _, qw, qx, qy, qz, u, v, w, p, q, r = state
        # Rows of the rotation's transpose: the world's axes as the body sees them.
        r11, r21, r31 = 1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + qw * qz), 2 * (qx * qz - qw * qy)
        r12, r22, r32 = 2 * (qx * qy - qw * qz), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz + qw * qx)
        r13, r23, r33 = 2 * (qx * qz + qw * qy), 2 * (qy * qz - qw * qx), 1 - 2 * (qx * qx + qy * qy)
        cx, cy, cz = self.current
        cu = r11 * cx + r21 * cy + r31 * cz
        cv = r12 * cx + r22 * cy + r32 * cz
        cw = r13 * cx + r23 * cy + r33 * cz
        ur, vr, wr = u - cu, v - cv, w - cw
        ux, uy, uz, au, av, aw = r31, r32, r33, 0.0, 0.0, 0.0
        if any(self.acceleration):
            ax, ay, az = self.acceleration
            au = r11 * ax + r21 * ay + r31 * az
            av = r12 * ax + r22 * ay + r32 * az
            aw = r13 * ax + r23 * ay + r33 * az
            ux, uy, uz = r31 + au / GRAVITY, r32 + av / GRAVITY, r33 + aw / GRAVITY
        mx, my, mz, ix, iy, iz = self.inertia
        px, py, pz, hx, hy, hz = mx * ur, my * vr, mz * wr, ix * p, iy * q, iz * r
        lin, quad, lift = self._linear, self._quadratic, self.lift
        net = lift - self.weight
        bx, by, bz = self._center
        fx = wrench[0] - (q * pz - r * py) - (lin[0] + quad[0] * abs(ur)) * ur + net * r31
        fy = wrench[1] - (r * px - p * pz) - (lin[1] + quad[1] * abs(vr)) * vr + net * r32
        fz = wrench[2] - (p * py - q * px) - (lin[2] + quad[2] * abs(wr)) * wr + net * r33
        tx = wrench[3] - (q * hz - r * hy) - (vr * pz - wr * py) - (lin[3] + quad[3] * abs(p)) * p
        ty = wrench[4] - (r * hx - p * hz) - (wr * px - ur * pz) - (lin[4] + quad[4] * abs(q)) * q
        tz = wrench[5] - (p * hy - q * hx) - (ur * py - vr * px) - (lin[5] + quad[5] * abs(r)) * r
        tx += lift * (by * uz - bz * uy)
        ty += lift * (bz * ux - bx * uz)
        tz += lift * (bx * uy - by * ux)
        return [
            r11 * u + r12 * v + r13 * w,
            r21 * u + r22 * v + r23 * w,
            r31 * u + r32 * v + r33 * w,
            0.5 * (-qx * p - qy * q - qz * r),
            0.5 * (qw * p + qy * r - qz * q),
            0.5 * (qw * q + qz * p - qx * r),
            0.5 * (qw * r + qx * q - qy * p),
            fx / mx - (q * cw - r * cv) + au,
            fy / my - (r * cu - p * cw) + av,
            fz / mz - (p * cv - q * cu) + aw,
            tx / ix,
            ty / iy,
            tz / iz,
        ]

    def velocity_in_water(self, state: Array) -> Array:
        """Velocity relative to the water and angular rates (6,) of a state, body frame [m/s, rad/s]."""
        velocity = state[7:].copy()
        if any(self.current):
            w, x, y, z = state[3:7].tolist()
            cx, cy, cz = self.current
            # The current as the body sees it: turned by the conjugate quaternion.
            ax, ay, az = 2 * (cy * z - cz * y), 2 * (cz * x - cx * z), 2 * (cx * y - cy * x)
            velocity[0] -= cx + w * ax - (y * az - z * ay)
            velocity[1] -= cy + w * ay - (z * ax - x * az)
            velocity[2] -= cz + w * az - (x * ay - y * ax)
        return velocity

    def step(self, state: Array, wrench: Sequence[float], dt: float) -> Array:
        """The state (13,) after `dt` [s] under a wrench that the body carries along: Runge-Kutta, order 4.

        Raises:
            LayoutError: the body moves too fast to be simulated.
        """
        y: list[float] = state.tolist()
        n_steps = self.n_steps(y[7:], dt)
        for _ in range(n_steps):
            y = self._runge_kutta(y, wrench, dt / n_steps)
        return np.array(y)

    def _runge_kutta(self, y0: list[float], wrench: Sequence[float], dt: float) -> list[float]:
        k1 = self.derivative(y0, wrench)
        k2 = self.derivative([a + 0.5 * dt * b for a, b in zip(y0, k1, strict=True)], wrench)
        k3 = self.derivative([a + 0.5 * dt * b for a, b in zip(y0, k2, strict=True)], wrench)
        k4 = self.derivative([a + dt * b for a, b in zip(y0, k3, strict=True)], wrench)
        y = [a + dt / 6 * (b + 2 * (c + d) + e) for a, b, c, d, e in zip(y0, k1, k2, k3, k4, strict=True)]
        norm = math.sqrt(y[3] ** 2 + y[4] ** 2 + y[5] ** 2 + y[6] ** 2)
        y[3:7] = [value / norm for value in y[3:7]]
        return y
