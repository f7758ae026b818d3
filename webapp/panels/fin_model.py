"""What the selected fins are known by: a formula with its numbers, or a table fitted to measurements."""

from collections.abc import Callable
from functools import partial
from typing import Any

import viser

from finlab.errors import FinlabError
from finlab.layout import Fin, Layout
from finlab.layout.fin import FIN_MODELS
from webapp.markup.fin_model import model_card
from webapp.markup.html import html
from webapp.markup.thrust_curves import thrust_curves
from webapp.page import Page
from webapp.session.fin_edits import FORMULAS
from webapp.session.fin_edits import words as key_words
from webapp.tasks.fitting import MAX_BYTES, Fitted

CSV = ".csv,.txt"
"""How the names of files of measurements end."""


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
        page.bind_number(handle, partial(session.set_parameter, key), value)
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
