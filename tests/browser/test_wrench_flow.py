"""Ask for a wrench, fail and damage fins, choose among answers and methods: numbers and arrows
follow."""

from pathlib import Path
from typing import Any

import pytest

from finlab.layout import Damage
from finlab.swim.simulation import load_log
from webapp.session.state import COMPARED


def test_numbers_and_arrows_follow_the_target(page: Any) -> None:
    before = page.instances("/robot/wrench/forces")
    page.type("Fx [N]", "2.5")
    page.until(lambda: page.session.state.target[0] == 2.5 and not page.view.busy)
    page.until(lambda: "+2.50" in page.text(".bars") and "Exact" in page.text(".fl-status"))
    page.until(lambda: page.instances("/robot/wrench/forces") != before)
    page.press("Turn")
    page.until(lambda: page.session.state.target[5] > 0 and page.session.state.target[0] == 1.2)
    page.until(
        lambda: page.view.jobs.ranging.answer is not None and not page.view.jobs.ranging.busy
    )
    high = float(page.view.jobs.ranging.answer.high[0])
    marks = page.row("Fx [N]").first.locator("xpath=ancestor::div[contains(@class,'Flex-root')][1]")
    track = marks.locator(".mantine-Slider-trackContainer")
    said = "track => getComputedStyle(track, '::after').content"
    page.until(lambda: f"{high:.0f}" in track.evaluate(said))
    page.type("Fz [N]", "30")
    page.until(
        lambda: "Out of reach" in page.text(".fl-status") and "left undone" in page.text(".said")
    )
    page.choose("Out of reach", "direction")
    page.until(
        lambda: page.session.state.policy == "direction" and "% of the wrench" in page.text(".said")
    )
    assert page.problems == []


def test_failed_and_damaged_fins(page: Any) -> None:
    session = page.session
    page.until(lambda: len(page.instances("/robot/forces")) == 4)
    force = page.instances("/robot/forces")[0]
    page.press("2")
    page.until(lambda: session.state.lost == ("front_left",))
    page.until(
        lambda: "lost" in page.text("table.fins tr.dead") and "3 of 4" in page.text(".fl-status")
    )
    page.until(
        lambda: (
            len(page.instances("/robot/forces")) == 3
            and page.instances("/robot/forces")[0] != force
        )
    )
    for number in ("1", "3"):
        page.press(number)
        page.until(
            lambda number=number: session.state.layout.names[int(number) - 1] in session.state.lost
        )
    page.press("4")
    page.until(lambda: "once all are lost" in page.text(".fl-status"))
    page.unfold("Damage", "Which")
    page.press("All")
    page.until(lambda: session.state.lost == ())
    page.choose("Which", "back_left")
    page.until(lambda: session.selected == "back_left")
    page.type("Strength [%]", "50")
    page.until(lambda: "weak 50 %" in page.text(".damage") and not page.view.busy)
    now = page.view.shown_allocation.command[2, 2]
    page.row("Stuck").first.click()
    page.until(lambda: "weak 50 %, stuck at" in page.text(".damage") and not page.view.busy)
    assert page.view.shown_allocation.command[2, 2] == pytest.approx(now), (
        "it is stuck where it was"
    )
    page.press("All")
    page.until(lambda: session.state.damage == Damage())
    page.page.locator(".damage").wait_for(state="detached")


def test_candidates_of_the_network_beside_either_answer(page: Any) -> None:
    session = page.session
    answering = page.view.jobs.answering
    page.tab("Candidates")
    rows = page.page.locator("table.modes tr.pick >> visible=true")  # another drawer has one, too
    # The table is drawn again when the network's rows come.
    page.until(lambda: not answering.searching and "component" in rows.last.inner_text())
    assert "optimum" in rows.first.inner_text()
    assert "network" in rows.last.inner_text()
    page.until(lambda: "proved least" in page.text(".said"))
    watts = answering.shown_answer().best.power
    page.choose("Least", "effort")
    page.until(lambda: session.state.method == "mdn" and not page.view.busy)
    page.until(
        lambda: (
            "least effort" in page.text(".fl-status")
            and answering.shown_answer().best.power > watts
        )
    )
    page.until(lambda: rows.count() > 1 and not answering.searching)
    page.until(lambda: "component" in rows.first.inner_text())
    best = answering.shown_answer().best
    rows.nth(1).click()
    page.until(lambda: session.mode == 1 and page.view.shown_allocation is not best)
    page.until(lambda: page.text("table.modes tr.chosen").startswith("2"))
    page.page.locator("svg.plot:visible g.pick circle").last.click()  # the best one is drawn last
    page.until(lambda: session.mode == 0)
    page.type("Temperature", "0.5")
    page.until(lambda: session.state.temperature == 0.5 and not page.view.busy)
    page.until(lambda: page.page.locator("svg.plot:visible .samples circle").count() > 4)
    assert page.problems == []


