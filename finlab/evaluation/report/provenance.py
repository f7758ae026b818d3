"""Where and from what a report was made: enough to make it again and to trace every number."""

import subprocess
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import finlab
from finlab.evaluation.experiments.latency import machine
from finlab.evaluation.report.document import Block, Column, Fold, Table
from finlab.evaluation.report.jobs import THREADS
from finlab.evaluation.report.results import Results
from finlab.evaluation.report.sizes import Sizes


def source_commit() -> str:
    """Commit of the source tree this runs from; the package's version where there is none."""

    def git(*arguments: str) -> str:
        root = Path(finlab.__file__).resolve().parent.parent
        command = ["git", "-C", str(root), *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()

    try:
        commit = git("rev-parse", "--short=10", "HEAD")
        changed = git("status", "--porcelain", "--untracked-files=no", "--", "finlab", "checkpoints")
    except (OSError, subprocess.SubprocessError):
        return f"version {finlab.__version__}"
    return f"{commit}+" if changed else commit


@dataclass(frozen=True)
class Provenance:
    """What a reader needs to make the report again."""

    checkpoints: dict[str, str]
    """Name of each checkpoint -> SHA-256 of its weights."""
    seed: int
    """Of all draws."""
    command: str
    """That makes it again."""
    commit: str = field(default_factory=source_commit)
    """Of the source tree, `+` for changes that are not in it; the version where there is no tree."""
    made: str = field(default_factory=lambda: time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()))
    """Time of day, UTC."""
    machine: dict[str, str] = field(default_factory=lambda: machine() | {"threads": str(THREADS)})
    """Processor, cores, threads of a part, and versions."""

    def about(self) -> dict[str, Any]:
        """What stands above the rows for scripts."""
        return {key: value for key, value in asdict(self).items() if key not in ("command", "made")}


def how_made_blocks(results: Results, provenance: Provenance, sizes: Sizes) -> list[Block]:
    """The section that says so."""
    machine = ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in provenance.machine.items())
    prints = [f"\n- Checkpoint `{name}`: SHA-256 `{value}`" for name, value in provenance.checkpoints.items()]
    columns = (
        Column("name", "part", "code"),
        Column("seconds", "seconds", "three"),
        Column("made", "made"),
        Column("commit", "commit", "code"),
        Column("settings", "settings"),
    )
    rows, hours = [], 0.0
    for job in results.plan:
        settings = ", ".join(f"{key} {value}" for key, value in job.settings.items())
        _, made = job.result(results.folder)
        rows.append({**made, "name": job.name, "settings": settings})
        hours += made["seconds"] / 3600.0
    then = ", and the same with `--sections slow-days`" if "slow_swims" in results.tables else ""
    return [
        "## How this was made",
        f"- Command: `{provenance.command}`{then} (size {sizes.name}, seed {provenance.seed})\n"
        f"- Commit `{provenance.commit}`, {provenance.made}\n"
        f"- Machine: {machine}\n"
        f"- Time: {hours:.1f} hours by the clock for all parts together, one core each" + "".join(prints),
        (
            "Each part is kept as a file of records, one entry per target, found by its settings and the "
            "fingerprint of the weights; a report that was stopped goes on where it was. The columns are "
            "described in [docs/evaluation.md](../evaluation.md). Every table here is computed from those "
            "files."
        ),
        (
            "Figures called printed are from Y. Hamamatsu, M. Kruusmaa, A. Ristolainen, Layout-independent "
            "actuation allocator for fin-actuated marine robots; `finlab/evaluation/paper_figures.yaml` "
            "names the table of each. They stand beside ours and in comparisons with them, and enter no "
            "other number."
        ),
        Fold("Every part, with its settings", (Table(columns, rows),)),
    ]
