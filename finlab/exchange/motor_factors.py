"""Motor factors of ArduSub, and the frames that it knows: roll, pitch, yaw, throttle, forward and lateral.

Factors hold directions of forces and signs of torques, no lengths and no newtons. Forward, right and up are
positive, and so are roll to the right, pitch up and yaw clockwise seen from above (ArduSub,
`AP_Motors6DOF::setup_motors`, commit of 2026).
"""

import re

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.ardusub_rows import MotorRow
from finlab.exchange.exchange import Exchange
from finlab.exchange.parameters import read_parameters
from finlab.layout import Layout, own_effectiveness

AXES = ("Tx", "Ty", "Tz", "Fz", "Fx", "Fy")
"""Axis of the body frame (x forward, y left, z up) for each column."""
SIGNS = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0])
"""Sign of that axis for a positive factor."""
_PLANAR = "0 0 1 0 -1 1, 0 0 -1 0 -1 -1, 0 0 -1 0 1 1, 0 0 1 0 1 -1, "
_SIMPLE, _TWO = "0 0 -1 0 1 0, 0 0 1 0 1 0, ", "1 0 0 -1 0 0, -1 0 0 -1 0 0"
_FRAMES = {
    "BLUEROV1": f"{_SIMPLE} -0.5 0.5 0 0.45 0 0, 0.5 0.5 0 0.45 0 0, 0 -1 0 1 0 0, -0.25 0 0 0 0 1",
    "VECTORED": _PLANAR + _TWO,
    "VECTORED_6DOF": f"{_PLANAR} 1 -1 0 -1 0 0, -1 -1 0 -1 0 0, 1 1 0 -1 0 0, -1 1 0 -1 0 0",
    "VECTORED_6DOF_90DEG": "1 1 0 1 0 0, 0 0 1 0 1 0, 1 -1 0 1 0 0, 0 0 0 0 0 1, "
    "0 0 0 0 0 1, -1 1 0 1 0 0, 0 0 -1 0 1 0, -1 -1 0 1 0 0",
    "SIMPLEROV_3": f"{_SIMPLE} 0 0 0 -1 0 0",
    "SIMPLEROV_4": _SIMPLE + _TWO,
    "SIMPLEROV_5": f"{_SIMPLE} {_TWO}, 0 0 0 0 0 1",
}
FRAMES: dict[str, Array] = {
    name: np.array([row.split() for row in rows.split(",")], np.float64) for name, rows in _FRAMES.items()
}
"""Name of a frame -> factors (n, 6), in the order of FRAME_CONFIG."""
ARM = 0.2
"""Arm of a factor of 1 [m]; the file has none."""
ORDER = [AXES.index(axis) for axis in ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")]
"""Columns of factors in the order of a wrench."""
OF_ARDUPILOT = re.compile(r"^[ \t\d]{0,20}(?:FRAME_C(?:ONFIG|LASS)|MOT_\w+|SYSID_THISMAV)\b", re.MULTILINE)
"""A line by which parameters of ArduPilot are known."""
WEAK = 0.1
"""Torques about an axis are none where they stay below this share of those about another one."""


def of_motors(name: str, rows: list[MotorRow], exchange: Exchange) -> Layout:
    """Returns the layout, called `name`, of motors and their factors. Raises LayoutError: there is none, one
    of them twice, or one that gives no force."""
    names = [motor for motor, _ in rows]
    if not rows:
        raise LayoutError("has no rows of factors, a motor and its six factors in each")
    for i, motor in enumerate(names):
        if motor in names[:i]:
            raise LayoutError(f"adds a motor twice, {motor}; keep the lines of one frame")
    exchange.note(f"Factors hold no lengths: one of 1 is taken for an arm of {ARM} m; correct `position_m`.")
    columns = (np.array([factors for _, factors in rows]) * SIGNS)[:, ORDER]
    columns[:, 3:] *= ARM * np.linalg.norm(columns[:, :3], axis=1, keepdims=True)
    return Layout(name, tuple(exchange.of_column(*each, None) for each in zip(names, columns, strict=True)))


def read_parameters_of_ardusub(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout, called `name`, of the frame in a list of parameters.

    MOT_n_DIRECTION -1 turns a motor the other way for the same output, so that it pushes as its frame says.
    Raises LayoutError: FRAME_CONFIG is not in it, or names a frame of one's own; a value is no number."""
    values = read_parameters(text, "FRAME_ MOT_1 MOT_2 MOT_3 MOT_4 MOT_5 MOT_6 MOT_7 MOT_8")
    config, frames = values.get("FRAME_CONFIG"), [*FRAMES]
    if config is None:
        other = " of another vehicle (FRAME_CLASS)" if "FRAME_CLASS" in values else ""
        lacks = "no FRAME_CONFIG, by which ArduSub names the motors of a robot"
        raise LayoutError(f"holds {len(values)} parameters of ArduPilot{other}, but {lacks}")
    if config not in range(len(frames)):
        why = "a frame of one's own, which parameters do not hold; give the script (.lua) or source with its"
        known = f"finlab knows 0 to 6: {', '.join(frames)}"
        raise LayoutError(f"is {config:g}, {why} motors; {known}", "FRAME_CONFIG")
    frame = frames[int(config)]
    exchange.note(f"FRAME_CONFIG {config:g} was read: ArduSub's frame {frame}.")
    signs = {i: values.get(f"MOT_{i}_DIRECTION", 1.0) for i in range(1, len(FRAMES[frame]) + 1)}
    for i, sign in signs.items():
        if abs(sign) != 1.0:
            raise LayoutError(f"is {sign:g}, expected 1 or -1", f"MOT_{i}_DIRECTION")
    if turned := ", ".join(str(i) for i, sign in signs.items() if sign < 0):
        exchange.note(
            f"MOT_n_DIRECTION reverses the outputs of motors {turned}, so that they push as the frame says: "
            "forces of the layout are those of the frame."
        )
    return of_motors(name, [(f"motor{i}", [*FRAMES[frame][i - 1]]) for i in signs], exchange)


def factors_of(layout: Layout, exchange: Exchange) -> tuple[list[str], Array]:
    """Returns the names of a layout's thrusters and their factors (n, 6), the largest of each kind 1. Raises
    LayoutError: there is no thruster."""
    kept = exchange.thrusters_of(layout, "A table of factors", "limits", "lengths")
    full = np.maximum(kept.upper, -kept.lower)[:, :1]
    factors = (own_effectiveness(kept)[:, 0] * full)[:, np.argsort(ORDER)] * SIGNS
    largest = np.abs(factors).max(0)
    for kinds in (slice(0, 3), slice(3, 6)):
        largest[kinds][largest[kinds] <= WEAK * largest[kinds].max()] = np.inf
    for kind in np.flatnonzero(np.isinf(largest[:3])):
        exchange.note(f"Torque in {('roll', 'pitch', 'yaw')[kind]} is too weak to count.")
    factors = factors / largest
    return list(kept.names), np.where(np.abs(factors) < 1e-4, 0.0, factors)


def write_ardusub(layout: Layout, exchange: Exchange, suffix: str) -> str:
    """Returns the factors of a layout's thrusters: for `.csv` a table, else lines of source. Raises
    LayoutError: there is no thruster."""
    names, factors = factors_of(layout, exchange)
    lines = ["motor,roll,pitch,yaw,throttle,forward,lateral"] if suffix == ".csv" else []
    for i, (name, row) in enumerate(zip(names, factors.tolist(), strict=True), 1):
        numbers = ", ".join(f"{factor}f" for factor in row)
        call = f"add_motor_raw_6dof(AP_MOTORS_MOT_{i}, {numbers}, {i});  // {name}"
        lines.append(",".join(map(str, [name, *row])) if suffix == ".csv" else call)
    return "\n".join(lines) + "\n"
