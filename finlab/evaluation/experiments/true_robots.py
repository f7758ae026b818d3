"""What fins truly give, and layouts that say all that there is to know of a plant: the judges of fits."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from finlab.arrays import Array
from finlab.layout import FinModelSpec, Interaction, Jet, Layout
from finlab.physics import TableLaw, write_table
from finlab.physics.coupling import WIDE_AND_NARROW
from finlab.sim import inflow, wake
from finlab.sim.fin_force import FinForce, FlexibleForce
from finlab.sim.offset import ASKEW, CENTER
from finlab.sim.plants import make_plant
from finlab.vehicle.fin_motion import FinMotion

SETTLE_S, MEAN_S = 2.0, 10.0
"""Time after which, and over which, forces are averaged that swing within the beat."""
TABLE = 9
"""Amplitudes and frequencies at which the mean law of a soft fin is tabulated."""


def true_wrench(plant: str, layout: Layout, command: Array, velocity: Array) -> Array:
    """Mean wrenches (T, 6) [N, N m] that commands (T, n, 3) truly give a robot that moves through the water
    with (T, 6) [m/s, rad/s]."""
    found = []
    for one, water in zip(command, velocity, strict=True):
        force = make_plant(plant, layout)
        found.append(np.einsum("nk,nkw->w", _mean_force(force, layout, one, water), force.columns))
    return np.array(found)


def _mean_force(force: FinForce, layout: Layout, command: Array, water: Array) -> Array:
    """Mean forces (n, 3) of fins that follow a command (n, 3) for long."""
    motion = FinMotion(layout)
    motion.amplitude[:], motion.frequency[:], motion.direction[:] = command.T
    if not isinstance(force, FlexibleForce):
        return force.step(motion, force.step_s, water)
    dt, forces = force.step_s, []
    for k in range(round((SETTLE_S + MEAN_S) / dt)):
        motion.step(command, dt)
        step = force.step(motion, dt, water)
        if k * dt >= SETTLE_S:
            forces.append(step)
    # Each fin over whole beats of its own, or what swings within the beat would be left.
    beats = np.maximum(np.floor(MEAN_S * command[:, 1]), 1.0) / np.maximum(command[:, 1], 1.0 / MEAN_S)
    whole = np.minimum(np.rint(beats / dt).astype(int), len(forces))
    return np.array([np.mean(forces[-count:], axis=0)[i] for i, count in enumerate(whole)])


def true_layout(plant: str, layout: Layout, folder: Path) -> Layout:
    """The layout that says all that there is to know of a plant, as far as layouts can; tables that it names
    lie in a folder."""
    return TRUE_LAYOUTS[plant](layout, folder)


def _as_drawn(layout: Layout, folder: Path) -> Layout:
    return layout


def _offset(layout: Layout, folder: Path) -> Layout:
    for i, fin in enumerate(layout.fins):
        x, y, z = (np.array(fin.position) - np.array(CENTER)).tolist()
        angle = fin.mounting_angle + (ASKEW if i % 2 == 0 else -ASKEW)
        layout = layout.replace_fin(fin.name, position=(x, y, z), mounting_angle=angle)
    return layout


def _wake(layout: Layout, folder: Path) -> Layout:
    """Jets like the plant's to 0.6 % of the loss in their middle; where several meet a fin they add up, even
    beyond the plant's largest loss."""
    angle = np.linspace(0.0, np.pi, 181)
    lost = np.exp(-((angle / wake.SPREAD) ** 2))

    def best(narrowness: float) -> tuple[float, Array]:
        """What is left over, and the shares (2,) of the wide and the narrow jet."""
        jets = np.exp(narrowness * WIDE_AND_NARROW * (np.cos(angle)[:, None] - 1.0))
        share = np.linalg.lstsq(jets, lost, rcond=None)[0]
        return float(np.square(jets @ share - lost).sum()), share

    narrowness = min(np.linspace(1.0, 8.0, 141).tolist(), key=lambda tried: best(tried)[0])
    share = wake.MOST * best(narrowness)[1]
    jets = []
    for source in layout.fins:
        for target in layout.fins:
            distance = float(np.linalg.norm(np.subtract(target.position, source.position)))
            if distance > 1e-9:
                near = np.exp(-((distance / wake.REACH) ** 2))
                jets.append(Jet(source.name, target.name, tuple((near * share).tolist())))
    return replace(layout, interaction=Interaction(tuple(jets), wake.HALF_THRUST, narrowness))


def _inflow(layout: Layout, folder: Path) -> Layout:
    return replace(layout, interaction=Interaction(inflow=(inflow.MOST, 0.0)))


def _flexible(layout: Layout, folder: Path) -> Layout:
    """All fins with the mean forces of one that beats alone, as a table."""
    most = layout.upper[:, :2].max(axis=0)
    amplitude, frequency = (np.linspace(0.0, end, TABLE) for end in most)
    thrust = np.zeros((TABLE, TABLE))
    beats = [(a, f) for a in range(1, TABLE) for f in range(1, TABLE)]
    for k in range(0, len(beats), layout.n_fins):
        some = (beats[k : k + layout.n_fins] * layout.n_fins)[: layout.n_fins]
        command = np.array([[amplitude[a], frequency[f], 0.0] for a, f in some])
        force = _mean_force(FlexibleForce(layout), layout, command, np.zeros(6))
        for (a, f), own in zip(some, force, strict=True):
            thrust[a, f] = own[1]
    turns = np.linspace(-np.pi, np.pi, 13)
    parts = [thrust[..., None] * part(turns) for part in (np.zeros_like, np.cos, np.sin)]
    values = np.stack(parts, axis=-1)
    path = folder / "flexible.csv"
    axes = [amplitude, frequency, turns[:-1]]
    write_table(path, TableLaw(axes, values[:, :, :-1], True), *axes)
    for name in layout.names:
        layout = layout.replace_fin(name, model=FinModelSpec("table", (("path", str(path)),)))
    return layout


TRUE_LAYOUTS: dict[str, Callable[[Layout, Path], Layout]] = {
    "mean": _as_drawn,
    "ripple": _as_drawn,
    "flexible": _flexible,
    "wake": _wake,
    "inflow": _inflow,
    "offset": _offset,
}
"""By the plant's name."""
