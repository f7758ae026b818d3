"""A fitted robot as a layout: where its actuators are and how strong, its body, and tables of fins
whose law is another one."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from finlab.errors import DataError
from finlab.fit.robot.learned_actuators import learned
from finlab.fit.robot.model import shape_factor
from finlab.fit.robot.report import summary
from finlab.fit.robot.robot_fit import RobotFit
from finlab.fit.robot.unknowns import SHAPE
from finlab.layout import Body, Fin, FinModelSpec, Layout, load_layout, save_layout
from finlab.layout.force_table_file import COLUMNS, POWER_COLUMN, table_text
from finlab.layout.layout import MAX_DESCRIPTION_LENGTH
from finlab.physics import make_law
from finlab.whole_file import write_whole

GRID = (17, 17, 16)
"""Amplitudes, frequencies and zero directions of a fin that becomes a table."""
DEFLECTIONS = (3.0, 0.03)
"""Standard errors, and angle [rad], from which a fin's lean counts; an IMU that is mounted askew looks like a
smaller one."""


def write_robot(fit: RobotFit, path: str | os.PathLike[str]) -> Layout:
    """Writes the layout that a fit gives, and tables beside it where its fins follow another law.

    Raises:
        DataError: a table cannot be written.
        LayoutError: the layout cannot be written.
    """
    layout, place = fit.model.layout, Path(path)
    lean = fit.found("lean")
    certain = np.abs(lean) > np.maximum(DEFLECTIONS[0] * fit.found_error("lean"), DEFLECTIONS[1])
    parts = list(learned(fit, np.where(certain, lean, 0.0)))
    for i, (drawn, part) in enumerate(zip(layout.actuators, parts, strict=True)):
        if isinstance(drawn, Fin) and isinstance(part, Fin) and (fit.other_law or part.model.type == "table"):
            table = place.with_name(f"{place.stem}-fin{i + 1}.csv")
            write_whole(table, _table(fit, i, drawn), DataError)
            parts[i] = replace(part, model=FinModelSpec("table", (("path", table.name),)))
    notes = "\n".join(summary(fit))
    text = f"{notes}\n{layout.description}".strip()[:MAX_DESCRIPTION_LENGTH]
    name = layout.name if place.stem == layout.name else place.stem[:64].strip() or layout.name
    save_layout(Layout(name, tuple(parts), text, _body(fit)), place)
    return load_layout(place)


def _table(fit: RobotFit, i: int, fin: Fin) -> str:
    """The law of the i-th actuator, a fin, as a table, from rest to its limits."""
    law = make_law(fin.model)
    ends = fin.limits.amplitude[1], fin.limits.frequency[1]
    axes = [np.linspace(0.0, end, count) for end, count in zip(ends, GRID, strict=False)]
    axes.append(np.linspace(-np.pi, np.pi, GRID[2], endpoint=False))
    command = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    force = float(np.exp(fit.found("strength")[i])) * np.asarray(law.force(command))
    shape = fit.part(SHAPE)
    if shape is not None:
        force = force * shape_factor(fit.model.shape_terms(command), shape)[:, None]
    power = np.asarray(law.power(command))
    notes = [f"fin {fin.name}, fitted to a swim of the whole robot"]
    return table_text(notes, [*COLUMNS, POWER_COLUMN], np.hstack([command, force, power[:, None]]), 8)


def _body(fit: RobotFit) -> Body:
    """The body as it was found."""
    model, unknowns, vector = fit.model, fit.fitted.unknowns, fit.fitted.vector
    found = model.bodies(unknowns, vector[None])
    hull = None if model.layout.body is None else model.layout.body.hull
    if hull is not None:
        hull = replace(hull, center_m=tuple(np.array(hull.center_m) - fit.found("center")))
    own = model.dynamics.inertia - np.array(model.body.added_mass or (0.0,) * 6)
    added = np.maximum(found.inertia[:, 0] - own, 0.0)
    return replace(
        model.body,
        hull=hull,
        added_mass=tuple(added.tolist()),
        linear_damping=tuple(found.linear[:, 0].tolist()),
        quadratic_damping=tuple(found.quadratic[:, 0].tolist()),
        center_of_buoyancy_m=tuple(found.center[:, 0].tolist()),
        buoyancy_n=max(float(found.lift[0]), 0.0),
    )
