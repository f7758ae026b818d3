"""What learning buys: the network's seeds against random and quasi-random ones, all else equal.

Every kind of seed gives the same number of commands per target; all are refined by the same number of
Levenberg-Marquardt steps on the surrogate and scored by the plant. Of each target's refined commands
the surrogate picks the answer: the cheapest exact one, or the most exact one.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.allocation.learned.levenberg_marquardt import refine
from finlab.allocation.learned.prepared import Prepared
from finlab.allocation.learned.proposal import propose
from finlab.allocation.learned.refined_candidates import RANKING
from finlab.evaluation.progress import progress
from finlab.evaluation.splits import Case
from finlab.evaluation.statistics.bootstrap import mean_interval
from finlab.evaluation.statistics.tables import MET, Row, text_table
from finlab.physics import Plant
from finlab.physics.energy import command_energy

Array = NDArray[Any]

STEPS = (0, 1, 2, 4, 8)
"""Numbers of refinement steps that are compared."""
KINDS = ("network", "random", "quasi-random")
"""Seeds: the mixture's best candidates; uniform commands within the limits; a scrambled Sobol sequence."""


def seed_rows(
    allocator: LearnedAllocator, cases: Sequence[Case], *, n_seeds: int = 16, seed: int = 0
) -> list[Row]:
    """One row per fin count, kind of seed and number of steps.

    Args:
        allocator: gives network, surrogate and normalization.
        cases: layouts with targets.
        n_seeds: commands per target.
        seed: of all draws.
    """
    found: dict[tuple[int, str, int], list[tuple[Array, Array, Array]]] = {}
    for k, case in enumerate(progress(cases, "layout")):
        layout = case.healthy
        prepared, plant = allocator.pipeline.prepare(layout), Plant(layout)
        for kind in KINDS:
            start = _commands(kind, allocator, prepared, case.targets, n_seeds, seed)
            for steps in STEPS:
                command = _answer(allocator, prepared, case.targets, start, steps)
                error = allocator.normalization.error(plant.wrench(command), case.targets)
                energy = command_energy(command, prepared.upper)
                part = (np.full(len(error), k), error, energy)
                found.setdefault((layout.n_fins, kind, steps), []).append(part)
    ordered = sorted(found, key=lambda key: (key[0], key[2], KINDS.index(key[1])))
    joined = {key: tuple(map(np.concatenate, zip(*parts, strict=True))) for key, parts in found.items()}
    return [_row(*key, joined[key], joined[key[0], KINDS[0], key[2]]) for key in ordered]


def seed_report(rows: Sequence[Row], n_seeds: int) -> str:
    """The rows as a table, with what scored them."""
    note = (
        f"{n_seeds} seeds per target for every kind, the same Levenberg-Marquardt steps on the surrogate; "
        "scored by the plant. energy_over_network: over the targets that both met within 0.05."
    )
    return f"{text_table(rows)}\n\n{note}"


def _commands(
    kind: str, allocator: LearnedAllocator, prepared: Prepared, targets: Array, n_seeds: int, seed: int
) -> Array:
    """Commands (N, n_seeds, n, 3) inside the limits."""
    lower, upper = prepared.lower, prepared.upper
    n = len(lower)
    if kind == "network":
        mean, sigma = allocator.normalization
        target = targets / sigma
        centred = target - mean / sigma
        network, chosen = allocator.pipeline.network, allocator.settings
        count, temperature = chosen.n_candidates, chosen.temperature
        drawn = propose(network, prepared, centred, target, count, temperature, seed)
        score = drawn.error**2 + chosen.gamma * drawn.energy
        best = np.argsort(score, axis=1)[:, :n_seeds]
        command = np.take_along_axis(drawn.command, best[..., None, None], axis=1).astype(np.float64)
        return np.clip(command, lower, upper)
    if kind == "random":
        unit = np.random.default_rng(seed).random((len(targets), n_seeds, n, 3))
    else:
        # The sequence is balanced in blocks of powers of two: one is drawn whole, and its beginning taken.
        block = int(np.ceil(np.log2(n_seeds)))
        points = qmc.Sobol(3 * n, rng=np.random.default_rng(seed)).random_base2(block)[:n_seeds]
        unit = np.broadcast_to(points.reshape(1, n_seeds, n, 3), (len(targets), n_seeds, n, 3))
    return np.asarray(lower + unit * (upper - lower))


def _answer(
    allocator: LearnedAllocator, prepared: Prepared, targets: Array, start: Array, steps: int
) -> Array:
    """The chosen command (N, n, 3) of each target after refinement."""
    rows, k, n, _ = start.shape
    target = np.repeat(targets / allocator.normalization.std, k, axis=0)
    refined = refine(prepared.commands, target, start.reshape(-1, n, 3), steps)
    energy = command_energy(refined.command, prepared.upper)
    # The tolerance of the product; without refinement nothing is exact and the error decides.
    rank = np.where(refined.error > 10 * RANKING.exact_error, 1e3 + refined.error, energy).reshape(rows, k)
    return np.asarray(refined.command.reshape(rows, k, n, 3)[np.arange(rows), rank.argmin(1)])


def _row(fins: int, kind: str, steps: int, found: tuple[Array, ...], by_network: tuple[Array, ...]) -> Row:
    (layout, error, energy), (_, network_error, network_energy) = found, by_network
    both = (error <= MET) & (network_error <= MET)
    return {
        "fins": fins,
        "steps": steps,
        "seeds": kind,
        "n": len(error),
        "err_norm_mean": float(error.mean()),
        "err_norm_mean_interval": list(mean_interval(error, layout)),
        "success_0.01": float((error <= 0.01).mean()),
        "success_0.05": float((error <= MET).mean()),
        "energy_over_network": float(energy[both].sum() / network_energy[both].sum()) if both.any() else None,
    }
