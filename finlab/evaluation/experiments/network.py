"""What the network of method `mdn` buys: the same search begun from its proposals, and from as many other
seeds.

Each row answers the same targets with the same pipeline. Only where the search begins differs.
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.learned.mdn import MdnAllocator
from finlab.allocation.search.prepared import Prepared, resting_fins, resting_seeds
from finlab.arrays import Array
from finlab.evaluation.progress import progress
from finlab.evaluation.statistics.bootstrap import ratio_interval
from finlab.evaluation.statistics.tables import Row
from finlab.inference.threads import single_threaded_products
from finlab.layout import Layout, random_layout
from finlab.layout.random_fins import random_fin_model
from finlab.physics import plant_of
from finlab.physics.objective import Name

DOMAIN = 0x5EED5
"""Leads the seed of every robot here; those of training and of the splits begin otherwise."""
TRACKED = 1e-3
"""Normalized error up to which a target counts as delivered."""
STARTS = {
    "network": "the network's proposals: the components' means, the likeliest first",
    "random": "as many random sizes of the fins' forces",
    "sub-layouts": "as many random sub-layouts, in which the other fins nearly rest",
    "one": "all fins at their largest force, and nothing else",
    "all": "what method search does: for effort every sub-layout that it knows, for power the same one seed",
}
"""Where the search begins."""


class _Found(NamedTuple):
    """Answers to N targets."""

    cost: Array
    """(N,)."""
    error: Array
    """Normalized (N,)."""
    ms: Array
    """The processor's time [ms] for each (N,)."""


def network_rows(
    allocator: MdnAllocator, fins: Sequence[int], objective: Name, *, layouts: int, targets: int, seed: int
) -> list[Row]:
    """One row for each number of fins and each of `STARTS`.

    Costs are compared where both the row and "all" deliver the target.

    Args:
        allocator: method `mdn`, with as many candidates as seeds are given to the others.
        fins: numbers of fins.
        objective: what is kept least.
        layouts: robots for each number, of which half have fins of one random model, half each its own.
        targets: wrenches of uniform commands on each.
        seed: of robots, targets and random seeds.
    """
    method = allocator.with_settings(objective=objective)
    rows: list[Row] = []
    for count in fins:
        parts: dict[str, list[_Found]] = {name: [] for name in STARTS}
        for k in progress(range(layouts), "robot", f"{count} fins, {objective}"):
            rng = np.random.default_rng([DOMAIN, seed, count, k])
            layout = _robot(rng, count, mixed=bool(k % 2))
            plant = plant_of(layout)
            wanted = plant.wrench(plant.sample(rng, (targets,)))
            for name in STARTS:
                parts[name].append(_answers(method, layout, wanted, name, rng))
        found = {name: _Found(*map(np.concatenate, zip(*each, strict=True))) for name, each in parts.items()}
        group = np.repeat(np.arange(layouts), targets)
        rows += [_row(count, objective, name, found, group) for name in STARTS]
    return rows


def _robot(rng: np.random.Generator, n_fins: int, mixed: bool) -> Layout:
    """A robot of the box of training, with fins that no training saw."""
    layout, model = random_layout(rng, n_fins=n_fins), random_fin_model(rng)
    fins = (replace(fin, model=random_fin_model(rng) if mixed else model) for fin in layout.fins)
    return replace(layout, fins=tuple(fins))


def _answers(
    method: MdnAllocator, layout: Layout, targets: Array, name: str, rng: np.random.Generator
) -> _Found:
    pipeline, one_thread = method.pipeline, single_threaded_products()
    prepared = pipeline.prepare(layout)
    ends, ms = [], []
    for target in targets:
        begin = time.process_time()
        with one_thread():
            seeds = _seeds(method, prepared, target[None], name, rng)
            found = pipeline.solve(prepared, target[None], seeds=seeds)
        ms.append(1e3 * (time.process_time() - begin))
        ends.append((found.cost[0, 0], found.error[0, 0]))
    cost, error = np.array(ends).T
    return _Found(cost, error, np.array(ms))


def _seeds(
    method: MdnAllocator, prepared: Prepared, target: Array, name: str, rng: np.random.Generator
) -> Array | None:
    """Where the search for one target (1, 6) begins; None for where method `search` would."""
    maximum, n = prepared.planar.fins.maximum, prepared.plant.n_fins
    count = method.settings.n_candidates
    if name == "network":
        return method.proposals(prepared, target, 0).force
    if name == "random":
        return (rng.random((1, count, n)) ** 2) * maximum
    if name == "sub-layouts":
        known = resting_fins(n)
        chosen = rng.choice(len(known), size=min(count, len(known)), replace=False)
        return resting_seeds(maximum, tuple(known[k] for k in chosen))[None]
    return maximum[None, None] if name == "one" else None


def _row(count: int, objective: Name, name: str, found: dict[str, _Found], group: NDArray[np.int64]) -> Row:
    own, best = found[name], found["all"]
    both = (own.error <= TRACKED) & (best.error <= TRACKED)
    row: dict[str, Any] = {
        "fins": count,
        "objective": objective,
        "seeds": name,
        "n": len(own.cost),
        "error_mean": float(own.error.mean()),
        "error_max": float(own.error.max()),
        "tracked": float((own.error <= TRACKED).mean()),
    }
    if both.any():
        cost, cheapest = own.cost[both], best.cost[both]
        row |= {
            "cost_ratio": float(cost.sum() / cheapest.sum()),
            "cost_ratio_interval": list(ratio_interval(cost, cheapest, group[both])),
            "dearer": float((cost > 1.01 * cheapest).mean()),
        }
    return row | {"ms": float(np.median(own.ms))}
