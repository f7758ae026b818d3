"""Proofs by boxes: what the checker accepts holds, and what is false is refused."""

import json
import math
import os
import random
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction as F
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

import finlab
from finlab.analysis import check_proof
from finlab.analysis.prove import ProofResult, box_share, prove
from finlab.assets import shipped_layouts
from finlab.cli import main
from finlab.errors import CommandError
from finlab.forces.force_sets import SCALE, force_sets
from finlab.interaction.jets import Jets
from finlab.layout import Layout
from tests.analysis.proof_oracle import is_true
from tests.random_robots import KINDS, layout_of, load, random_robot

ROBOTS_PER_KIND = int(os.environ.get("FINLAB_PROOF_ROBOTS", "0"))
"""Random robots of each kind; 20 are two hundred. By default one each of those that are quick."""
SLOW = ("mixed", "all")
"""Kinds with many actuators."""
CHANGED_FILES = int(os.environ.get("FINLAB_PROOF_CHANGES", "60"))
"""Files with one digit changed; a thousand say more."""
SHARE = 0.6


def settled(result: ProofResult) -> str:
    """The verdict of a result, whose file the checker reads as a stranger would."""
    assert result.verdict in ("proved", "refuted"), result.reason
    assert check_proof.check(json.dumps(result.proof)).startswith(result.verdict)
    return result.verdict


def box_of(layout: Layout) -> list[float]:
    """60 % of what each axis can alone; of one that can nothing alone, of a third of what its
    actuators can together."""
    try:
        return list(box_share(layout, SHARE))
    except CommandError:
        sets = force_sets(layout)
        together = np.abs(sets.full_effectiveness()[0]).sum(axis=0) * SCALE
        return list(SHARE / 3.0 * together * layout.commanded)


def verdicts(layout: Layout) -> list[str]:
    """Verdicts of the box of a share, and of the same share of the largest box of that shape."""
    box = box_of(layout)
    result = prove(layout, box)
    found = [settled(result)]
    if result.largest_share is not None and result.largest_share > 1e-9:
        smaller = [SHARE * result.largest_share * half for half in box]
        found.append(settled(prove(layout, smaller)))
    return found


@pytest.mark.parametrize("name", shipped_layouts())
def test_shipped_robots_are_settled(name: str) -> None:
    """Each box of each shipped robot is proved or refuted."""
    found = verdicts(finlab.load_layout(name))
    assert len(found) == 1 or found[1] == "proved"


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "slipstreams"])
def test_random_robots_are_settled(kind: str) -> None:
    """So is that of random robots, with rudders at rest, wide arcs and fins that cannot rest;
    rudders in slipstreams are refused, see `test_propeller_rudder.py`."""
    for number in range(ROBOTS_PER_KIND or (kind not in SLOW)):
        assert verdicts(load(random_robot(kind, number, 63)))


def pods_with_arcs(number: int, least_share: float = 0.0) -> dict[str, Any]:
    """A planar robot of three or four pods with two or three arcs each; the least force is a share
    of the largest one."""
    rng = np.random.default_rng([0xA2C5, number])
    pods = []
    for k in range(int(rng.integers(3, 5))):
        width = rng.dirichlet(np.ones(2 * int(rng.integers(2, 4))) * 3.0)
        angles = rng.uniform(-180.0, 0.0) + 360.0 * np.cumsum(width)
        most = float(rng.uniform(5.0, 30.0))
        pods.append(
            {
                "name": f"p{k}",
                "type": "azimuth",
                "position_m": [*rng.uniform(-0.4, 0.4, 2).tolist(), 0.0],
                "turn_axis": [0.0, 0.0, 1.0],
                "zero": [1.0, 0.0, 0.0],
                "force_n": [least_share * most, most],
                "model": {"type": "power_law", "forward": 1.0},
                "arc_deg": angles.reshape(-1, 2).tolist(),
            }
        )
    layout = layout_of("pods", pods)
    return {**layout, "axes": ["Fx", "Fy", "Tz"]}


