"""What the selected fins are known by: a formula with its numbers, or a table fitted to measurements."""

from functools import partial

import viser

from finlab.errors import FinlabError
from finlab.layout.fin import FIN_MODELS
from webapp.handles import Changes, put
from webapp.markup.fin_model import model_card
from webapp.markup.html import html
from webapp.markup.thrust_curves import thrust_curves
from webapp.page import Page
from webapp.session.fin_edits import FORMULAS, words
from webapp.tasks.fitting import MAX_BYTES, Fitted

CSV = ".csv,.txt"
"""How the names of files of measurements end."""


class FinModelPanel:
    """Widgets of one folder."""

    def __init__(self, gui: viser.GuiApi, page: Page) -> None:
        self._page = page
        self._numbers: dict[tuple[str, str], viser.GuiInputHandle[float]] = {}
        with gui.add_folder("Fin model"):
            about = "The formula that gives the fin's force; a table comes from a file, below."
            self._kind = gui.add_dropdown("Model", FORMULAS, hint=about)
            page.on_change(self._kind, page.session.choose_model)
            self._words = gui.add_html("")
            for kind in FORMULAS:
                self._add_numbers(gui, kind)
            self._curves = gui.add_html("")
            page.opening.add(CSV, self._upload)
            self._upload_button = page.add_upload(
                "Fit from measurements (CSV)",
                self._upload,
                icon=viser.Icon.UPLOAD,
                mime_type=CSV,
                hint=(
                    "For the selected fin: noisy rows of A, f, phi, Fx, Fy, Fz, or a finished "
                    f"force table. Up to {MAX_BYTES // 1_000_000} MB."
                ),
            )
            self._bar = gui.add_progress_bar(100.0, animated=True, visible=False)
            self._cancel = page.add_button(
                "Cancel",
                page.fitting.forget,
                icon=viser.Icon.X,
                visible=False,
                hint="The fin stays as it is.",
            )
            self._card = gui.add_html("")
            results = {
                "On all like it": page.fitting.put_on_all,
                "Close": page.fitting.forget,
            }
            self._results = page.add_buttons(
                "Fit", results, visible=False, hint="All fins that had the same model. Undo takes a fit back."
            )
        self._changes = Changes()

    def _add_numbers(self, gui: viser.GuiApi, kind: str) -> None:
        """A box for each number of a model, shown while the fin has that model."""
        for key, rule in FIN_MODELS[kind].items():
            unit = f" [{rule.unit}]".replace("^2", "²").replace("^3", "³") if rule.unit else ""
            hint = f"{rule.meaning[0].upper()}{rule.meaning[1:]}. Usual: {rule.default:g}."
            label, step = f"{words(key)}{unit}", (abs(rule.default) or 1.0) / 20
            handle = gui.add_number(label, rule.default, step=step, hint=hint, visible=False)
            self._page.bind_number(
                handle, partial(self._page.session.set_parameter, key), partial(self._value, kind, key)
            )
            self._numbers[kind, key] = handle

    def _value(self, kind: str, key: str) -> float:
        """A number of the selected fin's model; the usual one while it has another model."""
        session = self._page.session
        layout = session.state.layout
        if session.selected is not None:
            model = layout.fins[layout.index(session.selected)].model
            if model.type == kind:
                return float(model.values()[key])
        return FIN_MODELS[kind][key].default

    def _upload(self, name: str, content: bytes) -> None:
        session = self._page.session
        if session.selected is None:
            raise FinlabError("no fin is selected; click the one that was measured, or choose it in the list")
        session.state.layout.only_fins("a fit in the app", horizontal=True)
        self._page.fitting.start(session.selected, name, content)
        session.show_task("Design")

    def refresh(self) -> None:
        session, fitting = self._page.session, self._page.fitting
        layout = session.state.layout
        fin = None if session.selected is None else layout.fins[layout.index(session.selected)]
        if fin is not None:
            found, kind = fitting.findings, fin.model.type
            put(self._words, content=model_card(fin, doubts=found is None or found.model != fin.model))
            put(self._kind, options=(*FORMULAS, kind) if kind not in FORMULAS else FORMULAS, value=kind)
            put(self._curves, content=thrust_curves(fin))
        for (kind, _), handle in self._numbers.items():
            put(handle, visible=fin is not None and fin.model.type == kind)
        put(self._upload_button, disabled=session.selected is None or fitting.busy)
        put(self._bar, visible=fitting.busy)
        put(self._cancel, visible=fitting.busy)
        found = fitting.findings
        put(self._results, visible=found is not None)
        if self._changes(found, fitting.busy, fitting.progress, fitting.error):
            put(self._card, content=self._written(found))

    def _written(self, found: Fitted | None) -> str:
        fitting = self._page.fitting
        if fitting.busy:
            return html("<div class='fl dim'>{} …</div>", fitting.progress)
        if fitting.error is not None:
            return html("<div class='fl'><div class='said missing'>{}</div></div>", fitting.error)
        if found is None:
            return ""
        from webapp.markup.fit_card import fit_card  # scipy comes with it

        return fit_card(found)
