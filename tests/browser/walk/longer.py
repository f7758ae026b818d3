"""What takes more than one press: a sweep, a search and its mission, files, the stick. Swims: swims.py."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from playwright.sync_api import TimeoutError

from finlab.layout import layout_to_dict, load_layout
from tests.browser.walk.boxes import FIGURES, FILES, IMPROVE, PILOT, RUN, SWEEP
from tests.browser.walk.swims import MOST_FINS, swim
from webapp.panels.pilot import PADS
from webapp.session.files import candidates_csv

MISSION = "power for a mission"
CANDIDATES = "Candidates (CSV)"
"""Of methods that have any; others refuse."""


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
    if session.draft.goal == MISSION:  # each round of it takes seconds
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


def mission(walk: Any) -> None:
    """Write the wrenches of a mission, and take the present one into it."""
    session = walk.model.session
    walk.hand.go(IMPROVE, walk.model)
    if session.draft.goal != MISSION:
        walk.hand.choose(IMPROVE, "Goal", MISSION)
        session.set_draft(session.draft.with_goal(MISSION))
    text = walk.random.choice(("1 0 0 0 0 0.1", "0 0 -2 0 0 0", "one two", ""))
    walk.hand.inputs(IMPROVE, "Mission").first.click()
    walk.hand.keys.press("Control+a")
    walk.hand.keys.type(text) if text else walk.hand.keys.press("Delete")
    session.set_draft(session.draft.with_mission(text))
    walk.page.until(lambda: walk.page.session.draft.mission == text)
    if walk.random.random() < 0.5:
        line = " ".join(f"{value:g}" for value in session.state.target)
        walk.hand.click(IMPROVE, "", "Add the present wrench")
        session.set_draft(session.draft.with_mission(f"{text.rstrip()}\n{line}".lstrip()))


def exported(walk: Any) -> None:
    """A file to take home, with something in it, unless there is no answer or no fin to make it of."""
    walk.hand.go(FILES, walk.model)
    walk.page.until(lambda: not walk.page.view.busy)
    state = walk.model.session.state
    if walk.page.view.shown is None or len(state.failed) == state.layout.n_fins:
        return
    name = walk.random.choice(("Graph file", CANDIDATES, "Picture (PNG)", "3D view (HTML)"))
    if name == CANDIDATES and walk.page.view.answering.best.candidates is None:
        walk.told(lambda: walk.hand.click(FILES, "Single files", name), lambda _: candidates_csv(None))
        return
    download = walk.hand.download(FILES, "Single files", name)
    assert Path(download.path()).stat().st_size > 100, f"{name} is empty"


def saved(walk: Any) -> None:
    """The layout as a file is the layout."""
    download = walk.hand.download(("Design", "File"), "", "Save")
    walk.model.session.note_saved()
    path = Path(download.path())
    named = path.with_name(f"{path.name}-{download.suggested_filename}")
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
    "exported": exported,
    "mission": mission,
    "steer": steer,
}
"""By name."""
KNOWN = {
    *((RUN, label) for label in ("Run", "Break a fin")),
    *((FIGURES, label) for label in ("Compare", "Save")),
    *((IMPROVE, label) for label in ("Mission", " ")),
    (FILES, "Single files"),
}
"""Rows that are used here."""
