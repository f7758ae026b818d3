"""axe-core on every task, light and dark."""

from typing import Any

import pytest

from tests.browser.accessibility import findings
from webapp.session.looking import TASKS


def settle(page: Any, dark: bool) -> None:
    """Turn to a theme, by the list of commands' own intent, and let its colours fade in."""
    if page.session.display.dark != dark:
        page.unfold("Display", "Dark")
        page.row("Dark").first.click()
    scheme = "dark" if dark else "light"
    page.page.wait_for_function(
        "scheme => document.documentElement.dataset.mantineColorScheme === scheme", arg=scheme
    )
    page.rest(300)


@pytest.mark.parametrize(
    ("dark", "rules"), ((False, None), (True, ["color-contrast"])), ids=("light", "dark")
)
def test_no_serious_finding(page: Any, dark: bool, rules: list[str] | None) -> None:
    """In the dark theme nothing but colours is another."""
    settle(page, dark)
    for task in TASKS:
        page.tab(task)
        assert findings(page, rules) == [], task
    page.tab("Design")
    page.key("n")
    page.row("Position [m]").last.wait_for()
    assert findings(page, rules) == [], "a selected fin"
    settle(page, dark=False)


def test_a_box_without_a_name_is_found(page: Any) -> None:
    page.tab("Allocate")
    page.page.evaluate(
        "() => document.body.append(Object.assign(document.createElement('input'), { id: 'it' }))"
    )
    assert any(line.startswith("label, 1 times") for line in findings(page, ["label"]))
    page.page.evaluate("() => document.getElementById('it').remove()")


def test_each_box_of_a_row_is_called_by_it(page: Any) -> None:
    page.tab("Design")
    page.key("n")
    page.row("Position [m]").last.wait_for()
    boxes, wanted = page.row("Position [m]"), [f"Position [m], {k + 1} of 3" for k in range(3)]
    page.until(lambda: [box.get_attribute("aria-label") for box in boxes.all()] == wanted, 10)
