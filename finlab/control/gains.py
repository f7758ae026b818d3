"""Gains of the controllers, and how they are read from the files beside this one."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from finlab.errors import DataError
from finlab.files.guarded import read_text
from finlab.files.plain_values import parse_yaml

WAYPOINT_GAINS = ("waypoint", "waypoint_paper")
"""Shipped gains of the waypoint controller: with damping, and proportional only as the paper writes it."""


@dataclass(frozen=True)
class WaypointGains:
    """Gains of the waypoint controller."""

    period_s: float
    """Time between calls [s]."""
    lead_s: float
    """How far ahead of now the waypoint runs on the trajectory [s]."""
    surge: float
    """Fx per metre of horizontal distance [N/m]."""
    heave: float
    """Fz per metre of height [N/m]."""
    heave_damping: float
    """Fz against the speed of climbing [N s/m]; 0 is the paper's law."""
    climb_filter_s: float
    """Time constant of the filter of the speed that is damped [s]."""
    odometry_filter_s: float
    """Time constant with which markers and pressure correct the odometry [s]."""
    yaw: float
    """Tz per radian of heading error [N m/rad]."""
    yaw_damping: float
    """Tz against the yaw rate [N m s/rad]; 0 is the paper's law."""
    near_m: float
    """Within this distance of the waypoint the heading counts in proportion to it [m]; right above the
    waypoint there is none to steer to."""
    max_surge: float
    """Largest Fx [N]."""
    max_heave: float
    """Largest Fz [N]."""
    max_yaw: float
    """Largest Tz [N m]."""


@dataclass(frozen=True)
class PidGains:
    """Gains of one PID loop, per unit of its error."""

    kp: float
    """Per unit of error."""
    ki: float
    """Per unit of error and second."""
    kd: float
    """Per unit of error per second."""
    rate_filter_s: float
    """Time constant of the filter of the error's rate [s]."""


@dataclass(frozen=True)
class VelocityGains:
    """Gains of the velocity and depth controller."""

    period_s: float
    """Time between calls [s]."""
    velocity_filter_s: float
    """Time constant of the filter of the DVL's surge speed [s]."""
    surge: PidGains
    """Fx from the error of speed [N per m/s]."""
    depth: PidGains
    """Upward force from the error of depth [N per m]."""
    yaw_damping: float
    """Tz against the yaw rate [N m s/rad]."""
    max_surge: float
    """Largest Fx [N]."""
    max_heave: float
    """Largest Fz [N]."""
    max_yaw: float
    """Largest Tz [N m]."""


Kind = TypeVar("Kind", WaypointGains, VelocityGains)


def load_gains(kind: type[Kind], source: str | Path) -> Kind:
    """Reads gains.

    Args:
        kind: `WaypointGains` or `VelocityGains`.
        source: a YAML file, or the name of a shipped one: waypoint, waypoint_paper, velocity.

    Raises:
        DataError: the file is missing or not YAML, or a gain is missing, unknown or no number from 0.
    """
    shipped = files("finlab.control").joinpath("gains", f"{source}.yaml")
    file = str(shipped) if shipped.is_file() else str(source)
    values = parse_yaml(read_text(file, 100_000, "a YAML file of gains"), f"gains {source}")
    gains: Kind = _build(kind, values, str(source), "")
    if gains.period_s <= 0.0:
        raise DataError(f"gains {source}: period_s: expected a time above 0, got {gains.period_s:g}")
    return gains


def _build(kind: type, values: Any, source: str, prefix: str) -> Any:
    """A dataclass of floats, and of such dataclasses, from a mapping with exactly its keys."""
    names = [field.name for field in fields(kind)]
    if not isinstance(values, Mapping) or set(values) != set(names):
        found = ", ".join(map(str, values)) if isinstance(values, Mapping) else repr(values)
        raise DataError(
            f"gains {source}: {prefix or 'file'}: expected the keys {', '.join(names)}; got {found}"
        )
    types = get_type_hints(kind)
    result = {}
    for name in names:
        value, key = values[name], f"{prefix}{name}"
        if is_dataclass(types[name]):
            result[name] = _build(types[name], value, source, f"{key}.")
            continue
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < math.inf:
            raise DataError(f"gains {source}: {key}: expected a number from 0, got {value!r}")
        result[name] = float(value)
    return kind(**result)
