"""A fitted robot as a layout: where its fins are and how strong, its body, the interaction, and tables of
fins whose law is another one."""

import csv
import io
import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from finlab.errors import DataError
from finlab.fit.robot.learned_fins import learned
from finlab.fit.robot.model import shape_factor
from finlab.fit.robot.report import summary
from finlab.fit.robot.robot_fit import RobotFit
from finlab.layout import Body, Fin, FinModelSpec, Interaction, Jet, Layout, save_layout
from finlab.layout.force_table_file import COLUMNS, POWER_COLUMN
from finlab.layout.interaction import MAX_SHARE
from finlab.layout.layout import MAX_DESCRIPTION_LENGTH
from finlab.physics import make_law
from finlab.whole_file import write_whole

GRID = (17, 17, 16)
"""Amplitudes, frequencies and zero directions of a fin that becomes a table."""
DEFLECTIONS = (3.0, 0.03)
"""Standard errors, and angle [rad], from which a fin's lean counts; an IMU that is mounted askew looks like a
smaller one."""
LEAST_SHARE = 0.005
"""Smallest share of a jet that is worth its line."""


def fitted_layout(fit: RobotFit, path: str | os.PathLike[str]) -> tuple[Layout, dict[str, str]]:
    """Returns the layout that a fit gives, and the texts of the tables that it names, by path.

    Args:
        fit: what was found.
        path: of the layout; tables lie beside it.
    """
    layout, place = fit.model.layout, Path(path)
    lean = fit.found("lean")
    certain = np.abs(lean) > np.maximum(DEFLECTIONS[0] * fit.found_error("lean"), DEFLECTIONS[1])
    fins, tables = list(learned(fit, np.where(certain, lean, 0.0))), {}
    for i, fin in enumerate(fins):
        if fit.part("shape") is not None or fin.model.type == "table":
            name = str(place.resolve().with_name(f"{place.stem}-fin{i + 1}.csv"))
            tables[name] = _table(fit, i)
            fins[i] = replace(fin, model=FinModelSpec("table", (("path", name),)))
    notes = "\n".join(summary(fit))
    text = f"{notes}\n{layout.description}".strip()[:MAX_DESCRIPTION_LENGTH]
    name = layout.name if place.stem == layout.name else place.stem[:64].strip() or layout.name
    return Layout(name, tuple(fins), text, _body(fit), _interaction(fit)), tables


def write_robot(fit: RobotFit, path: str | os.PathLike[str]) -> Layout:
    """Writes the layout that a fit gives, and tables beside it where its fins follow another law.

    Raises:
        DataError: a table cannot be written.
        LayoutError: the layout cannot be written.
    """
    layout, tables = fitted_layout(fit, path)
    for name, text in tables.items():
        write_whole(name, text, DataError)
    beside = {name: Path(name).name for name in tables}
    save_layout(_named(layout, beside), path)
    return layout


def _named(layout: Layout, names: dict[str, str]) -> Layout:
    """The layout as its file says it: tables beside it by their names alone."""

    def renamed(fin: Fin) -> Fin:
        path = str(fin.model.values().get("path", ""))
        if path not in names:
            return fin
        return replace(fin, model=FinModelSpec("table", (("path", names[path]),)))

    return replace(layout, actuators=tuple(renamed(fin) for fin in layout.fins))


def _table(fit: RobotFit, i: int) -> str:
    """The i-th fin's law as a table, from rest to its limits."""
    fin = fit.model.layout.fins[i]
    law = make_law(fin.model)
    ends = fin.limits.amplitude[1], fin.limits.frequency[1]
    axes = [np.linspace(0.0, end, count) for end, count in zip(ends, GRID, strict=False)]
    axes.append(np.linspace(-np.pi, np.pi, GRID[2], endpoint=False))
    command = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    force = float(np.exp(fit.found("strength")[i])) * np.asarray(law.force(command))
    shape = fit.part("shape")
    if shape is not None:
        force = force * shape_factor(fit.model.shape_terms(command), shape)[:, None]
    power = np.asarray(law.power(command))
    text = io.StringIO()
    text.write(f"# fin {fin.name}, fitted to a swim of the whole robot\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*COLUMNS, POWER_COLUMN])
    rows = np.hstack([command, force, power[:, None]]) + 0.0
    writer.writerows([f"{value:.8g}" for value in row] for row in rows)
    return text.getvalue()


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


def _interaction(fit: RobotFit) -> Interaction | None:
    """What the fins take from each other, and speed from them; None where neither is used."""
    jets, inflow = fit.part("jets"), fit.part("inflow")
    if jets is None and inflow is None:
        return None
    names, made, form = fit.model.layout.names, [], (Interaction.half_thrust_n, Interaction.narrowness)
    if jets is not None:
        pairs = [(a, b) for a in names for b in names if a != b]
        shares = np.clip(jets[:-2].reshape(-1, 2), -MAX_SHARE, MAX_SHARE)
        form = fit.model.jet_form(jets)
        made = [
            Jet(a, b, tuple(share.tolist()))
            for (a, b), share in zip(pairs, shares, strict=True)
            if np.abs(share).max() >= LEAST_SHARE
        ]
    taken = (0.0, 0.0) if inflow is None else tuple(np.clip(inflow, -MAX_SHARE, MAX_SHARE).tolist())
    return Interaction(tuple(made), *form, taken)
