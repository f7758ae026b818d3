"""Robots of fins with laws of the split `fins`, drawn by the library's maker, and tables of laws.

A table is a file, which the library's makers of random robots never write.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finlab.layout import FinModelSpec, Layout, Limits
from finlab.physics import FinLaw, make_law
from finlab.research.random_layouts import random_fin_model, random_layout

Array = NDArray[np.float64]

KINDS = ("drag", "lighthill", "soft", "table")
"""Kinds of fin."""


def write_fin_table(
    path: Path,
    law: FinLaw,
    limits: Limits,
    *,
    rng: np.random.Generator | None = None,
    noise: float = 0.0,
    sideways: float = 0.0,
    power: bool = False,
    points: tuple[int, int, int] = (7, 8, 13),
) -> FinModelSpec:
    """A table of a law on a grid that covers the limits: with noise (a share of the largest force),
    a force along the shaft (a share of the planar one) and a column of power."""
    ends = zip(limits.lower, limits.upper, points, strict=True)
    axes = [np.linspace(low, high, n) for low, high, n in ends]
    command = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    force: Any = law.force(command) + 0.0
    size = np.hypot(force[:, 1], force[:, 2])
    force[:, 0] = sideways * size * np.cos(2.0 * command[:, 2])
    if rng is not None:
        force += noise * size.max() * rng.standard_normal(force.shape) * [0.2, 1.0, 1.0]
        if limits.upper[2] - limits.lower[2] > 6.28:  # one turn later is the same direction
            whole = force.reshape(*points, 3)
            whole[:, :, -1] = whole[:, :, 0]
    rows = np.hstack([command, force])
    header = "A,f,phi,Fx,Fy,Fz"
    if power:
        rows = np.hstack([rows, 1.3 * np.asarray(law.power(command))[:, None] + 0.05])
        header += ",P"
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.12g")
    return FinModelSpec("table", (("path", str(path)),))


def random_robot_of_fins(
    rng: np.random.Generator,
    kinds: tuple[str, ...],
    folder: Path | None = None,
    *,
    n_fins: int | tuple[int, int] = (2, 5),
    limits: Any = "nominal",
) -> Layout:
    """A robot whose fins are each of one of the kinds, with numbers of its own; tables go to a
    folder."""
    layout = random_layout(rng, n_fins=n_fins, limits=limits)
    fins = []
    for fin in layout.fins:
        kind = str(rng.choice(kinds))
        model = random_fin_model(rng, None if kind == "table" else kind)
        if kind == "table":
            assert folder is not None
            path = folder / f"{rng.integers(2**62)}.csv"
            law = make_law(model)
            model = write_fin_table(
                path, law, fin.limits, rng=rng, noise=0.03, sideways=0.1, power=True
            )
        fins.append(replace(fin, model=model))
    return replace(layout, actuators=tuple(fins))
