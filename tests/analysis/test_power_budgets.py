"""What cards and plots say of layouts with power budgets, beside a cone program."""

import json
import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from finlab.allocation.power_budget import budget_of
from finlab.analysis import score_card
from finlab.analysis.capability import Capability, capability, dp_capability
from finlab.analysis.capability_text import capability_picture
from finlab.analysis.improvement_text import improvement_remarks
from finlab.analysis.optimize import optimize_layout
from finlab.analysis.refusal_check import faults
from finlab.analysis.ship_file import Ship, read_ship
from finlab.errors import AllocationError
from finlab.forces.force_sets import SCALE
from finlab.forces.reach import max_wrench_along_exactly
from finlab.forces.within_budget import force_sets_within
from finlab.interaction.jets import Jets
from finlab.layout import Layout, load_layout
from finlab.layout.layout import Bus
from finlab.physics import plant_of
from tests.analysis.supply_vessel import write_vessel
from tests.oracle_budget import BudgetedPlant
from tests.oracle_plant import OraclePlant
from tests.random_robots import bluerov2_heavy, load

WATTS = 80.0
"""A budget that binds along each axis [W]."""


def test_the_largest_wrenches_are_those_within_the_budget() -> None:
    layout = replace(load(bluerov2_heavy()), power_w=WATTS)
    free = score_card(load(bluerov2_heavy())).authority
    card = score_card(layout)
    plant = OraclePlant(bluerov2_heavy())
    for k, (most, without) in enumerate(zip(card.authority.largest, free.largest, strict=True)):
        wrench = 2.0 * without * np.eye(6)[k]
        judge = BudgetedPlant(plant, np.ones((1, layout.n), bool), np.array([WATTS]))
        assert most == pytest.approx(2.0 * without * judge.largest_share(wrench), rel=1e-5)
        assert most < 0.9 * without
    assert any("power budget" in note for note in card.notes)
    assert len(card.losses) == layout.n


def test_a_budget_that_binds_nothing_changes_no_card() -> None:
    layout = load_layout("bluerov2_heavy")
    np.testing.assert_allclose(
        score_card(replace(layout, power_w=1e5)).authority.largest,
        score_card(layout).authority.largest,
        rtol=1e-6,
    )


def test_the_weakest_direction_is_within_the_budget() -> None:
    layout = replace(load(bluerov2_heavy()), power_w=WATTS)
    card = score_card(layout).authority
    wrench = np.array(card.weakest_direction) * SCALE
    judge = BudgetedPlant(OraclePlant(bluerov2_heavy()), np.ones((1, 8), bool), np.array([WATTS]))
    assert 500.0 * judge.largest_share(500.0 * wrench) == pytest.approx(card.weakest, rel=1e-5)
    assert card.weakest < 0.5 * score_card(load(bluerov2_heavy())).authority.weakest


@pytest.mark.parametrize("power_w", [None, WATTS])
def test_a_search_that_leaves_a_budget_out_says_so(power_w: float | None) -> None:
    layout = replace(load_layout("bluerov2"), power_w=power_w)
    found = optimize_layout(layout, ["lift_left", "lift_right"], rounds=1)
    words = " ".join(remark.text for remark in improvement_remarks(found))
    assert found.improved
    assert ("leaves the power budget out" in words) == (power_w is not None)
    is_free_value = found.value_before == pytest.approx(found.card_before.authority.weakest)
    assert is_free_value == (power_w is None)


