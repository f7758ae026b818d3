"""Checks the certificates of a capability plot, by its JSON file and Python's `math` alone.

A load is refused by prices of its axes. At a price, the actuators together can earn no more than
the sum of what each one can earn by itself, its support function; a load that would earn more is
out of reach. Actuators whose sets are not convex are covered by several prices: one for each leaf
of a tree that chooses among their parts.

Where buses have a power budget, their power has a price, too: an actuator earns what its force
does, less the price of the power that this takes, and to the sum comes what all budgets are worth.

This file imports nothing of finlab, so that it can be read, and trusted, by itself.
"""

import math
from typing import Any


def support(piece: dict[str, Any], pull: tuple[float, float]) -> float:
    """Returns the most that a force of a convex set earns at a pull (2,) [1/N]."""
    if "corners_n" in piece:
        return float(max(x * pull[0] + y * pull[1] for x, y in piece["corners_n"]))
    return max(0.0, largest_pull(piece, pull))


def largest_pull(arc: dict[str, Any], pull: tuple[float, float]) -> float:
    """Returns the most that one of the largest forces of a sector earns at a pull (2,) [1/N]."""
    center = arc["center_rad"]
    half_angle = arc["half_angle_rad"]
    turn = math.remainder(math.atan2(pull[1], pull[0]) - center, 2.0 * math.pi)
    if abs(turn) <= half_angle:
        return float(arc["radius_n"] * math.hypot(*pull))
    ends = []
    for end in (center - half_angle, center + half_angle):
        ends.append(math.cos(end) * pull[0] + math.sin(end) * pull[1])
    return float(arc["radius_n"] * max(ends))


def earned_by(piece: dict[str, Any], pull: tuple[float, float], watt_price: float) -> float:
    """Returns the most that a force of a convex set earns at a pull (2,) [1/N], less the price of
    its power [1/W]. A set with a power has sides, of which any may be taken: its largest forces,
    and what shares of these take."""
    if "sides" not in piece:
        return support(piece, pull)
    return max((profit(side, pull, watt_price) for side in piece["sides"]), default=0.0)


def profit(side: dict[str, Any], pull: tuple[float, float], watt_price: float) -> float:
    """Returns the same of one side."""
    if "corners_n" in side:
        reach = max(x * pull[0] + y * pull[1] for x, y in side["corners_n"])
    else:
        reach = largest_pull(side, pull)
    if "knots" in side:
        return best_of_knots(side["knots"], reach, watt_price)
    # The best share g of  g reach - price watts g^exponent.
    watts, exponent = side["watts"], side["exponent"]
    share = 0.0
    if reach > 0.0:
        slope_at_most = watt_price * watts * exponent
        share = 1.0
        if reach < slope_at_most:
            share = (reach / slope_at_most) ** (1.0 / (exponent - 1.0))
    share = max(share, side["least_share"])
    return float(share * reach - watt_price * watts * share**exponent)


def best_of_knots(knots: list[list[float]], reach: float, watt_price: float) -> float:
    """Returns the most of  g reach - price P(g)  where P has knots of g, P and its slope, and a
    slope that is linear between them."""
    best = max(share * reach - watt_price * watts for share, watts, _ in knots)
    for (share, watts, slope), (next_share, _, next_slope) in zip(knots, knots[1:], strict=False):
        if watt_price * slope < reach < watt_price * next_slope:
            rise = reach / watt_price - slope
            further = (next_share - share) * rise / (next_slope - slope)
            power = watts + further * (slope + 0.5 * rise)
            best = max(best, (share + further) * reach - watt_price * power)
    return float(best)


