"""Solvers of others for a robot of thrusters, each as its users call it from Python: set up once,
then a call for each wrench.

The question of all is: forces u (n,) within their limits that give the wrench, B u = w. The
quadratic ones keep ||u||^2 least, those with our power law the watts, sum of k |u|^p.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from finlab import Allocator, Thruster
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.physics.objective import wrench_scale_of
from tools.speed_groups.questions import thruster_effectiveness

TOLERANCE = 1e-9
"""Of solvers that end at one."""
LEAST_SQUARES_WEIGHT = 1e-13
"""Of the squared forces, beside the squared distance from the wrench, where a solver knows no
constraints but limits."""
DAQP_WEIGHT = 1e-9
"""The same for DAQP, over the trace of the Hessian: it needs one that is positive definite."""
MOST_ITERATIONS = 100_000
"""Of solvers that stop at a number."""

Solve = Callable[[Array], Array]
"""From a wrench (6,) [N, N m] to forces (n,) [N]."""


@dataclass(frozen=True)
class Thrusters:
    """What the solvers know of a robot."""

    layout: Layout
    """The robot."""
    B: Array
    """Effectiveness matrix (6, n): wrench [N, N m] per newton."""
    low: Array
    """Least forces (n,) [N]."""
    high: Array
    """Largest forces (n,) [N]."""
    ahead: Array
    """Watts (n,) of 1 N ahead."""
    reverse: Array
    """The same in reverse."""
    scale: Array
    """Wrench scale (6,) [N, N m], by which distances between wrenches are divided."""
    exponent: float
    """p of the watts k |u|^p, the same of all."""

    @property
    def n(self) -> int:
        """Number of thrusters."""
        return len(self.low)

    @classmethod
    def of(cls, layout: Layout) -> "Thrusters":
        """Reads a robot whose thrusters have a power law each, with one exponent."""
        models: list[Any] = []
        for actuator in layout.actuators:
            assert isinstance(actuator, Thruster)
            models.append(actuator.model)
        exponents = {model.exponent for model in models}
        assert len(exponents) == 1
        return cls(
            layout=layout,
            B=thruster_effectiveness(layout),
            low=layout.lower[:, 0].copy(),
            high=layout.upper[:, 0].copy(),
            ahead=np.array([model.forward for model in models]),
            reverse=np.array([model.reverse for model in models]),
            scale=wrench_scale_of(layout),
            exponent=exponents.pop(),
        )


def daqp_model(robot: Thrusters) -> Solve:
    """DAQP, a dual active-set method: its `Model`, whose bounds are updated."""
    import daqp

    n = robot.n
    is_equality = 5
    sense = np.zeros(n + 6, np.int32)
    sense[n:] = is_equality
    upper = np.concatenate([robot.high, np.zeros(6)])
    lower = np.concatenate([robot.low, np.zeros(6)])
    model = daqp.Model()
    model.setup(np.eye(n), np.zeros(n), np.ascontiguousarray(robot.B), upper, lower, sense)
    model.settings = {"primal_tol": TOLERANCE}

    def solve(w: Array) -> Array:
        upper[n:] = w
        lower[n:] = w
        model.update(bupper=upper, blower=lower)
        x: Array = model.solve()[0]
        return x

    return solve


def daqp_least_squares(robot: Thrusters) -> Solve:
    """DAQP on the distance from a wrench that is out of reach, over the wrench scale: least squares
    with limits alone, and a small weight of the squared forces."""
    import daqp

    n = robot.n
    scaled = robot.B / robot.scale[:, None]
    hessian = scaled.T @ scaled
    regularized = hessian + DAQP_WEIGHT * np.trace(hessian) * np.eye(n)
    model = daqp.Model()
    nothing = np.zeros((0, n))
    sense = np.zeros(n, np.int32)
    model.setup(regularized, np.zeros(n), nothing, robot.high, robot.low, sense)
    to_linear = -scaled.T / robot.scale

    def solve(w: Array) -> Array:
        model.update(f=to_linear @ w)
        x: Array = model.solve()[0]
        return x

    return solve


def piqp_dense(robot: Thrusters) -> Solve:
    """PIQP, an interior-point method: its dense solver, whose right side is updated."""
    import piqp

    n = robot.n
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = TOLERANCE
    solver.settings.eps_rel = TOLERANCE
    solver.setup(
        np.asfortranarray(np.eye(n)),
        np.zeros(n),
        np.asfortranarray(robot.B),
        np.zeros(6),
        x_l=robot.low,
        x_u=robot.high,
    )

    def solve(w: Array) -> Array:
        solver.update(b=w)
        solver.solve()
        return np.array(solver.result.x)  # the next call writes into the same memory

    return solve


def osqp_solver(robot: Thrusters) -> Solve:
    """OSQP, a splitting method: its limits are updated, and it begins at its last answer."""
    import osqp
    from scipy import sparse

    n = robot.n
    rows = sparse.csc_matrix(np.vstack([robot.B, np.eye(n)]))
    lower = np.concatenate([np.zeros(6), robot.low])
    upper = np.concatenate([np.zeros(6), robot.high])
    solver = osqp.OSQP()
    solver.setup(
        sparse.csc_matrix(np.eye(n)),
        np.zeros(n),
        rows,
        lower,
        upper,
        eps_abs=TOLERANCE,
        eps_rel=TOLERANCE,
        max_iter=MOST_ITERATIONS,
        verbose=False,
    )

    def solve(w: Array) -> Array:
        lower[:6] = w
        upper[:6] = w
        solver.update(l=lower, u=upper)
        x: Array = solver.solve().x
        return x

    return solve


def clarabel_quadratic(robot: Thrusters) -> Solve:
    """Clarabel, an interior-point method of cones, on the quadratic program: its right side is
    updated."""
    import clarabel
    from scipy import sparse

    n = robot.n
    rows = sparse.csc_matrix(np.vstack([robot.B, np.eye(n), -np.eye(n)]))
    right = np.concatenate([np.zeros(6), robot.high, -robot.low])
    cones = [clarabel.ZeroConeT(6), clarabel.NonnegativeConeT(2 * n)]
    cost = sparse.csc_matrix(np.eye(n))
    solver = clarabel.DefaultSolver(cost, np.zeros(n), rows, right, cones, _clarabel_settings())

    def solve(w: Array) -> Array:
        right[:6] = w
        solver.update(b=right)
        return np.array(solver.solve().x)

    return solve


def clarabel_power(robot: Thrusters) -> Solve:
    """Clarabel on the watts themselves, by power cones.

    A force is a part ahead less a part in reverse, each in [0, m] and a share y of its largest m.
    It costs k m^p t with t >= y^p, which is the cone t^(1/p) 1^(1 - 1/p) >= |y|.
    """
    import clarabel
    from scipy import sparse

    n = robot.n
    count = 2 * n
    p = robot.exponent
    largest = np.concatenate([robot.high, -robot.low])
    watts = np.concatenate([robot.ahead, robot.reverse]) * largest**p
    columns = np.hstack([robot.B, -robot.B]) * largest
    eye = np.eye(count)
    zero = np.zeros((count, count))
    reached = np.hstack([columns, np.zeros((6, count))])
    limits = np.vstack([np.hstack([eye, zero]), np.hstack([-eye, zero])])
    cone_rows = np.zeros((3 * count, 2 * count))
    cone_right = np.zeros(3 * count)
    for k in range(count):
        cone_rows[3 * k, count + k] = -1.0
        cone_right[3 * k + 1] = 1.0
        cone_rows[3 * k + 2, k] = -1.0
    rows = sparse.csc_matrix(np.vstack([reached, limits, cone_rows]))
    right = np.concatenate([np.zeros(6), np.ones(count), np.zeros(count), cone_right])
    cones = [clarabel.ZeroConeT(6), clarabel.NonnegativeConeT(2 * count)]
    cones += [clarabel.PowerConeT(1.0 / p) for _ in range(count)]
    cost = np.concatenate([np.zeros(count), watts / watts.max()])
    nothing = sparse.csc_matrix((2 * count, 2 * count))
    solver = clarabel.DefaultSolver(nothing, cost, rows, right, cones, _clarabel_settings())

    def solve(w: Array) -> Array:
        right[:6] = w
        solver.update(b=right)
        part = np.array(solver.solve().x[:count]) * largest
        return np.asarray(part[:n] - part[n:])

    return solve


def _clarabel_settings() -> Any:
    """Settings with which data may be updated, and nothing is printed."""
    import clarabel

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.presolve_enable = False
    settings.tol_gap_abs = TOLERANCE
    settings.tol_gap_rel = TOLERANCE
    settings.tol_feas = TOLERANCE
    return settings


def scipy_lsq_linear(robot: Thrusters) -> Solve:
    """SciPy's `lsq_linear`, an active-set method of least squares with limits alone: the squared
    forces have a small weight beside the distance from the wrench, over the wrench scale."""
    from scipy.optimize import lsq_linear

    weighted = np.sqrt(LEAST_SQUARES_WEIGHT) * np.eye(robot.n)
    rows = np.vstack([robot.B / robot.scale[:, None], weighted])
    right = np.zeros(6 + robot.n)
    limits = (robot.low, robot.high)

    def solve(w: Array) -> Array:
        right[:6] = w / robot.scale
        return np.asarray(lsq_linear(rows, right, limits, method="bvls", tol=1e-14).x)

    return solve


def scipy_slsqp(robot: Thrusters) -> Solve:
    """SciPy's SLSQP, sequential quadratic programs, on the watts themselves, with their
    gradient."""
    from scipy.optimize import Bounds, LinearConstraint, minimize

    p = robot.exponent
    bounds = Bounds(robot.low, robot.high)
    pinv = np.linalg.pinv(robot.B)

    def watts(u: Array) -> float:
        per_newton = np.where(u >= 0.0, robot.ahead, robot.reverse)
        return float((per_newton * np.abs(u) ** p).sum())

    def gradient(u: Array) -> Array:
        per_newton = np.where(u >= 0.0, robot.ahead, robot.reverse)
        return np.asarray(per_newton * p * np.sign(u) * np.abs(u) ** (p - 1.0))

    def solve(w: Array) -> Array:
        first = np.clip(pinv @ w, robot.low, robot.high)
        reached = LinearConstraint(robot.B, w, w)
        options = {"ftol": TOLERANCE, "maxiter": 200}
        end = minimize(
            watts,
            first,
            jac=gradient,
            bounds=bounds,
            constraints=reached,
            method="SLSQP",
            options=options,
        )
        return np.asarray(end.x)

    return solve


def px4(robot: Thrusters) -> Solve:
    """PX4's allocation with sequential desaturation, finlab's method `px4`."""
    return _baseline(Allocator(robot.layout, "px4"))


def pseudo_inverse(robot: Thrusters) -> Solve:
    """The pseudo-inverse, clipped at the limits: one line of numpy, the unit."""
    pinv = np.linalg.pinv(robot.B)
    return lambda w: np.clip(pinv @ w, robot.low, robot.high)


def _baseline(allocator: Allocator) -> Solve:
    """A method of finlab for thrusters."""
    return lambda w: allocator.allocate(w).command[:, 0]
