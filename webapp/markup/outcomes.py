"""Outcomes in a few words and figures: how a swim goes, and what a fit is worth, the verdict
first.

`panels/swim_tab.py` and `panels/status.py` show the swim, `panels/actuator_model.py` the fit.
"""

from typing import TYPE_CHECKING

from markupsafe import Markup

from finlab.display import as_sentence
from webapp.markup.tables import cell_text
from webapp.markup.words import fins_words, html, row, unlearned_sentence
from webapp.tasks.fitting import FitResult
from webapp.tasks.swimmer import Moment, Swimmer
from webapp.tasks.swimming import Swimming

if TYPE_CHECKING:  # scipy takes its time, and comes with it
    from finlab.fit.fin_fit import FinFit


def pace_words(swimming: Swimming) -> str:
    """At what pace it goes, in words: what is asked for, or what the machine can do."""
    capsized = None if swimming.swimmer is None else swimming.swimmer.visible_moment.capsized
    if capsized is not None:
        return html("<span class='missing'>capsized at {:.1f} s</span>", capsized)
    if swimming.done:
        return "arrived"
    if not swimming.running:
        return "paused"
    rate = swimming.pace.rate
    speed = swimming.pace.speed
    if rate is None or rate > 0.9 * speed:
        return f"running at {speed:.2g}×"
    return html(
        "<span class='missing'>{:.1f}× of {:g}×, as fast as this machine can</span>", rate, speed
    )


def findings_words(moment: Moment) -> list[str]:
    """Which unannounced losses the monitor has detected, and which it has not."""
    sentences = [
        f"The monitor found {name} lost {seconds:.1f} s after it broke."
        for name, seconds in moment.found
    ]
    for name in moment.lost:
        if name in moment.believed_lost:
            continue
        belief = "the allocator does not know yet"
        if name in moment.doubted:
            belief = "the monitor takes it for torn or stuck"
        sentences.append(html("<span class='missing'>{} is lost, and {}.</span>", name, belief))
    for name in moment.doubted:
        if name not in moment.believed_lost and name not in moment.lost:
            template = "<span class='missing'>The monitor takes {} for torn or stuck.</span>"
            sentences.append(html(template, name))
    for name in moment.believed_lost:
        if name not in moment.lost:
            template = "<span class='missing'>{} works, but the allocator takes it for lost.</span>"
            sentences.append(html(template, name))
    return sentences


def swim_card(swims: bool, swimmer: Swimmer | None, moment: Moment | None) -> str:
    """Distance from where the robot should be, depth error, power and energy so far, and what was
    found.

    Args:
        swims: whether a swim was begun.
        swimmer: the robot that swims; None until it is ready.
        moment: the moment of the swim that the page shows.
    """
    if not swims:
        return Markup("<div class='fl dim'>Start lets this robot swim, with what works.</div>")
    if swimmer is None or moment is None:
        return Markup("<div class='fl dim'>making ready …</div>")
    figures = moment.figures
    rows = []
    if figures is not None:
        rows = [
            row("off the path, root mean square", f"{figures.track_m:.3f} m"),
            row("off in depth", f"{figures.depth_m:.3f} m"),
            row("mean power", f"{figures.mean_w:.2f} W"),
            row("energy so far", f"{figures.energy_wh * 1000:.1f} mWh"),
        ]
    return html("<div class='fl swim'><table>{}</table>{}</div>", rows, _warnings(swimmer, moment))


def _warnings(swimmer: Swimmer, moment: Moment) -> str:
    """What the method has not learned, axes that cannot be steered apart, and the monitor's
    findings, a line each."""
    lines = []
    if swimmer.unknown_fins:
        words = unlearned_sentence(swimmer.layout, swimmer.unknown_fins)
        lines.append(html("<div class='missing'>{}: {}.</div>", swimmer.method, words))
    if not moment.controllable:
        missing = [swimmer.fins.index(name) for name in moment.believed_lost]
        condition = "With these actuators"
        if missing:
            condition = f"Without {fins_words(missing, swimmer.layout)}"
        sentence = (
            "<div class='missing'>{}, not all of surge, heave and yaw come apart: expect it "
            "to drift off.</div>"
        )
        lines.append(html(sentence, condition))
    for finding in findings_words(moment):
        lines.append(html("<div>{}</div>", finding))
    return Markup().join(lines)


def fit_card(result: FitResult) -> str:
    """What came of a file that was dropped on an actuator."""
    from finlab.fit.thruster_fit import ThrusterFit, summary  # scipy comes with it

    name = result.upload.name
    fit = result.fit
    if fit is None:
        sentence = "<b>{} is a finished table.</b> It is on {} as it stands."
        text = html(sentence, name, result.upload.actuator.name)
        return html("<div class='fl said'>{}</div>", text)
    if isinstance(fit, ThrusterFit):
        lines = [html("<div class='said'>{}</div>", as_sentence(line)) for line in summary(fit)]
        return html("<div class='fl'>{}</div>", lines)
    return _fin_fit_card(fit)


def _fin_fit_card(fit: "FinFit") -> str:
    """A verdict, figures of the fit, and notes on the file and on samples that were left out."""
    from finlab.fit.fin_fit import FIGURES, reach_words, verdict  # scipy comes with it

    style = "missing" if fit.doubts else "given"
    heading = html("<b class='{}'>{}</b>", style, as_sentence(verdict(fit)))
    rows = []
    for column in FIGURES:
        rows.append(row(column.heading, cell_text(column, fit)))
    markup = [html("<div class='said'>{}</div><table>{}</table>", heading, rows)]
    for note in (reach_words(fit), *fit.notes):
        markup.append(html("<div class='said dim'>{}</div>", as_sentence(note)))
    return html("<div class='fl'>{}</div>", markup)
