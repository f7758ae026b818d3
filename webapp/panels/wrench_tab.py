"""The question and its answer: the target wrench, bars, failures, and the table of commands."""

from functools import partial

import numpy as np
import viser

from finlab.allocation.policy import AXES, KINDS
from webapp.handles import Changes, add_html, put
from webapp.markup.answer import fin_table
from webapp.markup.html import html
from webapp.markup.picking import marker
from webapp.markup.words import three_digits
from webapp.page import Page
from webapp.panels.damage import FinButtons
from webapp.session.state import AXIS_UNITS, AXIS_WORDS
from webapp.session.targets import PRESETS, axis_reach, full_thrust, slider_end
from webapp.viser_internals import put_marks

CLOSE = 0.28
"""Share of a slider below which the texts of two marks would lie on each other."""


class FinsPanel:
    """What each fin does, and which have failed."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        self._failures = FinButtons(
            page,
            "Fail",
            "Press a number to fail or repair it; X does it to the selected one.",
            "fl-fails",
            page.session.toggle_failure,
        )
        self._table = gui.add_html("")

    def refresh(self) -> None:
        state, answer = self._page.session.state, self._page.shown
        self._failures.refresh(state.layout.names, state.failed)
        fitting = answer if answer is not None and answer.layout.names == state.layout.names else None
        table = fin_table(state, fitting, full_thrust(state.able), self._page.session.selected)
        put(self._table, content=table)


class TargetPanel:
    """Buttons and sliders."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        presets = gui.add_button_group("Preset", tuple(PRESETS), hint="Target wrenches to start from.")
        page.on_change(presets, page.session.set_preset)
        add_html(gui, marker("fl-reach"))
        self._sliders = [self._add_slider(gui, k) for k in range(6)]
        self._end = add_html(gui, marker("fl-reach-end"))
        policies = "Come closest, keep the direction, or serve axes by priority, heave first."
        page.bind(
            gui.add_dropdown("Out of reach", KINDS, hint=policies),
            partial(page.session.set_setting, "policy"),
            lambda: page.session.state.policy,
        )
        self._changes = Changes()

    def _add_slider(self, gui: viser.GuiApi, axis: int) -> viser.GuiSliderHandle[float]:
        session, step = self._page.session, 0.01 if axis < 3 else 0.001
        label, hint = f"{AXES[axis]} [{AXIS_UNITS[axis]}]", AXIS_WORDS[axis].capitalize()
        return self._page.bind_number(
            gui.add_slider(label, -10.0, 10.0, step, 0.0, hint=hint),
            lambda value: session.set_target(axis, value),
            lambda: session.state.target[axis],
        )

    def refresh(self) -> None:
        state = self._page.session.state
        most = axis_reach(state.able, state.failed)  # with the others free
        for slider, value, reach in zip(self._sliders, state.target, most, strict=True):
            end = slider_end(float(reach))
            put(slider, min=min(-end, value), max=max(end, value))
        ranges, error = self._page.ranging.findings, self._page.ranging.error
        if not self._changes(ranges, error):
            return
        sentence = (
            ""
            if error is None or not state.layout.is_of_fins
            else html("<div class='fl missing'>What is in reach: {}</div>", error)
        )
        put(self._end, content=marker("fl-reach-end") + sentence)
        for k, slider in enumerate(self._sliders):
            if ranges is None:
                put_marks(slider, ())
                put(slider, hint=AXIS_WORDS[k].capitalize())
                continue
            low, high = float(ranges.low[k]), float(ranges.high[k])
            put_marks(slider, reach_marks(low, high, slider.max - slider.min))
            put(slider, hint=_hint(k, low, high, float(most[k])))


def reach_marks(low: float, high: float, width: float) -> tuple[tuple[float, str], ...]:
    """Both ends of a range, value and text, on a slider that is `width` long; one mark where it is a point,
    none where there is no range, and one text for both where two would lie on each other."""
    if not np.isfinite(low):
        return ()
    first, last = _short(low), _short(high)
    if high - low <= 1e-3:
        return ((round(low, 3), first),)
    if high - low < CLOSE * width:
        first, last = "", f"±{last}" if first == f"−{last}" else f"{first} … {last}"
    return (round(low, 3), first), (round(high, 3), last)


def _short(value: float) -> str:
    digits = 0 if abs(value) >= 9.95 else 1
    rounded = round(value, digits)
    return f"{rounded:.{digits}f}".replace("-", "−") if rounded else "0"


def _hint(axis: int, low: float, high: float, reach: float) -> str:
    word, unit = AXIS_WORDS[axis].capitalize(), AXIS_UNITS[axis]
    at_most = f"±{three_digits(reach)} {unit} if nothing else is asked to stay"
    if not np.isfinite(low):
        return f"{word}: the other five are out of reach as they are; {at_most}."
    ends = f"{three_digits(low)} to {three_digits(high)} {unit}"
    return f"{word}: the marks show {ends}, what is within reach with the others as they are; {at_most}."
