"""A page of the app in a real browser, in the words of a user: press, type, drag, read."""

import contextlib
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from webapp.session.looking import DRAWERS, TASKS, Desk, SearchRequest
from webapp.session.swim_plan import SwimSettings
from webapp.viser_internals import run_script

WAIT_MS = 120_000
"""Longest wait for the page: software rendering on a busy machine is slow."""
PAUSE_S = 0.12
"""Between two inputs: the page sends at most one change in 50 ms, a quicker one would overwrite the
last."""

ROW = "xpath=ancestor::div[contains(@class,'Flex-root')][1]"
"""From a label to the row it stands in."""
VERTICES_SCRIPT = """name => {
  let geometry = null;
  window.__viserMutable.nodeRefFromName[name].traverse(o => { geometry = geometry ?? o.geometry ?? null; });
  return Array.from(geometry.attributes.position.array.slice(0, 6000));
}"""
"""Script: the first 2000 vertices of a node's mesh, as a flat list."""
INSTANCES_SCRIPT = """name => {
  let mesh = null;
  const find = o => { mesh = mesh ?? (o.matricesTexture ? o : null); };
  window.__viserMutable.nodeRefFromName[name].traverse(find);
  return Array.from(mesh?.matricesTexture.image.data.slice(0, 16 * mesh.instancesCount) ?? []);
}"""
"""Script: the matrices (4, 4) of a node's instances, as a flat list."""
PROJECT_SCRIPT = """([name, point]) => {
  const node = window.__viserMutable.nodeRefFromName[name];
  node.updateWorldMatrix(true, false);
  const place = node.localToWorld(node.position.clone().set(...point));
  const seen = place.project(window.__viserMutable.camera);
  const canvas = document.querySelector('canvas').getBoundingClientRect();
  return [canvas.left + (seen.x + 1) / 2 * canvas.width, canvas.top + (1 - seen.y) / 2 * canvas.height];
}"""
"""Script: where a point of a node is on the page [px]."""


