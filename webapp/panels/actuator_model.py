"""Editor of the selected actuators' force model: a formula with its numbers, or a table of
measurements."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import viser

from finlab.actuators.fin.fin_laws import PLANAR_LAWS
from finlab.actuators.fin.fin_model import DOUBT
from finlab.actuators.fin.table_law import TableLaw
from finlab.actuators.thrust_model import PowerTable
from finlab.arrays import Array
from finlab.errors import DataError, FinlabError
from finlab.layout import Actuator, Fin, Layout
from finlab.physics import make_law, plant_of
from webapp.markup.plot import Plot, exact_axis, positive
from webapp.markup.words import degrees, html, in_app
from webapp.page import Page
from webapp.tasks.fitting import MAX_BYTES, Fitted
from webapp.theme import BLUE, GREEN, ORANGE

BEYOND = 0.01
"""Amplitude [rad] or frequency [Hz] by which limits may lie beyond a table without a word."""
LAWS = {
    "drag": "a stiff blade in quasi-steady drag (U-CAT's own law)",
    "lighthill": "a fin after Lighthill's elongated-body theory",
    "soft": "a soft fin that saturates, then declines",
    "power_law": "power that grows with a power of the force",
    "foil": "lift and drag of a foil; at rest it gives nothing",
}
"""Model -> what it is, in words of the app; see `law_words`."""
HEIGHT = 140
"""Height of a plot [px]."""
SHARES, COLORS = (1.0, 2 / 3, 1 / 3), (ORANGE, GREEN, BLUE)
"""Of the largest amplitude, and the colours of curves."""
POINTS = 41
CSV = ".csv,.txt,.xlsx"
NOMINAL = Fin("nominal", (0.0, 0.0, 0.0), 0.0)


def part_shown(selected: str | None, layout: Layout) -> Actuator:
    """The actuator that was selected last; a nominal fin where none is."""
    return NOMINAL if selected is None else layout.part(selected)


def of_part(value: Callable[[Actuator], Any]) -> Callable[[str | None, Layout], Any]:
    """What is shown of the actuator that was selected last."""
    return lambda selected, layout: value(part_shown(selected, layout))


def add_model(page: Page) -> None:
    """The choice of a formula, and what is said of it."""

    def options(part: Actuator) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*part.KIND.models, part.model_type)))

    def words(selected: str | None, layout: Layout, fitted: Fitted | None) -> str:
        part = part_shown(selected, layout)
        reported = fitted is not None and fitted.found["model"] == getattr(part, "model", None)
        return model_card(part, doubts=not reported)

    about = "The formula that gives force and power; a table comes from a file, below."
    kinds = page.board.show(
        page.gui.add_dropdown("Model", NOMINAL.KIND.models, hint=about), options=of_part(options)
    )
    page.board.show(kinds, visible=of_part(lambda part: len(options(part)) > 1))
    page.bind(kinds, page.session.choose_model, of_part(lambda part: part.model_type))
    page.add_html(words)


def add_fit(page: Page) -> None:
    """Curves of the model, a file for the selected actuator, and what comes of it."""
    session = page.session
    gui = page.gui
    board = page.board
    fitting = page.jobs.fitting

    def upload(name: str, content: bytes) -> None:
        if session.selected is None:
            raise FinlabError(
                "no actuator is selected; click the one that was measured, or its row"
            )
        fitting.start(session.selected, name, content)
        session.show_task("Design")

    page.add_html(of_part(drawn_curves))
    page.opening.add(CSV, upload)
    about = (
        "A fin: noisy rows of A, f, phi, Fx, Fy, Fz, or a force table. A thruster: PWM, force and "
        "power."
    )
    with gui.add_folder(None) as full:  # viser cannot hide a button for files
        button = page.add_upload(
            "Fit from measurements (CSV)",
            upload,
            icon=viser.Icon.UPLOAD,
            mime_type=CSV,
            hint=f"{about} Up to {MAX_BYTES // 1_000_000} MB.",
        )
    board.show(button, disabled=lambda selected, fitting: selected is None or fitting is not None)
    board.show(full, visible=of_part(lambda part: hasattr(part, "model")))
    bar = gui.add_progress_bar(100.0, animated=True, visible=False)
    hint = "The actuator stays as it is."
    cancel = page.add_button("Cancel", fitting.forget, icon=viser.Icon.X, visible=False, hint=hint)
    for handle in (bar, cancel):
        board.show(handle, visible=lambda fitting: fitting is not None)
    page.add_html(_written)
    results = {"On all like it": fitting.put_on_all, "Close": fitting.forget}
    hint = "All that had the same model. Undo takes a fit back."
    buttons = page.add_buttons("Fit", results, visible=False, hint=hint)
    board.show(buttons, visible=lambda fitted: fitted is not None)


def _written(fitted: Fitted | None, fitting: str | None, fitted_error: str | None) -> str:
    if fitting is not None:
        return html("<div class='fl dim'>{} …</div>", fitting)
    if fitted_error is not None:
        return html(
            "<div class='fl'><div class='said missing'>{}</div></div>", in_app(fitted_error)
        )
    if fitted is None:
        return ""
    from webapp.markup.outcomes import fit_card  # scipy comes with it

    return fit_card(fitted)


def model_card(part: Actuator, doubts: bool = True) -> str:
    """The model of an actuator; without `doubts` where they stand elsewhere already."""
    if isinstance(part, Fin) and part.model.type == "table":
        return html("<div class='fl'>{}</div>", _table_words(part, doubts))
    model = getattr(part, "model", None)
    if isinstance(model, PowerTable):
        (first, *_) = model.rows[0]
        (last, *_) = model.rows[-1]
        template = "<div class='fl dim'><b>table</b> of {} rows, command {:g} to {:g} {}</div>"
        return html(template, len(model.rows), first, last, model.unit)
    sentence = law_words(part)
    return html("<div class='fl dim'>{}{}.</div>", sentence[0].upper(), sentence[1:])


def law_words(part: Actuator) -> str:
    """What the formula of an actuator is, without a full stop: the words of `LAWS`, else, of a fin
    law, the summary of its class."""
    kind = part.model_type
    if kind in LAWS:
        return LAWS[kind]
    if isinstance(part, Fin) and kind in PLANAR_LAWS:
        summary = (PLANAR_LAWS[kind].__doc__ or f"the law {kind}").split("\n\n")[0]
        return " ".join(summary.split()).removesuffix(".")
    return f"a law of its own kind, {part.type}"


def _table_words(fin: Fin, doubts: bool) -> str:
    try:
        law = make_law(fin.model)
    except DataError as error:
        return html("<b>table</b>: <span class='missing'>{}</span>", str(error))
    assert isinstance(law, TableLaw)
    (low_a, high_a), (low_f, high_f), (low_d, high_d) = law.covers
    turn = "all round" if law.periodic else f"from {degrees(low_d)}° to {degrees(high_d)}°"
    covers = f"A {degrees(low_a)}° to {degrees(high_a)}°, f {low_f:.2f} to {high_f:.2f} Hz, {turn}"
    power = "with the power that was measured" if law.has_power else "power as of U-CAT's fin"
    doubt = next((note for note in law.notes if note.startswith(DOUBT)), None)
    sentence = (
        ""
        if doubt is None or not doubts
        else html("<div class='missing'>This fin is {}.</div>", doubt)
    )
    if fin.limits.amplitude[1] > high_a + BEYOND or fin.limits.frequency[1] > high_f + BEYOND:
        most_a = fin.limits.amplitude[1]
        most_f = fin.limits.frequency[1]
        sentence += html(
            "<div class='missing'>The fin may be asked for {}° and {:.2f} Hz: beyond "
            "what was measured the force counts as at the edge.</div>",
            degrees(most_a),
            most_f,
        )
    fitted = next((note for note in law.notes if note.startswith("fitted to ")), None)
    origin = f", {fitted.split(',')[0]}" if fitted else " of forces"
    return html("<b>table</b>{}.{}<div class='dim'>{}; {}.</div>", origin, sentence, covers, power)


class Curves(NamedTuple):
    """A plot over a command."""

    across: str
    x: Array
    up: str
    lines: tuple[tuple[str, Array], ...]
    """Names and values of curves; a single one needs no name."""


def drawn_curves(part: Actuator) -> str:
    """Plots of one actuator; nothing where its table cannot be read, which is reported
    elsewhere."""
    try:
        result = curves(part)
    except DataError:
        return ""
    plots = []
    for across, x, up, lines in result:
        plot = Plot(
            exact_axis(across, x), positive(up, np.append(1e-6, [y for _, y in lines])), HEIGHT
        )
        parts = [plot.curve(x, y, color) for (_, y), color in zip(lines, COLORS, strict=False)]
        named = zip(lines, COLORS, strict=False)
        parts += [
            plot.key(104 * k, color, word) for k, ((word, _), color) in enumerate(named) if word
        ]
        plots.append(plot.drawn(parts))
    return html("<div class='fl'>{}</div>", plots)


@lru_cache(maxsize=64)
def curves(part: Actuator) -> Sequence[Curves]:
    """Force and power of an actuator over its command: of a fin for three amplitudes, of a rudder
    for water from ahead at 1 m/s. Raises DataError: its table cannot be read."""
    plant = plant_of(Layout("one", (part,)))
    if isinstance(part, Fin):
        across = np.linspace(*part.limits.frequency, POINTS)
        amplitude = np.array(SHARES) * part.limits.amplitude[1]
        command = np.zeros((len(SHARES), POINTS, 1, 3))
        command[..., 0, 0] = amplitude[:, None]
        command[..., 0, 1] = across
        command[..., 0, 2] = np.mean(part.limits.zero_direction)
        force = np.linalg.norm(plant.force(command)[..., 0, :], axis=-1)
        names = [f"A {degrees(size)}°" for size in amplitude]
        kinds = (("mean force [N]", force), ("power [W]", plant.power(command)[..., 0]))
        return [
            Curves("frequency [Hz]", across, up, tuple(zip(names, y, strict=True)))
            for up, y in kinds
        ]
    if part.KIND.driven_by_flow:
        across = np.linspace(part.lower[0], part.upper[0], POINTS)
        command = np.zeros((POINTS, 1, 3))
        command[:, 0, 0] = across
        flow = np.zeros(6)
        flow[:3] = part.frame[1]  # whatever its place, the water meets it from ahead
        at_origin = plant_of(Layout("one", (replace(part, position=(0.0, 0.0, 0.0)),)))
        force = at_origin.force(command, flow=flow)[:, 0]
        lines = ("lift", force[:, 2]), ("drag", -force[:, 1])
        return [Curves("deflection [°], water at 1 m/s", np.degrees(across), "force [N]", lines)]
    model = getattr(part, "model", None)
    if isinstance(model, PowerTable):
        across, force, power = model.columns
        word = f"command [{model.unit}]" if model.unit else "command"
        pairs = (("force [N]", force), ("power [W]", power))
        return [Curves(word, across, up, (("", y),)) for up, y in pairs]
    if part.KIND.force_number is None:
        return []
    across = np.linspace(
        part.lower[part.KIND.force_number], part.upper[part.KIND.force_number], POINTS
    )
    command = np.zeros((POINTS, 1, 3))
    command[:, 0, part.KIND.force_number] = across
    return [Curves("force [N]", across, "power [W]", (("", plant.power(command)[:, 0]),))]
