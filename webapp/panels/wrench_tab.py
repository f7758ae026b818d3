"""The question and its answer: the target wrench, bars, losses, commands, and what jets
change."""

import math
import operator
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import viser
from markupsafe import Markup

from finlab.allocation.allocation import Allocation
from finlab.allocation.policy import POLICY_NAMES
from finlab.allocation.report import missing_words
from finlab.axes import AXES, MOTIONS, UNITS
from finlab.display import listed
from finlab.forces.reach import Ranges
from finlab.forces.within_budget import leaves_budget_out
from finlab.layout import Layout
from webapp.handles import add_html, placed, press
from webapp.markup.answer import bars_of, fin_table
from webapp.markup.reach import reach_style
from webapp.markup.verdict import answer_sentence
from webapp.markup.words import (
    POWER,
    ROUNDING,
    SPEED,
    error_digits,
    html,
    marker,
    row,
    three_digits,
    with_unit,
)
from webapp.page import Page
from webapp.panels.damage import add_fin_buttons
from webapp.session.state import MAX_SPEED, Flow, State
from webapp.session.targets import (
    PRESETS,
    axis_reach,
    full_thrust,
    lone_reach,
    nudge,
    slider_end,
    widened_end,
)
from webapp.tasks.solver import JetComparison

MOST_BUSES = 6
"""Buses with a box of their own; ships have two to four."""
DIGITS = 4
"""Digits behind the point that sliders of the wrench show."""


class Memoized:
    """A function whose last result is kept while its arguments are the same objects: a page asks
    for the same markup whenever it is written."""

    def __init__(self, function: Callable[..., Any]) -> None:
        """Wraps a function that has not been called yet."""
        self._function = function
        self._arguments: tuple[Any, ...] | None = None
        self._result: Any = None

    def __call__(self, *arguments: Any) -> Any:
        """The result for these arguments, from the last call where they are the same objects."""
        if self._arguments is None or not all(map(operator.is_, arguments, self._arguments)):
            self._result = self._function(*arguments)
            self._arguments = arguments
        return self._result


def add_commands(page: Page) -> None:
    """What each actuator does, and which are lost."""
    hint = "Press a number to fail or repair it; X does it to the selected one."
    add_fin_buttons(
        page,
        "Fail",
        hint,
        "fl-losses",
        page.session.toggle_loss,
        lambda layout, lost: (layout.names, lost, ()),
    )
    page.add_html(
        lambda layout, damage, able, shown_allocation, selected, flow: fin_table(
            layout, damage, shown_allocation, full_thrust(able, flow), selected
        )
    )


class Tracks:
    """The tracks of the six sliders: how far they go, and in which steps."""

    def __init__(self, sliders: Sequence[Any]) -> None:
        """`sliders` are those of the six axes, in order."""
        self._sliders = sliders
        self._ends = [1.0] * 6
        """Where the tracks end by the robot's reach [N, N m]."""
        self.limits = [0.0] * 6
        """Where they end [N, N m]."""

    def follow_robot(self, able: Layout, lost: tuple[str, ...], flow: Flow | None) -> None:
        """Let the tracks be as long as the robot reaches, and their steps fit that."""
        sizes = lone_reach(able, lost, flow).tolist()
        self._ends = [slider_end(size) for size in sizes]
        for slider, size in zip(self._sliders, sizes, strict=True):
            step = nudge(size)
            if slider.step != step:
                slider.step = step

    def show_target(
        self, target: tuple[float, ...], able: Layout, lost: tuple[str, ...], flow: Flow | None
    ) -> None:
        """Show the target; first the ends: a value beyond them would not be shown."""
        for axis, slider in enumerate(self._sliders):
            rounded = round(target[axis], DIGITS) + 0.0
            limit = self._ends[axis]
            if abs(rounded) > limit:
                limit = widened_end(limit, rounded)
            if limit != self.limits[axis]:
                self.limits[axis] = slider.max = limit
                slider.min = -limit
            # What the page has sent may have more digits, of which it shows no other ones.
            if round(slider.value, DIGITS) != rounded:
                slider.value = rounded


