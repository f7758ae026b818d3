"""Answers that beat the reference, computed again: the fin law written out, apart from the plant, in double
precision. A win that came from a broken limit or a missed target would show here."""

from typing import Any

import numpy as np

from finlab.errors import DataError
from finlab.evaluation.splits import Case
from finlab.evaluation.statistics.records import Records
from finlab.evaluation.statistics.tables import MET
from finlab.layout import Layout
from finlab.layout.arrays import Array


def wrench_by_hand(layout: Layout, command: Array) -> Array:
    """Wrenches (N, 6) of commands (N, n, 3) by the drag law `F = 2 rho Cd S rc^2 (2 pi f)^2 (1 - cos 2A)`.

    Raises:
        DataError: a fin follows another law.
    """
    total = np.zeros((len(command), 6))
    for fin, (amplitude, frequency, direction) in zip(layout.fins, command.transpose(1, 2, 0), strict=True):
        if fin.model.type != "drag":
            raise DataError(f"recheck: knows the fin law drag only, fin {fin.name!r} has {fin.model.type!r}")
        law = {key: float(value) for key, value in fin.model.values().items()}
        size = 2 * law["density"] * law["drag_coefficient"] * law["area"] * law["lever"] ** 2
        thrust = size * (2 * np.pi * frequency) ** 2 * (1 - np.cos(2 * amplitude))
        across, angle = thrust * np.cos(direction), fin.mounting_angle
        force = np.stack(
            [-np.sin(angle) * across, np.cos(angle) * across, thrust * np.sin(direction)], axis=-1
        )
        total[:, :3] += force
        total[:, 3:] += np.cross(np.array(fin.position), force)
    return total


def recheck(
    cases: list[Case], records: Records, command: Array, reference: Records, sigma: Array
) -> dict[str, Any]:
    """Every target that the method meets with less energy than the reference, checked again.

    Args:
        cases: layouts with targets, as both ran on them.
        records: of the method.
        command: its commands (N, m, 3), NaN beyond a layout's fins.
        reference: records of the reference, in the same order.
        sigma: per-axis standard deviation (6,).

    Returns:
        `wins`: how many targets; `worst_error`: the largest normalized error among them; `outside`: commands
        beyond a limit; `disagreement`: largest difference from the recorded error.
    """
    wins = (records.err_norm <= MET) & (records.energy < reference.energy)
    worst, outside, disagreement = 0.0, 0, 0.0
    for k, case in enumerate(cases):
        rows = np.flatnonzero(wins & (records.layout == k))
        if len(rows) == 0:
            continue
        mine = command[rows, : case.layout.n_fins]
        outside += int(((mine < case.layout.lower) | (mine > case.layout.upper)).sum())
        difference = wrench_by_hand(case.layout, mine) - case.targets[records.target[rows]]
        error = np.linalg.norm(difference / sigma, axis=-1)
        worst = max(worst, float(error.max()))
        disagreement = max(disagreement, float(np.abs(error - records.err_norm[rows]).max()))
    return {"wins": int(wins.sum()), "worst_error": worst, "outside": outside, "disagreement": disagreement}
