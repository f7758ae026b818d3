"""Reference optima in the space of forces, by solvers that the library has no part in.

`lower_bound` is a proof: no answer takes fewer watts. `least_known` is what SLSQP finds from many
starts. Where both agree, the optimum is known. `farthest` is a linear program on the hulls of the
actuators' sets, `least_miss` a quadratic one, `conic_optimum` Clarabel on thrusters' power cones.
"""

import itertools
import math
from functools import cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog, minimize, nnls

from finlab.arrays import Array
from tests.oracle_plant import OracleActuator, OraclePlant, edge_forces

LEVELS = 3001
"""Sizes of force in a table of costs."""
SHARES = np.linspace(0.0, 1.0, LEVELS) ** 2
"""Dense where a cost bends most: near rest."""


class OracleSet:
    """What an actuator can push and at what cost, in polar form: size times unevenness along an
    angle.

    A thruster is two rays. `sizes` (LEVELS,) [N] and `costs` (LEVELS,) [W], by ray.
    """

    def __init__(self, actuator: OracleActuator, arc: tuple[float, float] | None = None) -> None:
        self.actuator = actuator
        low, high = actuator.limits
        if actuator.kind == "thruster":
            self.rays = [self._ray(actuator, sign, low[0], high[0]) for sign in (1.0, -1.0)]
            return
        if actuator.kind == "rudder":
            self.angles = np.linspace(low[0], high[0], 4001)
            self.curve, self.taken = actuator.foil(self.angles)
            self.rays = [_Ray(np.array([0.0, 1.0]), np.full(2, self.taken.max()))]
            return
        if actuator.kind == "propeller_rudder":
            self._take_steered(actuator, low, high)
            return
        if actuator.kind == "fin":
            sizes, costs = fin_costs(actuator)
        else:
            sizes = low[1] + SHARES * (high[1] - low[1])
            costs = actuator.propeller_watts(sizes)
        turn = 2 if actuator.kind == "fin" else 0
        self.full = actuator.turns_fully and arc is None
        first, last = arc or (low[turn], high[turn])
        self.middle = 0.5 * (first + last)
        self.half = 0.5 * (last - first)
        self.rays = [_Ray(sizes, costs)]

    def _take_steered(self, actuator: OracleActuator, low: Array, high: Array) -> None:
        """Takes a propeller with a rudder: forces of deflections (4001,) at no thrust and per newton
        of it, and the costs of thrusts, ahead and astern."""
        self.angles = np.linspace(low[0], high[0], 4001)
        none = actuator.steered(self.angles, np.zeros(4001))
        self.curve = none
        self.per_newton = actuator.steered(self.angles, np.ones(4001)) - none
        ahead = max(low[1], 0.0) + SHARES * (high[1] - max(low[1], 0.0))
        self.rays = [_Ray(ahead, actuator.propeller_watts(ahead))]
        if low[1] < 0.0 and not actuator.flow.any():
            astern = -SHARES * low[1]
            self.rays.append(_Ray(astern, actuator.propeller_watts(-astern)))

    def _steered_answer(self, price: Array) -> tuple[Array, float]:
        """See `answer`, of a propeller with a rudder: the best of all deflections ahead, by the
        parabola through the best three, and straight astern."""
        paid = self.per_newton @ price
        ends = [int(paid.argmax()), int((self.curve @ price).argmax())]
        tried = {0, 4000}
        for end in ends:
            tried |= set(range(max(end - 2, 0), min(end + 3, 4001)))
        tried |= set(range(0, 4001, 40))
        best = (np.zeros(2), -np.inf)
        for k in sorted(tried):
            size, earned = self.rays[0].answer(float(paid[k]))
            total = earned + float(self.curve[k] @ price)
            if total > best[1]:
                best = (self.curve[k] + size * self.per_newton[k], total)
        if len(self.rays) > 1:
            size, earned = self.rays[1].answer(-float(price[0]))
            if earned > best[1]:
                best = (np.array([-size, 0.0]), earned)
        return best

    @staticmethod
    def _ray(actuator: OracleActuator, sign: float, low: float, high: float) -> "_Ray":
        low, high = (low, high) if sign > 0.0 else (-high, -low)
        least = max(low, 0.0)
        most = max(high, 0.0)
        least = max(least, actuator.dead_band) if most >= actuator.dead_band else most
        sizes = least + SHARES * (most - least)
        if low <= 0.0 and least > 0.0:
            sizes = np.concatenate([[0.0], sizes])
        return _Ray(sizes, actuator.propeller_watts(sign * sizes))

    @property
    def wide(self) -> bool:
        """Whether its arc is no convex set."""
        return (
            self.actuator.kind in ("fin", "azimuth")
            and not self.full
            and self.half > 0.5 * math.pi + 1e-9
        )

    def answer(self, price: Array) -> tuple[Array, float]:
        """The force (1 or 2,) [N] that earns most at a price (1 or 2,) [W/N], and what it earns
        [W]."""
        if self.actuator.kind == "thruster":
            ahead, back = (
                ray.answer(sign * price[0])
                for ray, sign in zip(self.rays, (1.0, -1.0), strict=True)
            )
            return (
                (np.array([ahead[0]]), ahead[1])
                if ahead[1] >= back[1]
                else (np.array([-back[0]]), back[1])
            )
        if self.actuator.kind == "propeller_rudder":
            return self._steered_answer(price)
        if self.actuator.kind == "rudder":
            best = int((self.curve @ price - self.taken).argmax())
            return self.curve[best], float(self.curve[best] @ price - self.taken[best])
        size = float(np.hypot(*price))
        towards = math.atan2(price[1], price[0])
        lean = self.actuator.lean
        phi = self._direction(towards - lean)
        uneven = float(self.actuator.unevenness(phi))
        force, earned = self.rays[0].answer(size * uneven * math.cos(phi + lean - towards))
        return force * uneven * np.array([math.cos(phi + lean), math.sin(phi + lean)]), earned

    def watts_at(self, numbers: Array, costs: Any) -> float:
        """Watts at the numbers of `_polar`, with a spline of the costs over sizes."""
        actuator = self.actuator
        if actuator.kind == "propeller_rudder":
            return float(actuator.propeller_watts(numbers[1]))
        if actuator.kind in ("thruster", "rudder"):
            return float(actuator.watts(np.array([numbers[0], 0.0, 0.0])))
        return float(costs(numbers[0]))

    def _direction(self, towards: float) -> float:
        """The zero direction [rad] at which a force is worth most, the price pointing at
        `towards`."""
        span = math.pi if self.full else self.half
        off = (towards - self.middle + math.pi) % (2.0 * math.pi) - math.pi
        nearest = min(max(off, -span), span)
        if self.actuator.unevenness(0.0) == 1.0 and self.actuator.unevenness(1.0) == 1.0:
            return self.middle + nearest
        grid = self.middle + span * np.linspace(-1.0, 1.0, 361)
        worth = self.actuator.unevenness(grid) * np.cos(grid - self.middle - off)
        best = int(worth.argmax())
        if 0 < best < 360:
            left, here, right = worth[best - 1 : best + 2]
            bend = left - 2.0 * here + right
            shift = 0.5 * (left - right) / bend if bend else 0.0
            return float(grid[best] + shift * (grid[1] - grid[0]))
        return float(grid[best])


