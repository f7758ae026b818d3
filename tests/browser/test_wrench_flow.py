"""Move a slider, fail a fin, choose a candidate: numbers and arrows follow."""

from typing import Any


def test_slider_moves_numbers_and_arrows(page: Any) -> None:
    before = page.vertices("/robot/wrench/delivered_force")
    page.slide("Fx [N]", 25)
    page.until(lambda: page.session.state.target[0] > 2.0)
    # The last step of the drag may still be on its way.
    page.until(lambda: float(page.row("Fx [N]").last.input_value()) == page.session.state.target[0])
    asked = page.session.state.target[0]
    page.until(lambda: f"{asked:+.2f}" in page.text(".bars"))
    page.until(lambda: not page.view.busy)
    assert abs(page.view.shown.wrench[0] - asked) < 0.05
    page.until(lambda: page.vertices("/robot/wrench/delivered_force") != before)
    page.until(lambda: "Exact" in page.text(".fl-status"))
    assert page.problems == []


def test_unreachable_wrench_is_said_in_words(page: Any) -> None:
    page.type("Fz [N]", "30")
    page.until(lambda: "Out of reach" in page.text(".fl-status"))
    page.until(lambda: "left undone" in page.text(".said"))
    assert "at the limit" in page.text(".fl-status")


def test_failed_fin_leaves_table_arrows_and_graph(page: Any) -> None:
    force = page.vertices("/robot/fins/0/turn/force")
    page.press("2")
    page.until(lambda: page.session.state.failed == ("front_left",))
    page.until(lambda: "failed" in page.text("table.fins tr.dead"))
    page.until(lambda: "3 of 4 fins" in page.text(".fl-status"))
    page.until(lambda: page.vertices("/robot/fins/0/turn/force") != force)
    hidden = "() => window.__viserMutable.nodeRefFromName['/robot/fins/1/turn/force'].visible === false"
    page.page.wait_for_function(hidden)
    page.press("2 ✕")
    page.until(lambda: page.session.state.failed == ())


def test_last_fin_cannot_fail(page: Any) -> None:
    for number in ("1", "2", "3"):
        page.press(number)
        page.until(lambda number=number: len(page.session.state.failed) == int(number))
    page.press("4")
    page.until(lambda: any("last fin that works" in note for note in page.notes()))
    assert len(page.session.state.failed) == 3


def test_mode_is_picked_in_plot_and_table(page: Any) -> None:
    page.tab("Candidates")
    page.until(lambda: len(page.view.answering.modes.shown) > 1 and not page.view.answering.searching)
    page.until(lambda: page.page.locator("table.modes tr.pick").count() > 1)
    best = page.view.answering.best
    page.page.locator("table.modes tr.pick").nth(1).click()
    page.until(lambda: page.session.mode == 1)
    page.until(lambda: page.view.shown is not best)
    page.until(lambda: page.text("table.modes tr.chosen").startswith("2"))
    page.page.locator("svg.plot:visible g.pick").last.click()  # the best one is drawn last
    page.until(lambda: page.session.mode == 0)
    page.page.locator("svg.plot:visible .samples circle").nth(7).dispatch_event("click")
    page.until(lambda: page.session.sample == 7)
    page.until(lambda: "Raw sample 7" in page.text(".step"))
    assert page.view.shown.command.tolist() == best.samples.command[7].tolist()
    page.choose("Method", "mdn")
    page.until(lambda: page.session.state.method == "mdn" and not page.view.busy)
    page.type("Candidates K", "24")
    page.until(lambda: page.session.state.n_candidates == 24 and not page.view.busy)
    assert len(page.view.answering.best.samples.energy) == 24


def test_method_that_fails_says_so_and_the_page_goes_on(page: Any) -> None:
    page.tab("Candidates")
    page.choose("Method", "ipopt")
    page.until(lambda: any("out of order" in note for note in page.notes()))
    page.key("Control+z")
    page.until(lambda: page.session.state.method == "search")
    page.until(lambda: "Exact" in page.text(".fl-status"))


def test_one_axis_and_the_marks_of_its_reach(page: Any) -> None:
    page.press("Tz")
    page.until(lambda: page.session.state.target[5] > 0 and page.session.state.target[0] == 0.0)
    page.until(lambda: page.view.ranging.findings is not None and not page.view.ranging.busy)
    high = float(page.view.ranging.findings.high[0])
    marks = page.row("Fx [N]").first.locator("xpath=ancestor::div[contains(@class,'Flex-root')][1]")
    page.until(lambda: f"{high:.0f}" in marks.locator(".mantine-Slider-markLabel").last.inner_text())


def test_the_stick_steers_and_springs_back(page: Any) -> None:
    before = page.session.state
    page.tab("Steer by hand")
    stick = page.page.locator("svg.pad")
    stick.scroll_into_view_if_needed()
    box = stick.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + 0.52 * box["height"]
    mouse = page.page.mouse
    mouse.move(x, y)
    mouse.down()
    for k in range(1, 9):
        mouse.move(x - 4 * k, y - 5 * k)
        page.page.wait_for_timeout(70)
    page.until(lambda: page.session.state.target[0] > 3.0 and page.session.state.target[5] > 0.5)
    assert page.session.history.undo_name == "Steer"
    mouse.up()
    page.until(lambda: page.session.state == before)
    assert page.session.history.undo_name != "Steer"
    page.tab("Steer by hand")


def test_a_sweep_plays_and_stops(page: Any) -> None:
    page.tab("Sweep")
    page.press("Play the sweep")
    page.until(lambda: page.view.sweep.running)
    page.until(lambda: page.session.state.target[0] > -4.0)
    page.until(lambda: page.page.locator(".uplot").count() > 0)
    page.press("Stop the sweep")
    page.until(lambda: not page.view.sweep.running)
    page.until(lambda: page.session.state.target[0] == 1.2 and page.row("Fx [N]").last.input_value() == "1.2")
