"""Capability plots, beside a published case, mixed integer programs, and the force sets."""

import copy
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from scipy.optimize import Bounds, LinearConstraint, linprog, milp

from finlab.analysis.capability import Capability, capability, dp_capability
from finlab.analysis.capability_text import capability_picture
from finlab.analysis.dnv_loads import WEATHER
from finlab.analysis.dnv_thrust import LOSSES, ship_sets, ship_thrusters, thrust_left
from finlab.analysis.refusal_check import faults
from finlab.analysis.ship_file import Ship, read_ship
from finlab.analysis.split_sets import largest_shares
from finlab.errors import LayoutError
from finlab.forces.force_sets import SCALE, force_sets
from finlab.forces.reach import max_wrench_along_exactly
from finlab.layout import Layout, load_layout
from finlab.layout.load import parse_layout_text
from tests.analysis.supply_vessel import AZIMUTH, layout_text, write_vessel

CLOSE_TO_PUBLISHED = 5e-3
"""The published numbers have three digits, and are of polygons with 36 corners."""


@pytest.fixture(scope="module")
def five(tmp_path_factory: pytest.TempPathFactory) -> tuple[Layout, Ship]:
    """The published vessel with five actuators."""
    layout, ship = write_vessel(tmp_path_factory.mktemp("five"), retractable=True)
    return load_layout(layout), read_ship(ship)


@pytest.fixture(scope="module")
def four(tmp_path_factory: pytest.TempPathFactory) -> tuple[Layout, Ship]:
    """The same with four."""
    layout, ship = write_vessel(tmp_path_factory.mktemp("four"), retractable=False)
    return load_layout(layout), read_ship(ship)


@pytest.fixture(scope="module")
def plot(four: tuple[Layout, Ship]) -> Capability:
    """The plot of the vessel with four actuators, with all losses."""
    return dp_capability(*four)


def as_file(plot: Capability) -> dict:
    """A plot as its JSON file holds it."""
    return json.loads(json.dumps(plot.to_dict(), allow_nan=False))


def test_utilisations_of_the_published_case(five: tuple[Layout, Ship]) -> None:
    plot = dp_capability(*five, headings=[90.0], losses=())
    assert plot.utilisation[0, 0, 6:9] == pytest.approx((0.587, 0.826, 1.106), rel=5e-3)
    assert plot.values[0] == [7]


def test_a_sway_load_alone_takes_more_than_there_is(five: tuple[Layout, Ship]) -> None:
    sets = ship_sets(ship_thrusters(*five), five[1], losses=())
    target = np.array([[0.0, 664e3, 0.0, 0.0, 0.0, 0.0]])
    answer = largest_shares(sets, target, np.full((1, 5), 0.9))
    assert 1.0 / answer.share[0] == pytest.approx(1.055, rel=CLOSE_TO_PUBLISHED)


@pytest.mark.parametrize(
    ("losses", "beam", "beam_above", "abaft", "astern"),
    [
        (("ventilation", "flushing"), 0.747, 1.055, 0.995, 0.692),
        (LOSSES, 0.759, 1.071, 1.011, 0.747),
    ],
)
def test_losses_of_the_published_case(
    four: tuple[Layout, Ship],
    losses: tuple[str, ...],
    beam: float,
    beam_above: float,
    abaft: float,
    astern: float,
) -> None:
    plot = dp_capability(*four, headings=[90.0, 100.0, 170.0], losses=losses)
    used = plot.utilisation[0]
    found = (used[0, 6], used[0, 7], used[1, 7], used[2, 11])
    assert found == pytest.approx((beam, beam_above, abaft, astern), rel=CLOSE_TO_PUBLISHED)


def test_numbers_of_the_published_case(plot: Capability) -> None:
    least = set(np.array(plot.headings)[plot.values[0] == 6.0].tolist())
    assert least == {60, 70, 80, 90, 100, 260, 270, 280, 290, 300}
    assert plot.values[0][[0, 18]].tolist() == [11, 11]
    assert plot.notation is not None and plot.notation[:2] == (8, 6)
    assert [case.name for case in plot.cases][-2:] == ["SWBD 1", "SWBD 2"]


