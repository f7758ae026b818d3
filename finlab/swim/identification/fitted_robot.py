"""A fitted robot: its actuators and how sure they are, its layout with tables of fins, and words on
it.

A robot can learn its actuators while it swims: every minute the last four are fitted, and what
their strengths and directions turn out to be is what allocation works with from then on.
"""

import os
from collections import deque
from dataclasses import replace
from pathlib import Path

import numpy as np

from finlab.actuators.actuator import Actuator, Uncertainty
from finlab.actuators.fin.fin_model import DOUBT
from finlab.actuators.fin.force_table_file import COLUMNS, POWER_COLUMN, table_text
from finlab.arrays import Array
from finlab.errors import DataError, FinlabError
from finlab.layout import Body, Fin, FinModelSpec, Layout, load_layout, save_layout
from finlab.layout.layout import MAX_DESCRIPTION_LENGTH
from finlab.physics import make_law
from finlab.swim.identification.robot_fit import SOUND, UNTOLD, RobotFit, fit_robot
from finlab.swim.identification.robot_model import shape_factor, turned_frames
from finlab.swim.identification.swim import STEP_S, Swim, followed, only_new
from finlab.swim.identification.unknowns import SHAPE
from finlab.swim.vehicle.actuator_motion import ActuatorMotion
from finlab.swim.vehicle.fin_motion import FinMotion
from finlab.whole_file import write_whole

OTHER_LAW = "thrust that grows otherwise with amplitude and frequency"
GRID = (17, 17, 16)
"""Amplitudes, frequencies and zero directions of a fin that becomes a table."""
DEFLECTIONS = (3.0, 0.03)
"""Standard errors, and angle [rad], from which a fin's lean counts; an IMU that is mounted askew
looks like a smaller one."""


def summary(fit: RobotFit) -> tuple[str, ...]:
    """Returns what the fit is worth, a line each; the first says why it should not be trusted, if
    so."""
    doubts = fit.doubts()
    unknown = fit.untold()
    seconds = 0.1 * len(fit.model.motion)
    thrusters = any(part.KIND.force_number is not None for part in fit.model.layout.actuators)
    turned = "pushes the other way than the layout says; in the layout that is written it is turned"
    lines = {
        f"{DOUBT}: {'; '.join(doubts)}": bool(doubts),
        f"fitted to {seconds:.0f} s of swimming, of whose motion simulated swims explain "
        f"{fit.explained:.1%}": True,
        **{f"{name} {turned}": True for name in fit.opposed},
        f"used, since it helps on parts not seen: {OTHER_LAW}": fit.other_law,
        f"tried, and no help: {OTHER_LAW}": fit.other_law is False,
        "a common scale of all forces, damping and inertia does not follow from motion; it rests "
        "on the mass "
        "and added mass that the layout gave": True,
        "a force in the layout is what a thruster gives: divide it by the strength that was found "
        "for "
        "what the thruster is to be sent": thrusters,
        f"the data cannot tell {', '.join(unknown)}: there the layout's own values stand": bool(
            unknown
        ),
    }
    return tuple(line for line, holds in lines.items() if holds)


def table(fit: RobotFit) -> str:
    """Every unknown with its standard error, and how much of what was doubtful before is left."""
    unknowns = fit.fitted.unknowns
    vector = fit.fitted.vector
    error = fit.error
    width = max(len(label) for label in unknowns.labels)
    lines = [f"{'':{width}}  {'found':>10}  {'+-':>9}  doubt left"]
    rows = zip(unknowns.labels, unknowns.units, vector, error, unknowns.scale, strict=True)
    for label, unit, value, own, scale in rows:
        said = "  not determined by the data" if own > UNTOLD else ""
        lines.append(
            f"{label:{width}}  {value * scale:10.4f}  {own * scale:9.4f}  {min(own, 1.0):9.0%} "
            f"{unit}{said}"
        )
    return "\n".join(lines)


def learned(fit: RobotFit, lean: Array) -> tuple[Actuator, ...]:
    """Returns the actuators of a fit that lean by angles (n,) [rad], see `turned_frames`, by the
    laws that they had before."""
    parts = []
    center = fit.found("center")
    unsure = uncertainties(fit)
    layout = fit.model.layout
    share = np.exp(fit.found("strength"))
    frames = turned_frames(layout, fit.found("mounting"), lean)
    for i, part in enumerate(layout.actuators):
        moved = part.turned(frames[i], np.array(part.position) - center, uncertainty=unsure[i])
        parts.append(moved.scaled(float(share[i])))
    return tuple(parts)


def leaned(layout: Layout, lean: Array) -> Layout:
    """Returns a robot whose actuators lean by angles (n,) [rad]; see `turned_frames`."""
    frames = turned_frames(layout, np.zeros(layout.n), lean)
    pairs = zip(layout.actuators, frames, strict=True)
    return replace(layout, actuators=tuple(part.turned(frame) for part, frame in pairs))


