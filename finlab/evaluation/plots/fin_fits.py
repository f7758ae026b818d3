"""A fitted fin beside its measurements: thrust over amplitude, what is left over, direction, power."""

import math
from typing import Any

import numpy as np

from finlab.evaluation.plots.style import BLUE, GREY, ORANGE, Picture, picture
from finlab.fit.fin_fit import BAND, FinFit
from finlab.fit.thrust_curves import POINTS, all_round, thrust_curves
from finlab.layout.angles import wrapped

PANELS = 6
"""Frequencies side by side in the first picture."""
SURE = 0.1
"""Share of the largest force from which a direction is drawn; weaker ones are mostly noise."""
DOT: dict[str, Any] = {"s": 9, "color": GREY, "alpha": 0.75, "linewidths": 0, "zorder": 3}
"""Of a sample."""


def draw_thrust(fit: FinFit) -> Picture:
    """Force along the thrust's direction over amplitude, one panel for each band of frequencies."""
    with picture(2, PANELS // 2, height=4.8, sharex=True, sharey=True) as view:
        for axis, curve in zip(view.axes, thrust_curves(fit, PANELS), strict=True):
            low, high = curve.thrust - BAND * curve.deviation, curve.thrust + BAND * curve.deviation
            axis.fill_between(curve.amplitude, low, high, color=BLUE, alpha=0.18, lw=0, label="95 % band")
            axis.plot(curve.amplitude, curve.thrust, color=BLUE, label="fit")
            axis.scatter(*curve.samples.T, label="measured", **DOT)
            title = f"{curve.frequency:.2f} Hz  ({curve.band[0]:.2f} to {curve.band[1]:.2f})"
            axis.set_title(title, fontsize=9)
        for axis in view.axes[-PANELS // 2 :]:
            axis.set_xlabel("half amplitude [rad]")
        for axis in view.axes[:: PANELS // 2]:
            axis.set_ylabel("thrust [N]")
        return view


def draw_errors(fit: FinFit) -> Picture:
    """What the fit leaves over at each sample, and the directions of thrust beside the zero directions."""
    command, measured = fit.measurements.command, fit.measured
    predicted = fit.mean_thrust(command)
    reach = np.linalg.norm(predicted, axis=-1)
    error = 100.0 * np.linalg.norm(measured - predicted, axis=-1) / fit.largest
    strong = reach > SURE * fit.largest
    columns = 2 + fit.measurements.turned + (fit.measurements.power is not None)
    with picture(1, columns, height=3.1) as view:
        axes = iter(view.axes)
        axis = next(axes)
        axis.scatter(reach, error, **DOT)
        axis.set(xlabel="fitted force [N]", ylabel="error [% of the largest]", title="What is left over")
        axis.set_ylim(0.0, None)
        axis = next(axes)
        lean, fitted = (
            np.degrees(wrapped(np.arctan2(force[strong, 1], force[strong, 0]) + fit.lean))
            for force in (measured, predicted)
        )
        axis.scatter(reach[strong], lean, label="measured", **DOT)
        axis.scatter(reach[strong], fitted, s=9, color=BLUE, linewidths=0, label="fit", zorder=4)
        axis.set(xlabel="fitted force [N]", ylabel="direction less zero direction [deg]", title="Lean")
        if fit.measurements.turned:
            axis = next(axes)
            share = measured[strong, 0] / all_round(fit, command[strong])
            axis.scatter(np.degrees(command[strong, 2]), share, **DOT)
            turn = np.linspace(-math.pi, math.pi, POINTS)
            hard = np.stack(
                [np.full(POINTS, 0.8 * most) for most in fit.measurements.reach] + [turn], axis=-1
            )
            axis.plot(np.degrees(turn), fit.mean_thrust(hard)[:, 0] / all_round(fit, hard), color=BLUE)
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