def reversing_tilts(number: int) -> dict[str, Any]:
    """A planar robot of three tilts that also push astern within an arc, and two thrusters."""
    rng = np.random.default_rng([0xB0E, number])
    actuators = []
    for k in range(5):
        most = float(rng.uniform(5.0, 30.0))
        angle = float(rng.uniform(-math.pi, math.pi))
        actuator = {
            "name": f"a{k}",
            "position_m": [*rng.uniform(-0.4, 0.4, 2).tolist(), 0.0],
            "force_n": [-float(rng.uniform(0.3, 1.0)) * most, most],
            "model": {"type": "power_law", "forward": 1.0, "reverse": 1.7},
        }
        if k < 3:
            half_deg = float(rng.uniform(10.0, 60.0))
            actuator |= {"type": "tilt", "turn_axis": [0, 0, 1], "arc_deg": [-half_deg, half_deg]}
            actuator["zero"] = [math.cos(angle), math.sin(angle), 0.0]
        else:
            actuator |= {"type": "thruster", "axis": [math.cos(angle), math.sin(angle), 0.0]}
        actuators.append(actuator)
    return {**layout_of("tilts", actuators), "axes": ["Fx", "Fy", "Tz"]}


@pytest.mark.parametrize("number", range(4))
def test_tilts_that_push_astern_are_settled(number: int) -> None:
    """Each box; wrenches at random of one that is proved are answered exactly, and with a budget
    far above or below what its corners take it is proved or refuted."""
    layout = load(reversing_tilts(number))
    box = np.array(box_of(layout))
    verdicts_of = {}
    for share in (1.0, 0.5, 0.25):
        verdicts_of[share] = settled(prove(layout, share * box, 0))
        settled(prove(layout, share * box, 1))
    share = 0.25
    assert verdicts_of[share] == "proved"
    allocator = finlab.Allocator(layout)
    rng = np.random.default_rng(number)
    wrenches = rng.uniform(-share, share, (20, 6)) * box
    assert allocator.allocate_batch(wrenches).err_norm.max() < 1e-5
    corners = np.array(np.meshgrid(*([-1, 1],) * 6)).reshape(6, -1).T * share * box
    answers = allocator.allocate_batch(corners)
    assert settled(prove(layout, share * box, 0, power=0.3 * answers.bound.max())) == "refuted"
    assert settled(prove(layout, share * box, 0, power=10.0 * answers.power.max())) == "proved"


def forces_by_corners(pod: dict[str, Any], is_outer: bool) -> list[Any]:
    """Convex polygons (K, 2) [N], inside or around the forces of a pod: each arc in pieces of at
    most half a turn, of one that cannot stop of a degree."""
    least, most = pod["force_n"]
    polygons = []
    for low, high in np.deg2rad(pod["arc_deg"]):
        count = math.ceil((high - low) / (np.pi / 180.0 if least else np.pi))
        for begin, end in pairwise(np.linspace(low, high, count + 1)):
            steps = math.ceil((end - begin) / 0.02) + 1
            angle = np.linspace(begin, end, steps + 1)
            rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
            grown = 1.0 / np.cos(0.5 * (angle[1] - angle[0])) if is_outer else 1.0
            shrunk = np.cos(0.5 * (end - begin)) if is_outer and least else 1.0
            inner = least * shrunk / (1.0 if is_outer else np.cos(0.5 * (end - begin)))
            polygons.append(np.concatenate([grown * most * rim, inner * rim[[-1, 0]]]))
    return polygons


def gives(pods: list[dict[str, Any]], wrench: Any, is_outer: bool) -> bool:
    """Whether pods give a wrench (3,) of Fx, Fy, Tz: a linear programme for each choice of
    polygons."""
    for chosen in product(*(forces_by_corners(pod, is_outer) for pod in pods)):
        columns = []
        sums = np.zeros((len(pods), sum(map(len, chosen))))
        at = 0
        for k, (pod, corners) in enumerate(zip(pods, chosen, strict=True)):
            x, y, _ = pod["position_m"]
            columns.append(np.column_stack([corners, x * corners[:, 1] - y * corners[:, 0]]))
            sums[k, at : at + len(corners)] = 1.0
            at += len(corners)
        equal = np.concatenate([np.concatenate(columns).T, sums])
        right = np.concatenate([wrench, np.ones(len(pods))])
        if linprog(np.zeros(at), A_eq=equal, b_eq=right, method="highs").status == 0:
            return True
    return False


