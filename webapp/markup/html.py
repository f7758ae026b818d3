"""How markup is made: what is put into it is escaped, unless it is markup itself."""

from collections.abc import Iterable

import numpy as np
from markupsafe import Markup

SAFE = (Markup, int, float, np.float64)
ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "'": "&#39;", '"': "&#34;"})


def html(template: str, *values: object) -> str:
    """Markup, a text that is marked as such, with values in the place of `{}`, which may have formats, as
    `str.format` has them. Of several things in one, all stand one after the other."""
    # Much faster than the format of `Markup`, which looks at each value through a formatter of its own.
    safe = [v if type(v) in SAFE else v.translate(ESCAPES) if type(v) is str else _joined(v) for v in values]
    return str.__new__(Markup, template.format(*safe))


def _joined(value: object) -> str:
    if isinstance(value, Iterable) and not isinstance(value, str):
        return "".join([v if type(v) is Markup else html("{}", v) for v in value])
    return str(value).translate(ESCAPES)


def row(*cells: object) -> str:
    """A row of a table."""
    return html("<tr>{}</tr>", [html("<td>{}</td>", cell) for cell in cells])


def marker(name: str) -> str:
    """Invisible element that styles find; put right before what they are about."""
    return html("<i class='{}'></i>", name)


def button_colors(name: str, colors: list[tuple[str, str]]) -> str:
    """A style that paints the buttons of the group behind the marker: background and text colour of each."""
    rules = [
        html(
            "div:has(>.{}) + div button:nth-of-type({}) {{ background: {}; color: {}; border-color: {}; }}",
            name,
            k + 1,
            back,
            text,
            back,
        )
        for k, (back, text) in enumerate(colors)
    ]
    return html("<style>{}</style>{}", rules, marker(name))