def add_target(page: Page) -> None:
    """Buttons and sliders."""
    session = page.session
    gui = page.gui
    board = page.board
    presets = gui.add_button_group("Preset", tuple(PRESETS), hint="Target wrenches to start from.")
    page.on_change(presets, session.set_preset)
    add_html(gui, marker("fl-reach"))
    page.presses.on("axis", lambda key, _modifier: session.toggle_axis(placed(key, 6)))
    sliders: list[Any] = [_add_slider(page, k) for k in range(6)]
    tracks = Tracks(sliders)
    board.act(tracks.follow_robot)
    board.act(tracks.show_target, *sliders)
    style = Memoized(reach_style)
    hinted: Any = None

    def mark(ranges: Ranges | None, able: Layout, target: Any) -> Markup:
        """Show what is within reach on the sliders: the marks of all are one message."""
        del target  # it may have moved the ends
        markup: Markup = style(ranges, able, *tracks.limits)
        return markup

    def hint(ranges: Ranges | None, able: Layout, lost: tuple[str, ...], flow: Flow | None) -> None:
        """Say what the marks are; they change more often than that."""
        nonlocal hinted
        if ranges is None:
            return
        hints = able, lost, flow, np.isfinite(ranges.low).tolist()
        if hints == hinted:
            return
        axis_reaches = axis_reach(able, lost, flow)  # with the others free
        for k, slider in enumerate(sliders):
            if able.commanded[k]:
                slider.hint = _hint(k, ranges.low[k], axis_reaches[k])
            else:
                slider.hint = MOTIONS[k].capitalize()
        hinted = hints

    page.add_html(mark)
    board.act(hint)
    page.add_html(_ranges_error)
    policies = (
        "Come closest, keep the direction, serve axes by priority, heave first, or give no axis "
        "more than was asked for. Another robot begins with closest."
    )
    box = gui.add_dropdown("Out of reach", POLICY_NAMES, hint=policies)
    page.bind(box, partial(session.set_setting, "policy"), lambda policy: policy)
    _add_budgets(page)


def _add_budgets(page: Page) -> None:
    """Boxes of the power that actuators may take: of all, or of those of each bus."""
    gui = page.gui
    hint = (
        "The most that all actuators may take together, which method dual keeps; empty: no limit."
    )
    total = gui.add_number(POWER, 0.0, step=10.0, hint=hint)
    page.bind_number(total, page.session.set_power, _budget_of_all, may_be_empty=True)
    page.board.show(total, visible=lambda layout: not layout.buses)
    for place in range(MOST_BUSES):
        box = gui.add_number("Bus", 0.0, step=10.0, hint="Empty: no limit, and no such bus.")
        act = partial(page.session.set_bus_power, place)
        page.bind_number(box, act, partial(_budget_of_bus, place), may_be_empty=True)
        page.board.show(
            box,
            visible=lambda layout, place=place: place < len(layout.buses),
            label=partial(_bus_label, place),
            hint=partial(_bus_hint, place),
        )
    page.add_html(_budget_notes)


def _budget_of_all(layout: Layout) -> float:
    """The power that all actuators may take together [W]; NaN, an empty box, where there is no
    limit."""
    return math.nan if layout.power_w is None else layout.power_w


def _budget_of_bus(place: int, layout: Layout) -> float:
    """The power that the actuators of a bus may take [W]; NaN where there is no such bus."""
    return layout.buses[place].power_w if place < len(layout.buses) else math.nan


def _bus_label(place: int, layout: Layout) -> str:
    """Label of the box of a bus."""
    return f"Bus {layout.buses[place].name} [W]" if place < len(layout.buses) else "Bus"


def _bus_hint(place: int, layout: Layout) -> str:
    """What a bus feeds."""
    if place >= len(layout.buses):
        return ""
    fed = listed(layout.buses[place].actuators)
    return f"The most that {fed} may take together; empty: no limit, and no such bus."


def _budget_notes(layout: Layout, flow: Flow | None) -> str:
    """What is said of buses that have no box, and of what no budget counts in."""
    notes = []
    n_more = len(layout.buses) - MOST_BUSES
    if n_more > 0:
        notes.append(f"{n_more} more buses keep the budgets of their file.")
    if leaves_budget_out(layout, flow):
        notes.append("Marks and ends of sliders leave the budget out: the flow drives actuators.")
    return html("<div class='fl dim'>{}</div>", " ".join(notes)) if notes else ""


def add_speed(page: Page) -> None:
    """How fast the robot moves, and what gives nothing at rest."""
    hint = "How fast the robot moves ahead through the water, on which rudders depend."
    speed = page.gui.add_slider(SPEED, 0.0, MAX_SPEED, 0.05, 0.0, hint=hint)
    page.bind_number(speed, page.session.set_speed, lambda state: state.speed, digits=2)
    page.add_html(_at_rest)


