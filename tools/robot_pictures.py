#!/usr/bin/env python3
"""Draws the robots of the start page: the app's own view of each, without what stands around it.

    python tools/robot_pictures.py

Needs Chromium and playwright, as the tests of the browser do. Each picture is a WebP file in
`webapp/markup/pictures`, with a transparent background, so that it fits the light and the dark
theme.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
from playwright.sync_api import sync_playwright

from finlab.arrays import Array
from finlab.files.worker import prepare
from finlab.layout import load_layout
from finlab.swim.hull import hull_of
from tests.browser.conftest import CHROMIUM, CHROMIUM_FLAGS
from webapp.app import App
from webapp.scene.stage import view_size
from webapp.session import Display
from webapp.session.files import shipped
from webapp.start_page import PICTURES, ROBOTS
from webapp.tasks.solver import Solver
from webapp.view import View
from webapp.viser_internals import start_server, stop_server

SIZE = (320, 200)
"""Width and height of a picture [px]."""
FINER = 3
"""Pixels that are drawn per pixel of a picture, each way."""
EYE = np.array([0.70, 0.66, 0.50])
"""Where the camera stands, for a robot as large as the U-CAT [m]."""
NARROW = 0.72
"""Angle of the view, from top to bottom [rad]."""
MARGIN = 6
"""Free pixels around a robot."""
HIDDEN = ("/floor", "/robot/wrench", "/robot/axes", "/robot/forces", "/robot/fans")
"""Nodes that are no part of the robot; those whose names begin so as well."""
QUALITY = 82
"""Of the WebP files, of 100."""
WAIT_MS = 120_000


def main() -> None:
    """Draws all of them."""
    prepare(["webapp.session.files", "webapp.tasks.fitting"])
    server = start_server()
    display = Display(shadows=False, frozen=True)
    app = App(server, Solver(), load_layout("ucat"), display)
    folder = Path(__file__).parent.parent / "webapp" / "markup" / PICTURES
    with sync_playwright() as playwright, ThreadPoolExecutor(1) as thread:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM, chromium_sandbox=False, args=CHROMIUM_FLAGS
        )
        page = browser.new_page(viewport={"width": 1400, "height": 860})
        page.set_default_timeout(WAIT_MS)
        page.goto(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=1")
        page.locator(".fl-status .err").wait_for(state="attached")
        view = next(iter(app.views.values()))
        for name in ROBOTS:
            drawing = thread.submit(drawn, server, view, name)
            while not drawing.done():
                page.wait_for_timeout(50)
            picture = fitted(drawing.result())
            content = BytesIO()
            picture.save(content, "WEBP", quality=QUALITY, method=6)
            (folder / f"{name}.webp").write_bytes(content.getvalue())
            print(f"{name}: {len(content.getvalue()):,} bytes")
        browser.close()
    app.stop()
    stop_server(server)


def drawn(server: Any, view: View, name: str) -> Array:
    """The view of a robot (height, width, 4), with transparency; called on a thread beside viser's
    event loop."""
    layout = shipped()[name]
    loop = server.get_event_loop()
    loop.call_soon_threadsafe(view.do, lambda: view.session.open_layout(layout))
    time.sleep(3.0)
    client = view.client
    for path, node in list(client.scene._handle_from_node_name.items()):
        if path.startswith(HIDDEN) or path.endswith("/label"):
            node.visible = False
    time.sleep(1.0)
    client.scene.set_background_image(None)
    center = np.array(hull_of(layout).center)
    client.camera.fov = NARROW
    client.camera.position = center + 1.6 * view_size(layout) * EYE
    client.camera.look_at = center
    time.sleep(1.0)
    width, height = SIZE
    picture = client.get_render(FINER * height, FINER * width, transport_format="png")
    for path, node in list(client.scene._handle_from_node_name.items()):
        if path.startswith(HIDDEN) or path.endswith("/label"):
            node.visible = True
    return np.asarray(picture)


def fitted(picture: Array) -> PIL.Image.Image:
    """A picture cut to what is drawn in it, in the middle of one of `SIZE`."""
    image = PIL.Image.fromarray(picture.astype(np.uint8), "RGBA")
    box = image.getchannel("A").getbbox()
    cut = image.crop(box)
    width, height = SIZE
    scale = min((width - 2 * MARGIN) / cut.width, (height - 2 * MARGIN) / cut.height)
    size = (round(scale * cut.width), round(scale * cut.height))
    small = cut.convert("RGBa").resize(size, PIL.Image.Resampling.LANCZOS).convert("RGBA")
    canvas = PIL.Image.new("RGBA", SIZE)
    canvas.paste(small, ((width - size[0]) // 2, (height - size[1]) // 2))
    return canvas


if __name__ == "__main__":
    main()