def test_a_plot_is_the_mirror_image_of_itself(plot: Capability) -> None:
    mirrored = [(36 - k) % 36 for k in range(36)]
    names = [case.name for case in plot.cases]
    for name, twin in (("intact", "intact"), ("AZ1", "AZ2"), ("BT1", "BT1")):
        values = plot.share[names.index(name)]
        assert values[mirrored] == pytest.approx(plot.share[names.index(twin)], rel=1e-6)


def test_all_questions_of_all_single_losses_within_two_seconds(five: tuple[Layout, Ship]) -> None:
    times = []
    for _ in range(2):
        start = time.thread_time()
        plot = dp_capability(*five)
        times.append(time.thread_time() - start)
    assert plot.share[0].size == 432 and len(plot.cases) == 1 + 5 + 2
    assert min(times) <= 2.0


def test_every_no_is_proved(plot: Capability) -> None:
    values = as_file(plot)
    n_refused = int((~plot.held).sum())
    assert n_refused > 500
    assert len(values["refusals"]) == n_refused
    assert max(len(refusal["leaves"]) for refusal in values["refusals"]) > 1
    assert faults(values) == []


def test_a_certificate_that_proves_less_is_found(four: tuple[Layout, Ship]) -> None:
    values = as_file(dp_capability(*four, headings=[170.0, 100.0]))
    refused = next(r for r in values["refusals"] if len(r["leaves"]) > 1)
    for change in ("price", "leaf", "load", "share", "missing"):
        wrong = copy.deepcopy(values)
        refusal = wrong["refusals"][values["refusals"].index(refused)]
        if change == "price":
            refusal["leaves"][0]["price"][5] *= -1.0
        elif change == "leaf":
            refusal["leaves"].pop()
        elif change == "load":
            load = wrong["loads"][refusal["heading"]][refusal["condition"]]
            load[:] = [0.9 * refusal["share"] * each for each in load]
        elif change == "share":
            refusal["share"] *= 0.999
        else:
            wrong["refusals"].remove(refusal)
        assert faults(wrong), change


def star_corners(thruster_y: float, radius: float) -> np.ndarray:
    """Corners of an aft azimuth of the published vessel, with the loss behind its skeg, by the
    formulas of Table 3-7 and its mirror image, without what flushing forbids."""
    side = np.sign(thruster_y)
    distance = np.hypot(4.0, 5.5)
    jet = np.arctan(0.6 * 3.0 / distance)
    flush = np.pi / 2 + np.arctan(4.0 / 5.5)
    worst = flush + jet
    knots = [0.0, flush - jet, worst, min(worst + 4.0 * jet, np.pi), 2.0 * np.pi]
    left = [1.0, 1.0, 2.0 * worst / np.pi - 1.0, 1.0, 1.0]
    angle = np.unique(np.append(np.deg2rad(np.arange(0.0, 360.0, 2.0)), knots[1:4]))
    size = radius * np.interp(angle, knots, left)
    half = np.arctan(0.1 + 3.0 / 11.0)
    size[np.abs(angle - np.pi / 2) < half] = 0.0
    angle *= side
    return np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)


