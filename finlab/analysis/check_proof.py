"""Checks a file of `finlab layout prove`: `python check_proof.py FILE`.

It needs Python alone, and computes with fractions, so that nothing is rounded but square roots, and
these to the safe side. Read it, then trust it. It takes from the file, as they are, the positions
[m], axes, limits [N] and power laws [W] of the actuators: compare these with the robot.

Proved: in each case (who is lost) every actuator has a convex set of forces, and each corner of the
box is the wrench of forces out of these sets, whose power, a convex function, is within the budget.
A wrench of the box is a weighted mean of corners, so the same mean of their forces gives it. Where
a set is not convex, a convex part is named, the same for all corners; a box may be split in two,
each with parts of its own.

Refuted: in one case, of one wrench w of the box, for a price y per newton and l per watt, no force
of any actuator has a profit y.Bf - l.P(f) above a bound, and all bounds together are below
y.w - l.budget. Where forces are not convex, arcs are taken one by one, or cut in pieces, and there
is such a price for each choice of them.
"""

import json
import sys
from fractions import Fraction
from itertools import combinations, product
from math import isqrt
from typing import Any

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
FINE = 10**30  # square roots are rounded to this part of one


class WrongProof(Exception):
    """The file does not prove what it says."""


# What comes of a file that has another form than a proof.
OTHER_FORM = (LookupError, TypeError, ValueError, ArithmeticError, AttributeError, RecursionError)


def need(condition: Any, words: Any) -> None:
    if not condition:
        raise WrongProof(words)


def number(text: Any) -> Any:
    exponent = text.lower().partition("e")[2]
    need(len(text) < 5000 and abs(int(exponent or 0)) < 40, f"a number is out of range: {text:.40}")
    return Fraction(text)


def dot(a: Any, b: Any) -> Any:
    return Fraction(sum(x * y for x, y in zip(a, b, strict=True)))


def cross(a: Any, b: Any) -> Any:
    """Of vectors in a plane: positive where b lies to the left of a."""
    return a[0] * b[1] - a[1] * b[0]


