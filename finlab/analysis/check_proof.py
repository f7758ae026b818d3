"""Checks a file of `finlab layout prove`: `python check_proof.py FILE`.

It needs Python alone, and computes with fractions, so that nothing is rounded but square roots, and
these to the safe side. Read it, then trust it. It takes from the file, as they are, the positions
[m], axes, sets of forces [N] and curves of power [W] of the actuators: compare these with the
robot.

The forces of an actuator are vectors p along its axes (of one axis: with a second number 0). They
lie in sectors (u, v) of at most half a turn, from u counterclockwise to v. Their size is from
`force_n[0]` to `force_n[1]`; where `force_n[0]` is negative, there are also forces up to that size
against these directions. What is proved takes no others. What is refuted grants all up to
`outer_force_n`.

Proved: in each case (who is lost), each corner of the box is the wrench of some forces. The hull of
the forces of one actuator at all corners lies within its set, and the power of each corner, a
convex function of the forces, is within the budget. A wrench of the box is a weighted mean of
corners, so the same mean of their forces gives it. A box may be split in two, each with forces of
its own.

Refuted: in one case, of one wrench w of the box, for a price y per newton and l per watt, no force
of any actuator has a profit y.Bf - l.P(f) above a bound, and all bounds together are below
y.w - l.budget. A counterexample may take the sectors of an actuator one by one, with such a price
for each.
"""

import json
import sys
from fractions import Fraction
from itertools import combinations, pairwise, product
from math import isqrt
from typing import Any, NamedTuple

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
FINE = 10**30  # square roots are rounded to this part of one
LINE = [[[1, 0], [1, 0]]]  # the sectors of an actuator of one axis
NEAR = Fraction(1, 10**9)  # of axes that are rounded


class WrongProof(Exception):
    """The file does not prove what it says."""


def need(condition: Any, words: Any) -> None:
    if not condition:
        raise WrongProof(words)


# Vectors.


def dot(a: Any, b: Any) -> Any:
    return Fraction(sum(x * y for x, y in zip(a, b, strict=True)))


def cross(a: Any, b: Any) -> Any:
    """Of vectors in a plane: positive where b lies to the left of a."""
    return a[0] * b[1] - a[1] * b[0]


def length_above(a: Any) -> Any:
    """The length of a vector, or a little more."""
    square = dot(a, a)
    root = isqrt(square.numerator * FINE**2 // square.denominator)
    return Fraction(root + 1, FINE)


def columns(actuator: Any) -> Any:
    """The wrench of 1 N along each axis a of an actuator at r: a, then r x a + k a."""
    x, y, z = actuator["position_m"]
    k = actuator["torque_per_newton_m"]
    for a in actuator["axes"]:
        torque = (y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0])
        yield [*a, *(t + k * along for t, along in zip(torque, a, strict=True))]


# Sets of forces.


class Side(NamedTuple):
    """A sector of directions, and how far forces reach along them."""

    u: Any
    v: Any
    least: Any
    most: Any
    sign: int  # 1 ahead, -1 astern


def sides_of(actuator: Any, limits: Any) -> list[Side]:
    """The sectors of an actuator, ahead, and astern where it pushes that way."""
    low, high = actuator[limits]
    sides = []
    for u, v in actuator["sectors"]:
        sides.append(Side(u, v, max(low, Fraction(0)), high, 1))
    if low < 0:
        for u, v in actuator["sectors"]:
            sides.append(Side([-x for x in u], [-x for x in v], Fraction(0), -low, -1))
    return sides


def is_toward(side: Side, p: Any) -> Any:
    """Whether p lies in the directions of a sector."""
    u, v = side.u, side.v
    is_wide = cross(u, v) > 0 or dot(u, v) < 0  # else both are one direction
    return cross(u, p) >= 0 and cross(p, v) >= 0 and (is_wide or dot(u, p) >= 0)


def reaches(side: Side, p: Any) -> Any:
    """Whether a sector has the force p, or one of its direction that is larger."""
    return is_toward(side, p) and dot(p, p) <= side.most**2


def hold_triangle(sides: Any, a: Any, b: Any) -> Any:
    """Whether sectors have the forces between 0, a and b, but for small ones.

    The way from a to b is cut where a sector ends; one sector has both ends of each piece."""
    if cross(a, b) == 0:
        return any(reaches(side, a) for side in sides) and any(reaches(side, b) for side in sides)
    shares = [Fraction(0), Fraction(1)]
    for side in sides:
        for end in (side.u, side.v):
            before = cross(a, end)
            after = cross(end, b)
            if before * after > 0:
                shares.append(before / (before + after))
    shares.sort()
    points = [[x + share * (y - x) for x, y in zip(a, b, strict=True)] for share in shares]
    for p, q in pairwise(points):
        if not any(reaches(side, p) and reaches(side, q) for side in sides):
            return False
    return True


