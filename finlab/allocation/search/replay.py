"""How an answer came about: the search that led to a command, done once more and told step by step."""

from typing import NamedTuple

import numpy as np

from finlab.allocation.search.levenberg_marquardt import refine
from finlab.allocation.search.pipeline import Pipeline
from finlab.allocation.search.prepared import Prepared
from finlab.allocation.solution import Path
from finlab.arrays import Array
from finlab.forces import force_space

SEEN = 0.02
"""Share of the answer's largest force by which some force must change for a step to be told."""
REST = 0.01
"""The same as a share of what the fins can give, for answers that hardly push."""
LAST_STEPS = 4
"""Most steps of refinement that are told: the error has long vanished by then."""
DONE = 1e-6
"""Normalized error at which refinement ends."""


class Starts(NamedTuple):
    """Searches that begin alike."""

    seeds: Array
    """Sizes of forces (S, n), or planar forces (S, 2, n) [N]."""
    names: tuple[str, ...]
    """What each is called; those beyond have no name of their own."""
    steps: int
    """Most quadratic problems."""
    works: Array | None = None
    """0 where a fin has to rest (S, n), else 1."""


def replay(
    pipeline: Pipeline, prepared: Prepared, wrench: Array, command: Array, starts: tuple[Starts, ...]
) -> Path:
    """The path to a command (n, 3) that delivers a wrench (6,) [N, N m]: of all searches the one that ends
    nearest to it, first in force space, then in commands."""
    target = (wrench / pipeline.std)[None]
    wanted = prepared.plant.forces(command)
    unit = float(prepared.planar.fins.maximum.max())
    shares = (None,) if pipeline.objective.convex else (force_space.IDLE, 0.0, None)
    best, chosen = np.inf, None
    for start in starts:
        many = np.repeat(target, len(start.seeds), axis=0)
        planar = force_space.descend(prepared.planar, many, start.seeds, start.steps, start.works)
        for share in shares:
            ends = prepared.commands.feasible(force_space.realize(prepared.planar, planar, share)[0])
            ends = refine(prepared.commands, many, ends, LAST_STEPS).command
            away = np.linalg.norm(prepared.plant.forces(ends) - wanted, axis=-1).max(axis=-1)
            if away.min() < best - 1e-6 * unit:  # of equal ones the first, which is the answer's own
                best, chosen = float(away.min()), (start, int(away.argmin()), share)
    assert chosen is not None
    start, k, share = chosen
    works = None if start.works is None else start.works[[k]]
    steps: list[tuple[str, Array]] = []

    def tell(name: str, planar: force_space.Planar) -> None:
        found, _ = force_space.realize(prepared.planar, planar, share)
        steps.append((name, prepared.commands.feasible(found)[0]))

    if start.seeds.ndim == 3:
        tell("start", force_space.polar(prepared.planar, start.seeds[[k]].swapaxes(1, 2)))
    for step in range(1, start.steps + 1):
        planar = force_space.descend(prepared.planar, target, start.seeds[[k]], step, works)
        tell(f"search, step {step}", planar)
    began = start.names[k] if k < len(start.names) else "another start"
    return refined_path(prepared, target, steps, command, began)


def refined_path(
    prepared: Prepared, target: Array, steps: list[tuple[str, Array]], command: Array, start: str
) -> Path:
    """The path on from the last of some steps: by Levenberg-Marquardt, then the answer. Of steps that hardly
    differ the first is told.

    Args:
        prepared: the layout.
        target: normalized wrench (1, 6) that the search goes for.
        steps: names and commands (n, 3) of those so far, at least one.
        command: the answer (n, 3).
        start: where the path began.
    """
    size = prepared.plant.forces(command)
    seen = max(SEEN * float(np.abs(size).max()), SEEN * REST * float(prepared.planar.fins.maximum.max()))

    def differ(a: Array, b: Array) -> bool:
        return bool(np.abs(prepared.plant.forces(a) - prepared.plant.forces(b)).max() > seen)

    told = steps[:1]
    for step in steps[1:]:
        if differ(step[1], told[-1][1]):
            told.append(step)
    last = steps[-1][1]
    for k in range(1, LAST_STEPS + 1):
        found = refine(prepared.commands, target, last[None], 1)
        error = float(np.linalg.norm(prepared.commands.wrench(last[None]) - target))
        last = found.command[0]
        if found.error[0] <= DONE or not (differ(last, told[-1][1]) or found.error[0] < 0.5 * error):
            break
        told.append((f"refinement, step {k}", last))
    names, commands = zip(*told, ("answer", command), strict=True)
    return Path(np.stack(commands), names, start)
