"""A robot as the dual sees it: scaled effectiveness in the range that its actuators span, and their sets."""

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.response import Line, Plane, Response, price_grid
from finlab.allocation.dual.answers import Answers
from finlab.allocation.dual.sets import Sets
from finlab.arrays import Array
from finlab.precision import NEARLY, NOTHING


class DualRobot:
    """One robot, prepared of the responses of its n actuators; lines come first."""

    def __init__(self, responses: list[Response]) -> None:
        lines = [each for each in responses if isinstance(each, Line)]
        planes = [each for each in responses if isinstance(each, Plane)]
        self.order = np.argsort([isinstance(each, Plane) for each in responses], kind="stable")
        """Places (n,) of the actuators in the layout."""
        self.answers = Answers(lines, planes)
        both: list[Response] = [*lines, *planes]
        self.ends = np.array([each.ends for each in both])
        """Least and largest forces (n, 2) [N], of planes sizes, below 0 in reverse."""
        low, high = self.ends[:, :1], self.ends[:, 1:]
        self.most = np.abs(self.ends).max(axis=1, keepdims=True) + 1e-12
        """Largest force or size (n, 1) [N] of each actuator."""
        self.band = np.array([each.band for each in both])[:, None]
        """Dead bands (n, 1) [N]: smaller forces, other than 0, cannot be held."""
        at_band = [sign * np.minimum(self.band, high) for sign in (-1.0, 0.0, 1.0)]
        self.band_cost = self.answers.marginal(np.concatenate(at_band, axis=1))[1]
        """Power (n, 3) [W] at the negative end of the band, at rest, and at its positive end."""
        arcs = np.array([(plane.middle, plane.half) for plane in planes]).reshape(-1, 2)
        idle = np.array([_needs_no_reverse(plane) for plane in planes], bool)
        least = np.where(np.pad(idle, (len(lines), 0))[:, None], 0.0, low)
        self.sets = limited_sets(self.answers, least, high, arcs)
        """What each may give."""
        rows = [line.effectiveness for line in lines]
        rows += [plane.effectiveness[k] for k in range(2) for plane in planes]
        rows += [line.drag for line in lines if line.drag is not None]
        self.most_drag = self.answers.drag(self.most) + 1e-12
        """Drag (f, 1) [N] of the largest forces of the lines that drag."""
        self._span(np.array(rows))

    def _span(self, effectiveness: Array) -> None:
        self.effectiveness = effectiveness
        """Wrench (k, 6) per newton along each direction, lines, first directions, second directions, drag."""
        sizes = np.abs(self.ends).max(axis=1, keepdims=True)
        largest = np.concatenate([sizes, sizes[self.answers.lines :], self.answers.drag(sizes) + 1e-12])
        scaled = self.effectiveness * largest
        size = np.sqrt((scaled**2).sum(axis=0))
        self.scale = np.where(size > NOTHING * max(size.max(), 1e-300), size, 1.0)
        """Size (6,) of what the robot can push along each axis [N, N m]; 1 where it cannot."""
        left, values, _ = np.linalg.svd((scaled / self.scale).T, full_matrices=False)
        self.basis = left[:, values > NOTHING * max(values[0], 1e-300)]
        """Directions (6, r) of scaled wrenches that the actuators span, orthonormal."""
        self.matrix = (self.effectiveness / self.scale) @ self.basis
        """Effectiveness (k, r) in that basis."""

    def tilted(self, effectiveness: Array) -> "DualRobot":
        """The same actuators with another effectiveness (k, 6)."""
        other = copy(self)
        for name in ("outer", "squares", "first_force", "trace", "least_trace", "metric"):
            other.__dict__.pop(name, None)
        other._span(effectiveness)
        return other

    @cached_property
    def outer(self) -> Array:
        """Products (r r, l + 3 p) that make the Hessian of derivatives of the answers."""
        lines, planes = self.answers.lines, self.answers.planes
        ends = np.cumsum([lines, planes, planes])
        line, first, second, drag = np.split(self.matrix, ends)
        mixed = _products(first, second)
        mixed = mixed + mixed.swapaxes(1, 2)
        parts = [_products(line, line), _products(first, first), mixed, _products(second, second)]
        if len(drag):
            along = _products(line[self.answers.dragging], drag)
            parts += [along + along.swapaxes(1, 2), _products(drag, drag)]
        return np.concatenate(parts).reshape(-1, self.shape[0] * self.shape[1]).T.copy()

    @cached_property
    def largest_power(self) -> float:
        """Power [W] of all actuators at the dearer ends of their sets."""
        return float(self.sets.most_cost[0])

    @cached_property
    def gain(self) -> Array:
        """Force over price (k, 1) [N^2/W] of each direction at its limit, by what half the force costs."""
        each = self.most / self.answers.prices[:, None]
        steep = (self.most_drag / self.most[self.answers.dragging]) ** 2
        return np.concatenate([each, each[self.answers.lines :], each[self.answers.dragging] * steep])

    @cached_property
    def squares(self) -> Array:
        """Products (r r, k) that make the Hessian of weights of the directions."""
        return np.asarray(np.einsum("ki,kj->ijk", self.matrix, self.matrix).reshape(-1, len(self.matrix)))

    @cached_property
    def first_force(self) -> Array:
        """Forces (k, r) of a scaled wrench at least quadratic cost."""
        hessian = (self.matrix.T * self.gain[:, 0]) @ self.matrix
        return np.asarray((self.matrix * self.gain) @ np.linalg.pinv(hessian, hermitian=True))

    @cached_property
    def trace(self) -> Array:
        """Row (l + 3 p,) that makes the trace of the Hessian."""
        return np.asarray(self.outer.reshape(*self.shape, -1).trace())

    @cached_property
    def least_trace(self) -> float:
        """Least trace that a ridge is a share of: that of the quadratic costs, times 1e-6."""
        return NEARLY * float((self.squares @ self.gain).reshape(self.shape).trace())

    @cached_property
    def metric(self) -> Array:
        """Matrix (r, r) by which a ridge grows: the Hessian of the quadratic costs, over its mean, so that
        directions that are driven badly are not held back more than the others."""
        hessian = (self.squares @ self.gain).reshape(self.shape)
        mean = float(hessian.trace()) / max(len(hessian), 1)
        return np.asarray(hessian / mean + NEARLY * np.eye(len(hessian)))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the Hessian."""
        return self.matrix.shape[1], self.matrix.shape[1]

    def farthest(self, sets: Sets) -> Callable[[Array], Array]:
        """Gives the forces (k,) [N] within the sets of one target that are worth most at prices (k,)."""
        return lambda price: self.answers.farthest(price[:, None], sets)[:, 0]

    def middle(self, sets: Sets) -> Array:
        """Forces (k,) [N] inside the sets of one target."""
        lines = self.answers.lines
        size = 0.5 * (sets.low + sets.high)[:, 0]
        angle = sets.middle[:, 0]
        turns = (sets.half[:, 0] < np.pi) & (sets.reverse[:, 0] == 0.0)
        planar = np.where(turns, size[lines:], 0.0)
        drag = self.answers.drag(size[:, None])[:, 0]
        return np.concatenate([size[:lines], planar * np.cos(angle), planar * np.sin(angle), drag])

    def frozen(self, sets: Sets, force: Array, fixed: NDArray[np.bool_]) -> Sets:
        """Sets in which fixed actuators (n, N) give their forces (k, N) [N] and nothing else."""
        lines = self.answers.lines
        x, y = self.answers.pair(force)
        size = np.concatenate([force[:lines], np.hypot(x, y)])
        within = np.clip(size, sets.low, sets.high)
        within[lines:] *= 1.0 - 2.0 * sets.flipped
        cost = self.answers.marginal(within)[1]
        cut = {"low": size, "high": size, "low_cost": cost, "high_cost": cost}
        turned = {"middle": np.arctan2(y, x), "half": 0.0, "reverse": 0.0}
        changes: list[Any] = [(name, value, fixed) for name, value in cut.items()]
        changes += [(name, value, fixed[lines:]) for name, value in turned.items()]
        values = {name: np.where(where, value, getattr(sets, name)) for name, value, where in changes}
        return replace(sets, **values)

    def restricted(self, reach: Array) -> Sets:
        """Sets of actuators that give no more than rows (n, 4) of least and largest force [N], middle and
        half of the arc [rad], in the robot's order; what they give beyond their tables is left out."""
        low, high = np.clip(reach[:, :2], self.ends[:, :1], self.ends[:, 1:]).T[..., None]
        return limited_sets(self.answers, low, high, reach[self.answers.lines :, 2:])

    def target(self, wrench: Array) -> Array:
        """Wrenches (N, 6) in the basis (r, N)."""
        return np.asarray(self.basis.T @ (wrench / self.scale).T)

    def price(self, prices: Array) -> Array:
        """Prices (N, 6) [W/N, W/(N m)] of the wrench from those in the basis (r, N) [W]."""
        return np.asarray((self.basis @ prices).T / self.scale)


