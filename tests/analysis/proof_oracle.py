"""Whether a file of a proof is true, by decimals of 60 digits: shares no code with the checker.

Arcs are taken by angles, and by samples of their directions. Anything that cannot be read counts as
false.
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
Angles = tuple[float, float]
"""Where an arc begins, and how far it goes on counterclockwise [rad]."""


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
    if proof["format"] != "finlab-proof" or proof["version"] != "2" or not complete:
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
    parts = {}
    for name, part in working.items():
        parts[name] = case["parts"].get(name, {})
        if not part.is_convex(parts[name]):
            return False
    ends = [("+", "-") if a < b else ("0",) for a, b in zip(low, high, strict=True)]
    for signs in product(*ends):
        target = []
        for sign, a, b in zip(signs, low, high, strict=True):
            target.append(b if sign == "+" else a)
        forces = case["corners"]["".join(signs)]
        if not _gives(forces, working, parts, np.array(target), budget, tolerance):
            return False
    return True


def _gives(
    forces: dict[str, Any],
    working: dict[str, "_Oracle"],
    parts: dict[str, Any],
    target: Any,
    budget: Decimal | None,
    tolerance: Decimal,
) -> bool:
    if set(forces) != set(working):
        return False
    wrench = target * 0
    watts = Decimal(0)
    for name, force in forces.items():
        size = _array(force)
        if not working[name].can(size, parts[name]):
            return False
        wrench = wrench + size @ working[name].columns
        if budget is not None:
            watts += working[name].watts(size, parts[name])
    is_near = max(abs(wrench - target)) <= tolerance + EXACT
    return bool(is_near and (budget is None or watts <= budget))


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
    sets = {name: (part.arcs, part.outer) for name, part in working.items()}
    return _tree_separates(example["tree"], working, sets, target, budget, tolerance)


def _tree_separates(
    tree: dict[str, Any],
    working: dict[str, "_Oracle"],
    sets: dict[str, tuple[list[Angles] | None, list[Decimal]]],
    target: Any,
    budget: Decimal | None,
    tolerance: Decimal,
) -> bool:
    """Whether each choice of pieces of the arcs has a price that separates."""
    if "cut" in tree:
        name = tree["cut"]
        arcs, (low, high) = sets[name]
        if "sides" in tree:
            if low > 0 or len(tree["sides"]) != 2:
                return False
            halves = []
            for ends, branch in zip(
                ([Decimal(0), high], [low, Decimal(0)]), tree["sides"], strict=True
            ):
                chosen = {**sets, name: (arcs, ends)}
                halves.append(_tree_separates(branch, working, chosen, target, budget, tolerance))
            return all(halves)
        pieces = [_angles(piece) for piece in tree["arcs"]]
        if not working[name].may_cut(arcs, pieces):
            return False
        branches = []
        for piece, branch in zip(pieces, tree["each"], strict=True):
            chosen = {**sets, name: ([piece], [low, high])}
            branches.append(_tree_separates(branch, working, chosen, target, budget, tolerance))
        return all(branches)
    price = _array(tree["price"])
    per_watt = _decimal(tree["watt_price"])
    if per_watt < 0 or (budget is None and per_watt):
        return False
    profit = per_watt * (budget or 0)
    for name, part in working.items():
        profit += part.most_profit(part.columns @ price, per_watt, *sets[name])
    # The profit here is a little too small, by samples: what it does not separate is false.
    return bool(profit < price @ target - tolerance * sum(abs(price)))


def _angles(arc: Any) -> Angles:
    """An arc by its first and last direction."""
    (x0, y0), (x1, y1) = np.array(_array(arc), float)
    first = math.atan2(y0, x0)
    width = (math.atan2(y1, x1) - first) % (2.0 * math.pi)
    return first, 0.0 if width > 2.0 * math.pi - NEAR else width


def _is_in(arcs: list[Angles] | None, angle: float) -> bool:
    """Whether some arc has a direction [rad]."""
    if arcs is None:
        return True
    for first, width in arcs:
        beyond = (angle - first + NEAR) % (2.0 * math.pi)
        if beyond <= width + 2.0 * NEAR:
            return True
    return False


def _directions(arcs: list[Angles] | None) -> Any:
    """Samples of the directions of arcs [rad]."""
    found = []
    for first, width in arcs or [(0.0, 2.0 * math.pi)]:
        found.append(first + width * np.linspace(0.0, 1.0, SAMPLES))
    return np.concatenate(found)


class _Oracle:
    def __init__(self, actuator: dict[str, Any], axes: list[str]) -> None:
        directions = _array(actuator["axes"])
        position = _array(actuator["position_m"])
        reaction = _decimal(actuator["torque_per_newton_m"])
        torque = np.cross(position, directions) + reaction * directions
        whole = np.concatenate([directions, torque], axis=1)
        self.columns = whole[:, [AXES.index(axis) for axis in axes]]
        self.least, self.most = map(_decimal, actuator["force_n"])
        self.outer = [_decimal(end) for end in actuator["outer_force_n"]]
        self.power = actuator["power"]
        self.mean = actuator["mean"]
        own = actuator["arcs"]
        self.arcs = None if own is None else [_angles(arc) for arc in own]
        lengths = [float(_array(edge) @ _array(edge)) for arc in own or [] for edge in arc]
        is_long = all(1.0 <= length < 2.0 for length in lengths)
        norms = (directions * directions).sum(axis=1)
        square = len(directions) == 1 or abs(directions[0] @ directions[1]) < Decimal("1e-9")
        unit = max(abs(norms - 1)) < Decimal("1e-9")
        low, high = self.outer
        narrow = self.arcs is not None and all(w < math.pi - NEAR for _, w in self.arcs)
        has_means = self.mean and not narrow and len(directions) == 2
        covered = low <= self.least and high >= self.most and (low <= 0 or not has_means)
        ordered = self.most >= self.least and self.most >= 0
        kind = unit and square and is_long and len(directions) < 3
        self.sane = bool(kind and covered and ordered)

    def is_convex(self, part: dict[str, Any]) -> bool:
        """Whether the part that a file names is convex, and one of the forces'."""
        if len(self.columns) == 1:
            return True
        if "line" in part:
            x, y = np.array(_array(part["line"]), float)
            return bool(self.least <= 0 and _is_in(self.arcs, math.atan2(y, x)))
        if "disc" in part:
            wide = self.arcs is None or max(width for _, width in self.arcs) >= math.pi - NEAR
            return bool(self.least <= 0 and wide)
        if "astern" in part and self.least > 0:
            return False
        if "arc" not in part:
            return self.arcs is None or (len(self.arcs) == 1 and self.arcs[0][1] <= math.pi + NEAR)
        arc = _angles(part["arc"])
        is_inside = all(_is_in(self.arcs, angle) for angle in _directions([arc]))
        return bool(arc[1] <= math.pi + NEAR and is_inside)

    def can(self, force: Any, part: dict[str, Any]) -> bool:
        """Whether a force is within a part."""
        if len(force) != len(self.columns):
            return False
        if len(force) == 1:
            return bool(self.least <= force[0] <= self.most)
        square = force @ force
        if "line" in part:
            line = _array(part["line"])
            end = self.most if line @ force >= 0 else self.least
            off = abs(line[0] * force[1] - line[1] * force[0])
            return bool(off <= EXACT and square <= end**2 * (1 + EXACT))
        if "disc" in part:
            return bool(square <= min(self.most, -self.least) ** 2 * (1 + EXACT))
        if "astern" in part:
            force = -force
        most = -self.least if "astern" in part else self.most
        arc = _angles(part["arc"]) if "arc" in part else (self.arcs or [None])[0]
        x, y = np.array(force, float)
        size = math.hypot(x, y)
        inside = size < NEAR * float(most) or arc is None
        inside = inside or _is_in([arc], math.atan2(y, x))
        if self.least > 0:
            if arc is not None and self.mean and arc[1] > 0.0:
                # Beyond the chord between the least forces at both ends.
                half = 0.5 * arc[1]
                along = x * math.cos(arc[0] + half) + y * math.sin(arc[0] + half)
                inside = inside and along >= float(self.least) * math.cos(half) - NEAR
            elif not self.mean or arc is not None:
                ahead = _array(part["ahead"])
                inside = inside and ahead @ ahead <= 1 and ahead @ force >= self.least
        return bool(inside and square <= most**2 * (1 + EXACT))

    def may_cut(self, arcs: list[Angles] | None, pieces: list[Angles]) -> bool:
        """Whether pieces have all directions of arcs, and no means of forces go across them."""
        if self.mean and self.outer[0] > 0:
            return arcs is not None and np.allclose(arcs, pieces, atol=NEAR)
        return all(_is_in(pieces, angle) for angle in _directions(arcs))

    def watts(self, force: Any, part: dict[str, Any] | None = None) -> Decimal:
        size = (force @ force).sqrt()
        if len(force) == 2:
            size = max(size, self.least)
        along = force[0]
        if len(force) == 2:
            line = _array(part["line"]) if part and "line" in part else force
            along = -size if part and "astern" in part else line @ force
        sides = ["reverse" if along < 0 else "forward"]
        if part and "disc" in part:
            sides = ["reverse", "forward"]
        if "exponent" in self.power:
            power: Decimal = size ** _decimal(self.power["exponent"])
            return max(_decimal(self.power[side]) for side in sides) * power
        x, y = _array(self.power["points"]).T
        along = force[0] if len(force) == 1 else size
        i = min(max(int(np.searchsorted(x, along)), 1), len(x) - 1)
        slope = (y[i] - y[i - 1]) / (x[i] - x[i - 1])
        watts: Decimal = y[i - 1] + slope * (along - x[i - 1])
        return watts

    def most_profit(
        self, own_price: Any, per_watt: Decimal, arcs: list[Angles] | None, outer: list[Decimal]
    ) -> Decimal:
        best = Decimal(0) if per_watt else Decimal("-Infinity")
        error = _decimal(self.power["error_w"]) if self.power and "error_w" in self.power else 0
        for force, part in self._forces(own_price, arcs, outer):
            profit = own_price @ force
            if per_watt:
                profit -= per_watt * (self.watts(force, part) - error)
            best = max(best, profit)
        return best

    def _forces(
        self, own_price: Any, arcs: list[Angles] | None, outer: list[Decimal]
    ) -> list[tuple[Any, dict[str, Any]]]:
        """Forces among which that of the largest profit is nearly, and whether it is astern."""
        low, high = outer
        if len(own_price) == 1:
            ends = [end * k / 40 for end in outer for k in range(1, 41)]
            return [(np.array([size]), {}) for size in ends]
        toward = math.atan2(float(own_price[1]), float(own_price[0]))
        angles = [] if arcs is None else [*_directions(arcs)]
        angles += [turn for turn in (toward, toward + math.pi) if _is_in(arcs, turn)]
        least = max(low, Decimal(0))
        sizes = [least + (high - least) * k / 40 for k in range(41)]
        sizes += [low * k / 40 for k in range(1, 41) if low < 0]
        # Of the directions only that with the largest gain ahead, and astern, counts. They are a
        # little shorter than 1, whatever rounding does.
        gains = []
        for angle in angles:
            unit = np.array([Decimal(math.cos(angle)), Decimal(math.sin(angle))])
            direction = unit * (1 - Decimal("1e-14"))
            gains.append((own_price @ direction, direction))
        ahead = max(gains, key=lambda gain: gain[0])[1]
        astern = min(gains, key=lambda gain: gain[0])[1]
        found = []
        for size in sizes:
            direction = ahead if size >= 0 else astern
            found.append((size * direction, {} if size >= 0 else {"astern": True}))
        return found
