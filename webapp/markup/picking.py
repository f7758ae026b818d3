"""Elements that mark others for styles."""


def marker(name: str) -> str:
    """Invisible element that styles find; put right before what they are about."""
    return f"<i class='{name}'></i>"


def button_colors(name: str, colors: list[tuple[str, str]]) -> str:
    """A style that paints the buttons of the group behind the marker: background and text colour of each."""
    rules = [
        f"div:has(>.{name}) + div button:nth-of-type({k + 1}) "
        f"{{ background: {back}; color: {text}; border-color: {back}; }}"
        for k, (back, text) in enumerate(colors)
    ]
    return f"<style>{''.join(rules)}</style>{marker(name)}"
