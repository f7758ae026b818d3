"""What lies over the page for a while: the card of the first visit, and what is said while files are dragged
over it."""

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


def drop_card() -> str:
    """What can be dropped; `dropping.js` shows it while files are over the page."""
    kinds = (
        ("A design", "YAML, JSON or ZIP; its tables and its mesh at once with it", "opens it"),
        ("Measurements", "CSV", "are fitted to the fin that is selected, or on whose row they are dropped"),
        ("A hull", "STL, OBJ, GLB or PLY", "becomes this robot's"),
        ("A path", "CSV with t, x, y, z", "is swum"),
    )
    rows = Markup().join(html("<li><b>{}</b> {}<span>{}</span></li>", a, c, b) for a, b, c in kinds)
    return html(
        "<div class='fl fl-drop' aria-hidden='true'><div><h2>Drop to open</h2><ul>{}</ul></div></div>", rows
    )
