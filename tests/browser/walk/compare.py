"""What server and page show, against the model; and what of the page the walk does not know."""

from typing import Any

from finlab.errors import FinlabError
from tests.browser.walk.longer import KNOWN
from tests.browser.walk.model import facts
from webapp.panels.places import PLACES


def differences(walk: Any) -> list[str]:
    """In what the server and the page differ from the model, in words."""
    model, page = walk.model, walk.page
    model.let_go()
    wanted, now = facts(model.session), facts(page.session)
    found = [f"{k}: {now[k]!r:.300}, not {wanted[k]!r:.300}" for k in wanted if now[k] != wanted[k]]
    if found:
        return found
    shown = walk.hand.shown()
    for box in walk.boxes:
        key = (walk.hand.index(box.spot), box.label, box.nth)
        if key in shown and box.there(model):
            texts = [box.text(value) for value in box.values(model)]
            if shown[key][-len(texts) :] != texts:
                found.append(f"{box.label} shows {shown[key]}, not {texts}")
    for control in (*walk.choices, *walk.ticks):
        key = (walk.hand.index(control.spot), control.label, 0)
        if key in shown and control.there(model) and shown[key][0] != control.shows(model):
            found.append(f"{control.label} shows {shown[key]}, not {control.shows(model)!r}")
    if model.session.task == "Design":
        try:
            walk.rows.check()
        except FinlabError as error:
            found.append(str(error))
    if page.notes():
        found.append(f"a note lies over the page: {page.notes()}")
    return found


def unknown(walk: Any) -> list[str]:
    """Rows of the page now that no part of the walk knows."""
    controls = (*walk.boxes, *walk.choices, *walk.ticks, *walk.presses)
    known = {(walk.hand.index(control.spot), control.label) for control in controls}
    known |= {(walk.hand.index(spot), label) for spot, label in KNOWN}
    seen = {(section, label) for section, label, _ in walk.hand.shown()}
    return [f"{label} in {PLACES[section].title}" for section, label in sorted(seen - known)]
