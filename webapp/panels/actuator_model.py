"""Editor of the selected actuators' force model: a formula, or a table of measurements.

`panels/actuator_inspector.py` shows the choice of a model, and below it the curves and the file
from which a table is fitted.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache, partial
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
from webapp.markup.plot import Plot, exact_axis, positive_axis
from webapp.markup.words import degrees, html, in_app
from webapp.page import Page
from webapp.tasks.fitting import MAX_BYTES, FitResult, WhichVoltage
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
PLOT_HEIGHT = 140
"""Height of a plot [px]."""
AMPLITUDE_SHARES = (1.0, 2 / 3, 1 / 3)
"""Shares of a fin's largest amplitude for which there are curves."""
CURVE_COLORS = (ORANGE, GREEN, BLUE)
"""Colours of the curves of one plot, in their order."""
POINTS = 41
"""Points of a curve: enough that it looks smooth."""
TABLE_SUFFIXES = ".csv,.txt,.xlsx"
"""Endings of the files of measurements."""
NOMINAL = Fin("nominal", (0.0, 0.0, 0.0), 0.0)
"""What widgets are built for before an actuator is selected."""


def selected_actuator(selected: str | None, layout: Layout) -> Actuator:
    """The actuator that was selected last; a nominal fin where none is."""
    return NOMINAL if selected is None else layout.actuator(selected)


def of_selected(value: Callable[[Actuator], Any]) -> Callable[[str | None, Layout], Any]:
    """What is shown of the actuator that was selected last."""
    return lambda selected, layout: value(selected_actuator(selected, layout))


def add_model(page: Page) -> None:
    """The choice of a formula, and what is said of it."""

    def options(actuator: Actuator) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*actuator.KIND.models, actuator.model_type)))

    def words(selected: str | None, layout: Layout, fit_result: FitResult | None) -> str:
        actuator = selected_actuator(selected, layout)
        is_reported = fit_result is not None and fit_result.fields["model"] == getattr(
            actuator, "model", None
        )
        return model_card(actuator, has_doubts=not is_reported)

    hint = "The formula that gives force and power; a table comes from a file, below."
    models = page.gui.add_dropdown("Model", NOMINAL.KIND.models, hint=hint)
    page.board.show(models, options=of_selected(options))
    page.board.show(models, visible=of_selected(lambda actuator: len(options(actuator)) > 1))
    page.bind(models, page.session.choose_model, of_selected(lambda actuator: actuator.model_type))
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

    def ask_voltage(choice: WhichVoltage) -> None:
        answers = {}
        for level in choice.levels:
            answers[f"{level:.4g} V"] = partial(fitting.start_at, choice, level)
        text = f"{choice.upload.name} was measured at several. Which does the robot have?"
        page.ask("At which voltage?", text, answers)

    fitting.ask_voltage = ask_voltage
    page.add_html(of_selected(curves_html))
    page.opening.add(TABLE_SUFFIXES, upload)
    hint = (
        "A fin: noisy rows of A, f, phi, Fx, Fy, Fz, or a force table. A thruster: PWM, force and "
        f"power. Up to {MAX_BYTES // 1_000_000} MB."
    )
    with gui.add_folder(None) as folder:  # viser cannot hide a button for files
        button = page.add_upload(
            "Fit from measurements (CSV)",
            upload,
            icon=viser.Icon.UPLOAD,
            mime_type=TABLE_SUFFIXES,
            hint=hint,
        )
    board.show(
        button, disabled=lambda selected, fit_progress: selected is None or fit_progress is not None
    )
    board.show(folder, visible=of_selected(lambda actuator: hasattr(actuator, "model")))
    bar = gui.add_progress_bar(100.0, animated=True, visible=False)
    hint = "The actuator stays as it is."
    cancel = page.add_button("Cancel", fitting.forget, icon=viser.Icon.X, visible=False, hint=hint)
    for handle in (bar, cancel):
        board.show(handle, visible=lambda fit_progress: fit_progress is not None)
    page.add_html(_fit_html)
    results = {"On all like it": fitting.put_on_all, "Close": fitting.forget}
    hint = "All that had the same model. Undo takes a fit back."
    buttons = page.add_buttons("Fit", results, visible=False, hint=hint)
    board.show(buttons, visible=lambda fit_result: fit_result is not None)


