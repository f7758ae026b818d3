"""Results of a robot's fit: its actuators with their uncertainty, its layout with force tables of
fins, and a report in words.

`finlab fit robot` writes these; `online_fit.py` hands the actuators to a robot that swims.
"""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from finlab.actuators.actuator import Actuator, Uncertainty
from finlab.actuators.fin.fin_model import DOUBT
from finlab.actuators.fin.force_table_file import COLUMNS, POWER_COLUMN, table_text
from finlab.arrays import Array
from finlab.errors import DataError
from finlab.layout import Body, Fin, FinModelSpec, Layout, load_layout, save_layout
from finlab.layout.layout import MAX_DESCRIPTION_LENGTH
from finlab.physics import make_law
from finlab.swim.identification.robot_fit import UNDETERMINED, RobotFit
from finlab.swim.identification.robot_model import thrust_factor, turned_frames
from finlab.swim.identification.swim import STEP_S
from finlab.swim.identification.unknowns import SHAPE
from finlab.whole_file import write_whole

OTHER_LAW = "thrust that grows otherwise with amplitude and frequency"
GRID = (17, 17, 16)
"""Amplitudes, frequencies and zero directions of a fin that becomes a table."""
LEAN_ERRORS = 3.0
"""Standard errors from which on an actuator's lean is written."""
LEAN_MIN = 0.03
"""Angle [rad] from which on it is; an IMU that is mounted askew looks like a smaller one."""


def summary(fit: RobotFit) -> tuple[str, ...]:
    """Returns what the fit is worth, a line each; the first says why it should not be trusted, if
    so."""
    lines = []
    doubts = fit.doubts()
    if doubts:
        lines.append(f"{DOUBT}: {'; '.join(doubts)}")
    seconds = STEP_S * len(fit.model.motion)
    lines.append(
        f"fitted to {seconds:.0f} s of swimming, of whose motion simulated swims explain "
        f"{fit.explained:.1%}"
    )
    for name in fit.opposed:
        lines.append(
            f"{name} pushes the other way than the layout says; in the layout that is written it "
            "is turned"
        )
    if fit.other_law:
        lines.append(f"used, since it helps on parts not seen: {OTHER_LAW}")
    elif fit.other_law is not None:
        lines.append(f"tried, and no help: {OTHER_LAW}")
    lines.append(
        "a common scale of all forces, damping and inertia does not follow from motion; it rests "
        "on the mass and added mass that the layout gave"
    )
    if any(part.KIND.force_number is not None for part in fit.model.layout.actuators):
        lines.append(
            "a force in the layout is what a thruster gives: divide it by the strength that was "
            "found for what the thruster is to be sent"
        )
    unknown = fit.undetermined()
    if unknown:
        lines.append(
            f"the data cannot tell {', '.join(unknown)}: there the layout's own values stand"
        )
    return tuple(lines)


def table(fit: RobotFit) -> str:
    """Every unknown with its standard error, and how much of what was doubtful before is left."""
    unknowns = fit.fitted.unknowns
    vector = fit.fitted.vector
    error = fit.standard_errors
    width = max(len(label) for label in unknowns.labels)
    lines = [f"{'':{width}}  {'found':>10}  {'+-':>9}  doubt left"]
    rows = zip(unknowns.labels, unknowns.units, vector, error, unknowns.scale, strict=True)
    for label, unit, value, own, scale in rows:
        remark = "  not determined by the data" if own > UNDETERMINED else ""
        lines.append(
            f"{label:{width}}  {value * scale:10.4f}  {own * scale:9.4f}  {min(own, 1.0):9.0%} "
            f"{unit}{remark}"
        )
    return "\n".join(lines)