def share_by_integers(load: np.ndarray, scale: np.ndarray) -> float:
    """The largest share of a load (3,) that the four actuators hold, by a mixed integer program:
    one triangle between two neighbouring corners for each azimuth."""
    columns = []
    n_corners = []
    for y, left in ((5.5, scale[0]), (-5.5, scale[1])):
        corners = left * star_corners(y, 377519.5)
        n_corners.append(len(corners))
        columns.append(np.column_stack([corners, -40.0 * corners[:, 1] - y * corners[:, 0]]))
    tunnels = np.array([[0.0, 135770.0, 31.0 * 135770.0], [0.0, 126890.0, 28.0 * 126890.0]])
    tunnels *= scale[2:, None]
    k, n = n_corners
    # Unknown: weights of the corners, tunnels, one choice of a triangle each, and the share.
    n_unknown = 2 * (k + n) + 3
    balance = np.zeros((3, n_unknown))
    balance[:, :k] = columns[0].T
    balance[:, k : k + n] = columns[1].T
    balance[:, k + n : k + n + 2] = tunnels.T
    balance[:, -1] = load
    scale_of_rows = np.array([1e5, 1e5, 4e6])
    rows = [balance / scale_of_rows[:, None]]
    low = [np.zeros(3)]
    high = [np.zeros(3)]
    first = k + n + 2
    for begin, count, choices in ((0, k, first), (k, n, first + k)):
        total = np.zeros((2, n_unknown))
        total[0, begin : begin + count] = 1.0
        total[1, choices : choices + count] = 1.0
        rows.append(total)
        low.append(np.array([0.0, 1.0]))
        high.append(np.array([1.0, 1.0]))
        chosen = np.zeros((count, n_unknown))
        for corner in range(count):
            chosen[corner, begin + corner] = 1.0
            chosen[corner, choices + corner] = -1.0
            chosen[corner, choices + (corner - 1) % count] = -1.0
        rows.append(chosen)
        low.append(np.full(count, -np.inf))
        high.append(np.zeros(count))
    least = np.zeros(n_unknown)
    least[k + n : k + n + 2] = -1.0
    most = np.ones(n_unknown)
    most[-1] = np.inf
    is_integer = np.zeros(n_unknown)
    is_integer[first:-1] = 1.0
    cost = np.zeros(n_unknown)
    cost[-1] = -1.0
    answer = milp(
        cost,
        constraints=LinearConstraint(
            np.concatenate(rows), np.concatenate(low), np.concatenate(high)
        ),
        bounds=Bounds(least, most),
        integrality=is_integer,
        options={"mip_rel_gap": 1e-5},
    )
    assert answer.success, answer.message
    return float(answer.x[-1])


@pytest.mark.parametrize("heading", [10, 100, 190])
def test_shares_are_those_of_a_mixed_integer_program(
    four: tuple[Layout, Ship], plot: Capability, heading: int
) -> None:
    h = plot.headings.index(float(heading))
    condition = 8
    angle = np.deg2rad([float(heading)])
    scale = np.array(
        [
            thrust_left(each, four[1], WEATHER[condition], angle, ventilation=True)[0]
            for each in ship_thrusters(*four)
        ]
    )
    reference = share_by_integers(plot.loads[h, condition, [0, 1, 5]], scale)
    # The polygons of the program are within the arcs by at most 1 - cos(1 deg).
    assert plot.share[0, h, condition] == pytest.approx(reference, rel=3e-4)


def test_an_actuator_that_flushes_a_dead_one_loses_thrust() -> None:
    fore = AZIMUTH.format(name="fore", x=3, y=0)
    aft = AZIMUTH.format(name="aft", x=-3, y=0)
    layout = parse_layout_text(layout_text(fore, aft), ".yaml", "test")
    thruster = "{diameter_m: 2.0, power_kw: 1000, height_m: -50}"
    ship = ship_of(f"{{fore: {thruster}, aft: {thruster}}}")
    plot = dp_capability(layout, ship, headings=[0.0])
    thrust = 0.9 * 800.0 * (2.0 * 930.0) ** (2.0 / 3.0)
    force = -plot.loads[0, :, 0]
    names = [case.name for case in plot.cases]
    # The race of the fore one goes aft, onto the dead one; s / D = 3.
    left = 1.0 - 1.0 / (0.02 * 9.0 + 0.25 * 3.0 + 1.2)
    of_fore = plot.share[names.index("aft"), 0, 6]
    of_aft = plot.share[names.index("fore"), 0, 6]
    assert of_fore == pytest.approx(left * thrust / force[6], rel=1e-6)
    assert of_aft == pytest.approx(thrust / force[6], rel=1e-6)
    # Both together: the fore one must not flush the aft one while that works.
    half = np.arctan(0.1 + 2.0 / 6.0)
    of_both = (1.0 + np.cos(half)) * thrust / force[6]
    assert plot.share[0, 0, 6] <= of_both * (1.0 + 1e-6)
    assert faults(as_file(plot)) == []