class _Ray:
    """Costs over sizes along one direction, and the convex hull of them."""

    def __init__(self, sizes: Array, costs: Array) -> None:
        self.sizes = sizes
        self.costs = costs

        def slope(a: int, b: int) -> float:
            return float((costs[b] - costs[a]) / (sizes[b] - sizes[a]))

        keep = [0]
        for k in range(1, len(sizes)):
            if sizes[k] <= sizes[keep[-1]]:
                continue
            while len(keep) > 1 and slope(keep[-2], keep[-1]) >= slope(keep[-1], k):
                keep.pop()
            keep.append(k)
        self.corner = sizes[keep]
        self.worth = costs[keep]
        self.slopes = np.diff(self.worth) / np.diff(self.corner)

    def answer(self, price: float) -> tuple[float, float]:
        """The size that earns most at a price, and what it earns."""
        k = int(np.searchsorted(self.slopes, price))
        size = float(self.corner[k])
        earned = float(price * self.corner[k] - self.worth[k])
        if not 0 < k < len(self.slopes):
            return size, earned
        # Between three corners the cost is a parabola.
        below = self.slopes[k - 1]
        above = self.slopes[k]
        left = self.corner[k - 1] - size
        right = self.corner[k + 1] - size
        if right > -3.0 * left or -left > 3.0 * right:
            return size, earned  # the end of a piece that is not convex
        bend = (above - below) / (right - left)
        slope = below - bend * left
        step = min(max(0.5 * (price - slope) / bend, left), right) if bend > 0.0 else 0.0
        return size + step, earned + step * (price - slope - bend * step)


