"""How the view is looked at: sides to look from, framing."""

import viser

from webapp.handles import add_html
from webapp.markup.html import html
from webapp.page import Page
from webapp.presses import press
from webapp.scene.robot_scene import CAMERAS


class CameraBar:
    """Buttons."""

    def __init__(self, gui: viser.GuiApi, _page: Page) -> None:
        looks = (
            html("<button {} title='{}'>{}</button>", press("look", name), key, name)
            for key, name in enumerate(CAMERAS, 1)
        )
        hint = "what is selected fills the view (F)"
        frame = html("<button {} title='{}'>Frame</button>", press("frame", ""), hint)
        add_html(gui, html("<div class='fl fl-camera'>{}{}</div>", looks, frame))

    def refresh(self) -> None:
        """Nothing changes."""
