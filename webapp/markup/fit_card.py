"""What a fit of a fin is worth: the verdict first, samples and fit in a plot, and what to measure next."""

import math
from html import escape

import numpy as np

from finlab.fit.fin_fit import BAND, FinFit
from finlab.fit.thrust_curves import ThrustCurve
from webapp.markup.mode_plot import BOTTOM, RIGHT, TOP, WIDTH, axes, cost_axis
from webapp.markup.words import three_digits
from webapp.tasks.fitting import Fitted
from webapp.theme import BLUE, GREEN, ORANGE, css

LEFT, HEIGHT = 44, 214
"""Left margin and height of the plot [px]."""
COLORS = (ORANGE, GREEN, BLUE)
"""Of the curves, from the lowest frequency to the highest."""
MOST_NAMED = 8
"""Samples left out that are named one by one."""


def fit_card(found: Fitted) -> str:
    """What came of a file that was dropped on a fin."""
    name, fin = escape(found.upload.name), escape(found.upload.fin)
    if found.fit is None:
        said = f"<b>{name} is a finished force table.</b> It is on {fin} as it stands. Fit it if it is noisy."
        return f"<div class='fl said'>{said}</div>"
    fit = found.fit
    if fit.doubts:
        verdict = f"<b class='missing'>Not to be trusted: {escape('; '.join(fit.doubts))}.</b>"
    else:
        verdict = "<b class='given'>May be trusted within what was measured.</b>"
    parts = [f"<div class='said'>{verdict}</div>", _figures(fit), thrust_plot(found.curves), _left_out(fit)]
    if found.thin:
        parts.append(f"<div class='said missing'>Data are thin at {escape('; '.join(found.thin))}.</div>")
    if found.advice is not None:
        parts.append(_advice(found))
    parts += [f"<div class='said dim'>{_sentence(note)}</div>" for note in fit.measurements.notes]
    return f"<div class='fl'>{''.join(parts)}</div>"


def _sentence(note: str) -> str:
    return f"{escape(note[:1].upper() + note[1:])}."


def _figures(fit: FinFit) -> str:
    rows = (
        ("cross-validated error, of the largest force", f"{100.0 * fit.error():.1f} %"),
        ("noise of a sample, of the largest force", f"{100.0 * fit.noise():.1f} %"),
        ("unseen samples within the 95 % band", f"{100.0 * fit.coverage():.0f} %"),
        (f"largest force of {len(fit.measurements)} samples", f"{three_digits(fit.largest)} N"),
    )
    return f"<table>{''.join(f'<tr><td>{a}</td><td>{b}</td></tr>' for a, b in rows)}</table>"


def _left_out(fit: FinFit) -> str:
    if not fit.outliers:
        return "<div class='said'>No sample was left out.</div>"
    named = ", ".join(fit.outliers[:MOST_NAMED]) + (" …" if len(fit.outliers) > MOST_NAMED else "")
    many = "sample contradicts" if len(fit.outliers) == 1 else "samples contradict"
    return f"<div class='said'>{len(fit.outliers)} {many} the others: {escape(named)}.</div>"


def _advice(found: Fitted) -> str:
    assert found.fit is not None and found.advice is not None
    force = np.linalg.norm(found.fit.predict(found.advice)[0], axis=-1)
    rows = "".join(
        f"<tr><td>{k}</td><td>{a:.2f}</td><td>{f:.2f}</td><td>{math.degrees(phi):.0f}</td>"
        f"<td>{three_digits(float(size))}</td></tr>".replace("-", "−")
        for k, ((a, f, phi), size) in enumerate(zip(found.advice, force, strict=True), start=1)
    )
    head = "<tr><th></th><th>A [rad]</th><th>f [Hz]</th><th>direction [°]</th><th>expected [N]</th></tr>"
    return f"<div class='said'>Measure next, the most telling first:</div><table>{head}{rows}</table>"


def thrust_plot(curves: tuple[ThrustCurve, ...]) -> str:
    """Thrust over amplitude at a few frequencies: samples, the fit, and its 95 % band."""
    top = max(float(max(curve.thrust.max(), curve.samples[:, 1].max(initial=0.0))) for curve in curves)
    bottom = min(0.0, *(float(curve.samples[:, 1].min(initial=0.0)) for curve in curves))
    reach = float(curves[0].amplitude[-1])
    across = cost_axis("half amplitude [rad]", np.array([0.0, reach]))._replace(low=0.0, high=1.02 * reach)
    up = cost_axis("thrust [N]", np.array([bottom, top]))._replace(low=bottom)

    def x(value: float) -> float:
        return LEFT + across.share(value) * (WIDTH - LEFT - RIGHT)

    def y(value: float) -> float:
        return HEIGHT - BOTTOM - up.share(value) * (HEIGHT - BOTTOM - TOP)

    def path(values: np.ndarray, amplitudes: np.ndarray) -> str:
        return " ".join(f"{x(a):.1f},{y(v):.1f}" for a, v in zip(amplitudes, values, strict=True))

    parts = [axes(across, up, LEFT, HEIGHT, upright=False)]
    for curve, color in zip(curves, COLORS, strict=False):
        dots = "".join(f"<circle cx='{x(a):.1f}' cy='{y(v):.1f}' r='1.7'/>" for a, v in curve.samples)
        parts.append(f"<g fill='{css(color, 0.5)}'>{dots}</g>")
    for k, (curve, color) in enumerate(zip(curves, COLORS, strict=False)):
        band, a = BAND * curve.deviation, curve.amplitude
        outline = f"{path(curve.thrust + band, a)} {path((curve.thrust - band)[::-1], a[::-1])}"
        parts.append(f"<polygon points='{outline}' fill='{css(color, 0.22)}'/>")
        parts.append(
            f"<polyline points='{path(curve.thrust, a)}' fill='none' stroke='{css(color)}' stroke-width='2'/>"
        )
        place = LEFT + 116 * k
        parts.append(f"<rect x='{place}' y='7' width='14' height='5' rx='2' fill='{css(color)}'/>")
        low, high = curve.band
        parts.append(f"<text x='{place + 19}' y='14'>{low:.1f} to {high:.1f} Hz</text>")
    return f"<svg class='plot' viewBox='0 0 {WIDTH} {HEIGHT}'>{''.join(parts)}</svg>"
