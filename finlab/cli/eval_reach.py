"""`finlab eval unreachable|beyond`: wrenches that a robot cannot deliver, or only just."""

from typing import Annotated

from tyro.conf import arg

from finlab.cli.eval_arguments import Cases, Count, MethodRun, Names
from finlab.cli.inputs import check_positive

METHODS, BOUNDARY = MethodRun(), Cases(layouts=25, targets=4)


def unreachable(
    layouts: Count = 50, seed: Count = 0, run: Annotated[MethodRun, arg(name="")] = METHODS
) -> None:
    """Ask for wrenches out of reach; what each policy delivers against the best possible.

    Args:
        layouts: random layouts of 2 to 8 fins per kind of limits, with one target each.
        seed: draws layouts and targets.
    """
    from finlab.evaluation.experiments.unreachable import unreachable_rows
    from finlab.evaluation.report.sections.questions import unreachable_blocks

    check_positive(layouts=layouts)
    rows = unreachable_rows(run.method("search"), n_layouts=layouts, seed=seed)
    run.show(*unreachable_blocks(rows), rows=rows)


def beyond(
    cases: Annotated[Cases, arg(name="")] = BOUNDARY,
    methods: Names = "search,mdn,analytic,sqp",
    run: Annotated[MethodRun, arg(name="")] = METHODS,
) -> None:
    """Ask for the largest wrench of a direction, and for more; what is missed beyond the least possible.

    Args:
        methods: names with commas between, as in `eval wrench`.
    """
    from finlab.evaluation.experiments.beyond_reach import beyond_reach_rows
    from finlab.evaluation.report.sections.questions import beyond_blocks

    rows = beyond_reach_rows(
        run.methods(methods),
        layouts=cases.layouts,
        targets=cases.targets,
        seed=cases.seed,
        split=cases.split,
    )
    run.show(*beyond_blocks(rows), rows=rows)