def ship_of(actuators: str) -> Ship:
    """A ship of round numbers with some actuators."""
    from finlab.analysis.ship_file import ShipFile
    from finlab.files import parse_yaml
    from finlab.files.schema import checked

    text = f"""
ship:
  length_pp_m: 80
  breadth_m: 18
  draft_m: 6
  waterline: {{length_m: 86, center_m: -1, aft_area_m2: 648, bow_angle_deg: 22.918}}
  wind: {{frontal_area_m2: 200, lateral_area_m2: 800, lateral_center_m: 5}}
  current: {{lateral_area_m2: 490, lateral_center_m: -1.5}}
  actuators: {actuators}
"""
    return checked(parse_yaml(text, "test"), ShipFile).ship


def test_largest_forces_of_thrusters_are_those_of_linear_programs() -> None:
    robot = load_layout("bluerov2_heavy")
    plot = capability(robot, headings=[0.0, 35.0, 200.0], lost=["lift_rear_left"])
    columns = np.array(
        [[*part.axis, *np.cross(part.position, part.axis)] for part in robot.actuators]
    ).T
    names = [case.name for case in plot.cases]
    assert "lift_rear_left" not in names and len(names) == robot.n
    for c, name in enumerate(names):
        limits = [
            (0.0, 0.0) if part.name in (name, "lift_rear_left") else part.force
            for part in robot.actuators
        ]
        for h, load in enumerate(plot.loads[:, 0]):
            balance = np.column_stack([columns, load])
            answer = linprog(
                [0.0] * robot.n + [-1.0],
                A_eq=balance,
                b_eq=np.zeros(6),
                bounds=[*limits, (0.0, None)],
            )
            assert plot.values[c, h] == pytest.approx(-answer.fun, rel=1e-6, abs=1e-5)
    assert faults(as_file(plot)) == []


@pytest.mark.parametrize("name", ["A", "ucat", "catamaran", "restricted", "mixed", "torpedo"])
def test_largest_forces_are_those_of_the_force_sets(name: str) -> None:
    robot = load_layout(name)
    headings = [0.0, 77.0, 180.0, 260.0]
    plot = capability(robot, headings=headings)
    turn = np.deg2rad(headings)
    ray = np.zeros((len(headings), 6))
    ray[:, 0] = np.cos(turn)
    ray[:, 1] = -np.sin(turn)
    if "Fy" in robot.axes or robot.commanded.all():
        size, _ = max_wrench_along_exactly(force_sets(robot), ray / SCALE)
        assert plot.values[0] == pytest.approx(size[0], rel=1e-5, abs=1e-4)
    assert faults(as_file(plot)) == []


def test_an_axis_counts_if_a_load_is_about_it() -> None:
    robot = load_layout("torpedo")
    assert not robot.commanded[1]
    plot = capability(robot, headings=[0.0, 90.0])
    assert plot.values[0, 0] > 1.0
    assert plot.values[0, 1] == 0.0


def test_a_load_of_twice_the_size_has_half_the_share() -> None:
    robot = load_layout("catamaran")
    loads = np.array([[-30.0, 0.0, 0.0, 0.0, 0.0, 2.0], [-10.0, 25.0, 0.0, 0.0, 0.0, -4.0]])
    once = capability(robot, loads, headings=[0.0, 60.0])
    twice = capability(robot, 2.0 * loads, headings=[0.0, 60.0])
    assert once.unit == "1"
    assert twice.values == pytest.approx(0.5 * once.values, rel=1e-6)


