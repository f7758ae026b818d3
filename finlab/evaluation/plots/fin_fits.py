"""A fitted fin beside its measurements: thrust over amplitude, what is left over, direction, power."""

import math
from typing import Any

import numpy as np

from finlab.arrays import Array
from finlab.evaluation.plots.style import BLUE, GREY, ORANGE, Picture, picture
from finlab.fit.fin_fit import BAND, FinFit
from finlab.layout.angles import wrapped

PANELS = 6
"""Frequencies side by side in the first picture."""
SURE = 0.1
"""Share of the largest force from which a direction is drawn; weaker ones are mostly noise."""
LINE = 60
"""Points of a line."""
DOT: dict[str, Any] = {"s": 9, "color": GREY, "alpha": 0.75, "linewidths": 0, "zorder": 3}
"""Of a sample."""


def draw_thrust(fit: FinFit) -> Picture:
    """Force along the thrust's direction over amplitude, one panel for each band of frequencies."""
    command = fit.measurements.command
    # Without what differs from one zero direction to the next, which the line has averaged.
    uneven = _even(fit, command) - _along(fit, fit.predict(command)[0], command)
    measured = _along(fit, fit.measurements.force, command) + uneven
    edges = np.quantile(command[:, 1], np.linspace(0.0, 1.0, PANELS + 1))
    line = np.linspace(0.0, fit.measurements.reach[0], LINE)
    with picture(2, PANELS // 2, height=4.8, sharex=True, sharey=True) as view:
        for axis, low, high in zip(view.axes, edges[:-1], edges[1:], strict=True):
            inside = (command[:, 1] >= low) & (command[:, 1] <= high)
            middle = float(np.median(command[inside, 1]))
            mean, deviation = _all_round(fit, line, np.full(LINE, middle))
            axis.fill_between(
                line, mean - BAND * deviation, mean + BAND * deviation, color=BLUE, alpha=0.18, lw=0,
                label="95 % band",
            )  # fmt: skip
            axis.plot(line, mean, color=BLUE, label="fit")
            axis.scatter(command[inside, 0], measured[inside], label="measured", **DOT)
            axis.set_title(f"{middle:.2f} Hz  ({low:.2f} to {high:.2f})", fontsize=9)
        for axis in view.axes[-PANELS // 2 :]:
            axis.set_xlabel("half amplitude [rad]")
        for axis in view.axes[:: PANELS // 2]:
            axis.set_ylabel("thrust [N]")
        return view


def draw_errors(fit: FinFit) -> Picture:
    """What the fit leaves over at each sample, and the directions of thrust beside the zero directions."""
    command, force = fit.measurements.command, fit.measurements.force
    predicted = fit.predict(command)[0]
    error = 100.0 * np.linalg.norm(force - predicted, axis=-1) / fit.largest
    strong = np.linalg.norm(predicted, axis=-1) > SURE * fit.largest
    columns = 2 + fit.measurements.turned + (fit.measurements.power is not None)
    with picture(1, columns, height=3.1) as view:
        axes = iter(view.axes)
        axis = next(axes)
        axis.scatter(np.linalg.norm(predicted, axis=-1), error, **DOT)
        axis.set(xlabel="fitted force [N]", ylabel="error [% of the largest]", title="What is left over")
        axis.set_ylim(0.0, None)
        axis = next(axes)
        lean = np.degrees(wrapped(np.arctan2(force[:, 2], force[:, 1]) - command[:, 2]))
        fitted = np.degrees(wrapped(np.arctan2(predicted[:, 2], predicted[:, 1]) - command[:, 2]))
        reach = np.linalg.norm(predicted, axis=-1)
        axis.scatter(reach[strong], lean[strong], label="measured", **DOT)
        axis.scatter(reach[strong], fitted[strong], s=9, color=BLUE, linewidths=0, label="fit", zorder=4)
        axis.set(xlabel="fitted force [N]", ylabel="direction less zero direction [deg]", title="Lean")
        if fit.measurements.turned:
            axis = next(axes)
            share = _along(fit, force, command)[strong] / _even(fit, command[strong])
            axis.scatter(np.degrees(command[strong, 2]), share, **DOT)
            turn = np.linspace(-math.pi, math.pi, LINE)
            hard = np.stack([np.full(LINE, 0.8 * most) for most in fit.measurements.reach] + [turn], axis=-1)
            axis.plot(
                np.degrees(turn), _along(fit, fit.predict(hard)[0], hard) / _even(fit, hard), color=BLUE
            )
            axis.set(xlabel="zero direction [deg]", ylabel="thrust over its mean", title="Unevenness")
            axis.set_xticks([-180, -90, 0, 90, 180])
        if fit.measurements.power is not None:
            axis = next(axes)
            power = fit.predict_power(command)
            assert power is not None
            axis.scatter(power, fit.measurements.power, **DOT)
            most = float(fit.measurements.power.max())
            axis.plot([0.0, most], [0.0, most], color=ORANGE, lw=1.2)
            axis.set(xlabel="fitted power [W]", ylabel="measured power [W]", title="Power")
        return view


def _along(fit: FinFit, force: Array, command: Array) -> Array:
    """Forces (n, 3) along the direction in which the fin thrusts on the whole (n,)."""
    angle = command[..., 2] + fit.lean
    return np.asarray(force[..., 1] * np.cos(angle) + force[..., 2] * np.sin(angle))


def _all_round(fit: FinFit, amplitude: Array, frequency: Array) -> tuple[Array, Array]:
    """Thrust and its standard deviation (n,), averaged over zero directions."""
    turn = fit.directions(12)
    command = np.stack(np.broadcast_arrays(amplitude[:, None], frequency[:, None], turn), axis=-1)
    force, deviation = fit.predict(command)
    return _along(fit, force, command).mean(axis=1), np.hypot(*np.moveaxis(deviation[..., 1:], -1, 0)).mean(
        axis=1
    ) / math.sqrt(2.0)


def _even(fit: FinFit, command: Array) -> Array:
    return _all_round(fit, command[:, 0], command[:, 1])[0]
