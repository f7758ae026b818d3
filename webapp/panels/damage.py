"""Which fins have failed, and what is wrong with the others: a button for each fin, and sliders."""

import math
from collections.abc import Callable, Sequence
from functools import partial, wraps

from finlab.layout import Layout
from finlab.layout.damage import Health
from webapp.handles import numbered
from webapp.markup.html import button_colors
from webapp.page import Page
from webapp.session.state import STRENGTH_RANGE
from webapp.theme import DEAD, css, fin_color, ink

Row = tuple[Sequence[str], Sequence[str], Sequence[str]]
"""Names of fins, and of those of them that have failed, and that are held."""


def add_fin_buttons(
    page: Page, label: str, hint: str, marker: str, act: Callable[[str], object], row: Callable[..., Row]
) -> None:
    """A row of numbers, one for each fin.

    Args:
        page: where it stands.
        label: what the numbers do.
        hint: the same at more length.
        marker: its name on the page.
        act: an intent about the fin of a name.
        row: which fins there are, as a function of facts.
    """
    names: Sequence[str] = ()

    @wraps(row)
    def paint(*facts: object) -> str:
        nonlocal names
        names, failed, held = row(*facts)
        colors = []
        for k, name in enumerate(names):
            color = css(fin_color(k)), ink(fin_color(k))
            kinds = {name in failed: (css(DEAD), "#fff"), name in held: ("transparent", "inherit")}
            colors.append(kinds.get(True, color))
        return button_colors(marker, colors)

    @wraps(row)
    def options(*facts: object) -> tuple[str, ...]:
        known, failed, _ = row(*facts)
        return tuple([f"{k + 1} ✕" if name in failed else f"{k + 1}" for k, name in enumerate(known)])

    def pressed(button: str) -> None:
        index = numbered(button, len(names))
        if index is not None:
            act(names[index])

    page.add_html(paint)
    buttons = page.gui.add_button_group(label, ("1",), hint=hint)
    page.board.show(buttons, options=options)
    page.on_change(buttons, pressed)


def add_damage(page: Page) -> None:
    """What is wrong with the selected fin, or the first."""
    session, gui = page.session, page.gui

    def name_of(selected: str | None, layout: Layout) -> str:
        return selected or layout.names[0]

    def name() -> str:
        return name_of(session.selected, session.state.layout)

    def stop(selected: str | None, layout: Layout, health: Health | None) -> float | None:
        """The zero direction [rad] at which that fin is stuck."""
        return None if health is None else dict(health.stuck).get(name_of(selected, layout))

    def strength(selected: str | None, layout: Layout, health: Health | None) -> float:
        return 100.0 if health is None else 100.0 * dict(health.weak).get(name_of(selected, layout), 1.0)

    def jam(stuck: bool, degrees: float) -> None:
        session.jam(name(), math.radians(degrees) if stuck else None)

    left = "What is left of its largest amplitude and frequency: a worn motor, a torn fin."
    about = "Also the one that is selected in the view."
    fins = gui.add_dropdown("Which fin", ("1",), hint=about)
    page.board.show(fins, options=lambda layout: layout.names)
    page.bind(fins, session.select, name_of)
    page.bind_number(
        gui.add_slider("Strength [%]", 100 * STRENGTH_RANGE[0], 100.0, 5.0, 100.0, hint=left),
        lambda share: session.weaken(name(), share / 100.0),
        strength,
        digits=1,
    )
    page.bind(
        gui.add_checkbox("Stuck", False, hint="It no longer turns: it flaps about one direction only."),
        lambda stuck: jam(stuck, 0.0),
        lambda selected, layout, health: stop(selected, layout, health) is not None,
    )
    stays = "Zero direction at which it stays."
    angle = page.bind_number(
        gui.add_slider("Stuck at [°]", -180.0, 180.0, 5.0, 0.0, hint=stays, visible=False),
        partial(jam, True),
        lambda selected, layout, health: math.degrees(stop(selected, layout, health) or 0.0),
        digits=1,
    )
    page.board.show(
        angle, visible=lambda selected, layout, health: stop(selected, layout, health) is not None
    )
    mends = {"This fin": lambda: session.mend(name()), "All fins": session.mend_all}
    page.add_buttons("Repair", mends, hint="Repairs the fin; can be undone.")
