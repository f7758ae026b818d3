"""Damage of actuators: a button for each one that may be lost, and sliders for partial faults."""

import math
from collections.abc import Callable, Sequence
from functools import partial, wraps
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.layout import Actuator, Fin, Layout
from finlab.layout.damage import Damage
from webapp.markup.words import button_colors
from webapp.page import Page
from webapp.session.state import STRENGTH_RANGE
from webapp.theme import DEAD, css, fin_color, ink

Row = tuple[Sequence[str], Sequence[str], Sequence[str]]
"""Names of actuators, and of those of them that are lost, and that are held."""
DEGREE = 180.0 / math.pi


def add_fin_buttons(
    page: Page,
    label: str,
    hint: str,
    marker: str,
    act: Callable[[str], object],
    row: Callable[..., Row],
) -> None:
    """A row of numbers, one per actuator, that carry out `act(name)`; `row` is made of facts."""
    names: Sequence[str] = ()

    @wraps(row)
    def paint(*facts: object) -> str:
        nonlocal names
        names, lost, held = row(*facts)
        colors = []
        for k, name in enumerate(names):
            color = css(fin_color(k)), ink(fin_color(k))
            kinds = {name in lost: (css(DEAD), "#fff"), name in held: ("transparent", "inherit")}
            colors.append(kinds.get(True, color))
        return button_colors(marker, colors)

    @wraps(row)
    def options(*facts: object) -> tuple[str, ...]:
        known, lost, _ = row(*facts)
        return tuple([f"{k + 1} ✕" if name in lost else f"{k + 1}" for k, name in enumerate(known)])

    def pressed(button: str) -> None:
        numbers = {str(k + 1): name for k, name in enumerate(names)}
        if (number := button.split(" ")[0]) in numbers:  # a page may send anything
            act(numbers[number])

    page.add_html(paint)
    buttons = page.gui.add_button_group(label, ("1",), hint=hint)
    page.board.show(buttons, options=options)
    page.on_change(buttons, pressed)


def add_damage(page: Page) -> None:
    """What is wrong with the selected actuator, or the first: every fault that its type may
    have."""
    session = page.session
    gui = page.gui
    board = page.board

    def part() -> Actuator:
        return _part(session.selected, session.state.layout)

    def at_now() -> Array:
        """Where that actuator is [command]: the middle of its limits where nothing is known of
        it."""
        now = page.shown
        own = part()
        index = session.state.layout.index(own.name)
        known = now is not None and now.layout.names == session.state.layout.names
        command = now.command[index] if now is not None and known else np.full(3, np.nan)
        return np.where(np.isfinite(command), command, 0.5 * np.add(own.lower, own.upper))

    def damage(kind: str, value: Any) -> None:
        session.damage(part().name, kind, value)

    def leave(kind: str, percent: float) -> None:
        damage(kind, percent / 100.0)

    def held_now() -> list[float]:
        """The command of that actuator, its angle within a turn."""
        own = part()
        command = [float(value) for value in at_now()[: len(own.KIND.numbers)]]
        if own.KIND.sticks_at_angle:
            command[own.KIND.stuck_number] = math.remainder(
                command[own.KIND.stuck_number], math.tau
            )
        return command

    def jam(stuck: bool) -> None:
        damage("stuck", held_now()[part().KIND.stuck_number] if stuck else None)

    def run_on(running: bool) -> None:
        damage("running", tuple(held_now()) if running else None)

    about = "Also the one that is selected in the view."
    parts = gui.add_dropdown("Which", ("1",), hint=about)
    board.show(parts, options=lambda layout: layout.names)
    page.bind(parts, session.select, lambda selected, layout: _part(selected, layout).name)
    shares = {
        "weak": ("Strength [%]", "What is left of its limits: a worn motor gives less at most."),
        "torn": ("Force left [%]", "A torn fin or foil gives less at every command."),
    }
    least = 100 * STRENGTH_RANGE[0]
    for kind, (label, hint) in shares.items():
        slider = gui.add_slider(label, least, 100.0, 5.0, 100.0, hint=hint, visible=False)
        page.bind_number(slider, partial(leave, kind), _of(kind, 1.0, 100.0), digits=1)
        board.show(slider, visible=_may(kind))
    held = {
        "stuck": (
            "Stuck",
            "It no longer turns from where it is; a thruster hangs at its force.",
            jam,
        ),
        "running": ("Runs on", "It no longer listens: it keeps the command that it has.", run_on),
    }
    for kind, (label, hint, act) in held.items():
        box = gui.add_checkbox(label, False, hint=hint, visible=False)
        page.bind(box, act, _is(kind))
        board.show(box, visible=_may(kind))
    angle = gui.add_slider(
        "Stuck at [°]", -180.0, 180.0, 5.0, 0.0, hint="Where it stays.", visible=False
    )
    page.bind_number(
        angle, lambda at: damage("stuck", math.radians(at)), _of("stuck", 0.0, DEGREE), digits=1
    )
    board.show(angle, visible=_is("stuck", lambda own: own.KIND.sticks_at_angle))
    force = gui.add_number(
        "Hangs at [N]", 0.0, step=1.0, hint="The force that it keeps.", visible=False
    )
    page.bind_number(force, lambda at: damage("stuck", at), _of("stuck", 0.0, 1.0), digits=2)
    board.show(force, visible=_is("stuck", lambda own: not own.KIND.sticks_at_angle))
    kept = gui.add_vector3(
        "A [°], f [Hz], φ [°]",
        (0.0, 0.0, 0.0),
        step=0.5,
        hint="The command that it keeps.",
        visible=False,
    )
    page.bind_number(
        kept,
        lambda now: damage("running", (math.radians(now[0]), now[1], math.radians(now[2]))),
        _of("running", (0.0, 0.0, 0.0), (DEGREE, 1.0, DEGREE)),
        digits=2,
    )
    board.show(kept, visible=_is("running", lambda own: isinstance(own, Fin)))
    mends = {"This one": lambda: session.mend(part().name), "All": session.mend_all}
    page.add_buttons("Repair", mends, hint="Can be undone.")


def _part(selected: str | None, layout: Layout) -> Actuator:
    return layout.part(selected or layout.names[0])


def _may(kind: str) -> Callable[[str | None, Layout], bool]:
    """Whether the actuator may have a fault of a kind; the thrust of a table cannot be scaled."""

    def may(selected: str | None, layout: Layout) -> bool:
        return kind in _part(selected, layout).takes

    return may


def _is(
    kind: str, fits: Callable[[Actuator], bool] = lambda own: True
) -> Callable[[str | None, Layout, Damage], bool]:
    """Whether the actuator has a fault of a kind, and fits."""

    def has(selected: str | None, layout: Layout, damage: Damage) -> bool:
        own = _part(selected, layout)
        return kind in damage.of(own.name) and fits(own)

    return has


def _of(kind: str, full: Any, unit: Any) -> Callable[[str | None, Layout, Damage], Any]:
    """What is known of it, in units for people; `full` where it has no such fault."""

    def value(selected: str | None, layout: Layout, damage: Damage) -> Any:
        known = damage.of(_part(selected, layout).name).get(kind, full)
        if np.shape(known) != np.shape(full):  # the command of one that is no fin
            known = full
        scaled = np.multiply(known, unit)
        return tuple(scaled.tolist()) if scaled.ndim else float(scaled)

    return value
