"""Results of a run as a JSON file, and those of finlab's own methods that are shipped."""

import json
import os
import time
from pathlib import Path
from typing import Any

from finlab import __version__
from finlab.bench.problems import Problems
from finlab.evaluation.report.provenance import machine

FORMAT, VERSION = "finlab-bench-results", 2


def results(
    methods: list[dict[str, Any]], problems: Problems, *, quick: bool, limit_s: float, command: str
) -> dict[str, Any]:
    """Figures of methods, with what is needed to make them again."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "problems": problems.checksum,
        "seed": problems.about.get("seed"),
        "quick": quick,
        "limit_s": limit_s,
        "command": command,
        "finlab": __version__,
        "made": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
        "machine": {**machine(), "load": f"{os.getloadavg()[0]:.1f}"},
        "methods": methods,
    }


def stored(problems: Problems, *, quick: bool) -> dict[str, Any] | None:
    """The shipped results, where they are answers to the same questions."""
    path = Path(__file__).with_name("results-quick.json" if quick else "results.json")
    found: dict[str, Any] = json.loads(path.read_text("utf-8"))
    return found if found["problems"] == problems.checksum else None
