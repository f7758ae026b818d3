"""The actuators of a fitted robot: places, directions, strengths, and how sure they are."""

from dataclasses import replace

import numpy as np

from finlab.arrays import Array
from finlab.fit.robot.model import turned_frames
from finlab.fit.robot.robot_fit import RobotFit
from finlab.layout import Azimuth, Fin, Layout, Rudder, Thruster
from finlab.layout.commanded import Uncertainty
from finlab.layout.directions import with_axes
from finlab.layout.layout import Actuator
from finlab.layout.thrust_model import PowerLaw, PowerTable, ThrustModel


def learned(fit: RobotFit, lean: Array) -> tuple[Actuator, ...]:
    """Returns the actuators of a fit, by the laws that they had before.

    Args:
        fit: what was found.
        lean: of each actuator (n,) [rad]; see `turned_frames`.
    """
    parts, center, unsure = [], fit.found("center"), uncertainties(fit)
    layout, share = fit.model.layout, np.exp(fit.found("strength"))
    frames = turned_frames(layout, fit.found("mounting"), lean)
    for i, part in enumerate(layout.actuators):
        moved = with_axes(part, frames[i], np.array(part.position) - center)
        parts.append(scaled(replace(moved, uncertainty=unsure[i]), float(share[i])))
    return tuple(parts)


def leaned(layout: Layout, lean: Array) -> Layout:
    """Returns a robot whose actuators lean by angles (n,) [rad]; see `turned_frames`."""
    frames = turned_frames(layout, np.zeros(layout.n), lean)
    pairs = zip(layout.actuators, frames, strict=True)
    return replace(layout, actuators=tuple(with_axes(part, frame) for part, frame in pairs))


def scaled(part: Actuator, share: float) -> Actuator:
    """Returns an actuator that gives a share of the force at every command.

    The command of a thruster is the force that it gives: one of 0.8 has limits of 0.8 as much, and takes the
    power of force / 0.8. A fin that is a table stays as it is.
    """
    if isinstance(part, Fin):
        return part if part.model.type == "table" else replace(part, model=part.model.scaled(share))
    if isinstance(part, Rudder):
        return replace(part, area=share * part.area)
    return replace(
        part,
        force=(share * part.force[0], share * part.force[1]),
        dead_band=share * part.dead_band,
        rate=None if part.rate is None else share * part.rate,
        model=_thrust(part.model, share),
    )


def _thrust(model: ThrustModel, share: float) -> ThrustModel:
    if isinstance(model, PowerTable):
        return replace(model, rows=tuple((told, share * force, watts) for told, force, watts in model.rows))
    more = share**-model.exponent
    reverse = None if model.reverse is None else more * model.reverse
    return PowerLaw(more * model.forward, reverse, model.exponent)


def asked_more(layout: Layout, share: Array) -> Array:
    """Returns factors (n, 3) of commands to a robot of shares (n,) of the layout's strengths, by which the
    drives of the layout's thrusters and azimuths give what is to be given."""
    factor = np.ones((layout.n, 3))
    for i, part in enumerate(layout.actuators):
        if isinstance(part, Thruster | Azimuth):
            factor[i, part.LIMITS.index("force")] = 1.0 / share[i]
    return factor


def uncertainties(fit: RobotFit) -> tuple[Uncertainty, ...]:
    """Returns how far each actuator's force may be from what was found: the mean over strength and lean, with
    the share of it that all strengths have together."""
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