def fin_costs(actuator: OracleActuator) -> tuple[Array, Array]:
    """Thrusts (LEVELS,) [N] of a fin and the least watts of each, over all amplitudes and
    frequencies."""
    low, high = actuator.limits
    amplitudes = np.linspace(low[0], high[0], 161)
    soft = actuator.model["type"] == "soft"
    x_most = high[0] * high[1]
    if soft:
        x = np.linspace(low[0] * low[1], x_most, 20001)
        x_most = x[int(actuator.thrust(x, np.ones_like(x)).argmax())]
    least = float(actuator.thrust(low[0], low[1]))
    most = float(actuator.thrust(x_most, 1.0) if soft else actuator.thrust(high[0], high[1]))
    sizes = least + SHARES * (most - least)
    if soft:
        x = np.linspace(low[0] * low[1], x_most, 40001)
        needed = np.interp(sizes, actuator.thrust(x, np.ones_like(x)), x)
        ends = [needed / low[1] if low[1] else np.full_like(needed, np.inf), needed / high[1]]
    else:
        finer = np.linspace(low[0], high[0], 20001)
        unit = actuator.thrust(finer, 1.0)
        ends = [np.interp(sizes / max(f, 1e-9) ** 2, unit, finer) for f in (low[1], high[1])]
    ends = [np.clip(end, low[0], high[0]) for end in ends]
    tried = np.concatenate([np.repeat(amplitudes[:, None], LEVELS, 1), np.stack(ends)])
    if soft:
        frequency = needed / np.maximum(tried, 1e-12)
    else:
        unit = actuator.thrust(tried, 1.0)
        frequency = np.sqrt(sizes / np.maximum(unit, 1e-300))
    possible = (frequency >= low[1] * (1 - 1e-7) - 1e-12) & (frequency <= high[1] * (1 + 1e-7))
    watts = np.where(possible, actuator.beating(tried, frequency), np.inf).min(axis=0)
    good = np.isfinite(watts)
    return sizes[good], watts[good]


@cache
def _sets(plant: OraclePlant) -> tuple[OracleSet, ...]:
    """What each actuator of a robot may give."""
    return tuple(OracleSet(each) for each in plant.actuators)


def _halves(plant: OraclePlant, most: int) -> list[tuple[OracleSet, ...]]:
    """The robot with each arc that is no convex set cut into two, in all ways; at most `most` such
    arcs."""
    choices: list[list[OracleSet]] = []
    cut = 0
    for each in _sets(plant):
        if each.wide and cut < most:
            cut += 1
            ends = (each.middle - each.half, each.middle, each.middle + each.half)
            choices.append([OracleSet(each.actuator, arc) for arc in itertools.pairwise(ends)])
        else:
            choices.append([each])
    return list(itertools.product(*choices))


def lower_bound(plant: OraclePlant, wrench: Array, cut: int = 4) -> float:
    """Watts that no commands undercut which give a wrench (6,): the largest dual value that BFGS
    finds, the least over all ways to halve up to `cut` wide arcs; infinite where it shows the
    wrench out of reach."""
    return min(_dual(plant, sets, wrench)[0] for sets in _halves(plant, cut))