@pytest.mark.parametrize("number", range(3))
def test_several_arcs_are_proved_and_refuted_as_linear_programmes_say(number: int) -> None:
    """Of a box that is proved, wrenches at random are given, one lost or nobody; the wrench of a
    counterexample is not."""
    mapping = pods_with_arcs(number)
    layout = load(mapping)
    box = np.array(box_of(layout))
    rng = np.random.default_rng([63, number])
    found = []
    for share, lost in ((1.0, 1), (1.0, 0), (0.2, 0), (0.05, 1)):
        result = prove(layout, share * box, lost=lost)
        found.append(settled(result))
        if result.verdict == "refuted":
            example = result.proof["counterexample"]
            working = [pod for pod in mapping["actuators"] if pod["name"] not in example["lost"]]
            wrench = [float(F(example["wrench"][axis])) for axis in layout.axes]
            assert not gives(working, np.array(wrench), is_outer=False)
            continue
        for gone in [None, *layout.names][: 1 + lost * layout.n]:
            working = [pod for pod in mapping["actuators"] if pod["name"] != gone]
            for _ in range(4):
                wrench = rng.uniform(-share, share, 3) * box[[0, 1, 5]]
                assert gives(working, wrench, is_outer=True)
    assert "refuted" in found


@pytest.mark.parametrize(("turn_deg", "verdict"), [(0.0, "refuted"), (90.0, "proved")])
def test_two_pods_that_cannot_stop_push_against_each_other(turn_deg: float, verdict: str) -> None:
    """Side by side, and a wide zone of directions forbidden: against each other they turn the robot
    where they push ahead and astern, and give small wrenches where they push aside."""
    pods = []
    for side in (-1.0, 1.0):
        arcs = [[turn_deg - 70.0, turn_deg + 70.0], [turn_deg + 110.0, turn_deg + 250.0]]
        pods.append(pods_with_arcs(0)["actuators"][0] | {"name": f"p{side:g}"})
        pods[-1] |= {"position_m": [0.0, side, 0.0], "force_n": [10.0, 30.0], "arc_deg": arcs}
    layout = load({**layout_of("pair", pods), "axes": ["Fx", "Fy", "Tz"]})
    result = prove(layout, [0.5, 0.5, 0, 0, 0, 8.0], lost=0)
    assert settled(result) == verdict
    without_turns = replace(layout, axes=("Fx", "Fy"))
    assert settled(prove(without_turns, [2.0, 2.0, 0, 0, 0, 0], lost=0)) == "proved"
    assert settled(prove(without_turns, [2.0, 2.0, 0, 0, 0, 0], lost=1)) == "refuted"


def test_two_losses_and_free_axes() -> None:
    """With two lost there are all pairs; a free axis makes room."""
    heavy = finlab.load_layout("bluerov2_heavy")
    box = [10, 10, 10, 0, 0, 0]
    two = prove(heavy, box, lost=2)
    assert settled(two) == "refuted"
    freed = prove(heavy, box, lost=1, free=("Tx", "Ty"))
    assert settled(freed) == "proved"
    assert freed.n_cases == 9
    assert freed.n_corners == 8


def test_power_budget_agrees_with_the_least_power() -> None:
    """Around the least power of the dearest corner the verdict turns."""
    for name, box in (
        ("bluerov2_heavy", [20, 20, 0, 0, 0, 2]),
        ("no_yaw", [1, 1, 2, 0, 0, 0]),
        ("catamaran", [10, 5, 0, 0, 0, 4]),
    ):
        layout = finlab.load_layout(name)
        allocator = finlab.Allocator(layout)
        watts = 0.0
        for lost in ((), *((actuator,) for actuator in layout.names)):
            corners = np.array(np.meshgrid(*([-1, 1],) * 6)).reshape(6, -1).T * box
            watts = max(watts, float(allocator.allocate_batch(corners, lost=lost).power.max()))
        assert settled(prove(layout, box, power=1.02 * watts)) == "proved"
        assert settled(prove(layout, box, power=0.95 * watts)) == "refuted"


