"""Whether a file of a proof is true, by decimals of 60 digits: shares no code with the checker.

Sectors are taken by angles, and by samples of their directions; hulls by samples of means. Anything
that cannot be read counts as false.
"""

import json
import math
from decimal import Decimal, getcontext
from itertools import chain, combinations, product
from typing import Any

import numpy as np

getcontext().prec = 60
AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
EXACT = Decimal("1e-40")
"""Most by which numbers that are the same differ, from rounding."""
NEAR = 1e-9
"""Most by which angles [rad] that are the same differ, and forces over the largest one [1]."""
SAMPLES = 181
"""Directions of an arc that are looked at."""
MEANS = np.random.default_rng(65).dirichlet(np.full(3, 0.3), 60)
"""Weights (60, 3) of means of three forces."""
Angles = tuple[float, float]
"""Where a sector begins, and how far it goes on counterclockwise [rad]."""
Side = tuple[Angles, Decimal, Decimal, int]
"""A sector, its least and largest force [N], and 1 ahead or -1 astern."""


def is_true(text: str) -> bool:
    """Whether what a file claims holds."""
    try:
        proof = json.loads(text, parse_float=str, parse_int=str)
        return _holds(proof)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return False


def _decimal(value: str) -> Decimal:
    numerator, _, denominator = value.partition("/")
    return Decimal(numerator) / Decimal(denominator or 1)


def _array(values: Any) -> Any:
    if isinstance(values, list):
        return np.array([_array(value) for value in values], dtype=object)
    return _decimal(values)


def _holds(proof: dict[str, Any]) -> bool:
    statement = proof["statement"]
    axes = [axis for axis in AXES if axis in statement["box"]]
    box = dict(zip(axes, (_decimal(statement["box"][axis]) for axis in axes), strict=True))
    complete = sorted([*statement["box"], *statement["free"]]) == sorted(AXES)
    if proof["format"] != "finlab-proof" or proof["version"] != "3" or not complete:
        return False
    if min(box.values()) < 0:
        return False
    robot = {}
    for actuator in proof["actuators"]:
        robot[actuator["name"]] = _Oracle(actuator, axes)
    if len(robot) != len(proof["actuators"]) or not all(part.sane for part in robot.values()):
        return False
    count = int(statement["lost"])
    budget = None if statement["power_w"] is None else _decimal(statement["power_w"])
    tolerance = _decimal(statement["wrench_tolerance"])
    if not 0 <= count <= len(robot) or tolerance < 0:
        return False
    if proof["verdict"] == "refuted":
        return _separates(proof["counterexample"], robot, box, count, budget, tolerance)
    cases = {frozenset(case["lost"]): case for case in proof["cases"]}
    subsets = chain.from_iterable(combinations(robot, k) for k in range(count + 1))
    low = [-half for half in box.values()]
    high = [*box.values()]
    for lost in subsets:
        working = {name: part for name, part in robot.items() if name not in lost}
        case = cases[frozenset(lost)]
        if not _covers_box(case, working, [*box], low, high, budget, tolerance):
            return False
    return bool(proof["verdict"] == "proved")


def _covers_box(
    case: dict[str, Any],
    working: dict[str, "_Oracle"],
    axes: list[str],
    low: list[Decimal],
    high: list[Decimal],
    budget: Decimal | None,
    tolerance: Decimal,
) -> bool:
    """Whether a box of a case, and those that it is split into, are given."""
    if "axis" in case:
        k = axes.index(case["axis"])
        middle = _decimal(case["at"])
        if not low[k] < middle < high[k]:
            return False
        top = [*high]
        top[k] = middle
        bottom = [*low]
        bottom[k] = middle
        below = _covers_box(case["below"], working, axes, low, top, budget, tolerance)
        above = _covers_box(case["above"], working, axes, bottom, high, budget, tolerance)
        return below and above
    return _gives_corners(case["corners"], working, low, high, budget, tolerance)


