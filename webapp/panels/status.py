"""What lies over the 3D view: the status line and the legend."""

import viser

from webapp.handles import put
from webapp.markup.corner import corner, swim_corner
from webapp.page import Page
from webapp.scene.swim_scene import ARROWS_N


class Corner:
    """Both, in a corner of the view."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        self._content = gui.add_html("")

    def refresh(self) -> None:
        try:
            content = self._written()
        except Exception as error:
            self._page.fault(error)
            content = ""
        put(self._content, content=content)

    def _written(self) -> str:
        page, answering = self._page, self._page.answering
        if page.swimming.swimmer is not None:
            return swim_corner(page.swimming, page.swimming.swimmer, ARROWS_N)
        reply = answering.reply
        return corner(
            page.session.state,
            page.scenery.legend,
            page.shown,
            page.busy,
            answering.error,
            page.shown is answering.best,
            reply is not None and reply.in_reach,
        )
