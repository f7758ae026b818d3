"""The null space of an answer: a slider for each direction of it, what comes of them, and the mean
of two."""

import math
from functools import partial

import viser

from finlab.physics.objective import REACHED
from webapp.handles import add_html, set_properties
from webapp.markup.words import html, marker, three_digits
from webapp.page import Page
from webapp.panels.modes_tab import add_saving, mode_table
from webapp.tasks.null_space_modes import MOST
from webapp.tasks.solver import Modes, NullSpaceDirections
from webapp.viser_internals import slider_marks

ABOUT = "Each slider changes forces and leaves the wrench as it is. Its dot is the answer."
ALONE = "Each wrench has one set of forces here: the null space is empty."
WRONG = (
    "Both commands give the wrench, and their average does not: a model with one answer would "
    "learn that."
)
RIGHT = "The average gives the wrench, too: these commands are in proportion to forces."


def add_null_space(page: Page) -> None:
    """Sliders, and a table of the ways."""
    page.add_html(_sentence)
    add_html(page.gui, marker("fl-reach"))
    sliders = [_add_slider(page, k) for k in range(MOST)]

    def set_ranges(modes: Modes, shifts: tuple[float, ...]) -> None:
        space = modes.null_space
        for k, slider in enumerate(sliders):
            is_listed = space is not None and k < len(space.names)
            set_properties(slider, visible=is_listed)
            if space is None or not is_listed:
                continue
            low, high = space.ranges[k]
            step = 10.0 ** math.floor(math.log10(max(high - low, 1e-3)) - 2.5)
            low = math.ceil(low / step) * step
            high = math.floor(high / step) * step
            value = shifts[k] if k < len(shifts) else 0.0
            ends = {"max": max(high, value, step), "min": min(low, value, -step)}
            # The ends say how far; the dot between them is the answer.
            marks = slider_marks((low, three_digits(low)), (0.0, ""), (high, three_digits(high)))
            ends_words = f"From {three_digits(low)} to {three_digits(high)} N"
            set_properties(
                slider,
                label=f"{k + 1}: {space.names[k]} [N]",
                hint=f"{ends_words}, as far as {_limits_words(space)}. Shares: {space.about[k]}.",
                step=step,
                _marks=marks,
                **ends,
            )
            set_properties(slider, value=round(value, 6))

    page.board.act(set_ranges, *sliders)
    add_html(page.gui, marker("fl-column"))
    page.add_html(mode_table)
    page.add_html(_mean_words)
    add_saving(page)


def _add_slider(page: Page, direction: int) -> viser.GuiSliderHandle[float]:
    slider = page.gui.add_slider(
        f"{direction + 1} [N]", -1.0, 1.0, 0.01, 0.0, marks=((0.0, ""),), visible=False
    )
    slider.precision = 3
    page.on_change(slider, partial(page.session.shift, direction))
    return slider


def _sentence(modes: Modes) -> str:
    space = modes.null_space
    if space is None:
        return ""
    sentence = f"{ABOUT} {space.more} more directions are not shown." if space.more else ABOUT
    if space.has_budget:
        sentence += " They end where the power budget does."
    return html("<div class='fl dim'>{}</div>", sentence if space.names else ALONE)


def _limits_words(space: NullSpaceDirections) -> str:
    """Up to where forces go along the directions."""
    words = "every actuator has a command"
    return f"{words}, and the power budget allows it" if space.has_budget else words


def _mean_words(modes: Modes) -> str:
    if modes.null_space is None or len(modes.visible) < 3:
        return ""
    wrong = modes.visible[2].mode.err_norm > REACHED
    return html(
        "<div class='fl {}'>{}</div>", "missing" if wrong else "dim", WRONG if wrong else RIGHT
    )
