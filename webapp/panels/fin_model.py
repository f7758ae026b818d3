"""What the selected fins are known by: a formula with its numbers, or a table fitted to measurements."""

import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

import numpy as np
import viser

from finlab.actuators.fin.table import TableLaw
from finlab.arrays import Array
from finlab.errors import DataError, FinlabError
from finlab.layout import Fin, Layout
from finlab.layout.fin import FIN_MODELS, FinModelSpec, Limits
from finlab.layout.force_table_file import DOUBT
from finlab.physics import make_law
from webapp.markup.html import html
from webapp.markup.plot import Plot, cost_axis, positive
from webapp.page import Page
from webapp.session.actuator_edits import FORMULAS
from webapp.session.actuator_edits import words as key_words
from webapp.tasks.fitting import MAX_BYTES, Fitted
from webapp.theme import BLUE, GREEN, ORANGE

BEYOND = 0.01
"""Amplitude [rad] or frequency [Hz] by which limits may lie beyond a table without a word."""
LAWS = {
    "drag": "a stiff blade in quasi-steady drag (U-CAT's own law)",
    "lighthill": "a fin after Lighthill's elongated-body theory",
    "soft": "a soft fin that saturates, then declines",
}
HEIGHT = 150
"""Height of the plot [px]."""
SHARES, COLORS = (1.0, 2 / 3, 1 / 3), (ORANGE, GREEN, BLUE)
"""Of the largest amplitude, and the colours of their curves."""
POINTS = 41
CSV = ".csv,.txt"


def add_fin_model(page: Page, fin_of: Callable[[str | None, Layout], Fin]) -> None:
    """Widgets of one folder; `fin_of` gives the fin that they are about."""
    session, gui, board, fitting = page.session, page.gui, page.board, page.jobs.fitting

    def upload(name: str, content: bytes) -> None:
        if session.selected is None:
            raise FinlabError("no fin is selected; click the one that was measured, or choose it in the list")
        session.state.layout.only_fins("a fit in the app", horizontal=True)
        fitting.start(session.selected, name, content)
        session.show_task("Design")

    def kind_of(selected: str | None, layout: Layout) -> str:
        return fin_of(selected, layout).model.type

    def options(selected: str | None, layout: Layout) -> tuple[str, ...]:
        kind = kind_of(selected, layout)
        return (*FORMULAS, kind) if kind not in FORMULAS else FORMULAS

    def words(selected: str | None, layout: Layout, fitted: Fitted | None) -> str:
        fin = fin_of(selected, layout)
        return model_card(fin, doubts=fitted is None or fitted.model != fin.model)

    def add_number(kind: str, key: str, rule: Any) -> None:
        """A box for a number of a model, shown while the fin has that model."""

        def value(selected: str | None, layout: Layout) -> float:
            model = fin_of(selected, layout).model
            return float(model.values()[key]) if model.type == kind else rule.default

        unit = f" [{rule.unit}]".replace("^2", "²").replace("^3", "³") if rule.unit else ""
        hint = f"{rule.meaning[0].upper()}{rule.meaning[1:]}. Usual: {rule.default:g}."
        label, step = f"{key_words(key)}{unit}", (abs(rule.default) or 1.0) / 20
        handle = gui.add_number(label, rule.default, step=step, hint=hint, visible=False)
        page.bind_number(handle, partial(session.set_value, key), value)
        board.show(handle, visible=lambda selected, layout: kind_of(selected, layout) == kind)

    with gui.add_folder("Fin model"):
        about = "The formula that gives the fin's force; a table comes from a file, below."
        kinds = board.show(gui.add_dropdown("Model", FORMULAS, hint=about), options=options)
        page.bind(kinds, session.choose_model, kind_of)
        page.add_html(words)
        for kind in FORMULAS:
            for key, rule in FIN_MODELS[kind].items():
                add_number(kind, key, rule)
        page.add_html(lambda selected, layout: thrust_curves(fin_of(selected, layout)))
        page.opening.add(CSV, upload)
        about = "For the selected fin: noisy rows of A, f, phi, Fx, Fy, Fz, or a finished force table."
        button = page.add_upload(
            "Fit from measurements (CSV)",
            upload,
            icon=viser.Icon.UPLOAD,
            mime_type=CSV,
            hint=f"{about} Up to {MAX_BYTES // 1_000_000} MB.",
        )
        board.show(button, disabled=lambda selected, fitting: selected is None or fitting is not None)
        bar = gui.add_progress_bar(100.0, animated=True, visible=False)
        hint = "The fin stays as it is."
        cancel = page.add_button("Cancel", fitting.forget, icon=viser.Icon.X, visible=False, hint=hint)
        for handle in (bar, cancel):
            board.show(handle, visible=lambda fitting: fitting is not None)
        page.add_html(_written)
        results = {"On all like it": fitting.put_on_all, "Close": fitting.forget}
        hint = "All fins that had the same model. Undo takes a fit back."
        buttons = page.add_buttons("Fit", results, visible=False, hint=hint)
        board.show(buttons, visible=lambda fitted: fitted is not None)