def _polar(sets: tuple[OracleSet, ...], forces: list[Array]) -> Array:
    """Forces as sizes and zero directions, those of a thruster as they are."""
    parts = []
    for each, force in zip(sets, forces, strict=True):
        if each.actuator.kind == "rudder":
            place = np.square(each.curve - force).sum(axis=1).argmin()
            parts.append(each.angles[place : place + 1])
            continue
        if len(force) == 1:
            parts.append(force)
            continue
        if each.actuator.kind == "propeller_rudder":
            size = max(float(force[0]), 0.0)
            offset = force - each.curve - size * each.per_newton
            place = np.square(offset).sum(axis=1).argmin()
            parts.append(np.array([each.angles[place], force[0]]))
            continue
        turned = math.atan2(force[1], force[0]) - each.actuator.lean
        phi = each.middle + (turned - each.middle + math.pi) % (2.0 * math.pi) - math.pi
        parts.append(np.array([np.hypot(*force) / each.actuator.unevenness(phi), phi]))
    return np.concatenate(parts)


def _dual(
    plant: OraclePlant, sets: tuple[OracleSet, ...], wrench: Array
) -> tuple[float, list[Array]]:
    """The largest value of the dual of one robot of convex sets, and the forces that answer its
    prices."""
    effectiveness = plant.effectiveness / plant.scales[:, None]
    target = wrench / plant.scales
    widths = [each.actuator.effectiveness.shape[1] for each in sets]
    starts = np.concatenate([[0], np.cumsum(widths)])
    top = sum(max(ray.costs.max() for ray in each.rays) for each in sets)

    def loss(multiplier: Array) -> tuple[float, Array]:
        price = top * multiplier @ effectiveness
        gap = target.copy()
        value = top * float(multiplier @ target)
        for each, a, b in zip(sets, starts[:-1], starts[1:], strict=True):
            force, earned = each.answer(price[a:b])
            value -= earned
            gap -= effectiveness[:, a:b] @ force
        return -value / top, -gap

    def proved(intermediate_result: Any) -> None:
        if intermediate_result.fun < -1.001:
            raise StopIteration

    best = -np.inf
    start = np.linalg.pinv(effectiveness.T) @ (np.linalg.pinv(effectiveness) @ target)
    start *= 1.0 / max(np.abs(start).max(), 1e-12) * 0.1
    for _ in range(3):
        options = {"gtol": 1e-9, "maxiter": 300}
        end = minimize(loss, start, jac=True, method="BFGS", options=options, callback=proved)
        gain = -end.fun - best
        best = max(best, -end.fun)
        start = end.x
        if best > 1.001:
            best = np.inf
        if gain < 1e-9 or best == np.inf:
            break
    price = top * start @ effectiveness
    forces = [
        each.answer(price[a:b])[0] for each, a, b in zip(sets, starts[:-1], starts[1:], strict=True)
    ]
    return best * top, forces


