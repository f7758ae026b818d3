"""A hand on the page: finds widgets by their section and label, and reads what all of them show."""

import re
from typing import Any

from tests.browser.page import ROW
from webapp.panels.frame import FOLDER
from webapp.panels.places import PLACES, TOP, VIEW
from webapp.session.looking import DRAWERS

READ = """() => {
  const found = [];
  for (const label of document.querySelectorAll('label[for]')) {
    const row = label.closest('.mantine-Flex-root');
    if (!row || !row.getClientRects().length) continue;
    let box = label, mark = null;
    while (box && !mark) {
      box = box.parentElement?.closest('.mantine-Paper-root');
      mark = box?.querySelector(':scope > div > div > div > div > .fl-section');
    }
    if (!mark) continue;
    const inputs = [...row.querySelectorAll('input:not([type=hidden]):not([type=file]), textarea')];
    const values = inputs.map((input) => input.type === 'checkbox' ? input.checked : input.value);
    found.push([Number(mark.classList[1].slice(6)), label.textContent, values]);
  }
  return found;
}"""
"""All labelled rows that are seen: section, label, and what stands in the inputs."""

Spot = tuple[str, str]
"""A task and the title of a section in it."""


class Hand:
    """Real keys and clicks on one page."""

    def __init__(self, page: Any) -> None:
        """Take the page."""
        self.page = page
        self.keys = page.page.keyboard

    @staticmethod
    def index(spot: Spot) -> int:
        """Place of a section in `PLACES`."""
        task, title = spot
        found = [k for k, place in enumerate(PLACES) if place.title == title and task in place.tasks]
        assert found, f"there is no section {title} in {task}; the walk's tables name another one"
        return found[0]

    def section(self, spot: Spot) -> Any:
        """The folder of a section."""
        return self.page.page.locator(FOLDER.format(f"at-{self.index(spot)}"))

    def labels(self, spot: Spot, label: str) -> Any:
        """Rows of a section that are called so and seen."""
        exact = re.compile(f"^{re.escape(label)}$")
        return self.section(spot).locator("label:visible", has_text=exact)

    def row(self, spot: Spot, label: str, nth: int = 0) -> Any:
        """One of them."""
        return self.labels(spot, label).nth(nth).locator(ROW)

    def inputs(self, spot: Spot, label: str, nth: int = 0) -> Any:
        """The inputs in a row."""
        return self.row(spot, label, nth).locator("input:not([type=hidden]), textarea")

    def go(self, spot: Spot, model: Any) -> None:
        """Open the task, the tab of the drawer, and tell the model."""
        (task, title), session = spot, model.session
        place = PLACES[self.index(spot)]
        if place.region not in (TOP, VIEW) and session.task != task:
            self.page.tab(task)
            session.show_task(task)
        if title in DRAWERS.get(session.task, ()) and session.drawer != title:
            self.page.tab(title)
            session.show_drawer(title)
        self.page.catch_up()

    def unfold(self, spot: Spot, folder: str, label: str) -> None:
        """Open a folder in a section, or the section itself, unless what is in it is seen."""
        if self.labels(spot, label).count() == 0:
            self.section(spot).get_by_text(folder, exact=True).first.click()
            self.labels(spot, label).first.wait_for()

    def click(self, spot: Spot, label: str, button: str | int) -> None:
        """A button of a group, by its words or its place; without a label one that stands alone."""
        if not label:
            self.section(spot).get_by_role("button", name=str(button), exact=True).click()
            return
        buttons = self.row(spot, label).locator("button")
        if isinstance(button, int):
            buttons.nth(button).click()
        else:
            buttons.filter(has_text=re.compile(f"^{re.escape(button)}$")).first.click()

    def download(self, spot: Spot, label: str, button: str) -> Any:
        """The file that a button sends; what the page says instead, if it sends none."""
        sent: list[Any] = []
        self.page.page.once("download", lambda file: sent.append(file))
        self.click(spot, label, button)
        self.page.until(lambda: sent != [] or self.page.notes() != [])
        assert sent, f"{button} sends nothing: {self.page.notes()}"
        return sent[0]

    def choose(self, spot: Spot, label: str, entry: str) -> None:
        """An entry of a list."""
        self.inputs(spot, label).first.click()
        options = self.page.page.locator("div[role=option]:visible")
        options.filter(has_text=re.compile(f"^{re.escape(entry)}$")).first.click()

    def rest_of_page(self) -> None:
        """Take the focus out of every box."""
        self.page.page.evaluate("document.activeElement?.blur()")

    def shown(self) -> dict[tuple[int, str, int], list[Any]]:
        """What stands in all inputs: section, label, and which row of that label."""
        rows: dict[tuple[int, str, int], list[Any]] = {}
        for section, label, values in self.page.page.evaluate(READ):
            nth = sum(key[:2] == (section, label) for key in rows)
            rows[section, label, nth] = values
        return rows
