"""Experiment `robots`: errors of each method on robots unlike those of the paper's training."""

from dataclasses import replace

from finlab.research.evaluation.experiments import wrench

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
"""Splits of the report."""

experiment = replace(
    wrench.experiment,
    name="robots",
    question="How far off are the wrenches of each method on robots of more fins, other limits, "
    "lost fins, nearly singular layouts, other fin laws and noisy tables?",
    program="finlab eval wrench",
    quick={"split": HARD[2:4], "methods": ("dual", "paper", "sqp"), "layouts": 10, "targets": 5},
    usual={
        "split": HARD[2:],
        "methods": ("dual", "mdn", "paper", "qp", "sqp", "analytic"),
        "layouts": 30,
        "targets": 8,
    },
    full={"layouts": 100, "targets": 20},
    pieces=("split",),
    printed=None,
    compared=None,
)
