"""Rows and dots that can be clicked: a click on them presses a button of a group that stands on the page."""


def marker(name: str) -> str:
    """Invisible element to be put right before a group of buttons, so that `pick` finds it."""
    return f"<i class='{name}'></i>"


def pick(name: str, index: int) -> str:
    """Attribute of an element that presses the button at `index` of the group behind the marker."""
    find = f"document.querySelectorAll(&quot;div:has(>.{name}) + div button&quot;)[{index}]"
    return f'onclick="{find}?.click()"'


def chosen_button(name: str, index: int | None) -> str:
    """A style that fills the button at `index` behind the marker: the one whose choice is in force."""
    if index is None:
        return marker(name)
    return (
        f"<style>div:has(>.{name}) + div button:nth-of-type({index + 1}) "
        "{ background: var(--mantine-primary-color-filled); color: #fff; }"
        f"</style>{marker(name)}"
    )


def button_colors(name: str, colors: list[tuple[str, str]]) -> str:
    """A style that paints the buttons behind the marker: background and text colour of each."""
    rules = [
        f"div:has(>.{name}) + div button:nth-of-type({k + 1}) "
        f"{{ background: {back}; color: {text}; border-color: {back}; }}"
        for k, (back, text) in enumerate(colors)
    ]
    return f"<style>{''.join(rules)}</style>{marker(name)}"
