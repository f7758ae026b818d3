"""How the view is looked at: the axes as they stand, sides to look from, framing."""

import viser

from webapp.editables import press
from webapp.handles import put
from webapp.page import Page
from webapp.scene.robot_scene import CAMERAS

AXES = (("x", "Front"), ("y", "Side"), ("z", "Top"))
"""The axes, and from where their tips let one look."""


class CameraBar:
    """The triad and the buttons beside it."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        """Build it."""
        self._page, self._content = page, gui.add_html("")

    def refresh(self) -> None:
        """Nothing changes."""
        looks = "".join(
            f"<button {press('look', name)} title='{key}'>{name}</button>"
            for key, name in enumerate(CAMERAS, 1)
        )
        frame = f"<button {press('frame', '')} title='what is selected fills the view (F)'>Frame</button>"
        rows = f"<div><div>{looks}</div><div>{frame}</div></div>"
        put(self._content, content=f"<div class='fl fl-camera'>{triad()}{rows}</div>")


def triad() -> str:
    """The axes of the body, which a script turns with the camera; a click on a tip looks from it."""
    arms = "".join(
        f"<g class='axis {axis}' {press('look', view)}><title>{view}</title>"
        f"<line/><circle r='9'/><text>{axis}</text></g>"
        for axis, view in AXES
    )
    return f"<svg class='triad' viewBox='-36 -36 72 72' role='img' aria-label='Axes'>{arms}</svg>"