def least_known(plant: OraclePlant, wrench: Array, starts: int = 8, seed: int = 0) -> float | None:
    """The fewest watts (or None) that SLSQP finds for a wrench (6,) over sizes and directions of
    forces."""
    rng = np.random.default_rng(seed)
    sets = _sets(plant)
    scale = plant.scales
    low, high = _ends(sets)
    splines = [
        CubicSpline(each.rays[0].sizes, each.rays[0].costs) if len(low_high) else None
        for each, low_high in zip(sets, low, strict=True)
    ]
    bounds = np.concatenate([np.stack([a, b], 1) for a, b in zip(low, high, strict=True)])
    parts = np.cumsum([0, *map(len, low)])

    def forces(x: Array) -> list[Array]:
        out = []
        for each, a, b in zip(sets, parts[:-1], parts[1:], strict=True):
            part = x[a:b]
            if each.actuator.kind == "rudder":
                out.append(each.actuator.foil(part)[0][0])
            elif len(part) == 1:
                out.append(part)
            elif each.actuator.kind == "propeller_rudder":
                out.append(each.actuator.steered(part[0], part[1]))
            else:
                size = part[0] * each.actuator.unevenness(part[1])
                angle = part[1] + each.actuator.lean
                out.append(size * np.array([math.cos(angle), math.sin(angle)]))
        return out

    def missing(x: Array) -> Array:
        return (plant.effectiveness @ np.concatenate(forces(x)) - wrench) / scale

    def watts(x: Array) -> float:
        total = 0.0
        for each, spline, a in zip(sets, splines, parts[:-1], strict=True):
            total += each.watts_at(x[a:], spline)
        return total

    pulled = [_polar(sets, _dual(plant, halves, wrench)[1]) for halves in _halves(plant, 2)]
    best = None
    unit = max(sum(float(each.rays[0].costs.max()) for each in sets), 1e-9)
    for k in range(len(pulled) + starts):
        x0 = bounds[:, 0] + rng.random(len(bounds)) * (bounds[:, 1] - bounds[:, 0])
        if k < len(pulled):
            x0 = np.clip(pulled[k], bounds[:, 0], bounds[:, 1])
        end = minimize(
            lambda x: watts(x) / unit,
            x0,
            bounds=bounds,
            constraints=[{"type": "eq", "fun": missing}],
            method="SLSQP",
            options={"maxiter": 400, "ftol": 1e-12},
        )
        if np.abs(missing(end.x)).max() < 1e-6 and (best is None or watts(end.x) < best):
            best = watts(end.x)
    return best


def _ends(sets: tuple[OracleSet, ...]) -> tuple[list[Array], list[Array]]:
    """Least and largest size and direction by actuator; thrusters have a force alone."""
    low = []
    high = []
    for each in sets:
        if each.actuator.kind in ("thruster", "rudder"):
            ends = each.actuator.limits
            low.append(ends[0][:1])
            high.append(ends[1][:1])
            continue
        if each.actuator.kind == "propeller_rudder":
            ends = each.actuator.limits
            low.append(ends[0][:2])
            high.append(ends[1][:2])
            if each.actuator.flow.any():
                low[-1] = low[-1].clip([-np.inf, 0.0])
            continue
        sizes = each.rays[0].sizes
        span = 3.0 * math.pi if each.full else each.half
        low.append(np.array([sizes[0], each.middle - span]))
        high.append(np.array([sizes[-1], each.middle + span]))
    return low, high


def farthest(plant: OraclePlant, wrench: Array, count: int = 257) -> float:
    """How many times a wrench (6,) can be given at most: a linear program over the corners of the
    hulls of the actuators' forces, at least 0.9999 of the truth; wide arcs are halved in all
    ways."""
    best = 0.0
    for corners in itertools.product(*(_corners(each, count) for each in _sets(plant))):
        best = max(best, _farthest(plant, corners, wrench))
    return best


@cache
def _corners(each: OracleSet, count: int) -> list[Array]:
    """Points on the edges of what an actuator may give, of a wide sector in two halves."""
    edge = edge_forces(each.actuator, count)
    if not each.wide:
        return [edge]
    middle = count // 2
    return [
        np.concatenate([edge[a:b], edge[count + a : count + b]])
        for a, b in ((0, middle + 1), (middle, count))
    ]


def least_miss(plant: OraclePlant, wrench: Array, count: int = 257) -> float:
    """The least length of the missing wrench over `OraclePlant.scales` for a wrench (6,): least
    squares over the corners of the hulls of the actuators' forces (nonnegative, each hull's shares
    add up to 1)."""
    best = np.inf
    for corners in itertools.product(*(_corners(each, count) for each in _sets(plant))):
        columns, ones = _hulls(plant, corners)
        weight = 1e3  # of the sums of shares beside the wrench
        right = np.concatenate([wrench / plant.scales, weight * np.ones(len(ones))])
        shares, _ = nnls(np.vstack([columns, weight * ones]), right, maxiter=100 * columns.shape[1])
        best = min(best, float(np.linalg.norm(columns @ shares - wrench / plant.scales)))
    return best