def root_below(x: Any) -> Any:
    return Fraction(isqrt(x.numerator * FINE**2 // x.denominator), FINE)


def root_above(x: Any) -> Any:
    return root_below(x) + Fraction(1, FINE)


def raised(size: Any, exponent: Any, root: Any, leftover: Any) -> Any:
    """size^exponent by repeated square roots, rounded as `root` and `leftover` (min or max) are."""
    result = size ** int(exponent)
    rest = exponent - int(exponent)
    for _ in range(20):
        if rest == 0:
            return result
        size = root(size)
        rest *= 2
        if rest >= 1:
            result *= size
            rest -= 1
    return result * leftover(Fraction(1), size)


def columns(actuator: Any) -> Any:
    """The wrench of 1 N along each axis a of an actuator at r: a, then r x a + k a."""
    x, y, z = actuator["position_m"]
    k = actuator["torque_per_newton_m"]
    for a in actuator["axes"]:
        torque = (y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0])
        yield [*a, *(t + k * along for t, along in zip(torque, a, strict=True))]


def turns_left(arc: Any) -> Any:
    """Whether the arc from its first to its second direction is at most half a turn: convex."""
    a, b = arc
    return cross(a, b) >= 0


def is_line(arc: Any) -> Any:
    """Whether both directions of an arc are one."""
    return cross(*arc) == 0 < dot(*arc)


def in_arc(arc: Any, p: Any) -> Any:
    a, b = arc
    if not turns_left(arc):
        return cross(a, p) >= 0 or cross(p, b) >= 0
    return cross(a, p) >= 0 and cross(p, b) >= 0 and (not is_line(arc) or dot(a, p) >= 0)


def is_within(arc: Any, whole: Any) -> Any:
    """Whether an arc of at most half a turn lies within another one."""
    a, b = arc
    return in_arc(whole, a) and in_arc((a, whole[1]), b)


def is_wide(arcs: Any) -> Any:
    """Whether some arc has half a turn or more; no arcs are all directions."""
    return arcs is None or any(cross(*arc) <= 0 and not is_line(arc) for arc in arcs)


def check_edges(arcs: Any) -> None:
    for edge in sum(arcs, []):
        need(1 <= dot(edge, edge) < 2, "a direction of an arc is too short, or too long")


def check_actuator(actuator: Any) -> None:
    name = actuator["name"]
    axes = actuator["axes"]
    need(len(axes) in (1, 2), f"{name}: one or two axes")
    for a in axes:
        need(abs(dot(a, a) - 1) < Fraction(1, 10**9), f"{name}: its axes are no unit vectors")
    need(len(axes) == 1 or abs(dot(*axes)) < Fraction(1, 10**9), f"{name}: its axes are skew")
    least, most = actuator["force_n"]
    need(least <= most and most >= 0, f"{name}: limits of the force are in no order")
    check_edges(actuator["arcs"] or ())
    low, high = actuator["outer_force_n"]
    need(low <= least and high >= most, f"{name}: the outer forces are too few")
    held = actuator["mean"] and is_wide(actuator["arcs"])  # small forces, as means over time
    need(low <= 0 or not held, f"{name}: the outer forces are too few")
    power = actuator["power"]
    if power is None:
        return
    if "points" in power:
        points = power["points"]
        slopes = []
        for (x0, p0), (x1, p1) in zip(points, points[1:], strict=False):
            need(x0 < x1, f"{name}: the points of its power do not rise")
            slopes.append((p1 - p0) / (x1 - x0))
        need(slopes == sorted(slopes), f"{name}: its power is not convex")
        rises = len(axes) == 1 or (slopes[0] >= 0 and points[0][0] == 0)
        need(rises and min(p for _, p in points) >= 0, f"{name}: its power falls with the force")
        need(points[0][0] <= min(low, 0) or len(axes) == 2, f"{name}: its power is not known")
        largest = high if len(axes) == 1 else max(high, -low)
        need(points[-1][0] >= largest and power["error_w"] >= 0, f"{name}: its power is not known")
    else:
        need(power["forward"] >= 0 and power["reverse"] >= 0, f"{name}: its power is negative")
        need(1 <= power["exponent"] <= 4, f"{name}: its power is not convex")


def convex_part(actuator: Any, part: Any) -> Any:
    """A convex part of an actuator's forces p: its arc, its largest force, and n, c with n.p >= c.
    Of one that also pushes against its direction it may be a line, or all forces up to some size,
    or (`astern`) the forces -p."""
    name = actuator["name"]
    least, most = actuator["force_n"]
    whole = actuator["arcs"]
    if "line" in part:
        on_arc = whole is None or any(in_arc(arc, part["line"]) for arc in whole)
        need(on_arc and dot(part["line"], part["line"]) > 0, f"{name}: the line is in no arc")
        return part
    if "disc" in part:
        need(least <= 0 and is_wide(whole), f"{name}: does not push in all directions")
        return {"sides": ("forward", "reverse"), "bounds": (None, min(most, -least), (0, 0), 0)}
    if "astern" in part:
        need(least <= 0, f"{name}: does not push astern")
        ahead = {**actuator, "force_n": [Fraction(0), -least]}
        bounds = part_bounds(ahead, part)
        return {"sides": ("reverse",), "sign": -1, "bounds": bounds}
    return {"sides": ("forward",), "bounds": part_bounds(actuator, part)}


def part_bounds(actuator: Any, part: Any) -> Any:
    """The arc, the largest force, and n, c with n.p >= c of forces p ahead."""
    name = actuator["name"]
    least, most = actuator["force_n"]
    whole = actuator["arcs"]
    arc = part.get("arc", whole[0] if whole and len(whole) == 1 else None)
    need(arc is not None or whole is None, f"{name}: has several arcs, and no part")
    if arc is not None:
        need(turns_left(arc), f"{name}: its arc is not convex")
        check_edges([arc])
        is_part = whole is None or any(is_within(arc, each) for each in whole)
        need(is_part, f"{name}: the part is not within its arcs")
    if least <= 0 or (actuator["mean"] and arc is None):
        return arc, most, (0, 0), 0  # a small force is a mean of opposite ones
    if actuator["mean"] and not is_line(arc):  # beyond the chord of least forces at both ends
        a, b = arc
        return arc, most, (b[1] - a[1], a[0] - b[0]), least * cross(a, b)
    need("ahead" in part, f"{name}: cannot push less than {float(least):g} N, and has no part")
    need(dot(part["ahead"], part["ahead"]) <= 1, f"{name}: ahead is longer than 1")
    return arc, most, part["ahead"], least  # |p| >= ahead.p >= least


def in_part(actuator: Any, part: Any, force: Any) -> Any:
    if len(actuator["axes"]) == 1:
        least, most = actuator["force_n"]
        return least <= force[0] <= most
    if "line" in part:
        least, most = actuator["force_n"]
        end = most if dot(part["line"], force) >= 0 else min(least, 0)
        return cross(part["line"], force) == 0 and least <= 0 and dot(force, force) <= end**2
    force = [part.get("sign", 1) * p for p in force]
    arc, most, normal, bound = part["bounds"]
    is_ahead = (arc is None or in_arc(arc, force)) and dot(normal, force) >= bound
    return is_ahead and dot(force, force) <= most**2


def sides_of(part: Any, force: Any) -> Any:
    """The laws of power that may be those of a force."""
    if part is None or "line" in part:
        along = force[0] if part is None else dot(part["line"], force)
        return ("reverse",) if along < 0 else ("forward",)
    return part["sides"]


def most_watts(actuator: Any, force: Any, part: Any) -> Any:
    """An upper bound of the power of a force of a part, None of one along a line."""
    power = actuator["power"]
    is_plane = len(force) == 2
    size = root_above(dot(force, force)) if is_plane else abs(force[0])
    size = max(size, actuator["force_n"][0]) if is_plane else size  # means are of forces so large
    if "points" not in power:
        factor = max(power[side] for side in sides_of(part, force))
        return factor * raised(size, power["exponent"], root_above, max)
    x = size if is_plane else force[0]
    points = power["points"]
    i = max([1, *(j + 1 for j in range(1, len(points) - 1) if points[j][0] <= x)])
    (x0, p0), (x1, p1) = points[i - 1 : i + 1]
    return p0 + (p1 - p0) / (x1 - x0) * (x - x0)


def most_gain(arcs: Any, price: Any, low: Any, high: Any) -> Any:
    """An upper bound of price.p over forces p from low to high along the directions of arcs."""
    if arcs is None or any(in_arc(arc, price) for arc in arcs):
        return high * root_above(dot(price, price))
    gains = []
    for edge in sum(arcs, []):
        along = dot(price, edge)  # an edge is no shorter than 1
        is_loss = along < 0 < low
        gains.append(low * along / root_above(dot(edge, edge)) if is_loss else high * along)
    return max(gains) if low > 0 else max(0, *gains)


def most_profit(actuator: Any, price: Any, watt_price: Any, touch: Any) -> Any:
    """An upper bound of price.f - watt_price P(f) over all forces f of an actuator."""
    low, high = actuator["outer_force_n"]
    arcs = actuator["arcs"]
    power = actuator["power"]
    back = [-c for c in price]
    if len(actuator["axes"]) == 1:
        if watt_price == 0:
            return max(price[0] * low, price[0] * high)
        sides = [(price[0], high, "forward"), (-price[0], -low, "reverse")]
    else:
        if watt_price == 0:
            gain = most_gain(arcs, price, low, high)
            return gain if low >= 0 else max(gain, most_gain(arcs, back, 0, -low))
        sides = [(most_gain(arcs, price, 0, 1), high, "forward")]
        if low < 0:
            sides.append((most_gain(arcs, back, 0, 1), -low, "reverse"))
    if "points" in power:
        along = price[0] if len(actuator["axes"]) == 1 else max(gain for gain, *_ in sides)
        return max(along * x - watt_price * (p - power["error_w"]) for x, p in power["points"])
    best = Fraction(0)
    for gain, largest, side in sides:
        bound = max(Fraction(0), gain * largest)  # at no power, and by the tangent at `touch`:
        if touch > 0:
            e = power["exponent"]
            watts = power[side] * raised(touch, e, root_below, min)
            at_end = (gain - watt_price * e * watts / touch) * largest
            bound = min(bound, max(Fraction(0), at_end) + watt_price * (e - 1) * watts)
        best = max(best, bound)
    return best


def corner_wrench(low: Any, high: Any, signs: Any) -> list[Fraction]:
    ends = [{"-": a, "0": a, "+": b} for a, b in zip(low, high, strict=True)]
    return [end[sign] for end, sign in zip(ends, signs, strict=True)]


def checked_premises(proof: Any) -> Any:
    """The actuators with their columns, and the statement with the half widths of its box."""
    need(proof["format"] == "finlab-proof" and proof["version"] == 2, "no proof of version 2")
    statement = proof["statement"]
    rows = [i for i, axis in enumerate(AXES) if axis in statement["box"]]
    free = [axis for axis in AXES if axis not in statement["box"]]
    half_widths = [statement["box"][AXES[i]] for i in rows]
    need(free == statement["free"] and len(rows) == len(statement["box"]), "free axes are others")
    need(half_widths and min(half_widths) >= 0, "the box has no size")
    need(statement["wrench_tolerance"] >= 0, "the tolerance is negative")
    actuators = {actuator["name"]: actuator for actuator in proof["actuators"]}
    need(len(actuators) == len(proof["actuators"]), "two actuators have one name")
    need(statement["lost"] in range(len(actuators) + 1), "more are lost than there are")
    for actuator in actuators.values():
        check_actuator(actuator)
        known = statement["power_w"] is None or actuator["power"] is not None
        need(known, f"{actuator['name']}: its power is not known")
        actuator["columns"] = [[c[i] for i in rows] for c in columns(actuator)]
    return actuators, {**statement, "rows": rows, "half_widths": half_widths}


def no_number(text: Any) -> None:
    raise WrongProof(f"{text} is no number")


def each_key_once(pairs: Any) -> Any:
    """A mapping of a file. Of what a key says twice Python sees one, a reader perhaps another."""
    mapping = dict(pairs)
    need(len(mapping) == len(pairs), f"a key stands twice among {', '.join(mapping)}"[:200])
    return mapping


def shown(number: Any) -> str:
    """A number as people read it, with six digits; it says where it is another."""
    text = f"{float(number):g}"
    return text if Fraction(text) == number else f"about {text}"


def check(text: Any) -> str:
    """Returns the verdict of a file, in a sentence; raises WrongProof where it proves nothing."""
    values = json.loads(
        text,
        parse_float=str,
        parse_int=str,
        parse_constant=no_number,
        object_pairs_hook=each_key_once,
    )
    proof = numbers_in(values)
    actuators, statement = premises = checked_premises(proof)
    count = int(statement["lost"])
    if proof["verdict"] == "refuted":
        check_counterexample(proof["counterexample"], premises)
    else:
        need(proof["verdict"] == "proved", "no verdict")
        cases = {frozenset(case["lost"]): case for case in proof["cases"]}
        for n_lost in range(count + 1):
            for lost in combinations(actuators, n_lost):
                need(frozenset(lost) in cases, f"no case in which {lost or 'nobody'} is lost")
                case = cases[frozenset(lost)]
                high = statement["half_widths"]
                check_box(case, case["lost"], [-half for half in high], high, premises)
    box = ", ".join(f"{axis} +-{shown(half)}" for axis, half in statement["box"].items())
    free = f", {', '.join(statement['free'])} free" if statement["free"] else ""
    power = statement["power_w"]
    budget = "" if power is None else f", within {shown(power)} W"
    tolerance = statement["wrench_tolerance"]
    near = f", to within {shown(tolerance)}" if tolerance else ""
    means = [name for name, actuator in actuators.items() if actuator["mean"]]
    mean = f"; small forces as means over time: {', '.join(means)}" if means else ""
    return f"{proof['verdict']}: any wrench of {box}{free}, any {count} lost{budget}{near}{mean}"


def check_box(case: Any, lost: Any, low: Any, high: Any, premises: Any) -> None:
    actuators, statement = premises
    if "axis" in case:
        i, at = list(statement["box"]).index(case["axis"]), case["at"]
        need(low[i] < at < high[i], "a box is split outside of it")
        check_box(case["below"], lost, low, [*high[:i], at, *high[i + 1 :]], premises)
        check_box(case["above"], lost, [*low[:i], at, *low[i + 1 :]], high, premises)
        return
    budget = statement["power_w"]
    parts = {}
    for name, actuator in actuators.items():
        if len(actuator["axes"]) == 2 and name not in lost:
            parts[name] = convex_part(actuator, case["parts"].get(name, {}))
    for signs in product(*("+-" if a < b else "0" for a, b in zip(low, high, strict=True))):
        corner = "".join(signs)
        where = f"lost {', '.join(lost) or 'nobody'}, corner {corner}"
        need(corner in case["corners"], f"{where}: is missing")
        forces = case["corners"][corner]
        need(set(forces) == set(actuators) - set(lost), f"{where}: not the forces of those left")
        missing = corner_wrench(low, high, corner)
        watts = Fraction(0)
        for name, force in forces.items():
            actuator = actuators[name]
            need(len(force) == len(actuator["axes"]), f"{where}: {name} has other axes")
            need(in_part(actuator, parts.get(name), force), f"{where}: {name} cannot push so")
            for size, column in zip(force, actuator["columns"], strict=True):
                missing = [w - size * c for w, c in zip(missing, column, strict=True)]
            if budget is not None:
                watts += most_watts(actuator, force, parts.get(name))
        near = max(map(abs, missing)) <= statement["wrench_tolerance"]
        need(near, f"{where}: the wrench is another")
        need(budget is None or watts <= budget, f"{where}: takes more power")


def check_counterexample(example: Any, premises: Any) -> None:
    actuators, statement = premises
    lost = example["lost"]
    few = len(set(lost)) <= statement["lost"] and set(lost) <= set(actuators)
    need(few, "others are lost than the statement says")
    box = statement["box"]
    need(example["wrench"].keys() == box.keys(), "the wrench has other axes")
    wrench = [example["wrench"][AXES[i]] for i in statement["rows"]]
    in_box = all(abs(w) <= half for w, half in zip(wrench, statement["half_widths"], strict=True))
    need(in_box, "the wrench is not in the box")
    working = {name: each for name, each in actuators.items() if name not in lost}
    check_tree(example["tree"], wrench, working, statement)


def check_tree(tree: Any, wrench: Any, actuators: Any, statement: Any) -> None:
    """A price, or the name of an actuator, pieces of its arcs, and a tree for each of them."""
    if "price" in tree:
        check_price(tree, wrench, actuators.values(), statement)
        return
    actuator = actuators[tree["cut"]]
    if "sides" in tree:  # ahead, then astern
        low, high = actuator["outer_force_n"]
        need(low <= 0 and len(tree["sides"]) == 2, f"{tree['cut']}: does not push astern")
        for ends, branch in zip(
            ([Fraction(0), high], [low, Fraction(0)]), tree["sides"], strict=True
        ):
            one = {**actuators, tree["cut"]: {**actuator, "outer_force_n": ends}}
            check_tree(branch, wrench, one, statement)
        return
    pieces = tree["arcs"]
    need(covers(pieces, actuator["arcs"]), f"{tree['cut']}: pieces leave out directions")
    has_means = actuator["mean"] and actuator["outer_force_n"][0] > 0  # of forces in one arc
    need(not has_means or pieces == actuator["arcs"], f"{tree['cut']}: its arcs cannot be cut")
    for piece, branch in zip(pieces, tree["each"], strict=True):
        one = {**actuators, tree["cut"]: {**actuator, "arcs": [piece]}}
        check_tree(branch, wrench, one, statement)


def covers(pieces: Any, arcs: Any) -> Any:
    """Whether each arc is a chain of pieces of at most half a turn, one after the other."""
    check_edges(pieces)
    if arcs is None and any(map(is_line, pieces)):
        return False
    left = list(pieces)
    for first, last in arcs or [(pieces[0][0], pieces[0][0])]:  # all round, back to the beginning
        is_end = False
        at = first
        while not is_end:
            if not left or left[0][0] != at or not turns_left(left[0]):
                return False
            at = left.pop(0)[1]
            is_end = at == last
    return not left


def check_price(price: Any, wrench: Any, actuators: Any, statement: Any) -> None:
    per_wrench, per_watt, budget = price["price"], price["watt_price"], statement["power_w"]
    need(per_watt == 0 if budget is None else per_watt >= 0, "no such price per watt")
    value = dot(per_wrench, wrench) - statement["wrench_tolerance"] * sum(map(abs, per_wrench))
    profit = per_watt * (budget or 0)
    for actuator in actuators:
        own_price = [dot(per_wrench, column) for column in actuator["columns"]]
        touch = price["touch"].get(actuator["name"], Fraction(0))
        profit += most_profit(actuator, own_price, per_watt, touch)
    need(profit < value, "the price does not separate the corner")


NAMES = ("format", "name", "type", "free", "verdict", "layout", "axis", "cut", "remarks", "mean")


def numbers_in(value: Any, key: Any = "") -> Any:
    """The values of a file, with fractions in place of the numbers."""
    if isinstance(value, dict):
        inner = {}
        for name, item in value.items():
            inner[name] = numbers_in(item, name)
        return inner
    if isinstance(value, list):
        is_names = key in ("lost", *NAMES)
        return value if is_names else [numbers_in(item) for item in value]
    return number(value) if isinstance(value, str) and key not in NAMES else value


def main(path: Any) -> int:
    try:
        with open(path, encoding="utf-8") as file:
            print(check(file.read()))
    except (WrongProof, OSError, *OTHER_FORM) as error:
        print(f"refused: {type(error).__name__}: {error}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]) if len(sys.argv) == 2 else "usage: python check_proof.py FILE")
