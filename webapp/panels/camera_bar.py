"""How the view is looked at: the axes as they stand, sides to look from, framing."""

import viser
from markupsafe import Markup

from webapp.editables import press
from webapp.handles import put
from webapp.markup.html import html
from webapp.page import Page
from webapp.scene.robot_scene import CAMERAS

AXES = (("x", "Front"), ("y", "Side"), ("z", "Top"))
"""The axes, and from where their tips let one look."""


class CameraBar:
    """The triad and the buttons beside it."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page, self._content = page, gui.add_html("")

    def refresh(self) -> None:
        looks = Markup().join(
            html("<button {} title='{}'>{}</button>", press("look", name), key, name)
            for key, name in enumerate(CAMERAS, 1)
        )
        frame = html(
            "<button {} title='what is selected fills the view (F)'>Frame</button>", press("frame", "")
        )
        rows = html("<div><div>{}</div><div>{}</div></div>", looks, frame)
        put(self._content, content=html("<div class='fl fl-camera'>{}{}</div>", triad(), rows))


def triad() -> str:
    """The axes of the body, which a script turns with the camera; a click on a tip looks from it."""
    arms = Markup().join(
        html(
            "<g class='axis {}' {}><title>{}</title><line/><circle r='9'/><text>{}</text></g>",
            axis,
            press("look", view),
            view,
            axis,
        )
        for axis, view in AXES
    )
    return html("<svg class='triad' viewBox='-36 -36 72 72' role='img' aria-label='Axes'>{}</svg>", arms)
