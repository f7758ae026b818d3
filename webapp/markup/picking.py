"""Elements that mark others for styles."""

from webapp.markup.html import html


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
