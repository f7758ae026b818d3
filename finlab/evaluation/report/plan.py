"""Which jobs a report needs, by table. Sections look their results up here, by method, split or setting."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

from finlab.evaluation.experiments.ablation import REFINEMENTS, VARIANTS
from finlab.evaluation.experiments.cost import OBJECTIVES, cost_sets
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
from finlab.evaluation.report.sizes import Sizes
from finlab.evaluation.splits import SPLITS
from finlab.evaluation.statistics.records import Columns

COST_METHODS = ("search", "mdn", "analytic", "sqp", "multistart")
"""Methods whose costs are compared with the best of many starts."""
N_STARTS = 32
"""Of that yardstick."""
LATENCY_METHODS = ("search", "mdn", "analytic", "qp", "sqp", "multistart", "paper", "trf", "slsqp", "ipopt")
"""Methods that are timed side by side."""
N_CANDIDATES = 64
"""Candidates of the ablation, as in the paper."""
SCATTER_FINS, SCATTER_TARGETS = 4, 3
"""Fins of the layout, and its targets, whose candidates are drawn before and after refinement."""


WHOLE = ("ablation", "temperature", "scatter")
"""Studies that say something only when all of their jobs are done."""


@dataclass(frozen=True)
class Plan:
    """All jobs of a report."""

    cost: dict[tuple[str, str], Job] = field(default_factory=dict)
    """By set of cases and objective."""
    wrench: dict[tuple[str, str], Job] = field(default_factory=dict)
    """By split and method."""
    ablation: dict[tuple[str, str], Job] = field(default_factory=dict)
    """By variant and refinement, of the paper's network."""
    temperature: dict[float, Job] = field(default_factory=dict)
    """By temperature."""
    scatter: dict[str, Job] = field(default_factory=dict)
    """One job, `paper`."""
    training: dict[str, Job] = field(default_factory=dict)
    """By change."""
    tables: dict[str, Job] = field(default_factory=dict)
    """Jobs that give the rows of one table: the closed-loop experiments `trajectory`, `faults` and `velocity`
    (none in a tiny report), and `latency`."""

    def only_done(self, folder: Path) -> "Plan":
        """The jobs whose results are there; a study that lacks a part is left out whole."""
        left: dict[str, Any] = {}
        for group in fields(self):
            jobs = getattr(self, group.name)
            done = {key: job for key, job in jobs.items() if job.done(folder)}
            whole = group.name in WHOLE and len(done) < len(jobs)
            left[group.name] = {} if whole else done
        return Plan(**left)

    def __iter__(self) -> Iterator[Job]:
        """Every job once, the longest kinds first."""
        jobs = (job for group in fields(self) for job in getattr(self, group.name).values())
        yield from {job.name: job for job in jobs}.values()


def make_plan(sizes: Sizes, *, seed: int, checkpoints: Checkpoints, runs: Path) -> Plan:
    """The jobs of a report; what needs CasADi or PyTorch is left out where it is not installed. The small
    trainings have their runs in the folder `runs`."""
    casadi, torch = (find_spec(package) is not None for package in ("casadi", "torch"))
    names = [name for name in (*QUICK, *SLOW) if casadi or name != "ipopt"]
    prints = {name: fingerprint(name, checkpoints.of(name)) for name in names}

    def together(methods: list[str]) -> str:
        return "".join(dict.fromkeys(prints[name] for name in methods))

    def job(
        name: str, do: Callable[..., Columns], spec: str, size: tuple[int, int] | None = None, **settings: Any
    ) -> Job:
        settings |= {"seed": seed} | ({} if size is None else {"layouts": size[0], "targets": size[1]})
        return Job(name, do, settings, prints[spec], {"checkpoint": checkpoints.of(spec)})

    costed = [name for name in COST_METHODS if name in prints]
    cost: dict[tuple[str, str], Job] = {}
    for name, objective in product(cost_sets("all"), OBJECTIVES):
        about = {"split": name, "objective": objective, "starts": N_STARTS, "seed": seed}
        about |= {"methods": costed, "layouts": sizes.cost[0], "targets": sizes.cost[1]}
        known = {"checkpoint": checkpoints.default}
        cost[name, objective] = Job(f"cost-{name}-{objective}", work.cost, about, together(costed), known)
    wrench = {}
    for name in sorted(names, key=lambda name: name != "paper"):
        for split in SPLITS:
            main = split in paper_figures()["wrench_tracking"]
            size = sizes.of_split(main=main, slow=is_slow(name))
            about = {"split": split, "method": name}
            wrench[split, name] = job(f"wrench-{split}-{name}", work.wrench, name, size, **about)
    drawn = {"candidates": N_CANDIDATES, "temperature": PAPER_TEMPERATURE}
    ablation = {}
    for by, variant in product(REFINEMENTS, VARIANTS):
        name, change = f"ablation-{variant}-{by}", {"variant": variant, "refinement": by}
        ablation[variant, by] = job(name, work.ablation, "paper", sizes.ablation, **change, **drawn)
    temperature = {
        t: job(f"temperature-{t:.3g}", work.temperature, "paper", sizes.temperature, temperature=t)
        for t in TEMPERATURES
    }
    scatter = job("scatter", work.scatter, "paper", fins=SCATTER_FINS, targets=SCATTER_TARGETS)
    preset, steps, batch_size = sizes.training
    study = {"preset": preset, "steps": steps, "batch_size": batch_size, "seed": seed}
    study |= {"layouts": sizes.trained[0], "targets": sizes.trained[1]}
    tables = {}
    for do, n_runs, options in (
        (work.trajectory, sizes.swims[0], {"methods": "search,on-board"}),
        (work.faults, sizes.swims[1], {"methods": "search,on-board", "pairs": sizes.lost_pairs}),
        (work.velocity, sizes.swims[2], {"methods": "search,search-effort,analytic,on-board"}),
    ):
        if n_runs:
            tables[do.__name__] = job(f"swim-{do.__name__}", do, "search", runs=n_runs, **options)
    calls, budget_s = sizes.latency
    methods = [name for name in LATENCY_METHODS if name in prints]
    tables["latency"] = Job(
        "latency",
        work.latency,
        {"seed": seed, "methods": methods, "calls": calls, "budget_s": budget_s},
        together(methods),
        {"checkpoints": checkpoints},
        alone=True,
    )
    return Plan(
        cost=cost,
        wrench=wrench,
        ablation=ablation,
        temperature=temperature,
        scatter={"paper": scatter},
        training=training_jobs(study, runs) if torch else {},
        tables=tables,
    )


def training_jobs(settings: dict[str, Any], folder: Path) -> dict[str, Job]:
    """The small trainings, by change.

    Args:
        settings: `preset`, `steps`, `batch_size`, `layouts`, `targets` and `seed`.
        folder: for the training runs.
    """
    prints = surrogate_fingerprint("paper")
    size = "{preset}-{steps}x{batch_size}-seed{seed}".format(**settings)
    return {
        change: Job(
            f"training-{change}",
            work.training,
            {"change": change, **settings},
            prints,
            {"folder": str(folder / f"{change}-{size}-{prints[:8]}")},
        )
        for change in CHANGES
    }
