"""Which jobs a report needs, by table. Sections look their results up here, by method, split or setting."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

from finlab.errors import DataError
from finlab.evaluation.experiments.ablation import REFINEMENTS, VARIANTS
from finlab.evaluation.experiments.cost import OBJECTIVES, cost_sets
from finlab.evaluation.experiments.hard_days import choose_days
from finlab.evaluation.experiments.temperature import PAPER_TEMPERATURE, TEMPERATURES
from finlab.evaluation.experiments.training_study import CHANGES
from finlab.evaluation.method_specs import (
    QUICK,
    SLOW,
    Checkpoints,
    fingerprint,
    is_slow,
    surrogate_fingerprint,
)
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.report import work
from finlab.evaluation.report.jobs import Job
from finlab.evaluation.report.sizes import RERUN, Settings, Sizes
from finlab.evaluation.splits import GEOMETRIES, SPLITS

COST_METHODS = ("search", "mdn", "analytic", "sqp")
"""Methods whose costs are compared with the best of many starts."""
N_STARTS = 32
"""Of that yardstick."""
COST_SETS = tuple(name for name in cost_sets("all") if name not in GEOMETRIES)
"""Sets of cases on which costs are compared: all but those whose geometry alone is hard."""
LATENCY_METHODS = ("search", "mdn", "analytic", "qp", "sqp", "paper", "ipopt")
"""Methods that are timed side by side."""
N_CANDIDATES = 64
"""Candidates of the ablation, as in the paper."""
SHARES = {"paper": 50, "sqp": 5}
"""Method -> it answers one target in so many of a split: those that take milliseconds per target.
Intervals are by layout, and all layouts are kept."""
SCATTER_FINS, SCATTER_TARGETS = 4, 3
"""Fins of the layout, and its targets, whose candidates are drawn before and after refinement."""
SWIMMERS = {
    "trajectory": "search,on-board",
    "faults": "search,on-board",
    "velocity": "search,search-effort,analytic,on-board",
}
"""Experiment in closed loop -> methods that swim."""
DAY_METHODS = "search,analytic,on-board"
"""Methods that swim the hard days."""
SLOW_DAY_METHODS = ("sqp", "paper")
"""Those that swim them in a section of their own, as they take hours."""
SECTIONS = {
    "wrench": ("wrench", "rerun"),
    **{name: (name,) for name in ("cost", "network", "modes", "unreachable", "beyond")},
    **{name: (name,) for name in ("steadiness", "sequences")},
    "latency": ("latency", "first_answers"),
    "closed-loop": ("trajectory", "faults", "velocity"),
    "hard-days": ("swims",),
    "slow-days": ("swims", "slow_swims"),
    "ablation": ("ablation",),
    "temperature": ("temperature", "scatter"),
    "training": ("training",),
}
"""Section of the page -> its tables."""
OPTIONAL = ("slow-days",)
"""Sections that take hours: they are run where they are named, and no part of `all`."""
WHOLE = ("ablation", "temperature")
"""Sections that are left out while a part of them is missing."""


def parse_sections(names: str) -> list[str]:
    """Sections from their names with commas between, or `all` (but `OPTIONAL`); `DataError` for any other."""
    words = [word.strip() for word in names.split(",") if word.strip()]
    if words == ["all"]:
        return [name for name in SECTIONS if name not in OPTIONAL]
    if not words or (unknown := [word for word in words if word not in SECTIONS]):
        got = unknown[0] if words else names
        raise DataError(f"sections: expected all or some of {', '.join(SECTIONS)}, got {got!r}")
    return words


@dataclass(frozen=True)
class Plan:
    """Jobs of a report."""

    tables: dict[str, dict[Any, Job]] = field(default_factory=dict)
    """Table -> jobs by what tells them apart: `wrench` and `rerun` by (split, method), `cost` by (set of
    cases, objective), `network` by (fins, objective), `swims` by the day, `slow_swims` by (day, method),
    `ablation` by (variant, refinement), `temperature` and `training` by what is changed; the others are one
    job each, under the key ()."""

    def only(self, sections: Collection[str]) -> "Plan":
        """The jobs of some sections."""
        wanted = [table for section in sections for table in SECTIONS[section]]
        return Plan({table: jobs for table, jobs in self.tables.items() if table in wanted})

    def only_done(self, folder: Path) -> "Plan":
        """The jobs whose results are there; a study that lacks a part is left out whole."""
        left = {
            table: {key: job for key, job in jobs.items() if job.done(folder)}
            for table, jobs in self.tables.items()
        }
        for tables in (SECTIONS[section] for section in WHOLE):
            if any(left.get(table) != self.tables.get(table) for table in tables):
                left |= {table: {} for table in tables}
        return Plan({table: jobs for table, jobs in left.items() if jobs})

    def __iter__(self) -> Iterator[Job]:
        """Every job, the longest kinds first."""
        return (job for jobs in self.tables.values() for job in jobs.values())


def make_plan(sizes: Sizes, *, seed: int, checkpoints: Checkpoints, runs: Path) -> Plan:
    """The jobs of a report; what needs CasADi or PyTorch is left out where it is not installed. The small
    trainings have their runs in the folder `runs`."""
    casadi, torch = (find_spec(package) is not None for package in ("casadi", "torch"))
    prints = cache(lambda method: fingerprint(method, checkpoints.of(method)))
    names, costed, timed = (
        [name for name in each if casadi or name != "ipopt"]
        for each in ((*QUICK, *SLOW), COST_METHODS, LATENCY_METHODS)
    )
    tables: dict[str, dict[Any, Job]] = {table: {} for tables in SECTIONS.values() for table in tables}

    def add(table: str, key: tuple[Any, ...], who: Sequence[str], **settings: Any) -> None:
        parts = (f"{part:.3g}" if isinstance(part, float) else str(part) for part in key)
        settings = {**sizes.of_table.get(table, {}), **settings}
        settings.setdefault("seed", seed)
        together = "".join(dict.fromkeys(map(prints, who)))
        name, do, context = "-".join([table, *parts]), getattr(work, table), {"checkpoints": checkpoints}
        tables[table][key] = Job(name, do, settings, together, context, alone=table == "latency")

    for split, objective in product(COST_SETS, OBJECTIVES):
        about = {"split": split, "objective": objective, "methods": costed, "starts": N_STARTS}
        add("cost", (split, objective), costed, **about)
    for method, split in product(sorted(names, key=lambda name: name != "paper"), SPLITS):
        share, about = SHARES.get(method, 1), {"split": split, "method": method}
        size = sizes.of_split(main=split in paper_figures()["wrench_tracking"], slow=is_slow(method))
        add("wrench", (split, method), [method], **about, **_fewer(size, share))
        if not is_slow(method):
            size = _fewer(sizes.of_table["rerun"], share) | {"seed": seed + RERUN}
            add("rerun", (split, method), [method], **about, **size)
    for fins, objective in product(sizes.of_table["network"]["fins"], OBJECTIVES):
        add("network", (fins, objective), ["mdn"], fins=fins, objective=objective)
    for by, variant in product(REFINEMENTS, VARIANTS):
        drawn = {"candidates": N_CANDIDATES, "temperature": PAPER_TEMPERATURE}
        add("ablation", (variant, by), ["paper"], variant=variant, refinement=by, **drawn)
    for value in TEMPERATURES:
        add("temperature", (value,), ["paper"], temperature=value)
    add("scatter", (), ["paper"], fins=SCATTER_FINS, targets=SCATTER_TARGETS)
    add("latency", (), timed, methods=timed)
    for table in ("sequences", *(["beyond"] if casadi else [])):
        add(table, (), QUICK, methods=list(QUICK))
    for table in ("modes", "steadiness", "first_answers", *(["unreachable"] if casadi else [])):
        add(table, (), ["search"])
    for table, swimmers in SWIMMERS.items():
        if table in sizes.of_table:
            add(table, (), ["search"], methods=swimmers)
    for day in choose_days(sizes.of_table["swims"]["scenarios"]) if "swims" in sizes.of_table else ():
        add("swims", (day.name,), ["search"], scenarios=day.name, methods=DAY_METHODS)
        for method in SLOW_DAY_METHODS:
            about = {"scenarios": day.name, "methods": method, "seeds": sizes.of_table["swims"]["seeds"]}
            add("slow_swims", (day.name, method), [method], **about)
    if torch:
        tables["training"] = training_jobs(sizes.of_table["training"] | {"seed": seed}, runs)
    return Plan({table: jobs for table, jobs in tables.items() if jobs})


def _fewer(size: Settings, share: int) -> Settings:
    """One target in so many, at least one."""
    return size | {"targets": max(1, size["targets"] // share)}


def training_jobs(settings: Settings, folder: Path) -> dict[Any, Job]:
    """The small trainings, by change.

    Args:
        settings: `preset`, `steps`, `batch_size`, `layouts`, `targets` and `seed`.
        folder: for the training runs.
    """
    prints = surrogate_fingerprint("paper")
    size = "{preset}-{steps}x{batch_size}-seed{seed}".format(**settings)
    return {
        (change,): Job(
            f"training-{change}",
            work.training,
            {"change": change, **settings},
            prints,
            {"folder": str(folder / f"{change}-{size}-{prints[:8]}")},
        )
        for change in CHANGES
    }