def _fit_html(fit_result: FitResult | None, fit_progress: str | None, fit_error: str | None) -> str:
    """What came of a file, why nothing did, or how far it is."""
    if fit_progress is not None:
        return html("<div class='fl dim'>{} …</div>", fit_progress)
    if fit_error is not None:
        return html("<div class='fl'><div class='said missing'>{}</div></div>", in_app(fit_error))
    if fit_result is None:
        return ""
    from webapp.markup.outcomes import fit_card  # scipy comes with it

    return fit_card(fit_result)


def model_card(actuator: Actuator, has_doubts: bool = True) -> str:
    """The model of an actuator; without what is doubtful of a fit where that stands elsewhere
    already."""
    if isinstance(actuator, Fin) and actuator.model.type == "table":
        return html("<div class='fl'>{}</div>", _table_words(actuator, has_doubts))
    model = getattr(actuator, "model", None)
    if isinstance(model, PowerTable):
        lowest = model.rows[0][0]
        highest = model.rows[-1][0]
        template = "<div class='fl dim'><b>table</b> of {} rows, command {:g} to {:g} {}</div>"
        return html(template, len(model.rows), lowest, highest, model.unit)
    sentence = law_words(actuator)
    return html("<div class='fl dim'>{}{}.</div>", sentence[0].upper(), sentence[1:])


def law_words(actuator: Actuator) -> str:
    """What the formula of an actuator is, without a full stop: the words of `LAWS`, else, of a fin
    law, the summary of its class."""
    kind = actuator.model_type
    if kind in LAWS:
        return LAWS[kind]
    if isinstance(actuator, Fin) and kind in PLANAR_LAWS:
        summary = (PLANAR_LAWS[kind].__doc__ or f"the law {kind}").split("\n\n")[0]
        return " ".join(summary.split()).removesuffix(".")
    return f"a law of its own kind, {actuator.type}"


def _table_words(fin: Fin, has_doubts: bool) -> str:
    """Where a fin's table comes from, what of it is doubtful, and what it covers."""
    try:
        law = make_law(fin.model)
    except DataError as error:
        return html("<b>table</b>: <span class='missing'>{}</span>", str(error))
    assert isinstance(law, TableLaw)
    warnings = []
    doubt = _note(law, DOUBT)
    if doubt is not None and has_doubts:
        warnings.append(html("<div class='missing'>This fin is {}.</div>", doubt))
    amplitude_range, frequency_range, _ = law.covers
    amplitude = fin.limits.amplitude[1]
    frequency = fin.limits.frequency[1]
    if amplitude > amplitude_range[1] + BEYOND or frequency > frequency_range[1] + BEYOND:
        sentence = (
            "<div class='missing'>The fin may be asked for {}° and {:.2f} Hz: beyond what was "
            "measured the force counts as at the edge.</div>"
        )
        warnings.append(html(sentence, degrees(amplitude), frequency))
    fit_note = _note(law, "fitted to ")
    origin = " of forces" if fit_note is None else f", {fit_note.split(',')[0]}"
    power = "with the power that was measured" if law.has_power else "power as of U-CAT's fin"
    template = "<b>table</b>{}.{}<div class='dim'>{}; {}.</div>"
    return html(template, origin, warnings, _covers_words(law), power)


def _note(law: TableLaw, start: str) -> str | None:
    """The first note of a table that begins so, if any."""
    for note in law.notes:
        if note.startswith(start):
            return note
    return None


def _covers_words(law: TableLaw) -> str:
    """The commands that were measured."""
    amplitude, frequency, direction = law.covers
    directions = f"from {degrees(direction[0])}° to {degrees(direction[1])}°"
    if law.periodic:
        directions = "all round"
    return (
        f"A {degrees(amplitude[0])}° to {degrees(amplitude[1])}°, f {frequency[0]:.2f} to "
        f"{frequency[1]:.2f} Hz, {directions}"
    )


class CommandPlot(NamedTuple):
    """A plot of curves over a command."""

    across: str
    """The command, with its unit."""
    command: Array
    """Values (N,) in that unit."""
    up: str
    """What the curves show, with its unit."""
    curves: tuple[tuple[str, Array], ...]
    """Names and values (N,) of curves; a single one needs no name."""