def _products(a: Array, b: Array) -> Array:
    """Outer products (m, r, r) of rows (m, r)."""
    return np.asarray(a[:, :, None] * b[:, None, :])


def _needs_no_reverse(plane: Plane) -> bool:
    """Whether a plane that turns all round gives forward what it gives in reverse, at no more power."""
    ahead, back = plane.table, plane.reverse
    if back is None or plane.half < np.pi or back.largest > ahead.largest or back.rest < ahead.rest:
        return False
    price = price_grid(back.top)
    own = np.interp(price, price_grid(ahead.top), ahead.force)
    return bool((own >= back.force * (1.0 - NEARLY)).all())


def limited_sets(answers: Answers, low: Array, high: Array, arcs: Array) -> Sets:
    """Sets of actuators between forces (n, 1) [N] of their tables, of planes below 0 in reverse, in arcs
    (p, 2), middles and halves [rad]."""
    lines = answers.lines
    plane = (np.arange(len(low)) >= lines)[:, None]
    flipped, back = plane & (high <= 0.0) & (low < 0.0), plane & (low < 0.0)
    near = np.where(flipped, high, np.where(back, 0.0, low))
    far = np.where(flipped, low, high)
    cost = answers.marginal(np.concatenate([near, far, low], axis=1))[1]
    reverse = np.where(back & ~flipped, -low, 0.0)[lines:]
    near, far = np.where(plane, np.abs(near), near), np.where(plane, np.abs(far), far)
    turned, (low_cost, high_cost, other) = flipped[lines:], np.split(cost, 3, axis=1)
    middle, half = arcs[:, :1] + np.pi * turned, arcs[:, 1:]
    flips = turned.astype(np.float64)
    return Sets(near, far, low_cost, high_cost, middle, half, reverse, other[lines:], flips)
