"""Experiment `robots`: errors of each method on robots unlike those of the paper's training."""

from dataclasses import replace

from finlab.errors import DataError
from finlab.research.evaluation.document import Row
from finlab.research.evaluation.experiments import wrench
from finlab.research.evaluation.method_specs import load_method_specs
from finlab.research.evaluation.splits import SPLITS, make_split

HARD = (
    "id",
    "ood",
    "ood-fins",
    "limits",
    "failure",
    "near-singular",
    "fins-mixed",
    "tables",
    "many-fins",
)
"""Splits of robots of fins with horizontal shafts, the two of the paper first."""


def run(
    split: tuple[str, ...] = HARD[2:],
    methods: tuple[str, ...] = ("dual", "mdn", "paper", "qp", "sqp", "analytic"),
    layouts: int = 30,
    targets: int = 8,
    checkpoint: str | None = None,
    seed: int = 0,
) -> list[Row]:
    """One row for each split and method that takes its robots.

    Args:
        split: names, as in eval wrench.
        methods: names, as in eval wrench.
        layouts: of each split.
        targets: on each layout.
        checkpoint: of the learned methods, a shipped name or a folder.
        seed: of all draws.
    """
    specs = load_method_specs(methods, checkpoint)
    rows: list[Row] = []
    for name in split:
        if name not in SPLITS:
            raise DataError(f"split: expected some of {', '.join(SPLITS)}, got {name!r:.60}")
        robot = make_split(name, 1, 1, seed)[0].layout
        able = tuple(each for each, spec in specs.items() if spec.choice.kind.fits(robot))
        rows += wrench.run(
            split=(name,),
            methods=able,
            layouts=layouts,
            targets=targets,
            checkpoint=checkpoint,
            seed=seed,
        )
    return rows


experiment = replace(
    wrench.experiment,
    name="robots",
    question="How far off are the wrenches of each method on robots of more fins, other limits, "
    "lost fins, nearly singular layouts, other fin laws and noisy tables?",
    run=run,
    quick={"split": HARD[2:4], "methods": ("dual", "paper", "sqp"), "layouts": 10, "targets": 5},
    usual={},
    full={"layouts": 100, "targets": 20},
    pieces=("split",),
    measures=(*wrench.experiment.measures, "finlab/research/evaluation/experiments/robots.py"),
    printed=None,
    compared=None,
    picture=None,
    for_picture={},
    only_for_picture=None,
)