def uncertainties(fit: RobotFit) -> tuple[Uncertainty, ...]:
    """Returns how far each actuator's force may be from what was found: the mean over strength and
    lean, with the share of it that all strengths have together."""
    place = fit.fitted.unknowns.place("strength")
    covariance = fit.covariance[place, place]
    own = np.sqrt(np.diag(covariance))
    n = len(own)
    alike = (covariance / np.outer(own, own)).sum() / n if n > 1 else 1.0
    together = float(np.clip((alike - 1.0) / max(n - 1, 1), 0.0, 1.0))
    shares = np.sqrt(
        0.5 * (fit.found_error("strength") ** 2 + fit.found_error("lean") ** 2)
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
    lean = fit.found("lean")
    certain = np.abs(lean) > np.maximum(DEFLECTIONS[0] * fit.found_error("lean"), DEFLECTIONS[1])
    parts = list(learned(fit, np.where(certain, lean, 0.0)))
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
    force = float(np.exp(fit.found("strength")[i])) * np.asarray(law.force(command))
    shape = fit.part(SHAPE)
    if shape is not None:
        force = force * shape_factor(fit.model.shape_terms(command), shape)[:, None]
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
        hull = replace(hull, center_m=tuple(np.array(hull.center_m) - fit.found("center")))
    own = model.dynamics.inertia - np.array(model.body.added_mass or (0.0,) * 6)
    added = np.maximum(fitted.inertia[:, 0] - own, 0.0)
    return replace(
        model.body,
        hull=hull,
        added_mass=tuple(added.tolist()),
        linear_damping=tuple(fitted.linear[:, 0].tolist()),
        quadratic_damping=tuple(fitted.quadratic[:, 0].tolist()),
        center_of_buoyancy_m=tuple(fitted.center[:, 0].tolist()),
        buoyancy_n=max(float(fitted.lift[0]), 0.0),
    )


EVERY_S, LAST_S = 60.0, 240.0
"""Time between fits [s], and how much of the swim each takes."""
DOUBTS = {"inertia": 0.3, "linear": 0.3, "quadratic": 0.3, "mounting": 0.5, "center": 0.5}
"""How doubtful body and places of the actuators are, as a share of that before a swim that shakes a
robot: a path tells less of them, and what they take up is missing in the strengths."""


class OnlineFit:
    """What a robot's actuators are, by its own swim; to be called every `STEP_S` seconds."""

    def __init__(self, layout: Layout) -> None:
        """Takes the robot as it is believed to be. Raises FinlabError: a fin is a table, whose
        strength is no number of the layout."""
        for fin in layout.fins:
            if fin.model.type == "table":
                why = "expected a law: the strength of a table is fixed"
                raise FinlabError(f"fin {fin.name} is a table, {why}")
        self.layout = layout
        """As it was believed to be before."""
        self.notes: list[str] = []
        """What each fit has found, a sentence each."""
        self.factor = np.ones((layout.n, 3))
        """By what commands to the robot as it was learned are multiplied for its drives (n, 3)."""
        self._moving = ActuatorMotion(layout, FinMotion(layout))
        self._last: deque[tuple[Array, Array]] = deque(maxlen=round(LAST_S / STEP_S))
        self._steps = 0

    def step(self, measured: Array, command: Array) -> Layout | None:
        """Returns the robot as the last minutes show it, whenever they have been fitted, by what
        the sensors said last (12,), in the order of `CHANNELS`, and the drives' command for this
        step (n, 3), NaN for those at rest."""
        self._last.append((followed(self._moving, command), measured))
        self._steps += 1
        if self._steps % round(EVERY_S / STEP_S):
            return None
        motion, said = (np.array(part) for part in zip(*self._last, strict=True))
        swim = Swim("the swim", motion, only_new(said))
        fit = fit_robot(self.layout, [swim], other_law=False, doubts=DOUBTS)
        if fit.explained < SOUND:
            self.notes.append(
                f"{self._steps * STEP_S:.0f} s: nothing is learned, since simulated swims explain "
                f"{fit.explained:.0%} of the motion, expected at least {SOUND:.0%}"
            )
            return None
        strength = np.exp(fit.found("strength"))
        error = fit.found_error("strength")
        rows = zip(self.layout.names, strength, error, strict=True)
        words = ", ".join(f"{name} {own:.2f} +- {own * unsure:.2f}" for name, own, unsure in rows)
        turned = "".join(f"; {name} pushes the other way" for name in fit.opposed)
        self.notes.append(f"{self._steps * STEP_S:.0f} s: learned strengths {words}{turned}")
        for i, part in enumerate(self.layout.actuators):
            if part.KIND.force_number is not None:
                self.factor[i, part.KIND.force_number] = 1.0 / strength[i]
        return replace(self.layout, actuators=learned(fit, fit.found("lean")))