def test_what_is_not_certain_is_not_settled() -> None:
    """An interaction, and a file of measured forces, give the reason."""
    layout = finlab.load_layout("A")
    with_jets = Layout("jets", layout.actuators, interaction=Jets())
    result = prove(with_jets, [1, 1, 1, 0.1, 0.1, 0.1])
    assert result.verdict == "not settled"
    assert "interaction" in result.reason
    assert result.proof is None


@pytest.mark.parametrize(
    ("box", "options", "words"),
    [
        ([1, 1, 1, 1, 1], {}, "six half widths"),
        ([1, 1, 1, 1, -1, 1], {}, "six half widths"),
        ([0, 0, 0, 0, 0, 0], {}, "above 0"),
        ([0, 0, 0, 0, 1, 0], {}, "Ty is free"),
        ([1, 1, 1, 0, 0, 1], {"lost": 9}, "lost"),
        ([1, 1, 1, 0, 0, 1], {"power": -1.0}, "power"),
        ([1, 1, 1, 0, 0, 1], {"free": ("Tq",)}, "Tq"),
    ],
)
def test_statements_that_are_none(box: Any, options: Any, words: str) -> None:
    """Errors say what was expected."""
    with pytest.raises(CommandError, match=words):
        prove(finlab.load_layout("bluerov2"), box, **options)


@pytest.fixture(scope="module")
def files() -> list[str]:
    """Files of small robots: proved and refuted, with and without a budget; with several arcs, wide
    arcs and fins that cannot rest."""
    texts = []
    questions: list[tuple[str, list[float], float | None]] = [
        ("no_yaw", [1, 1, 2, 0.1, 0.1, 0], None),
        ("no_yaw", [1, 1, 2, 0.1, 0.1, 0], 150.0),
        ("catamaran", [10, 5, 0, 0, 0, 4], 900.0),
        ("bluerov2_heavy", [20, 20, 0, 0, 0, 2], None),
        ("bluerov2_heavy", [60, 60, 20, 1, 1, 2], None),
        ("bluerov2_heavy", [20, 20, 20, 1, 1, 2], 400.0),
        ("catamaran", [10, 5, 0, 0, 0, 4], 2.0),
    ]
    for name, box, power in questions:
        result = prove(finlab.load_layout(name), box, power=power)
        settled(result)
        texts.append(json.dumps(result.proof))
    for mapping, share, lost in (
        (pods_with_arcs(1), 0.2, 0),
        (pods_with_arcs(1), 1.0, 0),
        (pods_with_arcs(2, least_share=0.1), 0.3, 1),
        (random_robot("wide arcs", 14, 63), 0.6, 0),
        (random_robot("wide arcs", 14, 63), 0.01, 1),
        (random_robot("holes", 13, 63), 0.1, 0),
        (reversing_tilts(0), 1.0, 0),
        (reversing_tilts(1), 0.25, 0),
    ):
        layout = load(mapping)
        result = prove(layout, share * np.array(box_of(layout)), lost=lost)
        settled(result)
        texts.append(json.dumps(result.proof))
    return texts


def test_files_with_a_changed_digit(files: list[str]) -> None:
    """Of files with one digit changed, all that are false are refused."""
    rng = random.Random(63)
    for text in files:
        assert is_true(text)
    n_refused = 0
    for number in range(CHANGED_FILES):
        text = files[number % len(files)]
        places = [i for i, letter in enumerate(text) if letter.isdigit()]
        place = rng.choice(places)
        digit = rng.choice([d for d in "0123456789" if d != text[place]])
        changed = text[:place] + digit + text[place + 1 :]
        try:
            check_proof.check(changed)
        except (check_proof.WrongProof, LookupError, TypeError, ValueError, ArithmeticError):
            n_refused += 1
        else:
            assert is_true(changed), f"{text[place - 40 : place]}[{text[place]} -> {digit}]"
    print(f"\nof {CHANGED_FILES} files {n_refused} are refused, the others are true")
    assert n_refused > CHANGED_FILES // 4


