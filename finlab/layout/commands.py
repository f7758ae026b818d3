"""Commands of actuators as users see them: one small value per type; inside, a command is a row of three."""

from collections.abc import Mapping

import numpy as np
from msgspec import Struct

from finlab.arrays import Array
from finlab.layout.fin import Fin
from finlab.layout.layout import Actuator
from finlab.layout.propellers import Azimuth, Thruster
from finlab.layout.thrust_model import PowerTable, ThrustModel

KEYS: Mapping[str, str] = {
    "amplitude": "amplitude_rad",
    "frequency": "frequency_hz",
    "zero_direction": "zero_direction_rad",
    "force": "force_n",
    "angle": "angle_rad",
    "deflection": "deflection_rad",
}
"""Fields of commands -> their keys in a JSON file, which carry the units."""


class FinCommand(Struct, frozen=True, omit_defaults=True, rename=KEYS):
    """What a fin is told."""

    amplitude: float
    """Half amplitude [rad]."""
    frequency: float
    """[Hz]."""
    zero_direction: float
    """Direction about which it beats [rad]."""


class ThrusterCommand(Struct, frozen=True, omit_defaults=True, rename=KEYS):
    """What a thruster with a fixed axis is told."""

    force: float
    """Force along its axis [N], signed."""
    input: float | None = None
    """What its table says to send for it, in the table's unit; None for a power law."""


class AzimuthCommand(Struct, frozen=True, omit_defaults=True, rename=KEYS):
    """What a thruster that turns is told."""

    angle: float
    """Angle of its force from `zero` towards turn_axis x zero [rad]."""
    force: float
    """[N]."""
    input: float | None = None
    """As for a `ThrusterCommand`."""


class RudderCommand(Struct, frozen=True, omit_defaults=True, rename=KEYS):
    """What a rudder is told."""

    deflection: float
    """Angle of its chord from `zero` towards shaft x zero [rad]."""


Command = FinCommand | ThrusterCommand | AzimuthCommand | RudderCommand


def command_of(actuator: Actuator, row: Array) -> Command | None:
    """Returns a row (3,) of a command as the actuator's own type; None for a failed one, whose row is NaN."""
    first, second, third = row.tolist()
    if np.isnan(first):
        return None
    if isinstance(actuator, Fin):
        return FinCommand(first, second, third)
    if isinstance(actuator, Thruster):
        return ThrusterCommand(first, input_of(actuator.model, first))
    if isinstance(actuator, Azimuth):
        return AzimuthCommand(first, second, input_of(actuator.model, second))
    return RudderCommand(first)


def input_of(model: ThrustModel, force: float) -> float | None:
    """Returns what a table says to send for a force [N], in the table's unit; None for a power law.

    Where several inputs give no force, the middle of them stops the propeller.
    """
    if not isinstance(model, PowerTable):
        return None
    inputs, forces, _ = model.columns
    first, last = np.searchsorted(forces, 0.0, "left"), np.searchsorted(forces, 0.0, "right")
    if force == 0.0 and first < last:
        return float(0.5 * (inputs[first] + inputs[last - 1]))
    side = slice(max(last - 1, 0), None) if force > 0.0 else slice(0, first + 1)
    return float(np.interp(force, forces[side], inputs[side]))


def neutral_row(actuator: Actuator, now: Array | None = None) -> Array:
    """Returns the command (3,) that pushes least: a fin's least amplitude and frequency about the zero
    direction nearest to 0, no force of a thruster or the least that it can give, a rudder amidships.

    Args:
        actuator: whose.
        now: its present command (3,); an azimuth keeps its angle.
    """
    row: Array = np.clip(0.0, np.array(actuator.lower), np.array(actuator.upper))
    if isinstance(actuator, Azimuth) and now is not None and np.isfinite(now[0]):
        row[0] = now[0]
    return row
