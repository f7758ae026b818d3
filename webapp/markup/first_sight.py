"""What lies over the page for a while: the card of the first visit, the sheet of all keys, and what is said
while files are dragged over it."""

from collections.abc import Sequence
from html import escape

from webapp.editables import press

TRIES = (
    ("Ask for a wrench", "Drag Fx: the fins change, and green follows blue.", "Allocate"),
    ("Move a fin", "Select one and pull its arrows; what the robot can do changes with it.", "Design"),
    ("Break a fin while it swims", "Start, press its number, and see the others take over.", "Simulate"),
)
"""Three things to try: in a word, in a sentence, and in which task."""


def welcome() -> str:
    """The card of the first visit; `habits.js` shows it once."""
    tries = "".join(
        f"<li><button {press('task', task)} onclick='finlabFrame.met()'>{escape(title)}</button>"
        f"<span>{escape(text)}</span></li>"
        for title, text, task in TRIES
    )
    return (
        "<section class='fl fl-welcome' aria-label='Welcome'><h2>finlab</h2>"
        "<p>For robots that swim with fins: say which force and torque the body shall feel, and see "
        f"how each fin has to flap.</p><ol>{tries}</ol><div class='row'>"
        f"<button class='primary' {press('tour', '')} onclick='finlabFrame.met()'>Take the tour</button>"
        "<button onclick='finlabFrame.met()'>Close</button></div></section>"
    )


def drop_card() -> str:
    """What can be dropped; `dropping.js` shows it while files are over the page."""
    kinds = (
        ("A design", "YAML, JSON or ZIP; its tables and its mesh at once with it", "opens it"),
        ("Measurements", "CSV", "are fitted to the fin that is selected, or on whose row they are dropped"),
        ("A hull", "STL, OBJ, GLB or PLY", "becomes this robot's"),
        ("A path", "CSV with t, x, y, z", "is swum"),
    )
    rows = "".join(f"<li><b>{a}</b> {c}<span>{b}</span></li>" for a, b, c in kinds)
    return f"<div class='fl fl-drop' aria-hidden='true'><div><h2>Drop to open</h2><ul>{rows}</ul></div></div>"


def key_sheet(rows: Sequence[tuple[str, str, str]]) -> str:
    """The sheet of keys, from groups, labels and keys; rows without a key are left out."""
    groups: dict[str, list[str]] = {}
    camera = [("View", "Move the camera", "W A S D Q E")]
    about = [("Help", "All commands", "Ctrl+K"), ("Help", "This sheet", "?")]
    for group, label, keys in (*rows, *camera, *about):
        if keys:
            keys = "Ctrl+Y" if label == "Redo" else keys
            groups.setdefault(group, []).append(f"<dt><kbd>{escape(keys)}</kbd></dt><dd>{escape(label)}</dd>")
    lists = "".join(
        f"<div><h3>{escape(group)}</h3><dl>{''.join(found)}</dl></div>" for group, found in groups.items()
    )
    return (
        "<div class='fl fl-sheet' role='dialog' aria-label='Keys' onclick='finlabFrame.sheet(false)'>"
        f"<div class='sheet'><h2>Keys</h2><div class='groups'>{lists}</div></div></div>"
    )
