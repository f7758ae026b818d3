"""How the app looks: states of the page, pictures of them, and whether two pictures look the same.

Stored are pictures of a quarter of the size (`tests/browser/looks/STATE-SIZE-THEME.webp`), made by
`tools/bench-app looks --store`.
"""

import io
import json
import subprocess
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image, ImageFilter

from finlab.arrays import Array

FOLDER = Path(__file__).with_name("looks")
SIZES = ((1280, 720), (1400, 860), (1920, 1080), (900, 700))
THEMES = ("light", "dark")
SHARE = 4
"""How much smaller than the page a stored picture is, along each side."""
TILE = 8
"""Side of the tiles in which pictures are compared [px of a stored picture]."""
SEEN = 24.0
"""Mean distance of the colours of a tile from which it looks another [of 255]; compression takes up to 16."""
STILL_S = 20.0
"""Longest wait for a page that does not move any more."""
TIMES = """() => {
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let text; (text = walk.nextNode()); )
    if (/\\d ms$/.test(text.data.trim())) text.data = text.data.replace(/[\\d.]+ ms/, '1.00 ms');
}"""
"""Times that the machine took are another each time."""


class Look(NamedTuple):
    """One picture."""

    state: str
    size: tuple[int, int]
    theme: str

    @property
    def path(self) -> Path:
        """Where it is stored."""
        return FOLDER / f"{self.state}-{self.size[0]}x{self.size[1]}-{self.theme}.webp"


def _welcome(page: Any) -> None:
    page.page.evaluate("document.documentElement.classList.add('fl-first')")


def _failure(page: Any) -> None:
    page.key("n")
    page.key("x")
    page.until(lambda: page.session.state.failed != ())


def _damage(page: Any) -> None:
    page.unfold("Damage a fin", "Which fin")
    page.row("Stuck").first.click()
    page.until(lambda: page.session.state.stuck != ())


def _beyond(page: Any) -> None:
    page.type("Fx [N]", "40")
    page.until(lambda: page.session.state.target[0] == 40.0)


def _candidates(page: Any) -> None:
    page.choose("Method", "mdn")
    page.until(lambda: page.session.state.method == "mdn" and not page.view.answering.searching)


def _keys(page: Any) -> None:
    page.page.evaluate("finlabFrame.sheet(true)")


def _fin(page: Any) -> None:
    page.tab("Design")
    page.key("n")
    page.row("Position [m]").last.wait_for()


def _body(page: Any) -> None:
    page.tab("Design")
    page.press("All")
    page.until(lambda: page.session.state.layout.body.added_mass is not None)


def _reach(page: Any) -> None:
    page.tab("Reach")
    page.press("forces")
    page.until(lambda: not page.view.analyst.busy and page.view.analyst.findings.now is not None)


def _tour(page: Any) -> None:
    page.key("t")
    page.until(lambda: page.session.stop == 0)


def _lesson(page: Any) -> None:
    page.press("Lessons")
    page.until(lambda: page.session.lesson is not None)


STATES: dict[str, Callable[[Any], object]] = {
    "welcome": _welcome,
    "allocate": lambda page: page.tab("Allocate"),
    "failure": _failure,
    "beyond": _beyond,
    "candidates": _candidates,
    "keys": _keys,
    "tour": _tour,
    "lesson": _lesson,
    "fin": _fin,
    "body": _body,
    "reach": _reach,
    "simulate": lambda page: page.tab("Simulate"),
    "export": lambda page: page.tab("Export"),
    "damage": _damage,
}
"""What is looked at, and what to do before it, from first sight; the last one leaves a folder open."""


