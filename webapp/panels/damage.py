"""Damage of actuators: a button for each one that may be lost, and sliders of partial faults.

The faults are a section of the left column (`panels/arrangement.py`); the tabs of the wrench, of
limits and of swims have rows of buttons.
"""

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
"""Degrees in a radian."""
SHARES = {
    "weak": ("Strength [%]", "What is left of its limits: a worn motor gives less at most."),
    "torn": ("Force left [%]", "A torn fin or foil gives less at every command."),
}
"""Faults that leave a share of an actuator -> label and hint of their slider."""
KEPT_COMMANDS = {
    "stuck": ("Stuck", "It no longer turns from where it is; a thruster hangs at its force."),
    "running": ("Runs on", "It no longer listens: it keeps the command that it has."),
}
"""Faults that keep a command of an actuator -> label and hint of their switch."""
LOST_COLORS = (css(DEAD), ink(DEAD))
"""Background and text of the button of a lost actuator."""
HELD_COLORS = ("transparent", "inherit")
"""Background and text of the button of an actuator that is held."""


def add_fin_buttons(
    page: Page,
    label: str,
    hint: str,
    marker: str,
    act: Callable[[str], object],
    row: Callable[..., Row],
) -> None:
    """A row of numbers, one per actuator.

    Args:
        page: the page that gets it.
        label: what stands before the row.
        hint: what the page says when the pointer rests on it.
        marker: style class by which the buttons get their colours.
        act: carried out with the name of an actuator whose number was pressed.
        row: makes the row of facts, which its parameters name.
    """
    names: Sequence[str] = ()

    @wraps(row)
    def paint(*facts: object) -> str:
        nonlocal names
        names, lost, held = row(*facts)
        colors = []
        for k, name in enumerate(names):
            if name in held:
                colors.append(HELD_COLORS)
            elif name in lost:
                colors.append(LOST_COLORS)
            else:
                colors.append((css(fin_color(k)), ink(fin_color(k))))
        return button_colors(marker, colors)

    @wraps(row)
    def options(*facts: object) -> tuple[str, ...]:
        present, lost, _ = row(*facts)
        return tuple(
            [f"{k + 1} ✕" if name in lost else f"{k + 1}" for k, name in enumerate(present)]
        )

    def pressed(button: str) -> None:
        numbers = {str(k + 1): name for k, name in enumerate(names)}
        number = button.split(" ")[0]
        if number in numbers:  # a page may send anything
            act(numbers[number])

    page.add_html(paint)
    buttons = page.gui.add_button_group(label, ("1",), hint=hint)
    page.board.show(buttons, options=options)
    page.on_change(buttons, pressed)


def add_damage(page: Page) -> None:
    """What is wrong with the selected actuator, or the first: every fault that its type may
    have."""
    faults = _Faults(page)
    session = page.session
    choice = page.gui.add_dropdown(
        "Which", ("1",), hint="Also the one that is selected in the view."
    )
    page.board.show(choice, options=lambda layout: layout.names)
    page.bind(choice, session.select, lambda selected, layout: _actuator(selected, layout).name)
    _add_shares(page, faults)
    _add_switches(page, faults)
    _add_stuck_value(page, faults)
    _add_running_command(page, faults)
    mends = {"This one": faults.mend, "All": session.mend_all}
    page.add_buttons("Repair", mends, hint="Can be undone.")


class _Faults:
    """What is done to the actuator that the panel is about."""

    def __init__(self, page: Page) -> None:
        self._page = page

    @property
    def actuator(self) -> Actuator:
        """The selected actuator, or the first."""
        session = self._page.session
        return _actuator(session.selected, session.state.layout)

    def command(self) -> list[float]:
        """The numbers of that actuator's command, its angle within a turn [rad]: the middle of its
        limits where no answer says what it does."""
        actuator = self.actuator
        layout = self._page.session.state.layout
        allocation = self._page.shown_allocation
        command: Array = np.full(3, np.nan)
        if allocation is not None and allocation.layout.names == layout.names:
            command = allocation.command[layout.index(actuator.name)]
        middle = 0.5 * np.add(actuator.lower, actuator.upper)
        command = np.where(np.isfinite(command), command, middle)
        numbers = [float(value) for value in command[: len(actuator.KIND.numbers)]]
        if actuator.KIND.sticks_at_angle:
            angle = numbers[actuator.KIND.stuck_number]
            numbers[actuator.KIND.stuck_number] = math.remainder(angle, math.tau)
        return numbers

    def set(self, kind: str, value: Any) -> None:
        """A fault of a kind, see `Damage`; None mends it."""
        self._page.session.damage(self.actuator.name, kind, value)

    def leave(self, kind: str, percent: float) -> None:
        """A fault that leaves a share of the actuator."""
        self.set(kind, percent / 100.0)

    def jam(self, is_stuck: bool) -> None:
        """It no longer turns from where it is, or hangs at its force."""
        self.set("stuck", self.command()[self.actuator.KIND.stuck_number] if is_stuck else None)

    def run_on(self, is_running: bool) -> None:
        """It keeps the command that it has."""
        self.set("running", tuple(self.command()) if is_running else None)

    def run_on_with(self, command: tuple[float, float, float]) -> None:
        """A fin keeps a command: half amplitude [deg], frequency [Hz] and direction [deg]."""
        amplitude, frequency, direction = command
        self.set("running", (math.radians(amplitude), frequency, math.radians(direction)))

    def mend(self) -> None:
        """It is whole again."""
        self._page.session.mend(self.actuator.name)