def is_far(a: Any, b: Any, least: Any) -> Any:
    """Whether all between a and b are as long as the least force."""
    along = [y - x for x, y in zip(a, b, strict=True)]
    if dot(a, along) < 0 < dot(b, along):  # the nearest point lies between them
        return cross(a, b) ** 2 >= least**2 * dot(along, along)
    return min(dot(a, a), dot(b, b)) >= least**2


def is_mean(side: Side, p: Any) -> Any:
    """Whether p is a mean of forces of a sector: beyond the chord of least ones at both ends."""
    u, v, least = side.u, side.v, side.least
    normal = (v[1] - u[1], u[0] - v[0])
    is_beyond = dot(normal, p) >= least * cross(u, v)
    return reaches(side, p) and is_beyond and (cross(u, v) > 0 or dot(p, p) >= least**2)


def hull_of(points: Any) -> Any:
    """The corners of the convex hull of points, counterclockwise: its lower chain, then its upper
    one, each from end to end without points that lie above it."""
    in_order = sorted(set(map(tuple, points)))
    corners: Any = []
    for chain_points in (in_order, in_order[::-1]):
        chain: Any = []
        for p in chain_points:
            while len(chain) > 1 and turn(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        corners += chain[:-1]
    return corners or in_order


def turn(a: Any, b: Any, c: Any) -> Any:
    """Positive where c lies to the left of the way from a to b."""
    return cross((b[0] - a[0], b[1] - a[1]), (c[0] - a[0], c[1] - a[1]))


def hold_hull(actuator: Any, sides: Any, points: Any) -> Any:
    """Whether sectors of an actuator have the convex hull of some forces.

    A ray from 0 through a force of the hull leaves it across an edge, and enters it across another
    one, or begins within."""
    least = max(actuator["force_n"][0], Fraction(0))
    if actuator["mean"] and least > 0:
        return any(all(is_mean(side, p) for p in points) for side in sides)
    corners = hull_of(points)
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    if least > 0:
        is_around = all(cross(a, b) > 0 for a, b in edges)  # around 0
        if is_around or not all(is_far(a, b, least) for a, b in edges):
            return False
    return all(hold_triangle(sides, a, b) for a, b in edges)


def most_gain(side: Side, price: Any, low: Any, high: Any) -> Any:
    """An upper bound of price.p over forces p of a sector with sizes from low to high."""
    if is_toward(side, price):
        return high * length_above(price)
    gains = []
    for edge in (side.u, side.v):
        along = dot(price, edge)  # an edge is no shorter than 1
        gains.append(high * along if along > 0 else low * along / length_above(edge))
    return max(gains)


# Power.


def watts_at(points: Any, size: Any) -> Any:
    """The power of a force by the chord between two points of the curve."""
    for (x0, p0), (x1, p1) in pairwise(points):  # noqa: B007
        if size <= x1:
            break
    return p0 + (p1 - p0) * (size - x0) / (x1 - x0)


def most_watts(actuator: Any, force: Any, is_ahead: Any) -> Any:
    """An upper bound of the power of a force, convex in it; astern too unless all are ahead."""
    points = actuator["power"]["points"]
    if len(actuator["axes"]) == 1:
        return watts_at(points, force[0])
    size = max(length_above(force), actuator["force_n"][0])  # means are of forces so large
    watts = watts_at(points, size)
    return watts if is_ahead else max(watts, watts_at(points, -size))


def most_profit(actuator: Any, side: Side, price: Any, watt_price: Any) -> Any:
    """An upper bound of price.p - watt_price P(p) over the forces p of a sector."""
    if watt_price == 0:
        return most_gain(side, price, side.least, side.most)
    gain = most_gain(side, price, Fraction(0), Fraction(1))  # per newton
    error = actuator["power"]["error_w"]
    profits = []
    for x, watts in actuator["power"]["points"]:
        if side.sign * x >= 0:
            profits.append(gain * abs(x) - watt_price * (watts - error))
    return max(profits)


# What a file says.


def check_actuator(actuator: Any) -> None:
    name = actuator["name"]
    axes = actuator["axes"]
    need(len(axes) in (1, 2), f"{name}: one or two axes")
    need(all(abs(dot(a, a) - 1) < NEAR for a in axes), f"{name}: its axes are no unit vectors")
    need(len(axes) == 1 or abs(dot(*axes)) < NEAR, f"{name}: its axes are skew")
    least, most = actuator["force_n"]
    low, high = actuator["outer_force_n"]
    need(low <= least <= most <= high and most >= 0, f"{name}: its forces are in no order")
    sectors = actuator["sectors"]
    for u, v in sectors:
        is_long = all(1 <= dot(edge, edge) < 2 for edge in (u, v))
        need(is_long and len(u) == len(v) == 2, f"{name}: a direction is too short, or too long")
        need(cross(u, v) >= 0, f"{name}: a sector is wider than half a turn")
    is_line = len(axes) == 1 and sectors == LINE
    need(is_line or (len(axes) == 2 and sectors), f"{name}: its sectors are not those of its axes")
    one = not actuator["mean"] or low <= 0 or len(sectors) == 1
    need(one, f"{name}: means of its forces may lie between its sectors")
    if actuator["power"] is not None:
        check_power(name, actuator["power"], min(low, 0), high)


def check_power(name: Any, power: Any, low: Any, high: Any) -> None:
    points = power["points"]
    slopes = []
    for (x0, p0), (x1, p1) in pairwise(points):
        need(x0 < x1, f"{name}: the points of its power do not rise")
        slope = (p1 - p0) / (x1 - x0)
        need((slope >= 0 and x0 >= 0) or (slope <= 0 and x1 <= 0), f"{name}: its power falls")
        slopes.append(slope)
    need(slopes == sorted(slopes), f"{name}: its power is not convex")
    is_known = slopes and points[0][0] <= low and high <= points[-1][0] and power["error_w"] >= 0
    need(is_known, f"{name}: its power is not known")


def checked_robot(proof: Any) -> Any:
    """The actuators with their columns, and the statement with the half widths of its box."""
    need(proof["format"] == "finlab-proof" and proof["version"] == 3, "no proof of version 3")
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


def check_proved(cases: Any, robot: Any) -> None:
    """Whether there is each case, and its box is given."""
    actuators, statement = robot
    case_of = {frozenset(case["lost"]): case for case in cases}
    high = statement["half_widths"]
    low = [-half for half in high]
    for count in range(int(statement["lost"]) + 1):
        for lost in combinations(actuators, count):
            need(frozenset(lost) in case_of, f"no case in which {lost or 'nobody'} is lost")
            check_box(case_of[frozenset(lost)], lost, low, high, robot)


def check_box(box: Any, lost: Any, low: Any, high: Any, robot: Any) -> None:
    actuators, statement = robot
    if "axis" in box:
        i = list(statement["box"]).index(box["axis"])
        at = number(box["at"])
        need(low[i] < at < high[i], "a box is split outside of it")
        check_box(box["below"], lost, low, [*high[:i], at, *high[i + 1 :]], robot)
        check_box(box["above"], lost, [*low[:i], at, *low[i + 1 :]], high, robot)
        return
    working = {name: each for name, each in actuators.items() if name not in lost}
    forces_of: Any = {name: [] for name in working}
    for corner, wrench in corners_of(low, high):
        where = f"lost {', '.join(lost) or 'nobody'}, corner {corner}"
        need(corner in box["corners"], f"{where}: is missing")
        forces = box["corners"][corner]
        need(set(forces) == set(working), f"{where}: not the forces of those left")
        for name, actuator in working.items():
            force = list(map(number, forces[name]))
            for size, column in zip(force, actuator["columns"], strict=True):
                wrench = [w - size * c for w, c in zip(wrench, column, strict=True)]
            forces_of[name].append([*force, Fraction(0)][:2])
        missing = max(map(abs, wrench))
        need(missing <= statement["wrench_tolerance"], f"{where}: the wrench is another")

    who = f"lost {', '.join(lost) or 'nobody'}"
    for name, points in forces_of.items():
        sides = sides_of(actuators[name], "force_n")
        need(hold_hull(actuators[name], sides, points), f"{who}: {name} cannot push so")
    if statement["power_w"] is not None:
        most = max(watts_of_corners(forces_of, actuators), default=0)
        need(most <= statement["power_w"], f"{who}: takes more power")


def watts_of_corners(forces_of: Any, actuators: Any) -> Any:
    """Upper bounds of the power of each corner."""
    by_actuator = []
    for name, points in forces_of.items():
        actuator = actuators[name]
        ahead = [side for side in sides_of(actuator, "force_n") if side.sign > 0]
        is_ahead = hold_hull(actuator, ahead, points)
        own_axes = len(actuator["axes"])
        by_actuator.append([most_watts(actuator, p[:own_axes], is_ahead) for p in points])
    return [sum(watts) for watts in zip(*by_actuator, strict=True)]


def corners_of(low: Any, high: Any) -> Any:
    """The corners of a box: their signs, and their wrenches."""
    ends = []
    for a, b in zip(low, high, strict=True):
        ends.append([("+", b), ("-", a)] if a < b else [("0", a)])
    corners = []
    for chosen in product(*ends):
        signs, wrench = zip(*chosen, strict=True)
        corners.append(("".join(signs), list(wrench)))
    return corners


def check_refuted(example: Any, robot: Any) -> None:
    """Whether a wrench of the box is out of reach."""
    actuators, statement = robot
    lost = set(example["lost"])
    few = len(lost) <= statement["lost"] and lost <= set(actuators)
    need(few, "others are lost than the statement says")
    need(example["wrench"].keys() == statement["box"].keys(), "the wrench has other axes")
    wrench = [number(example["wrench"][AXES[i]]) for i in statement["rows"]]
    in_box = all(abs(w) <= half for w, half in zip(wrench, statement["half_widths"], strict=True))
    need(in_box, "the wrench is not in the box")
    sides = {}
    for name, actuator in actuators.items():
        if name not in lost:
            sides[name] = sides_of(actuator, "outer_force_n")
    check_tree(example["tree"], wrench, sides, robot)


def check_tree(tree: Any, wrench: Any, sides: Any, robot: Any) -> None:
    """A price, or the name of an actuator, and a tree for each of its sectors."""
    if "price" in tree:
        check_price(tree, wrench, sides, robot)
        return
    name = tree["cut"]
    for side, branch in zip(sides[name], tree["each"], strict=True):
        check_tree(branch, wrench, {**sides, name: [side]}, robot)


def check_price(tree: Any, wrench: Any, sides: Any, robot: Any) -> None:
    actuators, statement = robot
    price, watt_price, budget = tree["price"], tree["watt_price"], statement["power_w"]
    need(watt_price == 0 if budget is None else watt_price >= 0, "no such price per watt")
    value = dot(price, wrench) - statement["wrench_tolerance"] * sum(map(abs, price))
    profit = watt_price * (budget or 0)
    for name, own_sides in sides.items():
        actuator = actuators[name]
        own_price = [*(dot(price, column) for column in actuator["columns"]), Fraction(0)][:2]
        profit += max(most_profit(actuator, side, own_price, watt_price) for side in own_sides)
    need(profit < value, "the price does not separate the wrench")


# Reading a file, and saying what it proves.


def number(text: Any) -> Any:
    exponent = text.lower().partition("e")[2]
    need(len(text) < 5000 and abs(int(exponent or 0)) < 40, f"a number is out of range: {text:.40}")
    return Fraction(text)


def no_number(text: Any) -> None:
    raise WrongProof(f"{text} is no number")


def each_key_once(pairs: Any) -> Any:
    """A mapping of a file. Of what a key says twice Python sees one, a reader perhaps another."""
    mapping = dict(pairs)
    need(len(mapping) == len(pairs), f"a key stands twice among {', '.join(mapping)}"[:200])
    return mapping


def read(text: Any) -> Any:
    """The values of a file, with fractions in place of numbers."""
    return json.loads(
        text,
        parse_float=number,
        parse_int=number,
        parse_constant=no_number,
        object_pairs_hook=each_key_once,
    )


def check(text: Any) -> str:
    """Returns the verdict of a file, in a sentence; raises WrongProof where it proves nothing."""
    proof = read(text)
    robot = checked_robot(proof)
    if proof["verdict"] == "refuted":
        check_refuted(proof["counterexample"], robot)
    else:
        need(proof["verdict"] == "proved", "no verdict")
        check_proved(proof["cases"], robot)
    return f"{proof['verdict']}: {sentence(*robot)}"


def sentence(actuators: Any, statement: Any) -> str:
    """What a file states."""
    box = ", ".join(f"{axis} +-{shown(half)}" for axis, half in statement["box"].items())
    free = f", {', '.join(statement['free'])} free" if statement["free"] else ""
    power = statement["power_w"]
    budget = "" if power is None else f", within {shown(power)} W"
    tolerance = statement["wrench_tolerance"]
    near = f", to within {shown(tolerance)}" if tolerance else ""
    means = [name for name, actuator in actuators.items() if actuator["mean"]]
    mean = f"; small forces as means over time: {', '.join(means)}" if means else ""
    return f"any wrench of {box}{free}, any {statement['lost']} lost{budget}{near}{mean}"


def shown(value: Any) -> str:
    """A number as people read it, with six digits; it says where it is another."""
    text = f"{float(value):g}"
    return text if Fraction(text) == value else f"about {text}"


# What comes of a file that has another form than a proof.
OTHER_FORM = (LookupError, TypeError, ValueError, ArithmeticError, AttributeError, RecursionError)


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
