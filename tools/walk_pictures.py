#!/usr/bin/env python3
"""Walks through the app as a user does and takes its pictures, for the site and the README.

    python tools/walk_pictures.py [FOLDER]

Needs Chromium and playwright, as the tests of the browser do; a few minutes, as the 3D view is
drawn by software. The pictures go to `docs/pictures`, or to a folder that is named.
"""

import sys
import tempfile
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import PIL.Image
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from finlab.files.worker import prepare
from finlab.layout import load_layout
from tests.browser.conftest import CHROMIUM, CHROMIUM_FLAGS, Served
from tests.browser.page import Page
from webapp.app import App
from webapp.scene.wrench_handle import TIP_SIZE
from webapp.session import Display
from webapp.start_page import start_page
from webapp.tasks.solver import Solver
from webapp.viser_internals import start_server, stop_server

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures"
"""Where the pictures go."""
WINDOW = {"width": 1400, "height": 860}
"""Size of the browser's window [px]."""
WIDTH = 1000
"""Width of a picture [px]; its height follows."""
QUALITY = 70
"""Of the WebP files, of 100."""
PATIENCE = 3.0
"""How much longer than in tests is waited: each picture is drawn at full size."""
ASIDE = (1395, 855)
"""Where the mouse rests, over nothing that would tell of itself [px]."""
SETTLE_MS = 2500
"""Time for the view to come to rest before a picture [ms]."""
URDF = """<robot name="glider">
  <link name="base"><inertial><mass value="11"/>
    <inertia ixx="0.2" iyy="0.3" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="gripper"/><link name="thruster_port"/><link name="thruster_starboard"/>
  <joint name="j0" type="revolute"><parent link="base"/><child link="gripper"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
  <joint name="j1" type="continuous"><parent link="base"/><child link="thruster_port"/>
    <origin xyz="-0.3 0.2 0"/><axis xyz="1 0 0"/></joint>
  <joint name="j2" type="continuous"><parent link="base"/><child link="thruster_starboard"/>
    <origin xyz="-0.3 -0.2 0"/><axis xyz="1 0 0"/></joint>
</robot>"""
"""A description in which no plugin says what pushes."""

Held = AbstractContextManager[None]
"""What is held, such as the mouse, while a picture is taken."""


class Stop(NamedTuple):
    """A picture of the walk."""

    name: str
    """Of its file."""
    act: Callable[[Page], "Held | None"]
    """What the user does before it."""


def opened(page: Page) -> None:
    """A robot of the start page, with what it is asked for."""
    page.page.locator("[data-start='robot bluerov2_heavy']").click()
    page.page.locator("#fl-start").wait_for(state="hidden")
    page.ready()
    page.until(lambda: not page.view.busy and "Exact" in page.text(".fl-status"))


def pulled(page: Page) -> Held:
    """The wrench in the hand."""
    handle = 0.7 * TIP_SIZE
    start = page.pixel("/robot/wrench/tip", (handle, 0.0, 0.0))
    end = page.pixel("/robot/wrench/tip", (handle + 0.08, 0.0, 0.0))
    return page.held(start, end)


def lost(page: Page) -> None:
    """One thruster fails."""
    page.press("2")
    page.until(lambda: bool(page.session.state.lost) and not page.view.busy)


def beyond(page: Page) -> None:
    """More is asked for than there is."""
    page.type("Fz [N]", "-240")
    page.until(lambda: "Out of reach" in page.text(".fl-status"))


def candidates(page: Page) -> None:
    """Four fins, and what the network proposes."""
    page.session.open_example(load_layout("ucat"), (1.2, 0.0, 0.0, 0.0, 0.0, 0.25), 0.0)
    wake(page)
    page.tab("Candidates")
    rows = page.page.locator("table.modes tr.pick >> visible=true")
    page.until(
        lambda: (
            not page.view.jobs.answering.searching
            and rows.count() > 1
            and "component" in rows.last.inner_text()
        )
    )