class Page:
    """One tab."""

    def __init__(self, page: Any, served: Any, patience: float = 1.0) -> None:
        """Open the app and wait until the robot stands; `patience` makes all waits longer."""
        self.patience = patience
        self.page = page
        self._served = served
        self.problems: list[str] = []
        self._marks = 0
        page.set_default_timeout(WAIT_MS * patience)
        page.on("console", lambda m: self.problems.append(m.text) if m.type == "error" else None)
        before = set(served.app.views)
        page.on("dialog", lambda dialog: dialog.accept())
        page.goto(served.url)
        self.ready()
        self.until(lambda: bool(set(served.app.views) - before))
        self.session = served.app.views[max(set(served.app.views) - before)].session
        self._display = self.session.display

    def ready(self) -> None:
        """Wait for panel, robot and first answer."""
        self.page.locator(".fl-tasks").wait_for()
        self.node("/robot/fins/0/turn/blade")
        self.page.locator(".fl-status .err").wait_for(state="attached")
        self.close_notes()  # viser's own one on software rendering lies over the view

    @property
    def view(self) -> Any:
        """The server's side of this tab; another one after a reload."""
        return next(
            view for view in self._served.app.views.values() if view.session is self.session
        )

    def start_over(self) -> None:
        """As at first sight: the state, the tab, the camera, and no notes."""

        done = threading.Event()

        def restart() -> None:
            session = self.session
            session.start_over()
            # What `start_over` keeps for a user, so that no test sees what another one looked at.
            session.display = self._display
            session.desk = Desk()
            session.draft = SearchRequest()
            session.swim = SwimSettings()
            self.view.jobs.improver.forget()
            self.view.jobs.log.forget()
            self.view.scenery.end_swim()
            self.view.scenery.robot.look_from("3D")
            done.set()

        self.page.evaluate("document.activeElement?.blur()")
        self.rest(100)
        self._served.server.get_event_loop().call_soon_threadsafe(self.view.do, restart)
        self.until(done.is_set)
        self.close_notes()
        self.tab("Allocate")
        self.until(
            lambda: (
                not self.view.busy and self.page.locator(".mantine-Notification-root").count() == 0
            )
        )
        self.catch_up()
        self.problems.clear()

    def close_notes(self) -> None:
        """Close all notes; by script, because one that fades away cannot be clicked."""
        script = (
            "document.querySelectorAll('.mantine-Notification-closeButton').forEach(b => b.click())"
        )
        self.page.evaluate(script)

    def until(
        self,
        condition: Callable[[], bool],
        seconds: float = 120.0,
        told: Callable[[], str] = lambda: "what was waited for did not happen",
    ) -> None:
        """Wait for the server or the page to come round, longer on a page that needs patience;
        `told` says what was there instead."""
        end = time.monotonic() + seconds * self.patience
        while not condition():
            assert time.monotonic() < end, told()
            self.page.wait_for_timeout(50)

    def catch_up(self) -> None:
        """Wait until all that the server has told so far has come to the page."""
        self._marks += 1
        loop = self._served.server.get_event_loop()
        gui = self.view.client.gui
        loop.call_soon_threadsafe(run_script, gui, f"window.finlabMark = {self._marks}")
        self.page.wait_for_function(
            "mark => window.finlabMark === mark", arg=self._marks, polling=20
        )

    def rest(self, milliseconds: int) -> None:
        """Let time pass on the page's own clock: what it had put off until earlier has happened by
        then."""
        self.page.evaluate("time => new Promise(done => setTimeout(done, time))", milliseconds)

    def node(self, name: str) -> None:
        """Wait for a node of the scene."""
        self.page.wait_for_function(
            "name => window.__viserMutable?.nodeRefFromName[name] != null", arg=name
        )

    def visible(self, name: str, wanted: bool = True) -> None:
        """Wait until a node is shown, or hidden."""
        script = (
            "([name, wanted]) => !!window.__viserMutable.nodeRefFromName[name]?.visible === wanted"
        )
        self.page.wait_for_function(script, arg=[name, wanted])

    def tab(self, name: str) -> None:
        """Open a task, something in the drawer, or a folder that is there."""
        task = next((task for task, names in DRAWERS.items() if name in names), name)
        if task in TASKS and self.session.desk.task != task:
            self.page.locator(".fl-tasks button", has_text=task).click()
            self.until(lambda: self.session.desk.task == task)
            self.catch_up()
        if name in TASKS:
            return
        if task in TASKS:
            if self.session.drawer != name:
                self.page.locator(".fl-strip button", has_text=name).click()
                self.until(lambda: self.session.drawer == name)
                self.catch_up()
            return
        self.page.get_by_text(name, exact=True).locator("visible=true").first.click()
        self._pause()

    def unfold(self, folder: str, label: str) -> None:
        """Open a folder that holds this label, unless an earlier flow has left it open."""
        if self.page.locator("label:visible", has_text=label).count() == 0:
            self.page.get_by_text(folder, exact=True).locator("visible=true").first.click()
            self._pause()

    def press(self, name: str) -> None:
        """Press a button that is shown."""
        named = re.compile(f"^{name}(:|$)") if name in ("Undo", "Redo") else name
        self.page.get_by_role("button", name=named, exact=True).first.click()
        self._pause()

    def row(self, label: str) -> Any:
        """The inputs beside a label."""
        found = self.page.locator("label:visible", has_text=label).first
        return found.locator(ROW).locator("input:not([type=hidden])")

    def shows(self, label: str, text: str) -> None:
        """Wait until the first box beside a label shows a text."""
        seen = ""

        def there() -> bool:
            nonlocal seen
            seen = self.row(label).first.input_value()
            return seen == text

        self.until(
            there, told=lambda: f"{label} shows {seen!r}, not {text!r}; {self.session.state}"
        )

    def type(self, label: str, value: str, place: int = -1) -> None:
        """Type into a number box."""
        box = self.row(label)
        box = box.last if place < 0 else box.nth(place)
        box.fill(value)
        box.press("Enter")
        self._pause()

    def choose(self, label: str, entry: str) -> None:
        """Choose from a list."""
        self.row(label).first.click()
        options = self.page.locator("div[role=option]:visible")
        options.filter(has_text=re.compile(f"^{re.escape(entry)}")).first.click()
        self._pause()

    def upload(self, button: str, path: Path) -> None:
        """Press a button that asks for a file, and give it one."""
        with self.page.expect_file_chooser() as chooser:
            self.press(button)
        chooser.value.set_files(path)

    def download(self, button: str, path: Path) -> Path:
        """Press a button that sends a file, and keep that."""
        with self.page.expect_download() as download:
            self.press(button)
        download.value.save_as(path)
        return path

    def key(self, keys: str) -> None:
        """Press a key outside any input."""
        self.page.evaluate("document.activeElement && document.activeElement.blur()")
        self.page.keyboard.press(keys)
        self._pause()

    @contextlib.contextmanager
    def held(
        self, start: tuple[float, float], end: tuple[float, float], steps: int = 14
    ) -> Iterator[None]:
        """Drag with the mouse, as slowly as a hand; it is let go when the context ends."""
        mouse = self.page.mouse
        mouse.move(*start)
        self.page.wait_for_timeout(150)
        mouse.down()
        for k in range(1, steps + 1):
            mouse.move(*(a + (b - a) * k / steps for a, b in zip(start, end, strict=True)))
            self.page.wait_for_timeout(25)
        self.page.wait_for_timeout(100)
        yield
        mouse.up()
        self._pause()

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """The same, and let go."""
        with self.held(start, end):
            pass

    def look_from_above(self) -> None:
        """See the robot from above, where its x and y axes lie flat on the screen."""
        self.key("2")

        def above() -> bool:
            (x, y), (u, v) = (self.pixel("/robot", (0.0, 0.0, z)) for z in (0.0, 0.1))
            return abs(u - x) + abs(v - y) < 2.0

        self.until(above)

    def pixel(
        self, node: str, point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> tuple[float, float]:
        """Where a point of a node is on the screen."""
        x, y = self.page.evaluate(PROJECT_SCRIPT, [node, list(point)])
        return x, y

    def text(self, selector: str) -> str:
        """The text of the first such element that is shown."""
        return str(self.page.locator(f"{selector} >> visible=true").first.inner_text())

    def notes(self) -> list[str]:
        """Texts of the notes that are shown."""
        return [
            str(t)
            for t in self.page.locator(".mantine-Notification-root:visible").all_inner_texts()
        ]

    def vertices(self, node: str) -> list[float]:
        """First coordinates of a mesh as the browser holds it."""
        return [float(v) for v in self.page.evaluate(VERTICES_SCRIPT, node)]

    def instances(self, node: str) -> list[list[float]]:
        """Matrices of the arrows, or other instances, of a node as the browser holds them."""
        numbers = [float(v) for v in self.page.evaluate(INSTANCES_SCRIPT, node)]
        return [numbers[k : k + 16] for k in range(0, len(numbers), 16)]

    def _pause(self) -> None:
        """Wait until the page has sent the last input."""
        self.page.wait_for_timeout(1000 * PAUSE_S)
