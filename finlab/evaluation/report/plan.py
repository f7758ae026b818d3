"""Which jobs a report needs, by table. Sections look their results up here, by method, split or setting."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

from finlab.evaluation.experiments.ablation import REFINEMENTS, VARIANTS
from finlab.evaluation.experiments.temperature import PAPER_TEMPERATURE, TEMPERATURES
from finlab.evaluation.experiments.training_study import CHANGES
from finlab.evaluation.method_specs import (
    QUICK,
    SLOW,
    Checkpoints,
    fingerprint,
    has_distilled,
    is_slow,
    surrogate_fingerprint,
)
from finlab.evaluation.paper_figures import paper_figures
from finlab.evaluation.report import work
from finlab.evaluation.report.jobs import Job
from finlab.evaluation.report.sizes import Sizes
from finlab.evaluation.splits import SPLITS
from finlab.evaluation.statistics.records import Columns

REFERENCE = "ipopt-32"
"""Whose energies the others are measured by."""
ENERGY_METHODS = ("learned", "fast", "paper", "analytic", "sqp", "multistart", "trf", "slsqp", "ipopt")
"""Methods whose energies are compared with it."""
LATENCY_METHODS = ("learned", "fast", "analytic", "qp", "sqp", "multistart", "paper", "trf", "slsqp", "ipopt")
"""Methods that are timed side by side."""
N_CANDIDATES = 64
"""Candidates of the ablation, as in the paper."""
N_SEEDS = 16
"""Seeds per target in the comparison of seeds."""
SCATTER_FINS, SCATTER_TARGETS = 4, 3
"""Fins of the layout, and its targets, whose candidates are drawn before and after refinement."""


WHOLE = ("ablation", "temperature", "scatter")
"""Studies that say something only when all of their jobs are done."""


@dataclass(frozen=True)
class Plan:
    """All jobs of a report."""

    energy: dict[str, Job] = field(default_factory=dict)
    """By method; the reference is among them where it is installed."""
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
    """Jobs that give the rows of one table: `seeds`, the closed-loop experiments `trajectory`, `faults` and
    `velocity` (none in a tiny report), and `latency`."""

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
    names = [name for name in QUICK if name != "fast" or has_distilled(checkpoints.learned)]
    names += [name for name in (*SLOW, REFERENCE) if casadi or "ipopt" not in name]
    prints = {name: fingerprint(name, checkpoints.of(name)) for name in names}

    def job(
        name: str, do: Callable[..., Columns], spec: str, size: tuple[int, int] | None = None, **settings: Any
    ) -> Job:
        settings |= {"seed": seed} | ({} if size is None else {"layouts": size[0], "targets": size[1]})
        return Job(name, do, settings, prints[spec], {"checkpoint": checkpoints.of(spec)})

    energy = {}
    for name in (REFERENCE, *ENERGY_METHODS):
        if name in prints:
            layouts, targets = sizes.energy
            size = layouts, sizes.energy_slow if is_slow(name) and name != REFERENCE else targets
            energy[name] = job(f"energy-{name}", work.energy, name, size, method=name)
    wrench = {}
    for name in sorted(names, key=lambda name: name != "paper"):
        for split in SPLITS:
            if is_slow(name) and split == "id":
                wrench[split, name] = energy[name]  # the same targets, and more of them
            else:
                main = split in paper_figures()["wrench_tracking"]
                size = sizes.of_split(main=main, slow=is_slow(name))
                wrench[split, name] = job(
                    f"wrench-{split}-{name}", work.wrench, name, size, split=split, method=name
                )
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
    study |= {"layouts": sizes.seeds[0], "targets": sizes.seeds[1]}
    tables = {"seeds": job("seeds", work.seeds, "learned", sizes.seeds, candidates=N_SEEDS)}
    for do, n_runs, options in (
        (work.trajectory, sizes.swims[0], {"methods": "learned,on-board"}),
        (work.faults, sizes.swims[1], {"methods": "learned,on-board", "pairs": sizes.lost_pairs}),
        (work.velocity, sizes.swims[2], {"methods": "learned-power,learned,analytic,on-board"}),
    ):
        if n_runs:
            tables[do.__name__] = job(f"swim-{do.__name__}", do, "learned", runs=n_runs, **options)
    calls, budget_s = sizes.latency
    methods = [name for name in LATENCY_METHODS if name in prints]
    tables["latency"] = Job(
        "latency",
        work.latency,
        {"seed": seed, "methods": methods, "calls": calls, "budget_s": budget_s},
        prints["learned"] + prints["paper"],
        {"checkpoints": checkpoints},
        alone=True,
    )
    return Plan(
        energy=energy,
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
    prints = "".join(surrogate_fingerprint(name) for name in ("default", "paper"))
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
