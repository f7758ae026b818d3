"""The designs that a browser had lately, as a list to press on."""

import time
from collections.abc import Sequence

from markupsafe import Markup

from webapp.editables import edit, press
from webapp.markup.html import html
from webapp.tasks.designs import Recent


def design_card(name: str, about: str, recent: Sequence[Recent]) -> str:
    """The name to save under, what is said of the design, and the recent ones."""
    box = edit("save-as", "", name, "save under this name", at_once=True)
    rows = Markup().join(
        html(
            "<div class='pick recent' role='button' tabindex='0' {}><b>{}</b><span "
            "class='dim'>{} fins, {}</span></div>",
            press("design-recent", str(k)),
            one.name,
            one.fins,
            _ago(one.when),
        )
        for k, one in enumerate(recent)
    )
    lately = html("<div class='dim said'>Lately in this browser</div>{}", rows) if rows else ""
    return html(
        "<div class='fl'><div class='save-as'><span class='dim'>Save as</span><span "
        "class='edit box' {}>{}</span></div><div class='dim said'>{}</div>{}</div>",
        box,
        name,
        about,
        lately,
    )


def _ago(when: float) -> str:
    """How long ago something was, in words that stay true for a while."""
    minutes = max(0.0, time.time() - when) / 60.0
    if minutes < 60.0:
        return "within the hour"
    return f"{minutes / 60.0:.0f} h ago" if minutes < 2880.0 else f"{minutes / 1440.0:.0f} days ago"
