"""Clicks on the page's own markup: they press a button of a group, or send a word to the server."""

from collections.abc import Callable

import viser

from webapp.handles import on_user_change

MAX_LENGTH = 60
"""Longest word that is heard; pages may send anything."""


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


def open_box(
    gui: viser.GuiApi, name: str, hear: Callable[[str], None], longest: int
) -> viser.GuiInputHandle[str]:
    """A hidden text box behind a marker; `hear` gets each text that the page puts there, up to so long."""
    gui.add_html(f"<style>div:has(>.{name}) + div {{ display: none; }}</style>{marker(name)}")
    box = gui.add_text(name, "")
    on_user_change(box, lambda text: hear(text) if 0 < len(text) <= longest else None)
    return box


def add_channel(gui: viser.GuiApi, name: str, hear: Callable[[list[str]], None]) -> None:
    """A hidden box; `hear` gets the comma-separated parts of each word sent there."""
    open_box(gui, name, lambda word: hear(word.split(",")), MAX_LENGTH)


def send(name: str, word: str) -> str:
    """A line of script that sends `word`, an expression of script, through the channel.

    The box belongs to a framework that only notices what is set by the element's own setter.
    """
    return (
        f"const box = document.querySelector('div:has(>.{name}) + div input');"
        "Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set.call(box, "
        f"{word}); box.dispatchEvent(new Event('input', {{bubbles: true}}));"
    )