def pictures(page: Any, states: Iterable[str], sizes: Any = SIZES, themes: Any = THEMES) -> Iterable[Any]:
    """Looks and their pictures in full size, one after the other."""
    for state in states:
        page.page.set_viewport_size({"width": 1400, "height": 860})
        page.page.evaluate("document.documentElement.classList.remove('fl-first', 'fl-keys')")
        loop = page._served.server.get_event_loop()
        # So that what can be undone is the same whatever was done before.
        loop.call_soon_threadsafe(page.view.do, lambda: page.session.set_target(0, 0.5))
        page.until(lambda: page.session.state.target[0] == 0.5)
        page.start_over()
        STATES[state](page)
        for theme in themes:
            switch(page, theme)
            for width, height in sizes:
                page.page.set_viewport_size({"width": width, "height": height})
                yield Look(state, (width, height), theme), still(page)
        switch(page, "light")


def switch(page: Any, theme: str) -> None:
    """Another theme, as the switch in Display brings it."""
    loop, dark = page._served.server.get_event_loop(), theme == "dark"
    loop.call_soon_threadsafe(page.view.do, lambda: page.session.set_display("dark", dark))
    page.page.wait_for_selector(f"html[data-mantine-color-scheme={theme}]", state="attached")


def still(page: Any) -> Image.Image:
    """A picture of the page when it has come to rest: two in a row look the same."""
    view = page.view
    page.until(lambda: not (view.busy or view.analyst.busy or view.ranging.busy or view.answering.searching))
    page.rest(300)
    last: list[Image.Image] = [shot(page)]

    def rests() -> bool:
        page.rest(200)
        last.append(shot(page))
        return not differing(small(last[-1]), small(last[-2]))

    page.until(rests, STILL_S)
    return last[-1]


def shot(page: Any) -> Image.Image:
    """A picture of the page as it is."""
    page.close_notes()
    page.page.evaluate(TIMES)
    page.page.mouse.move(page.page.viewport_size["width"] / 2, 2)  # no hint there
    return Image.open(io.BytesIO(page.page.screenshot(timeout=0))).convert("RGB")


def small(picture: Image.Image) -> Image.Image:
    """As it is stored."""
    size = picture.width // SHARE, picture.height // SHARE
    return picture.resize(size, Image.Resampling.BOX)


def differing(one: Image.Image, other: Image.Image) -> list[tuple[int, int]]:
    """Tiles (column, row) in which two small pictures look different to an eye; all where sizes differ."""
    if one.size != other.size:
        return [(0, 0)]
    distance = np.linalg.norm(_colors(one) - _colors(other), axis=2)
    rows, columns = (-(-n // TILE) for n in distance.shape)
    padded = np.zeros((rows * TILE, columns * TILE))
    padded[: distance.shape[0], : distance.shape[1]] = distance
    means = padded.reshape(rows, TILE, columns, TILE).mean(axis=(1, 3))
    return [(int(column), int(row)) for row, column in np.argwhere(means > SEEN)]


def _colors(picture: Image.Image) -> Array:
    """Brightness and two differences of colour (h, w, 3), which an eye tells apart less than brightness; a
    little blurred, as edges are drawn otherwise by another machine."""
    blurred = picture.filter(ImageFilter.GaussianBlur(0.7)).convert("YCbCr")
    return np.asarray(np.asarray(blurred, dtype=float) * [1.0, 1.5, 1.5])


def store(look: Look, picture: Image.Image) -> None:
    """Keep a picture."""
    FOLDER.mkdir(exist_ok=True)
    small(picture).save(look.path, quality=82, method=6)


def stored(look: Look) -> Image.Image:
    """The picture that is kept."""
    return Image.open(look.path).convert("RGB")


def drawn_by(version: str) -> dict[str, str]:
    """What pictures depend on besides the app: the browser (its `version`) and the font."""
    font = subprocess.run(["fc-match", "sans-serif"], capture_output=True, text=True, check=False).stdout
    return {"chromium": version.split(".")[0], "font": font.strip()}


def note(version: str) -> None:
    """Keep what the stored pictures were drawn by."""
    (FOLDER / "drawn-by.json").write_text(json.dumps(drawn_by(version), indent=2) + "\n", "utf-8")


def comparable(version: str) -> bool:
    """Whether pictures of this browser can be compared with the stored ones."""
    path = FOLDER / "drawn-by.json"
    return path.is_file() and json.loads(path.read_text("utf-8")) == drawn_by(version)
