"""Motor factors of ArduSub: lines of its source, and tables.

Factors hold directions of forces and signs of torques, no lengths and no newtons; `ardusub_frames` has their
columns and signs.
"""

import re

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.ardusub_frames import AXES, SIGNS
from finlab.exchange.exchange import Exchange
from finlab.layout import Layout, own_effectiveness

ARM = 0.2
"""Arm of a factor of 1 [m]; the file has none."""
ORDER = [AXES.index(axis) for axis in ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")]
"""Columns of factors in the order of a wrench."""
WEAK = 0.1
"""Torques about an axis are none where they stay below this share of those about another one."""
_MOTOR = re.compile(
    r"^[^\w/]*(?:\w+\()?(?:AP_MOTORS_MOT_)?(\w[^,;()]*?)((?:[\s,]+[-+]?(?:\d+(?:\.\d*)?|\.\d+)f?){6})(?=[\s,)]|$)"
)


def read_ardusub(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout, called `name`, of motors: in lines `add_motor_raw_6dof(...)`, in a table with a
    motor and its factors in each row.

    Raises:
        LayoutError: it has no motors, one of them twice, or one that gives no force.
    """
    rows = [found for line in text.splitlines() if (found := _MOTOR.match(line[:500]))]
    names = [f"motor{found[1]}" if found[1].isdecimal() else found[1] for found in rows]
    factors = np.array([re.findall(r"[-+.\d]+", found[2]) for found in rows], dtype=np.float64)
    if not rows:
        raise LayoutError("has no rows of factors, a motor and its six factors in each")
    if len(set(names)) < len(names):
        raise LayoutError("adds a motor twice; keep the lines of one frame")
    exchange.note(f"Factors hold no lengths: one of 1 is taken for an arm of {ARM} m; correct `position_m`.")
    columns = (factors * SIGNS)[:, ORDER]
    columns[:, 3:] *= ARM * np.linalg.norm(columns[:, :3], axis=1, keepdims=True)
    parts = [exchange.of_column(*each, None) for each in zip(names, columns, strict=True)]
    return Layout(name, tuple(parts))


def factors_of(layout: Layout, exchange: Exchange) -> tuple[list[str], Array]:
    """Returns the names of a layout's thrusters and their factors (n, 6), the largest of each kind 1.

    Raises:
        LayoutError: there is no thruster.
    """
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
    """Returns the factors of a layout's thrusters: for `.csv` a table, else lines of source.

    Raises:
        LayoutError: there is no thruster.
    """
    names, factors = factors_of(layout, exchange)
    lines = ["motor,roll,pitch,yaw,throttle,forward,lateral"] if suffix == ".csv" else []
    for i, (name, row) in enumerate(zip(names, factors.tolist(), strict=True), 1):
        numbers = ", ".join(f"{factor}f" for factor in row)
        call = f"add_motor_raw_6dof(AP_MOTORS_MOT_{i}, {numbers}, {i});  // {name}"
        lines.append(",".join(map(str, [name, *row])) if suffix == ".csv" else call)
    return "\n".join(lines) + "\n"
