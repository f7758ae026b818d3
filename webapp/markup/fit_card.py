"""What a fit is worth: the verdict first."""

from markupsafe import Markup

from finlab.fit.fin_fit import FinFit
from finlab.fit.thruster_fit import ThrusterFit, summary
from webapp.markup.words import html, row, three_digits
from webapp.tasks.fitting import Fitted

MOST_NAMED = 8


def fit_card(result: Fitted) -> str:
    """What came of a file that was dropped on an actuator."""
    name, fit = result.upload.name, result.fit
    if fit is None:
        said = html("<b>{} is a finished table.</b> It is on {} as it stands.", name, result.upload.part.name)
        return html("<div class='fl said'>{}</div>", said)
    if isinstance(fit, ThrusterFit):
        return html(
            "<div class='fl'>{}</div>",
            [html("<div class='said'>{}</div>", _sentence(line)) for line in summary(fit)],
        )
    if fit.doubts:
        verdict = html("<b class='missing'>Not to be trusted: {}.</b>", "; ".join(fit.doubts))
    else:
        verdict = Markup("<b class='given'>May be trusted within what was measured.</b>")
    parts = [html("<div class='said'>{}</div>", verdict), _figures(fit), _left_out(fit)]
    parts += [html("<div class='said dim'>{}</div>", _sentence(note)) for note in fit.measurements.notes]
    return html("<div class='fl'>{}</div>", parts)


def _sentence(note: str) -> str:
    return f"{note[:1].upper() + note[1:]}."


def _figures(fit: FinFit) -> str:
    rows = (
        ("cross-validated error, of the largest force", f"{100.0 * fit.error():.1f} %"),
        ("noise of a sample, of the largest force", f"{100.0 * fit.noise():.1f} %"),
        ("unseen samples within the 95 % band", f"{100.0 * fit.coverage():.0f} %"),
        (f"largest force of {len(fit.measurements)} samples", f"{three_digits(fit.largest)} N"),
    )
    return html("<table>{}</table>", (row(*figure) for figure in rows))


def _left_out(fit: FinFit) -> str:
    if not fit.outliers:
        return Markup("<div class='said'>No sample was left out.</div>")
    named = ", ".join(fit.outliers[:MOST_NAMED]) + (" …" if len(fit.outliers) > MOST_NAMED else "")
    many = "sample contradicts" if len(fit.outliers) == 1 else "samples contradict"
    return html("<div class='said'>{} {} the others: {}.</div>", len(fit.outliers), many, named)
