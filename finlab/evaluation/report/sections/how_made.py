"""How the report was made: enough to make it again and to trace every number."""

from __future__ import annotations

from finlab.evaluation.report.document import Block, Bullets, Column, Fold, Heading, Table, Text
from finlab.evaluation.report.provenance import Provenance
from finlab.evaluation.report.results import Results
from finlab.evaluation.report.sizes import Sizes


def how_made_blocks(results: Results, provenance: Provenance, sizes: Sizes) -> list[Block]:
    """The whole section."""
    machine = ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in provenance.machine.items())
    prints = [f"Checkpoint `{name}`: SHA-256 `{value}`" for name, value in provenance.checkpoints.items()]
    columns = (
        Column("name", "part"),
        Column("seconds", "seconds", "three"),
        Column("made", "made"),
        Column("commit", "commit"),
        Column("settings", "settings"),
    )
    rows = []
    for job in results.plan:
        meta = job.result(results.store).meta
        settings = {key: value for key, value in meta["settings"].items() if key not in ("work", "prints")}
        words = ", ".join(f"{key} {value}" for key, value in settings.items())
        rows.append({"name": f"`{job.name}`", "settings": words, **{k: meta[k] for k in ("seconds", "made")}})
        rows[-1]["commit"] = f"`{meta['commit']}`"
    return [
        Heading("How this was made"),
        Bullets(
            (
                f"Command: `{provenance.command}` (size {sizes.name}, seed {provenance.seed})",
                f"Commit `{provenance.commit}`, {provenance.made}",
                f"Machine: {machine}",
                *prints,
            )
        ),
        Text(
            "Each part is kept as a file of records, one entry per target, found by its settings and the "
            "fingerprint of the weights; a report that was stopped goes on where it was. The columns are "
            "described in [docs/evaluation.md](../evaluation.md). Every table here is computed from those "
            "files."
        ),
        Text(
            "Figures called printed are from Y. Hamamatsu, M. Kruusmaa, A. Ristolainen, Layout-independent "
            "actuation allocator for fin-actuated marine robots; `finlab/evaluation/paper_figures.yaml` "
            "names the table of each. They are shown, never used to compute anything."
        ),
        Fold("Every part, with its settings", (Table(columns, rows),)),
    ]
