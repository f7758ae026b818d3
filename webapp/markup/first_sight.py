"""The card of the first visit."""

from markupsafe import Markup

from webapp.markup.html import html
from webapp.presses import press

TRIES = (
    ("Ask for a wrench", "Drag Fx: the fins change, and green follows blue.", "Allocate"),
    ("Move a fin", "Select one and pull its arrows; what the robot can do changes with it.", "Design"),
    ("Break a fin while it swims", "Start, press its number, and see the others take over.", "Simulate"),
)
"""Three things to try: in a word, in a sentence, and in which task."""


def welcome() -> str:
    """The card of the first visit; `habits.js` shows it once."""
    tries = Markup().join(
        html(
            "<li><button {} onclick='finlabFrame.met()'>{}</button><span>{}</span></li>",
            press("task", task),
            title,
            text,
        )
        for title, text, task in TRIES
    )
    return html(
        "<section class='fl fl-welcome' aria-label='Welcome'><h2>finlab</h2><p>For robots "
        "that swim with fins: say which force and torque the body shall feel, and see how "
        "each fin has to flap.</p><ol>{}</ol><div class='row'><button class='primary' {} "
        "onclick='finlabFrame.met()'>Take the tour</button><button "
        "onclick='finlabFrame.met()'>Close</button></div></section>",
        tries,
        press("tour", ""),
    )