def _gives_corners(
    forces_at: dict[str, Any],
    working: dict[str, "_Oracle"],
    low: list[Decimal],
    high: list[Decimal],
    budget: Decimal | None,
    tolerance: Decimal,
) -> bool:
    """Whether the corners of a box, and means of them, are given."""
    ends = [("+", "-") if a < b else ("0",) for a, b in zip(low, high, strict=True)]
    corners = ["".join(signs) for signs in product(*ends)]
    forces_of = {}
    for name, part in working.items():
        forces = [_array(forces_at[corner][name]) for corner in corners]
        if any(len(force) != len(part.columns) for force in forces):
            return False
        forces_of[name] = np.array(forces)
        if not part.has_hull(forces_of[name], part.sides(part.inner)):
            return False
    for number, corner in enumerate(corners):
        target = []
        for sign, a, b in zip(corner, low, high, strict=True):
            target.append(b if sign == "+" else a)
        if set(forces_at[corner]) != set(working):
            return False
        wrench = np.array(target) * 0
        for name, part in working.items():
            wrench = wrench + forces_of[name][number] @ part.columns
        if max(abs(wrench - np.array(target))) > tolerance + EXACT:
            return False
    if budget is None:
        return True
    watts = np.zeros(len(corners), dtype=object)
    for name, part in working.items():
        watts = watts + part.watts_of(forces_of[name])
    return bool(max(watts) <= budget)


def _separates(
    example: dict[str, Any],
    robot: dict[str, "_Oracle"],
    box: dict[str, Decimal],
    count: int,
    budget: Decimal | None,
    tolerance: Decimal,
) -> bool:
    lost = set(example["lost"])
    if len(lost) > count or not lost <= set(robot) or set(example["wrench"]) != set(box):
        return False
    target = np.array([_decimal(example["wrench"][axis]) for axis in box])
    if any(abs(w) > half for w, half in zip(target, box.values(), strict=True)):
        return False
    working = {name: part for name, part in robot.items() if name not in lost}
    sets = {name: part.sides(part.outer) for name, part in working.items()}
    return _tree_separates(example["tree"], working, sets, target, budget, tolerance)


def _tree_separates(
    tree: dict[str, Any],
    working: dict[str, "_Oracle"],
    sets: dict[str, list[Side]],
    target: Any,
    budget: Decimal | None,
    tolerance: Decimal,
) -> bool:
    """Whether each choice of sectors has a price that separates."""
    if "cut" in tree:
        name = tree["cut"]
        branches = []
        for side, branch in zip(sets[name], tree["each"], strict=True):
            chosen = {**sets, name: [side]}
            branches.append(_tree_separates(branch, working, chosen, target, budget, tolerance))
        return all(branches)
    price = _array(tree["price"])
    per_watt = _decimal(tree["watt_price"])
    if per_watt < 0 or (budget is None and per_watt):
        return False
    profit = per_watt * (budget or 0)
    for name, part in working.items():
        profit += part.most_profit(part.columns @ price, per_watt, sets[name])
    # The profit here is a little too small, by samples: what it does not separate is false.
    return bool(profit < price @ target - tolerance * sum(abs(price)))


def _angles(arc: Any) -> Angles:
    """An arc by its first and last direction."""
    (x0, y0), (x1, y1) = np.array(_array(arc), float)
    first = math.atan2(y0, x0)
    width = (math.atan2(y1, x1) - first) % (2.0 * math.pi)
    return first, 0.0 if width > 2.0 * math.pi - NEAR else width


def _is_in(sector: Angles, angle: Any) -> Any:
    """Whether a sector has directions [rad]."""
    first, width = sector
    return (angle - first + NEAR) % (2.0 * math.pi) <= width + 2.0 * NEAR