def curves_html(actuator: Actuator) -> str:
    """Plots of one actuator; nothing where its table cannot be read, which is reported
    elsewhere."""
    try:
        command_plots = plots_of(actuator)
    except DataError:
        return ""
    markup = []
    for across, command, up, curves in command_plots:
        values = np.append(1e-6, [curve for _, curve in curves])
        plot = Plot(exact_axis(across, command), positive_axis(up, values), PLOT_HEIGHT)
        layers = []
        for (_, curve), color in zip(curves, CURVE_COLORS, strict=False):
            layers.append(plot.curve(command, curve, color))
        for k, ((name, _), color) in enumerate(zip(curves, CURVE_COLORS, strict=False)):
            if name:
                layers.append(plot.key(104 * k, color, name))
        markup.append(plot.svg(layers))
    return html("<div class='fl'>{}</div>", markup)


@lru_cache(maxsize=64)
def plots_of(actuator: Actuator) -> Sequence[CommandPlot]:
    """Force and power of an actuator over its command: of a fin for three amplitudes, of a rudder
    for water from ahead at 1 m/s.

    Raises:
        DataError: its table cannot be read.
    """
    if isinstance(actuator, Fin):
        return _fin_plots(actuator)
    if actuator.KIND.driven_by_flow:
        return [_rudder_plot(actuator)]
    model = getattr(actuator, "model", None)
    if isinstance(model, PowerTable):
        command, force, power = model.columns
        word = f"command [{model.unit}]" if model.unit else "command"
        return [
            CommandPlot(word, command, "force [N]", (("", force),)),
            CommandPlot(word, command, "power [W]", (("", power),)),
        ]
    if actuator.KIND.force_number is None:
        return []
    return [_power_plot(actuator, actuator.KIND.force_number)]


def _fin_plots(fin: Fin) -> list[CommandPlot]:
    """Mean force and power over the frequency, at the middle of the directions."""
    plant = plant_of(Layout("one", (fin,)))
    frequency = np.linspace(*fin.limits.frequency, POINTS)
    amplitude = np.array(AMPLITUDE_SHARES) * fin.limits.amplitude[1]
    command = np.zeros((len(AMPLITUDE_SHARES), POINTS, 1, 3))
    command[..., 0, 0] = amplitude[:, None]
    command[..., 0, 1] = frequency
    command[..., 0, 2] = np.mean(fin.limits.zero_direction)
    force = np.linalg.norm(plant.force(command)[..., 0, :], axis=-1)
    power = plant.power(command)[..., 0]
    names = [f"A {degrees(value)}°" for value in amplitude]
    word = "frequency [Hz]"
    return [
        CommandPlot(word, frequency, "mean force [N]", tuple(zip(names, force, strict=True))),
        CommandPlot(word, frequency, "power [W]", tuple(zip(names, power, strict=True))),
    ]


def _rudder_plot(rudder: Actuator) -> CommandPlot:
    """Lift and drag over the deflection."""
    deflection = np.linspace(rudder.lower[0], rudder.upper[0], POINTS)
    command = np.zeros((POINTS, 1, 3))
    command[:, 0, 0] = deflection
    flow = np.zeros(6)
    flow[:3] = rudder.frame[1]  # whatever its position, the water meets it from ahead
    plant = plant_of(Layout("one", (replace(rudder, position=(0.0, 0.0, 0.0)),)))
    force = plant.force(command, flow=flow)[:, 0]
    curves = (("lift", force[:, 2]), ("drag", -force[:, 1]))
    word = "deflection [°], water at 1 m/s"
    return CommandPlot(word, np.degrees(deflection), "force [N]", curves)


def _power_plot(thruster: Actuator, force_number: int) -> CommandPlot:
    """Power over the force, which is that number of the command."""
    plant = plant_of(Layout("one", (thruster,)))
    force = np.linspace(thruster.lower[force_number], thruster.upper[force_number], POINTS)
    command = np.zeros((POINTS, 1, 3))
    command[:, 0, force_number] = force
    return CommandPlot("force [N]", force, "power [W]", (("", plant.power(command)[:, 0]),))
