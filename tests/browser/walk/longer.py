"""What takes more than one press: a sweep, a search, a swim, a comparison, files, the stick."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from playwright.sync_api import TimeoutError

from finlab.layout import layout_to_dict, load_layout
from tests.browser.walk.boxes import IMPROVE, PILOT, RUN, SWEEP
from webapp.panels.pilot import PADS

MOST_FINS = 6
"""Searches and swims of robots with more take too long for a walk."""


def sweep(walk: Any) -> None:
    """Play, see that it goes, stop: what was asked before is asked again."""
    walk.hand.go(SWEEP, walk.model)
    if walk.model.ends[0] >= walk.model.ends[1]:
        return
    before = walk.page.session.revision
    section = walk.hand.section(SWEEP)
    section.get_by_role("button", name="Play the sweep").click()
    walk.page.until(lambda: walk.page.session.revision > before + 3)
    section.get_by_role("button", name="Stop the sweep").click()
    walk.page.until(lambda: not walk.page.view.sweep.running)
    walk.model.session.history.end_merge()


def search(walk: Any) -> None:
    """Search a little, cancel, and leave what was found."""
    session = walk.model.session
    held = set(session.draft.held) | set(session.state.locked)
    if session.state.layout.n_fins > MOST_FINS or held >= set(session.state.layout.names):
        return
    if session.draft.goal == "power for a mission":
        return
    walk.hand.go(IMPROVE, walk.model)
    section, improver = walk.hand.section(IMPROVE), walk.page.view.improver
    section.get_by_role("button", name="Search").click()
    walk.page.until(lambda: improver.busy or improver.findings is not None or improver.error is not None)
    try:
        section.get_by_role("button", name="Cancel").click(timeout=2000)
    except TimeoutError:
        assert not improver.busy, "a search cannot be cancelled"  # it was quicker than the pointer
    walk.page.until(lambda: improver.findings is not None or improver.error is not None)
    found = improver.findings
    if found is None or not found.improved:  # then there is nothing to accept
        return
    accept = walk.random.random() < 0.5
    section.get_by_role("button", name="Accept" if accept else "Leave").click()
    if accept:
        walk.model.session.accept_layout(found.layout)
    walk.page.until(lambda: improver.findings is None)


def swim(walk: Any) -> None:
    """Start, pause, a step, end."""
    if walk.model.session.state.layout.n_fins > MOST_FINS:
        return
    walk.hand.go(RUN, walk.model)
    swimming, section = walk.page.view.swimming, walk.hand.section(RUN)
    if walk.model.told(lambda m: m.session.swim.plan(m.session.state, None)) is not None:
        return
    section.get_by_role("button", name="Start").click()
    walk.page.until(lambda: swimming.active and swimming.time > 0.2 or walk.page.notes() != [])
    assert walk.page.notes() == [], walk.page.notes()
    section.get_by_role("button", name="Pause").click()
    walk.page.until(lambda: not swimming.running and not swimming.busy)
    before = swimming.time
    section.get_by_role("button", name="Step").click()
    walk.page.until(lambda: swimming.time > before)
    section.get_by_role("button", name="End").click()
    walk.page.until(lambda: not swimming.active)


def saved(walk: Any) -> None:
    """The layout as a file is the layout."""
    with walk.page.page.expect_download() as download:
        walk.hand.click(("Design", "File"), "", "Save")
    walk.model.session.note_saved()
    path = Path(download.value.path())
    named = path.with_name(f"{path.name}-{download.value.suggested_filename}")
    path.rename(named)
    layout, wanted = load_layout(named), walk.model.session.state.layout
    written, meant = layout_to_dict(layout), layout_to_dict(wanted)  # with angles as a file has them
    assert written == meant, f"the file holds {written}, not {meant}"


def steer(walk: Any) -> None:
    """The stick changes its two axes and no other, and they come back where it springs."""
    walk.hand.go(PILOT, walk.model)
    walk.hand.unfold(PILOT, PILOT[1], "Stick for")
    model, page = walk.model, walk.page
    pad = walk.hand.section(PILOT).locator("svg.pad")
    pad.scroll_into_view_if_needed()
    box = pad.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    before = page.session.state.target
    page.drag((x, y), (x - walk.random.uniform(10, 40), y - walk.random.uniform(10, 40)), steps=6)
    page.until(lambda: page.session.history.merge_key is None)
    page.catch_up()
    if model.spring:
        model.session.release(True)
        return
    after, own = page.session.state.target, PADS[model.stick]
    changed = {k for k in range(6) if after[k] != before[k]}
    assert changed <= {own.up, own.left}, f"the stick for {model.stick} changed axes {changed}"
    model.session.steer({axis: after[axis] for axis in (own.up, own.left)})
    model.session.release(False)


LONGER: dict[str, Callable[[Any], None]] = {
    "sweep": sweep,
    "search": search,
    "swim": swim,
    "saved": saved,
    "steer": steer,
}
"""By name."""
