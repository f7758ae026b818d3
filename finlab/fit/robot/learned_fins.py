"""The fins of a fitted robot: places, directions, strengths, and how sure they are."""

from dataclasses import replace

import numpy as np

from finlab.arrays import Array
from finlab.fit.robot.robot_fit import RobotFit
from finlab.layout import Fin
from finlab.layout.uncertainty import Uncertainty


def learned(fit: RobotFit, lean: Array) -> tuple[Fin, ...]:
    """Returns the fins of a fit, by the laws that they had before.

    Args:
        fit: what was found.
        lean: of each fin (n,) [rad]; it turns `zero` about the shaft.
    """
    fins, center, unsure = [], fit.found("center"), uncertainties(fit)
    share, turned = np.exp(fit.found("strength")), fit.found("mounting")
    for i, fin in enumerate(fit.model.layout.fins):
        x, y, z = (np.array(fin.position) - center).tolist()
        angle = float(np.mod(fin.shaft_azimuth + turned[i] + np.pi, 2.0 * np.pi) - np.pi)
        model = fin.model if fin.model.type == "table" else fin.model.scaled(float(share[i]))
        moved = replace(fin, position=(x, y, z), mounting_angle=angle, model=model, uncertainty=unsure[i])
        fins.append(leaned(moved, float(lean[i])) if lean[i] else moved)
    return tuple(fins)


def leaned(fin: Fin, angle: float) -> Fin:
    """Returns a fin whose thrust is turned by an angle [rad] about its shaft, from `zero` to shaft x zero."""
    shaft, zero, across = (np.array(axis) for axis in fin.frame)
    turned = np.cos(angle) * zero + np.sin(angle) * across
    return replace(fin, mounting_angle=None, shaft=tuple(shaft.tolist()), zero=tuple(turned.tolist()))


def uncertainties(fit: RobotFit) -> tuple[Uncertainty, ...]:
    """Returns how far each fin's force may be from what was found: the mean over strength and lean, with the
    share of it that all strengths have together."""
    place = fit.fitted.unknowns.place("strength")
    covariance = fit.covariance[place, place]
    own = np.sqrt(np.diag(covariance))
    n = len(own)
    alike = (covariance / np.outer(own, own)).sum() / n if n > 1 else 1.0
    together = float(np.clip((alike - 1.0) / max(n - 1, 1), 0.0, 1.0))
    shares = np.sqrt(0.5 * (fit.found_error("strength") ** 2 + fit.found_error("lean") ** 2)).tolist()
    return tuple(
        Uncertainty(share, common=f"swim of {fit.model.layout.name}"[:64].strip(), correlation=together)
        for share in shares
    )