class _Oracle:
    def __init__(self, actuator: dict[str, Any], axes: list[str]) -> None:
        directions = _array(actuator["axes"])
        position = _array(actuator["position_m"])
        reaction = _decimal(actuator["torque_per_newton_m"])
        torque = np.cross(position, directions) + reaction * directions
        whole = np.concatenate([directions, torque], axis=1)
        self.columns = whole[:, [AXES.index(axis) for axis in axes]]
        self.inner = [_decimal(end) for end in actuator["force_n"]]
        self.outer = [_decimal(end) for end in actuator["outer_force_n"]]
        self.least = max(self.inner[0], Decimal(0))
        self.power = actuator["power"]
        self.mean = actuator["mean"]
        self.sectors = [_angles(sector) for sector in actuator["sectors"]]
        lengths = [
            float(_array(edge) @ _array(edge)) for arc in actuator["sectors"] for edge in arc
        ]
        is_long = all(1.0 <= length < 2.0 for length in lengths)
        norms = (directions * directions).sum(axis=1)
        square = len(directions) == 1 or abs(directions[0] @ directions[1]) < Decimal("1e-9")
        unit = max(abs(norms - 1)) < Decimal("1e-9")
        low, high = self.outer
        least, most = self.inner
        narrow = all(width <= math.pi + NEAR for _, width in self.sectors)
        one = not self.mean or low <= 0 or len(self.sectors) == 1
        ordered = low <= least <= most <= high and most >= 0
        kind = unit and square and is_long and narrow and one and len(directions) < 3
        line = len(directions) == 2 or self.sectors == [(0.0, 0.0)]
        self.sane = bool(kind and ordered and line)

    def sides(self, limits: list[Decimal]) -> list[Side]:
        """The sectors ahead, and astern."""
        low, high = limits
        found: list[Side] = [(each, max(low, Decimal(0)), high, 1) for each in self.sectors]
        if low < 0:
            for first, width in self.sectors:
                found.append(((first + math.pi, width), Decimal(0), -low, -1))
        return found

    def has_hull(self, forces: Any, sides: list[Side]) -> bool:
        """Whether sectors have forces (C, 1 or 2), and means of them."""
        plane = np.zeros((len(forces), 2), dtype=object)
        plane[:, : forces.shape[1]] = forces
        if self.mean and self.least > 0:
            return any(all(self._is_mean(side, force) for force in plane) for side in sides)
        for force in plane:
            if not any(self._has(side, force) for side in sides):
                return False
        points = plane.astype(float)
        rng = np.random.default_rng(66)
        chosen = rng.integers(0, len(points), (300, 3))
        means = np.einsum("mk,tkx->tmx", MEANS, points[chosen]).reshape(-1, 2)
        size = np.linalg.norm(means, axis=1)
        angle = np.arctan2(means[:, 1], means[:, 0])
        near = NEAR * float(self.inner[1] - min(self.inner[0], 0))
        found = np.zeros(len(means), bool)
        for sector, least, most, _ in sides:
            is_size = (size <= float(most) + near) & (size >= float(least) - near)
            found |= is_size & ((size <= near) | _is_in(sector, angle))
        return bool(found.all())

    def _has(self, side: Side, force: Any) -> bool:
        """Whether a sector has a force."""
        sector, least, most, _ = side
        square = force @ force
        x, y = np.array(force, float)
        inside = math.hypot(x, y) < NEAR * float(most) or _is_in(sector, math.atan2(y, x))
        return bool(inside and least**2 * (1 - EXACT) <= square <= most**2 * (1 + EXACT))

    def _is_mean(self, side: Side, force: Any) -> bool:
        """Whether a force is a mean of those of a sector: beyond the chord of its least ones."""
        (first, width), least, most, _ = side
        x, y = np.array(force, float)
        half = 0.5 * width
        along = x * math.cos(first + half) + y * math.sin(first + half)
        inside = self._has(((first, width), Decimal(0), most, 1), force)
        return bool(inside and along >= float(least) * math.cos(half) - NEAR)

    def watts_of(self, forces: Any) -> Any:
        """The power of forces (C, 1 or 2) [W], a convex function of all their means."""
        if forces.shape[1] == 1:
            return np.array([self._watts(force[0]) for force in forces], dtype=object)
        ahead = [side for side in self.sides(self.inner) if side[3] > 0]
        is_ahead = self.has_hull(forces, ahead)
        watts = []
        for force in forces:
            size = max((force @ force).sqrt(), self.least)
            forward = self._watts(size)
            watts.append(forward if is_ahead else max(forward, self._watts(-size)))
        return np.array(watts, dtype=object)

    def _watts(self, size: Decimal) -> Decimal:
        """The power of a force by the curve [W]."""
        x, y = _array(self.power["points"]).T
        i = min(max(int(np.searchsorted(x, size)), 1), len(x) - 1)
        slope = (y[i] - y[i - 1]) / (x[i] - x[i - 1])
        watts: Decimal = y[i - 1] + slope * (size - x[i - 1])
        return watts

    def most_profit(self, own_price: Any, per_watt: Decimal, sides: list[Side]) -> Decimal:
        """The largest profit among samples of the forces of sectors."""
        price = np.zeros(2, dtype=object)
        price[: len(own_price)] = own_price
        toward = math.atan2(float(price[1]), float(price[0]))
        best = Decimal("-Infinity")
        for sector, least, most, sign in sides:
            first, width = sector
            angles = [*(first + width * np.linspace(0.0, 1.0, SAMPLES))]
            angles += [toward] if _is_in(sector, toward) else []
            # They are a little shorter than 1, whatever rounding does.
            gains = []
            for angle in angles:
                unit = np.array([Decimal(math.cos(angle)), Decimal(math.sin(angle))])
                gains.append(price @ unit * (1 - Decimal("1e-14")))
            for size in [least + (most - least) * k / 40 for k in range(41)]:
                profit = max(gains) * size
                if per_watt:
                    error = _decimal(self.power["error_w"])
                    profit -= per_watt * (self._watts(sign * size) - error)
                best = max(best, profit)
        return best