def _written(fitted: Fitted | None, fitting: str | None, fitted_error: str | None) -> str:
    if fitting is not None:
        return html("<div class='fl dim'>{} …</div>", fitting)
    if fitted_error is not None:
        return html("<div class='fl'><div class='said missing'>{}</div></div>", fitted_error)
    if fitted is None:
        return ""
    from webapp.markup.fit_card import fit_card  # scipy comes with it

    return fit_card(fitted)


def model_card(fin: Fin, doubts: bool = True) -> str:
    """The model of a fin; without `doubts` where they stand elsewhere already."""
    words = _table_words(fin, doubts) if fin.model.type == "table" else _law_words(fin.model)
    return html("<div class='fl'>{}</div>", words)


def _law_words(model: FinModelSpec) -> str:
    said = LAWS[model.type]
    return html("<div class='dim'>{}{}.</div>", said[0].upper(), said[1:])


def _table_words(fin: Fin, doubts: bool) -> str:
    try:
        law = make_law(fin.model)
    except DataError as error:
        return html("<b>table</b>: <span class='missing'>{}</span>", str(error))
    assert isinstance(law, TableLaw)
    (low_a, high_a), (low_f, high_f), (low_d, high_d) = law.covers
    turn = "all round" if law.periodic else f"from {math.degrees(low_d):.0f}° to {math.degrees(high_d):.0f}°"
    covers = f"A {low_a:.2f} to {high_a:.2f} rad, f {low_f:.2f} to {high_f:.2f} Hz, {turn}"
    power = "with the power that was measured" if law.has_power else "power as of U-CAT's fin"
    doubt = next((note for note in law.notes if note.startswith(DOUBT)), None)
    said = "" if doubt is None or not doubts else html("<div class='missing'>This fin is {}.</div>", doubt)
    if fin.limits.amplitude[1] > high_a + BEYOND or fin.limits.frequency[1] > high_f + BEYOND:
        most_a, most_f = fin.limits.amplitude[1], fin.limits.frequency[1]
        said += html(
            "<div class='missing'>The fin may be asked for {:.2f} rad and {:.2f} Hz: beyond "
            "what was measured the force counts as at the edge.</div>",
            most_a,
            most_f,
        )
    fitted = next((note for note in law.notes if note.startswith("fitted to ")), None)
    origin = f", {fitted.split(',')[0]}" if fitted else " of forces"
    return html("<b>table</b>{}.{}<div class='dim'>{}; {}.</div>", origin, said, covers, power)


def thrust_curves(fin: Fin) -> str:
    """The plot of one fin; nothing where its table cannot be read, which is reported elsewhere."""
    try:
        amplitude, frequency, thrust = thrust_within(fin.model, fin.limits)
    except DataError:
        return ""
    across = cost_axis("frequency [Hz]", frequency)
    least = float(frequency[0])
    across = across._replace(low=least, ticks=tuple(tick for tick in across.ticks if tick[0] >= least))
    plot = Plot(across, positive("thrust [N]", np.array([1e-6, thrust.max()])), HEIGHT)
    parts = []
    for k, (size, curve, color) in enumerate(zip(amplitude, thrust, COLORS, strict=True)):
        parts += [plot.curve(frequency, curve, color), plot.key(104 * k, color, f"A {size:.2f} rad")]
    return html("<div class='fl'>{}</div>", plot.drawn(parts))


@lru_cache(maxsize=64)
def thrust_within(model: FinModelSpec, limits: Limits) -> tuple[Array, Array, Array]:
    """Amplitudes (3,) [rad], frequencies (F,) [Hz], and the size of the mean force (3, F) [N] in the middle
    of the zero directions.

    Raises:
        DataError: the fin is a table that cannot be read.
    """
    amplitude = np.array(SHARES) * limits.amplitude[1]
    frequency = np.linspace(*limits.frequency, POINTS)
    command = np.zeros((len(SHARES), POINTS, 1, 3))
    command[..., 0, 0], command[..., 0, 1] = amplitude[:, None], frequency
    command[..., 0, 2] = np.mean(limits.zero_direction)
    force = make_law(model).force(command)
    return amplitude, frequency, np.linalg.norm(force[..., 0, :], axis=-1)
