"""A swim on the page: begun, held, its fins broken and mended, kept, ended."""

from pathlib import Path
from typing import Any
from zipfile import ZipFile, is_zipfile

from tests.browser.walk.boxes import FIGURES, RUN

MOST_FINS = 6
"""Swims of robots with more, and searches for them, take too long for a walk."""
LONG_ENOUGH = 0.7
"""What a swim must have taken [s] before it is saved."""


def swim(walk: Any) -> None:
    """Start, pause, something that may be done to a swim, a step, end."""
    if walk.model.session.state.layout.n_fins > MOST_FINS:
        return
    walk.hand.go(RUN, walk.model)
    swimming = walk.page.view.swimming
    if walk.model.told(lambda m: m.session.swim.plan(m.session.state, None)) is not None:
        return
    walk.hand.click(RUN, "", "Start")
    walk.page.until(lambda: swimming.active and swimming.time > 0.2 or walk.page.notes() != [])
    assert walk.page.notes() == [], walk.page.notes()
    hold(walk, swimming)
    walk.random.choice((breaks, kept, taken))(walk, swimming)
    before = swimming.time
    walk.hand.click(RUN, "Run", "Step")
    walk.page.until(lambda: swimming.time > before)
    walk.hand.click(RUN, "Run", "End")
    walk.page.until(lambda: not swimming.active)


def hold(walk: Any, swimming: Any) -> None:
    """Pause, and wait until it rests."""
    walk.hand.click(RUN, "Run", "Pause")
    walk.page.until(lambda: not swimming.running and not swimming.busy)


def breaks(walk: Any, swimming: Any) -> None:
    """A fin breaks and is mended, or is mended and breaks."""
    robot = swimming.swimmers[0]
    fin = walk.random.randrange(len(robot.fins))
    name, before = robot.fins[fin], robot.shown.lost
    if name not in before and len(before) + 1 >= len(robot.fins):
        return
    for wanted in (name not in before, name in before):
        walk.hand.click(RUN, "Break a fin", fin)
        walk.page.until(lambda wanted=wanted: (name in robot.shown.lost) == wanted)
        walk.page.catch_up()


def kept(walk: Any, swimming: Any) -> None:
    """The swim is put aside, and forgotten."""
    walk.hand.click(FIGURES, "Compare", "Keep this swim")
    walk.page.until(lambda: swimming.kept is not None)
    walk.page.catch_up()
    walk.hand.click(FIGURES, "Compare", "Forget it")
    walk.page.until(lambda: swimming.kept is None)


def taken(walk: Any, swimming: Any) -> None:
    """Its log as a file has a line for each tick that was swum, a ZIP such a file for each robot."""
    walk.hand.click(RUN, "Run", "Go on")
    walk.page.until(lambda: swimming.time > LONG_ENOUGH)
    hold(walk, swimming)
    swum = [record.log.n_ticks for record in swimming.records()]
    download = walk.hand.download(FIGURES, "Save", "Table (CSV)")
    rows = [sum(line[:1].isdigit() for line in text.splitlines()) for text in tables(download.path())]
    assert rows == swum, f"the tables have {rows} rows for {swum} ticks"


def tables(path: str) -> list[str]:
    """Text of a table, or of each in a ZIP."""
    if not is_zipfile(path):
        return [Path(path).read_text(encoding="utf-8")]
    with ZipFile(path) as archive:
        return [archive.read(name).decode() for name in archive.namelist()]