def fitted_actuators(fit: RobotFit, lean: Array) -> tuple[Actuator, ...]:
    """Returns the actuators of a fit that lean by angles (n,) [rad], see `turned_frames`, by the
    laws that they had before."""
    parts = []
    center = fit.estimate("center")
    unsure = uncertainties(fit)
    layout = fit.model.layout
    share = np.exp(fit.estimate("strength"))
    frames = turned_frames(layout, fit.estimate("mounting"), lean)
    for i, part in enumerate(layout.actuators):
        moved = part.turned(frames[i], np.array(part.position) - center, uncertainty=unsure[i])
        parts.append(moved.scaled(float(share[i])))
    return tuple(parts)


def with_lean(layout: Layout, lean: Array) -> Layout:
    """Returns a robot whose actuators lean by angles (n,) [rad]; see `turned_frames`."""
    frames = turned_frames(layout, np.zeros(layout.n), lean)
    pairs = zip(layout.actuators, frames, strict=True)
    return replace(layout, actuators=tuple(part.turned(frame) for part, frame in pairs))


def uncertainties(fit: RobotFit) -> tuple[Uncertainty, ...]:
    """Returns how far each actuator's force may be from what was found: the mean over strength and
    lean, with the share of it that all strengths have together."""
    place = fit.fitted.unknowns.slice_of("strength")
    covariance = fit.covariance[place, place]
    own = np.sqrt(np.diag(covariance))
    n = len(own)
    alike = (covariance / np.outer(own, own)).sum() / n if n > 1 else 1.0
    together = float(np.clip((alike - 1.0) / max(n - 1, 1), 0.0, 1.0))
    shares = np.sqrt(
        0.5 * (fit.standard_error("strength") ** 2 + fit.standard_error("lean") ** 2)
    ).tolist()
    return tuple(
        Uncertainty(
            share, common=f"swim of {fit.model.layout.name}"[:64].strip(), correlation=together
        )
        for share in shares
    )


def write_robot(fit: RobotFit, path: str | os.PathLike[str]) -> Layout:
    """Writes the layout that a fit gives, and tables beside it where its fins follow another law.
    Raises DataError or LayoutError: a table or the layout cannot be written."""
    layout = fit.model.layout
    place = Path(path)
    lean = fit.estimate("lean")
    certain = np.abs(lean) > np.maximum(LEAN_ERRORS * fit.standard_error("lean"), LEAN_MIN)
    parts = list(fitted_actuators(fit, np.where(certain, lean, 0.0)))
    for i, (drawn, part) in enumerate(zip(layout.actuators, parts, strict=True)):
        if (
            isinstance(drawn, Fin)
            and isinstance(part, Fin)
            and (fit.other_law or part.model.type == "table")
        ):
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
    force = float(np.exp(fit.estimate("strength")[i])) * np.asarray(law.force(command))
    shape = fit.optional_estimate(SHAPE)
    if shape is not None:
        force = force * thrust_factor(fit.model.shape_terms(command), shape)[:, None]
    power = np.asarray(law.power(command))
    notes = [f"fin {fin.name}, fitted to a swim of the whole robot"]
    return table_text(
        notes, [*COLUMNS, POWER_COLUMN], np.hstack([command, force, power[:, None]]), 8
    )


def _body(fit: RobotFit) -> Body:
    model = fit.model
    unknowns = fit.fitted.unknowns
    vector = fit.fitted.vector
    fitted = model.bodies(unknowns, vector[None])
    hull = None if model.layout.body is None else model.layout.body.hull
    if hull is not None:
        hull = replace(hull, center_m=tuple(np.array(hull.center_m) - fit.estimate("center")))
    own = model.dynamics.inertia - np.array(model.body.added_mass or (0.0,) * 6)
    added = np.maximum(fitted.inertia[:, 0] - own, 0.0)
    return replace(
        model.body,
        hull=hull,
        added_mass=tuple(added.tolist()),
        linear_damping=tuple(fitted.linear_damping[:, 0].tolist()),
        quadratic_damping=tuple(fitted.quadratic_damping[:, 0].tolist()),
        center_of_buoyancy_m=tuple(fitted.center_of_buoyancy[:, 0].tolist()),
        buoyancy_n=max(float(fitted.buoyancy[0]), 0.0),
    )