def _hulls(plant: OraclePlant, corners: tuple[Array, ...]) -> tuple[Array, Array]:
    """Scaled wrenches (6, K) of the corners of all hulls, and which hull (n, K) each belongs to."""
    blocks = [
        points @ each.effectiveness.T for each, points in zip(plant.actuators, corners, strict=True)
    ]
    hull = np.repeat(np.arange(len(blocks)), [len(block) for block in blocks])
    columns: Array = np.concatenate(blocks).T / plant.scales[:, None]
    return columns, (hull == np.arange(len(blocks))[:, None]).astype(float)


def _farthest(plant: OraclePlant, corners: tuple[Array, ...], wrench: Array) -> float:
    """How many times a wrench a robot can give, by a linear program over corners."""
    columns, ones = _hulls(plant, corners)
    columns = np.hstack([columns, -(wrench / plant.scales)[:, None]])
    ones = np.hstack([ones, np.zeros((len(ones), 1))])
    cost = np.zeros(columns.shape[1])
    cost[-1] = -1.0
    right = np.concatenate([np.zeros(6), np.ones(len(ones))])
    answer = linprog(cost, A_eq=np.vstack([columns, ones]), b_eq=right, method="highs")
    return float(answer.x[-1]) if answer.status == 0 else 0.0


def conic_optimum(plant: OraclePlant, wrench: Array) -> tuple[float, Array]:
    """Least watts and forces (n,) [N] of thrusters that give a wrench (6,), by Clarabel on power
    cones.

    Each force is a part ahead less a part back; a part y within [0, most] costs k t with t >= y^p,
    the cone t^(1/p) 1^(1 - 1/p) >= |y|. Needs Clarabel, an extra of the tests.

    Raises:
        ValueError: the wrench is out of reach, or Clarabel does not solve it.
    """
    import clarabel
    from scipy import sparse

    n = len(plant.actuators)
    parts = list(product(range(n), (1.0, -1.0)))
    ends = np.array([each.limits for each in plant.actuators])[:, :, 0]
    if (ends[:, 0] > 0.0).any() or (ends[:, 1] < 0.0).any():
        raise ValueError("expected thrusters whose limits hold 0")
    scale = plant.scales
    columns = (
        np.stack([sign * plant.effectiveness[:, i] for i, sign in parts], axis=1) / scale[:, None]
    )
    m = len(parts)
    most = np.array([ends[i, 1] if sign > 0.0 else -ends[i, 0] for i, sign in parts])
    ways = np.array([sign for _, sign in parts])
    price = [plant.actuators[i].model["forward" if sign > 0.0 else "reverse"] for i, sign in parts]
    exponent = np.array([plant.actuators[i].model["exponent"] for i, _ in parts])
    unit = np.maximum(most, 1e-9)
    cost = np.concatenate([np.zeros(m), np.array(price) * unit**exponent])
    reached = sparse.csc_matrix(np.hstack([columns * unit, np.zeros((6, m))]))
    eye = sparse.identity(m)
    zero = sparse.csc_matrix((m, m))
    rows: list[sparse.spmatrix] = [reached, sparse.hstack([eye, zero]), sparse.hstack([-eye, zero])]
    right = [wrench / scale, (most > 0.0).astype(float), np.zeros(m)]
    cones = [clarabel.ZeroConeT(6), clarabel.NonnegativeConeT(2 * m)]
    for k in range(m):
        cone = sparse.csc_matrix(([-1.0, -1.0], ([0, 2], [m + k, k])), shape=(3, 2 * m))
        rows.append(cone)
        right.append(np.array([0.0, 1.0, 0.0]))
        cones.append(clarabel.PowerConeT(1.0 / exponent[k]))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-9
    nothing = sparse.csc_matrix((2 * m, 2 * m))
    scaled = cost / cost.max()
    matrix = sparse.csc_matrix(sparse.vstack(rows))
    answer = clarabel.DefaultSolver(
        nothing, scaled, matrix, np.concatenate(right), cones, settings
    ).solve()
    if "Solved" not in str(answer.status):
        raise ValueError(f"Clarabel: {answer.status}")
    share = np.array(answer.x[:m])
    force: NDArray[np.float64] = (unit * share * ways).reshape(n, 2).sum(axis=1)
    return float(answer.obj_val * cost.max()), force
