"""What lies over the 3D view: the status line and the legend."""

from finlab.allocation.allocation import Allocation
from webapp.handles import put
from webapp.markup.corner import corner, legend, set_rows, swim_corner
from webapp.page import Page
from webapp.scene.robot_scene import SWIM
from webapp.scene.wrench_nodes import Scale
from webapp.session.display import Display
from webapp.session.state import State
from webapp.tasks.analyst import Findings
from webapp.tasks.moment import Moment
from webapp.tasks.swimmer import Swimmer


def add_corner(page: Page) -> None:
    """Both, in a corner of the view."""

    def fail(error: Exception | None) -> None:
        if error is not None:
            put(content, content="")
            page.fault(error)

    page.board.group(fail)
    content = page.add_html(_written)


def _written(
    swimmer: Swimmer | None,
    moment: Moment | None,
    pace: str,
    state: State,
    display: Display,
    found: Findings | None,
    scale: Scale,
    shown: Allocation | None,
    best: Allocation | None,
    busy: bool,
    error: str | None,
    in_reach: bool,
) -> str:
    if swimmer is not None and moment is not None:
        return swim_corner(swimmer, moment, pace, SWIM.newtons)
    drawn = set_rows(found if display.drawn != "none" else None)
    return corner(state, legend(*scale, drawn), shown, busy, error, shown is best, in_reach)