def test_cards_count_what_they_can_of_a_budget() -> None:
    torpedo = replace(load_layout("torpedo"), power_w=20.0)
    free = score_card(replace(torpedo, power_w=None))
    at_rest = score_card(torpedo)
    assert at_rest.authority.largest[0] < 0.5 * free.authority.largest[0]
    assert at_rest.unit_power[0] == pytest.approx(free.unit_power[0])
    assert any("the powers are not" in note for note in at_rest.notes)
    flow = (1.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    moving = score_card(torpedo, flow=flow)
    assert moving.authority == score_card(replace(torpedo, power_w=None), flow=flow).authority
    assert any("power budget does not count" in note for note in moving.notes)


def test_cards_of_robots_with_an_interaction_count_the_laws() -> None:
    plain = load_layout("bluerov2_heavy")
    coupled = replace(plain, interaction=Jets())
    card = score_card(replace(coupled, power_w=WATTS))
    assert card.authority == score_card(replace(plain, power_w=WATTS)).authority
    assert card.unit_power == score_card(coupled).unit_power
    assert any("the powers are not" in note for note in card.notes)


class Plot(NamedTuple):
    """A capability plot with budgets, and the same robot as files have it."""

    layout: Layout
    plot: Capability


@pytest.fixture(scope="module")
def within_buses() -> Plot:
    """A BlueROV2 Heavy whose two buses limit most headings."""
    layout = load(bluerov2_heavy())
    buses = (Bus("port", 60.0, layout.names[1::2]), Bus("starboard", 45.0, layout.names[::2]))
    limited = replace(layout, buses=buses)
    return Plot(limited, capability(limited, headings=[0.0, 35.0, 200.0, 290.0]))


def as_file(plot: Capability) -> dict:
    """A plot as its JSON file holds it."""
    return json.loads(json.dumps(plot.to_dict(), allow_nan=False))


def test_what_is_held_after_each_loss_is_that_of_a_cone_program(within_buses: Plot) -> None:
    layout, plot = within_buses
    budget = budget_of(layout)
    assert budget is not None and len(plot.cases) == 1 + layout.n
    file = bluerov2_heavy()
    for case, values in zip(plot.cases, plot.values, strict=True):
        works = [each["name"] not in case.lost for each in file["actuators"]]
        left = [each for each, work in zip(file["actuators"], works, strict=True) if work]
        plant = OraclePlant(file | {"actuators": left})
        for load_of_heading, value in zip(plot.loads[:, 0], values, strict=True):
            judge = BudgetedPlant(plant, budget.members[:, works], budget.watts)
            share = judge.largest_share(-500.0 * load_of_heading)
            assert value == pytest.approx(500.0 * share, rel=1e-5, abs=1e-4)


def test_certificates_have_prices_of_power(within_buses: Plot) -> None:
    values = as_file(within_buses.plot)
    assert faults(values) == []
    watt_prices = [
        leaf["watt_prices"] for refusal in values["refusals"] for leaf in refusal["leaves"]
    ]
    assert len(watt_prices) == within_buses.plot.share.size
    assert sum(max(each.values()) > 0.0 for each in watt_prices) > 0.5 * len(watt_prices)


@pytest.mark.parametrize("change", ["none", "cheaper", "negative", "budget", "watts", "bus"])
def test_a_certificate_that_proves_less_is_found(within_buses: Plot, change: str) -> None:
    wrong = as_file(within_buses.plot)
    leaf = wrong["refusals"][0]["leaves"][0]
    if change == "none":
        leaf["watt_prices"] = {}
    elif change == "cheaper":
        leaf["watt_prices"] = {name: 0.7 * each for name, each in leaf["watt_prices"].items()}
    elif change == "negative":
        leaf["watt_prices"]["port"] *= -1.0
    elif change == "budget":
        wrong["buses"]["starboard"] *= 1.05
        wrong["buses"]["port"] *= 1.05
    elif change == "watts":
        for each in wrong["cases"][0]["sets"]:
            for side in each["cover"]["sides"]:
                side["watts"] *= 0.95
    else:
        wrong["cases"][0]["sets"][0]["bus"] = None
    assert faults(wrong), change


@pytest.mark.parametrize("name", ["A", "restricted", "catamaran", "turtle_hybrid"])
def test_a_plot_is_the_reach_within_the_budget(name: str) -> None:
    bare = load_layout(name)
    most = float(np.nansum(plant_of(bare).power(bare.upper)))
    layout = replace(bare, power_w=0.1 * most)
    headings = [0.0, 77.0, 180.0, 260.0]
    plot = capability(layout, headings=headings)
    ray = -plot.loads[:, 0] / np.linalg.norm(plot.loads[:, 0], axis=-1, keepdims=True)
    size, _ = max_wrench_along_exactly(force_sets_within(layout), ray / SCALE)
    assert plot.values[0] == pytest.approx(size[0], rel=1e-6, abs=1e-6)
    assert faults(as_file(plot)) == []
    asked = capability(bare, headings=headings, power=0.1 * most)
    np.testing.assert_array_equal(asked.values, plot.values)
    free = capability(layout, headings=headings, power=np.inf)
    np.testing.assert_array_equal(free.values, capability(bare, headings=headings).values)


def test_a_budget_at_rest_that_is_too_small_refuses_all_by_its_price() -> None:
    robot = load_layout("catamaran")
    pods = []
    for actuator in robot.actuators:
        is_pod = actuator.name != "bow"
        pods.append(replace(actuator, force=(20.0, 60.0), arc=(-0.5, 0.5)) if is_pod else actuator)
    layout = replace(robot, actuators=tuple(pods))
    idle = float(plant_of(layout).power(layout.lower)[:2].sum())
    plot = capability(replace(layout, power_w=0.9 * idle), headings=[0.0, 90.0])
    assert plot.values[0].tolist() == [0.0, 0.0]
    assert faults(as_file(plot)) == []
    enough = capability(replace(layout, power_w=1.5 * idle), headings=[0.0, 90.0])
    assert enough.values[0, 0] > 40.0 and enough.values[0, 1] == 0.0
    assert faults(as_file(enough)) == []


class Vessel(NamedTuple):
    """The published vessel with five actuators."""

    layout: Layout
    ship: Ship


@pytest.fixture(scope="module")
def vessel(tmp_path_factory: pytest.TempPathFactory) -> Vessel:
    """The same, without budgets."""
    layout, ship = write_vessel(tmp_path_factory.mktemp("five"), retractable=True)
    return Vessel(load_layout(layout), read_ship(ship))


def with_switchboards(vessel: Vessel, share: float) -> Layout:
    """The vessel with a bus for each switchboard, of a share of the brake power that it feeds."""
    buses = []
    for name, members in vessel.ship.groups.items():
        brake = 1e3 * sum(vessel.ship.actuators[each].power_kw or 0.0 for each in members)
        buses.append(Bus(name, share * brake, members))
    return replace(vessel.layout, buses=tuple(buses))


def test_numbers_of_a_ship_count_its_switchboards(vessel: Vessel) -> None:
    headings = [0.0, 60.0, 90.0, 180.0]
    free = dp_capability(vessel.layout, vessel.ship, headings)
    plenty = dp_capability(with_switchboards(vessel, 1.001), vessel.ship, headings)
    np.testing.assert_allclose(plenty.share, free.share, rtol=1e-6)
    assert {*plenty.limited_by[0]} == {"thrust"}
    plot = dp_capability(with_switchboards(vessel, 0.5), vessel.ship, headings)
    assert (plot.share <= free.share * (1.0 + 1e-6)).all() and plot.notation != free.notation
    assert any("SWBD 1" in words for words in plot.limited_by[0])
    values = as_file(plot)
    assert faults(values) == [] and len(values["refusals"]) == int((~plot.held).sum())


def test_all_questions_of_all_single_losses_within_budgets_take_seconds(vessel: Vessel) -> None:
    begin = time.thread_time()
    plot = dp_capability(with_switchboards(vessel, 0.5), vessel.ship)
    assert time.thread_time() - begin <= 3.0
    assert plot.share[0].size == 432 and len(plot.cases) == 1 + 5 + 2


def test_power_of_thrust_is_that_of_the_standard(vessel: Vessel) -> None:
    # Weather from ahead is held by both azimuths alone: twice 0.9 of their thrust, of a power that
    # grows with its 3/2.
    limited = replace(vessel.layout, power_w=2e6, buses=())
    lost = ("BT1", "BT2", "RAZ")
    plot = dp_capability(limited, vessel.ship, [0.0], lost, losses=())
    thrust = 2.0 * 0.9 * 1200.0 * (3.0 * 0.93 * 1000.0) ** (2.0 / 3.0)
    held = plot.share[0, 0, 1:] * -plot.loads[0, 1:, 0]
    assert held == pytest.approx(np.full(11, thrust), rel=1e-6)


def test_words_files_and_pictures_say_what_limits(within_buses: Plot) -> None:
    plot = within_buses.plot
    words = str(plot)
    assert "Power limits " in words and "intact limited by" in words
    assert "bus starboard" in words
    header, first, *_ = plot.to_csv().splitlines()
    assert header.endswith("worst,worst_case,limited_by,worst_limited_by")
    assert "bus starboard" in first
    labels = [line.get_label() for line in capability_picture(plot).axes[0].lines]
    assert labels.count("limited by power") == 1
    free = capability(replace(within_buses.layout, buses=()), headings=[0.0])
    assert "limited by" not in str(free) and not free.to_csv().splitlines()[0].endswith(
        "limited_by"
    )


def test_where_the_flow_drives_actuators_a_plot_refuses_a_budget() -> None:
    torpedo = replace(load_layout("torpedo"), power_w=20.0)
    flow = (1.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    with pytest.raises(AllocationError, match="the flow drives rudder_top"):
        capability(torpedo, headings=[0.0], flow=flow)
    at_rest = capability(torpedo, headings=[0.0])
    assert at_rest.limited_by[0] == ("power",)