RIGHT, LEFT, UP, DOWN = ([F(1), F(0)], [F(-1), F(0)], [F(0), F(1)], [F(0), F(-1)])
NARROW = [[F(1), F("-0.2")], [F(1), F("0.2")]]
"""A sector about the first axis."""
ROUND = [[RIGHT, UP], [UP, LEFT], [LEFT, DOWN], [DOWN, RIGHT]]
"""All directions."""


def pod(sectors: Any, least: float = 0, mean: bool = False) -> dict[str, Any]:
    """An actuator of a plane, as far as the checker asks about its forces."""
    limits = [F(least), F(10)]
    return {
        "name": "pod",
        "axes": [[F(1), F(0), F(0)], [F(0), F(1), F(0)]],
        "sectors": sectors,
        "mean": mean,
        "force_n": limits,
        "outer_force_n": limits,
        "power": None,
    }


def holds(actuator: dict[str, Any], points: Any) -> bool:
    """Whether the checker says that an actuator has the hull of forces."""
    sides = check_proof.sides_of(actuator, "force_n")
    return bool(check_proof.hold_hull(actuator, sides, [list(map(F, p)) for p in points]))


@pytest.mark.parametrize(
    ("sectors", "least", "mean", "points", "expected"),
    [
        ([[RIGHT, LEFT]], 0, False, [(1, 0), (-1, 0), (0, 1)], True),
        ([[RIGHT, LEFT]], 0, False, [(1, 0), (-1, 0), (0, -1)], False),  # the other half
        ([[RIGHT, LEFT]], 0, False, [(6, 8)], True),
        ([[RIGHT, LEFT]], 0, False, [(6, "8.0001")], False),  # too large
        (ROUND, 0, False, [(9, 1), (-9, 1), (0, -9)], True),  # across all sectors
        (ROUND[:3], 0, False, [(9, 0), (-9, 0), (0, 9)], True),
        (ROUND[:3], 0, False, [(9, 0), (0, -9)], False),  # across the gap
        (ROUND[:3], 0, False, [(9, 1), (-9, 0), (0, -9)], False),  # the same, with others
        ([ROUND[0], ROUND[2]], 0, False, [(9, 0), (0, 9)], True),
        ([ROUND[0], ROUND[2]], 0, False, [(9, 0), (-9, 0)], True),  # a line through 0
        ([ROUND[0], ROUND[2]], 0, False, [(9, 1), (-9, 0)], False),  # passes 0 across a gap
        (ROUND, 1, False, [(2, 1), (2, -1), (1, 0)], True),
        (ROUND, 1, False, [(2, 1), (2, -1), ("0.9", 0)], False),  # too small
        (ROUND, 1, False, [("0.8", 1), ("0.8", -1)], False),  # small forces between them
        (ROUND, 1, False, [(9, 9), (-9, 0), (9, -9)], False),  # small forces among them
        (ROUND, 1, False, [(9, -2), (-9, 0), (0, 5), (0, -5)], False),
        ([NARROW], 1, True, [(1, "0.1"), (1, 0)], True),  # beyond the chord
        ([NARROW], 1, True, [("0.99", 0)], False),  # before it
        ([NARROW], 1, True, [(2, "0.5")], False),
        ([[RIGHT, RIGHT]], 1, True, [("0.9", 0)], False),  # no chord along a line
        ([[RIGHT, RIGHT]], 1, True, [(1, 0), (5, 0)], True),
        ([NARROW], -5, False, [(9, 0), (-5, 0)], True),  # a line ahead and astern
        ([NARROW], -5, False, [(9, 0), (-6, 0)], False),  # too far astern
        ([NARROW], -5, False, [(9, 0), (-5, "0.5")], False),  # aside of 0
        ([NARROW], -5, False, [(-4, "0.5"), (-4, "-0.5")], True),
        ([[RIGHT, LEFT]], -5, False, [(4, 0), (0, 4), (-4, 0), (0, -4)], True),  # a disc
        ([[RIGHT, LEFT]], -5, False, [(4, 0), (0, 4), (-4, 0), (0, -6)], False),
    ],
)
def test_hulls_of_forces(
    sectors: Any, least: float, mean: bool, points: Any, expected: bool
) -> None:
    """The checker says whether an actuator has all means of some forces."""
    assert holds(pod(sectors, least, mean), points) is expected


