"""The page of a fitted fin: what the fit is worth, beside its measurements."""

from pathlib import Path

import numpy as np

from finlab.errors import DataError
from finlab.evaluation.plots.fin_fits import draw_errors, draw_thrust
from finlab.evaluation.report.document import Column, Document, Figure, Table
from finlab.evaluation.report.pages import to_html
from finlab.fit.advice import next_measurements, thin_regions
from finlab.fit.fin_file import summary
from finlab.fit.fin_fit import FinFit
from finlab.whole_file import write_whole

NEXT = (
    Column("amplitude", "half amplitude [rad]", "three"),
    Column("frequency", "frequency [Hz]", "three"),
    Column("direction", "zero direction [deg]", "three"),
    Column("force", "expected force [N]", "three"),
    Column("uncertain", "uncertain by [N]", "three"),
)


def fin_fit_page(fit: FinFit, name: str) -> Document:
    """Returns the page of a fit; `name` is that of the fin's file."""
    command = next_measurements(fit)
    force, deviation = fit.predict(command)
    rows = [
        {
            "amplitude": float(a),
            "frequency": float(f),
            "direction": float(np.degrees(phi)),
            "force": float(size),
            "uncertain": float(unsure),
        }
        for (a, f, phi), size, unsure in zip(
            command, np.linalg.norm(force, axis=-1), np.linalg.norm(deviation, axis=-1), strict=True
        )
    ]
    doubts = fit.doubts
    thin = thin_regions(fit)
    verdict = (
        f"**Not to be trusted: {'; '.join(doubts)}.**"
        if doubts
        else "May be trusted within what was measured."
    )
    figures = (
        f"**{fit.error():.1%}** cross-validated error, of the largest force, the samples' noise included",
        f"**{fit.noise():.1%}** noise of a sample, of the largest force",
        f"**{fit.coverage():.0%}** within the 95 % band, of samples that the fit had not seen",
        f"**{fit.largest:.3g} N** largest force, of {len(fit.measurements)} samples",
    )
    return Document(
        f"Fin {name}, fitted",
        verdict,
        (
            "\n".join(f"- {line}" for line in figures),
            "## Thrust",
            Figure(
                "thrust",
                lambda: draw_thrust(fit),
                "Force along the thrust's direction, averaged over all zero directions. Samples are moved "
                "to the frequency of the line as the fit has it: what stands off the line it leaves over.",
            ),
            "## Errors and direction",
            Figure(
                "errors",
                lambda: draw_errors(fit),
                "Directions are drawn for forces above a tenth of the largest.",
            ),
            "## What to measure next",
            f"Data are thin at {'; '.join(thin)}." if thin else "Data are thin nowhere.",
            Table(NEXT, rows),
            "## What was done",
            "\n".join(f"- {line}" for line in summary(fit)),
        ),
    )


def write_fin_fit_page(fit: FinFit, path: Path) -> None:
    """Writes the page to an HTML file.

    Raises:
        DataError: it cannot be written.
    """
    write_whole(path, to_html(fin_fit_page(fit, path.stem)), DataError)