def _add_shares(page: Page, faults: _Faults) -> None:
    """Sliders of what is left of an actuator [%]."""
    lowest_percent = 100 * STRENGTH_RANGE[0]
    for kind, (label, hint) in SHARES.items():
        slider = page.gui.add_slider(
            label, lowest_percent, 100.0, 5.0, 100.0, hint=hint, visible=False
        )
        page.bind_number(slider, partial(faults.leave, kind), _fault(kind, 1.0, 100.0), digits=1)
        page.board.show(slider, visible=_may_have(kind))


def _add_switches(page: Page, faults: _Faults) -> None:
    """Switches of faults that keep a command."""
    acts: dict[str, Callable[[bool], object]] = {"stuck": faults.jam, "running": faults.run_on}
    for kind, (label, hint) in KEPT_COMMANDS.items():
        switch = page.gui.add_checkbox(label, False, hint=hint, visible=False)
        page.bind(switch, acts[kind], _has(kind))
        page.board.show(switch, visible=_may_have(kind))


def _add_stuck_value(page: Page, faults: _Faults) -> None:
    """The angle or the force at which an actuator is stuck."""
    angle = page.gui.add_slider(
        "Stuck at [°]", -180.0, 180.0, 5.0, 0.0, hint="Where it stays.", visible=False
    )
    page.bind_number(
        angle,
        lambda degrees: faults.set("stuck", math.radians(degrees)),
        _fault("stuck", 0.0, DEGREE),
        digits=1,
    )
    page.board.show(angle, visible=_has("stuck", lambda actuator: actuator.KIND.sticks_at_angle))
    force = page.gui.add_number(
        "Hangs at [N]", 0.0, step=1.0, hint="The force that it keeps.", visible=False
    )
    page.bind_number(force, partial(faults.set, "stuck"), _fault("stuck", 0.0, 1.0), digits=2)
    page.board.show(
        force, visible=_has("stuck", lambda actuator: not actuator.KIND.sticks_at_angle)
    )


def _add_running_command(page: Page, faults: _Faults) -> None:
    """The command that a fin keeps."""
    command = page.gui.add_vector3(
        "A [°], f [Hz], φ [°]",
        (0.0, 0.0, 0.0),
        step=0.5,
        hint="The command that it keeps.",
        visible=False,
    )
    page.bind_number(
        command,
        faults.run_on_with,
        _fault("running", (0.0, 0.0, 0.0), (DEGREE, 1.0, DEGREE)),
        digits=2,
    )
    page.board.show(command, visible=_has("running", lambda actuator: isinstance(actuator, Fin)))


def _actuator(selected: str | None, layout: Layout) -> Actuator:
    """The actuator that the panel is about: the selected one, or the first."""
    return layout.actuator(selected or layout.names[0])


def _may_have(kind: str) -> Callable[[str | None, Layout], bool]:
    """Whether the actuator may have a fault of a kind; the thrust of a table cannot be scaled."""

    def may_have(selected: str | None, layout: Layout) -> bool:
        return kind in _actuator(selected, layout).takes

    return may_have


def _has(
    kind: str, matches: Callable[[Actuator], bool] = lambda actuator: True
) -> Callable[[str | None, Layout, Damage], bool]:
    """Whether the actuator has a fault of a kind, and is one that `matches`."""

    def has(selected: str | None, layout: Layout, damage: Damage) -> bool:
        actuator = _actuator(selected, layout)
        return kind in damage.faults_of(actuator.name) and matches(actuator)

    return has


def _fault(kind: str, default: Any, unit: Any) -> Callable[[str | None, Layout, Damage], Any]:
    """The value of the actuator's fault.

    Args:
        kind: of the fault.
        default: value [SI] that is shown of an actuator without such a fault.
        unit: factor from SI to the unit of the widget; one for each number.
    """

    def value(selected: str | None, layout: Layout, damage: Damage) -> Any:
        fault = damage.faults_of(_actuator(selected, layout).name).get(kind, default)
        if np.shape(fault) != np.shape(default):  # the command of an actuator that is no fin
            fault = default
        scaled = np.multiply(fault, unit)
        return tuple(scaled.tolist()) if scaled.ndim else float(scaled)

    return value
