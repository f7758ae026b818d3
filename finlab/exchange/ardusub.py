"""Motor factors of ArduSub: lines of its source, and tables.

Factors hold directions of forces and signs of torques, no lengths and no newtons; `ardusub_frames` has their
columns and signs.
"""

import numpy as np

from finlab.arrays import Array
from finlab.errors import LayoutError
from finlab.exchange.ardusub_frames import AXES, SIGNS
from finlab.exchange.ardusub_rows import rows_in
from finlab.exchange.exchange import Exchange
from finlab.layout import Layout, own_effectiveness

ARM = 0.2
"""Arm of a factor of 1 [m]; the file has none."""
ORDER = [AXES.index(axis) for axis in ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")]
"""Columns of factors in the order of a wrench."""
WEAK = 0.1
"""Torques about an axis are none where they stay below this share of those about another one."""


def read_ardusub(text: str, name: str, exchange: Exchange) -> Layout:
    """Returns the layout, called `name`, of motors: in calls `add_motor_raw_6dof(...)` of C++ or Lua, or in a
    table with a motor and its factors in each row.

    Raises:
        LayoutError: it has no motors, one of them twice, or one that gives no force; a row does not parse.
    """
    rows = rows_in(text)
    names = [row.name for row in rows]
    if not rows:
        raise LayoutError("has no rows of factors, a motor and its six factors in each")
    twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
    if twice is not None:
        raise LayoutError(f"adds a motor twice, {twice}; keep the lines of one frame")
    return of_factors(name, names, np.array([row.factors for row in rows]), exchange)


def of_factors(name: str, names: list[str], factors: Array, exchange: Exchange) -> Layout:
    """Returns the layout, called `name`, of motors by their names and factors (n, 6).

    Raises:
        LayoutError: one gives no force.
    """
    exchange.note(f"Factors hold no lengths: one of 1 is taken for an arm of {ARM} m; correct `position_m`.")
    columns = (factors * SIGNS)[:, ORDER]
    columns[:, 3:] *= ARM * np.linalg.norm(columns[:, :3], axis=1, keepdims=True)
    return Layout(name, tuple(exchange.of_column(*each, None) for each in zip(names, columns, strict=True)))


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