@pytest.mark.parametrize("number", range(40))
def test_hulls_of_random_forces_are_as_samples_say(number: int) -> None:
    """What the checker holds has no mean outside of the sectors; what it does not has one."""
    rng = np.random.default_rng([67, number])
    width = rng.dirichlet(np.ones(4)) * 2.0 * np.pi
    ends = rng.uniform(-np.pi, np.pi) + np.cumsum(width)
    sectors = []
    for first, last in ((ends[0], ends[1]), (ends[1], ends[2]), (ends[2], ends[3])):
        middle = 0.5 * (first + last)
        for low, high in ((first, middle), (middle, last)):
            edge = [1.0001 * np.array([np.cos(angle), np.sin(angle)]) for angle in (low, high)]
            sectors.append([[F(str(round(x, 12))) for x in each] for each in edge])
    least = float(rng.choice([0.0, 0.5, -4.0]))
    actuator = pod(sectors, least)
    sides = check_proof.sides_of(actuator, "force_n")
    for spread in (0.3, 1.0, 3.0):
        middle_force = rng.normal(size=2) * 4.0
        points = middle_force + spread * rng.normal(size=(4, 2))
        exact = [[F(str(round(x, 6))) for x in each] for each in points.tolist()]
        weights = rng.dirichlet(np.full(4, 0.4), 2000)
        means = weights @ np.array(exact, float)
        size = np.linalg.norm(means, axis=1)
        angle = np.arctan2(means[:, 1], means[:, 0])
        is_in = {}
        for tolerance in (1e-3, -1e-3):
            found = np.zeros(len(means), bool)
            for u, _, low, high, _ in sides:
                first = math.atan2(float(u[1]), float(u[0]))
                v = sides[[side[0] for side in sides].index(u)][1]
                span = (math.atan2(float(v[1]), float(v[0])) - first) % (2.0 * np.pi)
                turned = (angle - first + tolerance) % (2.0 * np.pi) <= span + 2.0 * tolerance
                found |= (
                    turned & (size <= float(high) + tolerance) & (size >= float(low) - tolerance)
                )
            is_in[tolerance] = found.all()
        if holds(actuator, exact):
            assert is_in[1e-3]
        else:
            assert not is_in[-1e-3]


@pytest.mark.parametrize(
    ("sectors", "least", "mean", "words"),
    [
        ([[RIGHT, DOWN]], 0, False, "wider than half a turn"),
        ([[[F("0.5"), F(0)], UP]], 0, False, "too short"),
        ([[[F(2), F(0)], UP]], 0, False, "too long"),
        ([], 0, False, "sectors"),
        ([[NARROW[0], RIGHT], [RIGHT, NARROW[1]]], 1, True, "between its sectors"),
        ([NARROW], 11, False, "in no order"),
    ],
)
def test_sectors_that_are_none(sectors: Any, least: float, mean: bool, words: str) -> None:
    """The checker refuses them."""
    with pytest.raises(check_proof.WrongProof, match=words):
        check_proof.check_actuator(pod(sectors, least, mean))


def test_a_tree_without_a_branch_for_each_sector() -> None:
    """The checker refuses a counterexample that leaves a sector out, whatever the prices."""
    price = {"price": [F(1)], "watt_price": F(0)}
    actuators = {"pod": pod(ROUND[:2], -1) | {"columns": [[F(0)], [F(0)]]}}
    robot = (actuators, {"power_w": None, "wrench_tolerance": F(0)})
    sides = {"pod": check_proof.sides_of(actuators["pod"], "outer_force_n")}
    for count in (1, 3, 4, 5):
        tree = {"cut": "pod", "each": [price] * count}
        if count == 4:
            check_proof.check_tree(tree, [F(1)], sides, robot)
            continue
        with pytest.raises(ValueError, match="zip"):
            check_proof.check_tree(tree, [F(1)], sides, robot)