def asked(page: Page) -> None:
    """A file that leaves something open."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "glider.urdf"
        file.write_text(URDF)
        page.upload("Open", file)
        page.page.locator(".fl-inquiry [role=dialog]").wait_for()


def designed(page: Page) -> None:
    """The places of the fins, one of them in the hand."""
    page.page.keyboard.press("Escape")
    page.page.locator(".fl-inquiry [role=dialog]").wait_for(state="detached")
    page.tab("Design")
    page.page.locator(".fin-list [data-fin=back_left]").click()
    page.until(lambda: page.session.selected == "back_left")


def compared(page: Page) -> None:
    """Two robots, one wrench."""
    page.tab("Allocate")
    page.tab("Two robots")
    page.node("/pair/right/fins/0/turn/blade")
    page.choose("Right", "Shipped: bluerov2_heavy")
    page.node("/pair/right/fins/7/turn/blade")
    page.until(lambda: page.page.locator(".versus .better-sign").count() >= 6)


def improved(page: Page) -> None:
    """A search for a better place of each fin."""
    page.press("Close")
    page.visible("/robot")
    page.tab("Improve")
    page.press("Search")
    improver = page.view.jobs.improver
    page.until(lambda: improver.answer is not None, 240.0)


def presented(page: Page) -> None:
    """Large words for a projector."""
    page.press("Leave")
    page.tab("Allocate")
    page.key("p")
    page.page.locator(".fl-present .plot").wait_for()


def logged(page: Page) -> None:
    """A log of PX4: when was the robot at its limits?"""
    page.page.keyboard.press("Escape")
    page.page.locator(".fl-tasks").wait_for()
    page.tab("Log")
    page.page.get_by_role("button", name="PX4 (.ulg)").click()
    page.page.locator(".fl-timeline svg:visible").first.wait_for()
    page.page.get_by_role("button", name="Open the improved robot").first.wait_for()


def swum(page: Page) -> None:
    """A fin is lost on the way, and found."""
    page.session.open_example(load_layout("ucat"), (1.2, 0.0, 0.0, 0.0, 0.0, 0.25), 0.0)
    wake(page)
    page.tab("Simulate")
    page.choose("Scenario", "lost-in-current")
    page.until(lambda: not page.session.swim.announced)
    page.type("Speed", "8")
    page.press("Start")
    swimming = page.view.jobs.swimming
    page.until(
        lambda: (
            swimming.swimmer is not None
            and bool(swimming.swimmer.visible_moment.believed_lost)
            and swimming.time > 20.0
        ),
        600.0,
    )
    page.press("Pause")
    page.until(lambda: not swimming.running and not swimming.busy)


def jets(page: Page) -> None:
    """Thrusters that blow at each other."""
    page.press("End")
    page.until(lambda: not page.view.jobs.swimming.active)
    page.press("Lessons")
    page.page.get_by_role("button", name="Jets meet each other").first.click()
    page.until(lambda: "Jets meet each other" in page.text(".fl-lesson"))
    page.page.locator("label:visible", has_text="Count jets").first.click()
    page.until(lambda: not page.view.busy and "✓" in page.text(".fl-lesson"))


STOPS = (
    Stop("start", lambda page: None),
    Stop("opened", opened),
    Stop("pulled", pulled),
    Stop("lost", lost),
    Stop("beyond", beyond),
    Stop("candidates", candidates),
    Stop("asked", asked),
    Stop("designed", designed),
    Stop("compared", compared),
    Stop("improved", improved),
    Stop("presented", presented),
    Stop("log", logged),
    Stop("swim", swum),
    Stop("jets", jets),
)
"""The walk."""


def wake(page: Page) -> None:
    """The page looks at its session, which was changed behind its back."""
    page.view.intents.is_new = True
    page.view.bell.ring_from_thread(page.view.deferred)
    page.until(lambda: not page.view.busy)
    page.catch_up()


class Newcomer(Page):
    """A page that is opened without a link, at the start page."""

    def ready(self) -> None:
        """Wait for the start page, or for what lies behind it once a robot is chosen."""
        start = self.page.locator("#fl-start")
        start.wait_for(state="attached")
        if start.is_visible():
            self.page.wait_for_function("() => window.__viserMutable?.scene != null")
            return
        super().ready()


def main() -> None:
    """Takes all pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    prepare(["webapp.session.files", "webapp.tasks.fitting"])
    server = start_server(start_page=start_page())
    app = App(server, Solver(), load_layout("ucat"), Display(frozen=True))
    served = Served(f"http://127.0.0.1:{server.get_port()}/", app, server)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM, chromium_sandbox=False, args=CHROMIUM_FLAGS
        )
        context = browser.new_context(viewport=WINDOW, accept_downloads=True)
        page = Newcomer(context.new_page(), served, PATIENCE)
        for number, stop in enumerate(STOPS, 1):
            held = stop.act(page)
            if held is None:
                page.page.mouse.move(*ASIDE)
            with held or nullcontext():
                page.rest(SETTLE_MS)
                page.close_notes()
                page.rest(SETTLE_MS)
                content = taken(page)
            (folder / f"{stop.name}.webp").write_bytes(content)
            print(f"{number}. {stop.name}: {len(content):,} bytes", flush=True)
        browser.close()
    app.stop()
    stop_server(server)


def taken(page: Page) -> bytes:
    """The window as a WebP file."""
    image = PIL.Image.open(BytesIO(page.page.screenshot())).convert("RGB")
    height = round(WIDTH * image.height / image.width)
    small = image.resize((WIDTH, height), PIL.Image.Resampling.LANCZOS)
    content = BytesIO()
    small.save(content, "WEBP", quality=QUALITY, method=6)
    return content.getvalue()


if __name__ == "__main__":
    main()
