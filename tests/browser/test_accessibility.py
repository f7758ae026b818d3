"""axe-core, the usual judge of accessible pages, on every task, light and dark."""

from importlib.resources import files
from typing import Any

from webapp.session.looking import DRAWERS, TASKS

AXE = files("axe_playwright_python").joinpath("axe.min.js").read_text("utf-8")
"""axe-core itself, as its wrapper for Python ships it."""
RUN = "rules => axe.run(document, { resultTypes: ['violations'], ...(rules && { runOnly: rules }) })"
SCHEME = "scheme => document.documentElement.dataset.mantineColorScheme === scheme"
SETTLE_MS = 300
"""Until what has just come to the page has got its names, and colours have faded in."""
GRAVE = ("moderate", "serious", "critical")
"""Impacts that are mended before anything lands."""


def findings(page: Any, rules: list[str] | None = None) -> list[str]:
    """What it finds that is grave on what is seen now, one line for each kind; by some rules, or by all."""
    tab = page.page
    page.rest(SETTLE_MS)
    if not tab.evaluate("() => typeof axe === 'object'"):
        tab.evaluate(AXE)
    found = []
    for violation in tab.evaluate(RUN, rules)["violations"]:
        if violation["impact"] in GRAVE:
            nodes = violation["nodes"]
            first = nodes[0]["html"][:160].replace("\n", " ")
            found.append(f"{violation['id']}, {len(nodes)} times: {violation['help']}, as in {first}")
    return found


def test_no_serious_finding_light_or_dark(page: Any) -> None:
    page.tab("Design")
    assert findings(page) == [], "nothing selected"
    page.key("n")
    for task in TASKS:
        for name in (task, *DRAWERS.get(task, ())):
            page.tab(name)
            assert findings(page) == [], name
    page.key("Control+k")
    page.page.get_by_placeholder("Search commands").wait_for()
    assert findings(page) == [], "commands"
    page.page.keyboard.press("Escape")
    page.session.set_display("dark", True)  # where nothing but colours is another
    page.key("Alt+1")
    page.page.wait_for_function(SCHEME, arg="dark")
    for task in TASKS:
        for name in (task, *DRAWERS.get(task, ())):
            page.tab(name)
            assert findings(page, ["color-contrast"]) == [], f"{name}, dark"
    page.tab("Comparison")
    page.press("Compare the methods")
    page.until(lambda: not page.view.jobs.comparison.run.running)
    assert findings(page, ["color-contrast"]) == [], "methods compared, dark"


def test_boxes_have_names_and_one_without_is_found(page: Any) -> None:
    page.tab("Design")
    page.key("n")
    page.row("Position [m]").last.wait_for()
    boxes, wanted = page.row("Position [m]"), [f"Position [m], {k + 1} of 3" for k in range(3)]
    page.until(lambda: [box.get_attribute("aria-label") for box in boxes.all()] == wanted)
    page.page.evaluate(
        "() => document.body.append(Object.assign(document.createElement('input'), { id: 'it' }))"
    )
    assert any(line.startswith("label, 1 times") for line in findings(page, ["label"]))
    page.page.evaluate("() => document.getElementById('it').remove()")