def proven_share(
    sets: list[dict[str, Any]],
    scales: list[float],
    leaf: dict[str, Any],
    load: list[float],
    buses: dict[str, float] | None = None,
) -> float:
    """Returns the share of a load that forces of a leaf cannot exceed, by the leaf's price.

    Args:
        sets: the actuators' sets.
        scales: what is left of each actuator's forces [1].
        leaf: `parts` by name, `price`, and `watt_prices` by the names of buses.
        load: wrench (6,) that is to be held [N, N m]; the forces together oppose it.
        buses: power budgets by name [W].

    Returns:
        The bound; 0 where the price refuses the load, but not multiples of it; infinity where it
        proves nothing.
    """
    price = leaf["price"]
    watt_prices = leaf.get("watt_prices", {})
    if any(not watt_price >= 0.0 for watt_price in watt_prices.values()):
        return math.inf
    earned = 0.0
    for bus, watt_price in watt_prices.items():
        earned += watt_price * (buses or {}).get(bus, math.inf)
    for actuator, scale in zip(sets, scales, strict=True):
        first, second = (
            sum(p * w for p, w in zip(price, column, strict=True))
            for column in actuator["wrench_per_newton"]
        )
        part = leaf["parts"].get(actuator["name"])
        piece = actuator["cover"] if part is None else actuator["parts"][part]
        pull = (scale * first, scale * second)
        earned += earned_by(piece, pull, watt_prices.get(actuator.get("bus"), 0.0))
    asked = -sum(p * w for p, w in zip(price, load, strict=True))
    if asked > 0.0:
        return float(max(earned / asked, 0.0))
    # Actuators that cannot stop may earn less than nothing: then the load itself is out of reach.
    return 0.0 if earned < asked else math.inf


def covers(leaves: list[dict[str, Any]], sets: list[dict[str, Any]]) -> bool:
    """Returns whether leaves leave out no choice among the parts of the actuators."""
    if not leaves:
        return False
    names = {name for leaf in leaves for name in leaf["parts"]}
    if any(not leaf["parts"] for leaf in leaves):
        return True
    for actuator in sets:
        if actuator["name"] not in names or not actuator["parts"]:
            continue
        for part in range(len(actuator["parts"])):
            chosen = []
            for leaf in leaves:
                if leaf["parts"].get(actuator["name"], part) == part:
                    others = {k: v for k, v in leaf["parts"].items() if k != actuator["name"]}
                    chosen.append({"parts": others})
            if not covers(chosen, sets):
                return False
        return True
    return False


def faults(capability: dict[str, Any]) -> list[str]:
    """Returns what is wrong with the certificates of a capability plot: nothing, if all hold.

    Args:
        capability: content of the JSON file.

    Returns:
        A sentence for each "no" without a certificate, and for each certificate that proves less
        than it claims.
    """
    found = []
    proved = set()
    for refusal in capability["refusals"]:
        case = capability["cases"][refusal["case"]]
        heading = capability["headings_deg"][refusal["heading"]]
        condition = capability["conditions"][refusal["condition"]]["name"]
        where = f"{case['name']}, {heading:g} deg, {condition}"
        load = capability["loads"][refusal["heading"]][refusal["condition"]]
        leaves = refusal["leaves"]
        if not covers(leaves, case["sets"]):
            found.append(f"{where}: the leaves leave out a choice among parts")
            continue
        bounds = [
            proven_share(case["sets"], refusal["scales"], leaf, load, capability.get("buses", {}))
            for leaf in leaves
        ]
        limit = refusal["share"] * (1.0 + 1e-9) + 1e-9
        if not all(bound <= limit for bound in bounds):
            found.append(f"{where}: the prices prove {max(bounds):g}, not {refusal['share']:g}")
            continue
        if refusal["share"] < 1.0:
            proved.add((refusal["case"], refusal["heading"], refusal["condition"]))
    for c, of_case in enumerate(capability["held"]):
        for h, of_heading in enumerate(of_case):
            for k, is_held in enumerate(of_heading):
                if not is_held and (c, h, k) not in proved:
                    name = capability["cases"][c]["name"]
                    found.append(f"{name}, heading {h}, condition {k}: no certificate")
    return found