def test_a_heading_without_a_load_is_refused() -> None:
    """Any share of it is held, beside which all others would be nothing."""
    loads = np.array([[-30.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    with pytest.raises(LayoutError, match="got none from 60 deg, .*; leave that heading out"):
        capability(load_layout("catamaran"), loads, headings=[0.0, 60.0])


def test_words_name_the_worst_loss(plot: Capability) -> None:
    words = str(plot)
    assert "DP capability-L1(8, 6, " in words
    assert "each has a certificate" in words
    assert len(plot.to_csv().splitlines()) == 37
    assert capability_picture(plot).axes


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"headings": []}, "headings: expected 1 to"),
        ({"losses": ["wind"]}, "losses: expected some of ventilation"),
        ({"lost": ["nobody"]}, "nobody"),
    ],
)
def test_what_is_wrong_is_named(
    five: tuple[Layout, Ship], arguments: dict[str, list[str]], words: str
) -> None:
    with pytest.raises(LayoutError, match=words):
        dp_capability(*five, **arguments)


@pytest.mark.parametrize(
    ("text", "words"),
    [("ship: {}", "length_pp_m"), ("boat: {}", "boat"), ("ship: {length_pp_m: -3}", "length_pp_m")],
)
def test_a_wrong_file_of_a_ship_is_refused(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "ship.yaml"
    file.write_text(text)
    with pytest.raises(LayoutError, match=words):
        read_ship(file)


def test_fins_have_no_thrust_of_the_standard() -> None:
    with pytest.raises(LayoutError, match="without a standard"):
        dp_capability(load_layout("A"), ship_of("{}"))


def test_pods_that_cannot_stop_hold_no_small_load_abeam() -> None:
    robot = load_layout("catamaran")
    pods = []
    for actuator in robot.actuators:
        is_pod = actuator.name != "bow"
        pods.append(replace(actuator, force=(20.0, 60.0), arc=(-0.5, 0.5)) if is_pod else actuator)
    plot = capability(replace(robot, actuators=tuple(pods)), headings=[0.0, 90.0])
    assert plot.values[0] == pytest.approx([120.0, 0.0])
    assert faults(as_file(plot)) == []


def test_without_actuators_nothing_is_held() -> None:
    robot = load_layout("pair")
    plot = capability(robot, headings=[0.0], lost=[robot.names[0]])
    assert [case.name for case in plot.cases] == ["intact", *robot.names[1:]]
    assert plot.values[1:].tolist() == [[0.0]]
    assert faults(as_file(plot)) == []


def test_the_origin_of_the_layout_does_not_count(four: tuple[Layout, Ship]) -> None:
    layout, ship = four
    moved = []
    for actuator in layout.actuators:
        x, y, z = actuator.position
        moved.append(replace(actuator, position=(x + 7.0, y, z)))
    shifted = structs.replace(ship, midship_m=7.0)
    headings = [20.0, 100.0]
    before = dp_capability(layout, ship, headings)
    after = dp_capability(replace(layout, actuators=tuple(moved)), shifted, headings)
    assert after.share[..., 1:] == pytest.approx(before.share[..., 1:], rel=1e-9)


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_an_arc_is_that_of_the_body_whichever_way_an_azimuth_turns(up: float) -> None:
    pod = AZIMUTH.format(name="pod", x=0, y=0).replace("[0, 0, 1]", f"[0, 0, {up:g}]")
    arc = ", arc_deg: [0, 90]}"
    layout = parse_layout_text(layout_text(pod[:-1] + arc), ".yaml", "test")
    (one,) = ship_thrusters(layout, ship_of("{}"))
    assert one.arc == pytest.approx((0.0, 0.5 * np.pi) if up > 0.0 else (-0.5 * np.pi, 0.0))
    # It pushes ahead and to port, or to starboard: weather is held from there.
    headings = [330.0, 30.0, 150.0]
    plot = dp_capability(layout, ship_of("{}"), headings)
    target = -plot.loads[:, 1, :2]
    ahead_and_aside = (target[:, 0] > 0.0) & (target[:, 1] * up > 0.0)
    (sets,) = [case.sets for case in plot.cases[:1]]
    force = 1e3 * target / np.linalg.norm(target, axis=-1, keepdims=True)
    assert sets[0].cover.contains(force).tolist() == ahead_and_aside.tolist()
