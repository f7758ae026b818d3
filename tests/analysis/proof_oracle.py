"""Whether a file of a proof is true, by decimals of 60 digits: shares no code with the checker.

For robots whose actuators are lines and whole circles; anything else, and anything that cannot be
read, counts as false.
"""

import json
from decimal import Decimal, getcontext
from itertools import chain, combinations, product
from typing import Any

import numpy as np

getcontext().prec = 60
AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
EXACT = Decimal("1e-40")
"""Most by which numbers that are the same differ, from rounding."""


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
        if actuator["arcs"] is not None:
            return False
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
    signs = [(1, -1) if half else (0,) for half in box.values()]
    for lost in subsets:
        corners = cases[frozenset(lost)]["corners"]
        working = {name: part for name, part in robot.items() if name not in lost}
        for corner in product(*signs):
            forces = corners["".join("-0+"[sign + 1] for sign in corner)]
            target = np.array([s * half for s, half in zip(corner, box.values(), strict=True)])
            if not _gives(forces, working, target, budget, tolerance):
                return False
    return bool(proof["verdict"] == "proved")


def _gives(
    forces: dict[str, Any],
    working: dict[str, "_Oracle"],
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
        if not working[name].can(size):
            return False
        wrench = wrench + size @ working[name].columns
        if budget is not None:
            watts += working[name].watts(size)
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
    found = example["tree"]
    price = _array(found["price"])
    per_watt = _decimal(found["watt_price"])
    if per_watt < 0 or (budget is None and per_watt):
        return False
    profit = per_watt * (budget or 0)
    for name, part in robot.items():
        if name not in lost:
            profit += part.most_profit(part.columns @ price, per_watt)
    # The profit here is a little too small, by samples: what it does not separate is false.
    return bool(profit < price @ target - tolerance * sum(abs(price)))


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
        norms = (directions * directions).sum(axis=1)
        square = len(directions) == 1 or abs(directions[0] @ directions[1]) < Decimal("1e-9")
        unit = max(abs(norms - 1)) < Decimal("1e-9")
        low, high = self.outer
        covered = low <= self.least and high >= self.most
        ordered = self.most >= self.least and self.most >= 0
        self.stops = bool(self.least <= 0 or actuator["mean"] or len(directions) == 1)
        self.sane = bool(unit and square and covered and ordered and len(directions) < 3)

    def can(self, force: Any) -> bool:
        if len(force) != len(self.columns) or not self.stops:
            return False
        if len(force) == 1:
            return bool(self.least <= force[0] <= self.most)
        return bool(force @ force <= self.most**2 * (1 + EXACT))

    def watts(self, force: Any) -> Decimal:
        size = (force @ force).sqrt()
        side = "reverse" if len(force) == 1 and force[0] < 0 else "forward"
        if side in self.power:
            power: Decimal = size ** _decimal(self.power["exponent"])
            return _decimal(self.power[side]) * power
        x, y = _array(self.power["points"]).T
        along = force[0] if len(force) == 1 else size
        i = min(max(int(np.searchsorted(x, along)), 1), len(x) - 1)
        slope = (y[i] - y[i - 1]) / (x[i] - x[i - 1])
        watts: Decimal = y[i - 1] + slope * (along - x[i - 1])
        return watts

    def most_profit(self, own_price: Any, per_watt: Decimal) -> Decimal:
        best = Decimal(0) if per_watt else Decimal("-Infinity")
        error = _decimal(self.power["error_w"]) if self.power and "error_w" in self.power else 0
        if len(own_price) == 1:
            ends = self.outer
            sizes = [np.array([end * k / 40]) for end in ends for k in range(1, 41)]
        else:
            length = (own_price @ own_price).sqrt()
            if not length:
                return best
            largest = max(self.outer[1], -self.outer[0])
            sizes = [own_price / length * largest * k / 40 for k in range(1, 41)]
        for force in sizes:
            profit = own_price @ force
            if per_watt:
                profit -= per_watt * (self.watts(force) - error)
            best = max(best, profit)
        return best