def test_a_robot_with_thrusters_is_shown_and_answered(page: Any) -> None:
    session = page.session
    page.tab("Design")
    page.choose("Layout", "turtle_hybrid")
    page.until(lambda: session.state.layout.name == "turtle_hybrid" and not page.view.busy)
    page.node("/robot/fins/5/turn/blade")
    page.tab("Allocate")
    page.type("Fz [N]", "40")
    page.until(lambda: "thruster" in page.text("table.fins") and "Exact" in page.text(".fl-status"))
    page.press("6")
    page.until(
        lambda: session.state.lost == ("lift_right",) and "5 of 6" in page.text(".fl-status")
    )
    page.until(lambda: 0 < len(page.instances("/robot/forces")) < 6)
    page.tab("Simulate")
    page.until(lambda: page.page.get_by_text("Start lets this robot swim").is_visible())
    assert page.problems == []


def test_methods_side_by_side(page: Any) -> None:
    page.tab("Comparison")
    page.press("Compare the methods")
    comparison = page.view.jobs.comparison
    page.until(lambda: page.session.drawer == "Comparison" and comparison.run.state is not None)
    page.until(lambda: not comparison.run.running)
    page.until(lambda: page.page.locator("table.methods tr").count() == 1 + len(COMPARED))


def test_a_number_counts_when_it_is_typed_whole(page: Any) -> None:
    session = page.session
    keys = page.page.keyboard
    box = page.row("Fx [N]").last

    def asked(text: str, end: str, value: float) -> None:
        box.click()
        keys.press("Control+a")
        keys.type(text, delay=20)
        keys.press(end)
        page.until(lambda: session.state.target[0] == value and not page.view.busy)
        page.until(lambda: box.input_value() == f"{value:g}", told=lambda: box.input_value())

    for text, end, value in (
        ("2.347", "Enter", 2.347),
        ("-0.5", "Tab", -0.5),
        ("12.25", "Enter", 12.25),
    ):
        asked(text, end, value)
    asked("77", "Escape", 12.25)
    asked("", "Enter", 12.25)
    asked("3", "ArrowUp", 3.2)  # a step is about a hundredth of what the robot reaches


BOTTOMS_SCRIPT = "all => all.map(one => one.getBoundingClientRect().bottom)"
"""Script: lower ends of elements [px]."""


def test_a_robot_swims_and_one_fin_breaks(page: Any) -> None:
    page.tab("Simulate")
    swimming = page.view.jobs.swimming
    assert "Once a swim is started" in page.text(".fl-unswum")
    page.choose("Path", "circle")
    page.until(lambda: page.session.swim.path == "circle")
    page.choose("Method", "analytic")
    page.until(lambda: "Method analytic, as in the bar" in page.page.inner_text("body"))
    page.press("Start")
    page.until(lambda: swimming.swimmer is not None)
    page.visible("/swim/floor")
    page.visible("/floor", False)
    start = page.pixel("/robot")
    page.until(lambda: page.pixel("/robot") != start)  # it moves on the screen
    page.until(
        lambda: page.page.locator(".fl-timeline .plot:visible").count() == 6,
        told=lambda: f"swum {swimming.time} s, running {swimming.running}, notes {page.notes()}",
    )
    ends = page.page.locator(".fl-timeline .plot:visible").evaluate_all(BOTTOMS_SCRIPT)
    assert max(ends) <= page.page.viewport_size["height"], f"the last plots end at {ends}"
    page.page.get_by_role("button", name="2", exact=True).locator("visible=true").first.click()
    page.until(lambda: swimming.swimmer.visible_moment.believed_lost == ("front_left",))
    page.until(lambda: "3 of 4 fins" in page.text(".fl-status"))
    page.page.get_by_role("button", name="2 ✕", exact=True).locator("visible=true").first.wait_for()
    page.press("Pause")
    page.until(lambda: not swimming.running and not swimming.busy)
    held = swimming.time
    page.press("Step")
    page.until(lambda: swimming.time > held)
    assert swimming.time == pytest.approx(held + 0.1)
    page.press("End")
    page.until(lambda: not swimming.active)
    page.visible("/floor")
    assert page.problems == []


def test_a_fin_lost_in_a_current_is_found(page: Any, tmp_path: Path) -> None:
    page.tab("Simulate")
    swimming = page.view.jobs.swimming
    page.choose("Scenario", "lost-in-current")
    page.until(lambda: not page.session.swim.announced)
    page.until(
        lambda: "In a current of 0.07 m/s a fin is lost half-way" in page.page.inner_text("body")
    )
    page.choose("Method", "analytic")
    page.until(lambda: page.session.state.method == "analytic")
    page.type("Speed", "8")
    page.press("Start")
    page.until(lambda: swimming.swimmer is not None)
    page.until(lambda: swimming.swimmer.visible_moment.lost == ("front_right",))
    page.until(lambda: swimming.swimmer.visible_moment.believed_lost == ("front_right",))
    page.until(lambda: "The monitor found front_right lost" in page.page.inner_text("body"))
    page.press("Pause")
    page.until(lambda: not swimming.running and not swimming.busy)
    assert swimming.swimmer.visible_moment.found[0][1] < 5.0

    held = swimming.time
    assert load_log(page.download("Log (NPZ)", tmp_path / "swim.npz")).n_ticks == round(held / 0.1)
    page.press("Go on")
    page.until(lambda: swimming.time > held)
    page.press("End")
    page.until(lambda: not swimming.active)
    assert page.problems == []