def _add_slider(page: Page, axis: int) -> viser.GuiSliderHandle[float]:
    session = page.session
    step = 0.01 if axis < 3 else 0.001
    label = f"{AXES[axis]} [{UNITS[axis]}]"
    hint = MOTIONS[axis].capitalize()
    page.add_html(lambda layout: _switch(axis, bool(layout.commanded[axis])))
    slider = page.gui.add_slider(label, -10.0, 10.0, step, 0.0, hint=hint, marks=())
    page.board.show(slider, disabled=lambda layout: not layout.commanded[axis])
    slider.precision = DIGITS
    page.on_change(slider, partial(session.set_target, axis), widens=True)
    return slider


def _switch(axis: int, counts: bool) -> str:
    """Whether an axis counts; it lies beside the axis's slider."""
    does = (
        "counts: press to free it" if counts else "is free, takes what comes: press to command it"
    )
    return html(
        "<div class='fl-axis fl-axis-{}'><span role='switch' tabindex='0' aria-checked='{}' "
        "aria-label='{}' title='{}' {}></span></div>",
        axis,
        "true" if counts else "false",
        f"{AXES[axis]} counts",
        f"{AXES[axis]} {does}",
        press("axis", str(axis)),
    )


def _at_rest(layout: Layout, flow: Flow | None) -> str:
    rudders = layout.flow_driven
    if flow is not None or not rudders:
        return ""
    verb = "gives" if len(rudders) == 1 else "give"
    sentence = f"{listed(rudders)} {verb} nothing: no water flows past at rest"
    return html("<div class='fl missing'>{}.</div>", sentence)


def _ranges_error(ranges_error: str | None) -> str:
    """Why the sliders have no marks."""
    template = "<div class='fl missing'>What is in reach: {}</div>"
    return "" if ranges_error is None else html(template, ranges_error)


def _hint(axis: int, low: float, reach: float) -> str:
    word = MOTIONS[axis].capitalize()
    unit = UNITS[axis]
    if reach < ROUNDING:
        return f"{word}: no working actuator pushes along it."
    at_most = f"up to {with_unit(reach, unit)} if nothing else is asked to stay"
    if not np.isfinite(low):
        return f"{word}: the other five are out of reach as they are; {at_most}."
    return f"{word}: the marks show what is within reach with the others as they are; {at_most}."


def add_answer(page: Page) -> None:
    """What is asked, what the actuators give, and what is left undone; an answer to an earlier
    question stands beside what was asked then."""
    bars = Memoized(bars_of)

    def write(
        shown_allocation: Allocation | None,
        state: State,
        busy: bool,
        proving: bool,
        step: int | None,
    ) -> Markup:
        """Bars and words are one message; what is proved of an answer changes the words alone."""
        sentence = answer_sentence(state, shown_allocation, busy, proving or step is not None)
        words = "<div class='fl'><div class='said'>{}</div></div>"
        return Markup(
            bars(shown_allocation, state.target, state.layout, busy) + html(words, sentence)
        )

    page.add_html(write)


JETS_HEADER = Markup(
    "<tr><th></th><th title='the answer, which counts jets'>with jets</th>"
    "<th title='commands by each own law alone, judged with jets'>without</th></tr>"
)


def add_jets(page: Page) -> None:
    """The switch that lets jets count, and the answer beside that which leaves them out."""
    hint = "What the jets of thrusters and fins take from each other, and where they meet the hull."
    switch = page.gui.add_checkbox("Count jets", False, hint=hint)
    page.bind(switch, page.session.set_jets, lambda layout: layout.interaction is not None)
    page.add_html(jets_table)


def jets_table(jet_comparison: JetComparison | None) -> str:
    """What the answer misses and takes, and what that of the actuators' laws alone would."""
    if jet_comparison is None:
        return ""
    with_jets = jet_comparison.with_jets
    without_jets = jet_comparison.without_jets
    rows = [
        row("error", error_digits(with_jets.err_norm), error_digits(without_jets.err_norm)),
        row("power [W]", three_digits(with_jets.power), three_digits(without_jets.power)),
    ]
    template = "<div class='fl'><table>{}{}</table><div class='said'>Without: {}.</div></div>"
    return html(template, JETS_HEADER, rows, missing_words(without_jets))