def test_wrenches_out_of_the_box_refute_nothing(files: list[str]) -> None:
    """Nor do those of other axes."""
    refuted = [text for text in files if '"refuted"' in text]
    for text in refuted:
        for change in ({"Fx": "1000"}, {"Fw": "0"}):
            proof = json.loads(text)
            proof["counterexample"]["wrench"] |= change
            with pytest.raises(check_proof.WrongProof, match="wrench"):
                check_proof.check(json.dumps(proof))


STRANGE_FILES = [
    (lambda text: text.replace('"lost": 1,', '"lost": 2, "lost": 1,', 1), "a key stands twice"),
    (lambda text: re.sub(r'("position_m": \[)[^,]*', r"\1NaN", text, count=1), "NaN is no number"),
    (
        lambda text: re.sub(r'("power_w": )[^,]*', r"\1Infinity", text, count=1),
        "Infinity is no num",
    ),
    (lambda text: "[" * 100_000 + text, "recursion"),
    (lambda text: re.sub(r'"box": \{[^}]*\}', '"box": []', text), ""),
    (lambda text: text.replace('"cases": [', '"cases": [3, '), ""),
    (lambda text: text[:-1], ""),
    (lambda text: "null", ""),
]
"""What somebody does to a true file, and what the refusal says."""


@pytest.mark.parametrize(("changed", "words"), STRANGE_FILES)
def test_a_file_of_another_form_is_refused_in_a_sentence(
    changed: Callable[[str], str],
    words: str,
    files: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = next(text for text in files if '"verdict": "proved"' in text and '"lost": 1,' in text)
    assert changed(text) != text
    path = tmp_path / "proof.json"
    path.write_text(changed(text), "utf-8")
    assert check_proof.main(path) == 1
    said = capsys.readouterr().out
    assert said.startswith("refused: ") and words in said


def test_a_rounded_number_of_the_statement_is_said_to_be_one() -> None:
    half = 3.9999996
    layout = load(random_robot("thrusters", 6, 5))
    result = prove(layout, [1e-6 * half, 0, 0, 0, 0, 0], lost=0)
    assert result.verdict == "proved"
    assert "Fx +-about 4e-06" in check_proof.check(json.dumps(result.proof))
    exact = prove(layout, [4e-6, 0, 0, 0, 0, 0], lost=0)
    assert "Fx +-4e-06," in check_proof.check(json.dumps(exact.proof))


def test_the_checker_needs_python_alone(tmp_path: Path, files: list[str]) -> None:
    """A copy of it runs without numpy and finlab, and its exit code tells."""
    checker = tmp_path / "check_proof.py"
    checker.write_text(Path(check_proof.__file__).read_text("utf-8"), "utf-8")
    proof = tmp_path / "proof.json"
    proof.write_text(files[0], "utf-8")
    wrong = tmp_path / "wrong.json"
    wrong.write_text(files[0].replace('"lost": 1,', '"lost": 2,'), "utf-8")
    for path, code, words in ((proof, 0, "proved: any wrench"), (wrong, 1, "no case in which")):
        command = [sys.executable, "-I", "-S", str(checker), str(path)]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (run.returncode, words in run.stdout) == (code, True), run.stdout + run.stderr


def test_the_verb(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit codes tell the verdicts; text, JSON and files go together."""
    output = tmp_path / "proof.json"
    box = ["--box", "20", "20", "20", "1", "1", "2"]
    assert main(["layout", "prove", "bluerov2_heavy", *box, "-o", str(output)]) == 0
    assert "proved: bluerov2_heavy" in capsys.readouterr().out
    assert check_proof.main(output) == 0
    capsys.readouterr()
    assert main(["layout", "prove", "bluerov2_heavy", "--box-share", "0.6", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["verdict"] == "refuted"
    assert main(["layout", "prove", "A"]) == 2
    assert "--box" in capsys.readouterr().err
