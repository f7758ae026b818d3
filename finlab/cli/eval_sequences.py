"""`finlab eval steadiness|sequences`: wrenches that follow each other, ten a second."""

from typing import Annotated

from tyro.conf import arg

from finlab.cli.eval_arguments import Count, MethodRun, Names, open_layouts
from finlab.cli.inputs import check_positive

METHODS = MethodRun()


def steadiness(
    layouts: Names = "A,B,C,D,ucat,asymmetric,penta,hexa,octo,restricted,pair",
    paths: Count = 3,
    ticks: Count = 600,
    seed: Count = 0,
    run: Annotated[MethodRun, arg(name="")] = METHODS,
) -> None:
    """Follow smooth paths of wrenches at 10 Hz with and without the previous command; turns and energy.

    Args:
        layouts: files or names of shipped layouts, with commas between.
        paths: random paths of each layout.
        ticks: length of a path; 600 are a minute.
        seed: draws the paths; same numbers, same paths.
    """
    from finlab.evaluation.experiments.steadiness import steadiness_rows
    from finlab.evaluation.report.sections.questions import steadiness_blocks

    check_positive(paths=paths, ticks=ticks - 1)
    robots = open_layouts(layouts)
    rows = steadiness_rows(run.method("search"), robots, n_paths=paths, ticks=ticks, seed=seed)
    run.show(*steadiness_blocks(rows, run.objective), rows=rows)


def sequences(
    layouts: Names = "A,hexa,restricted",
    methods: Names = "search,mdn,analytic,sqp",
    paths: Count = 2,
    ticks: Count = 300,
    noise: Annotated[float, arg(metavar="SHARE")] = 0.1,
    seed: Count = 0,
    run: Annotated[MethodRun, arg(name="")] = METHODS,
) -> None:
    """Follow smooth paths of wrenches with white noise at 10 Hz; what commands change by from tick to tick.

    Args:
        layouts: files or names of shipped layouts, with commas between.
        methods: names with commas between, as in `eval wrench`.
        paths: random paths of each layout.
        ticks: length of a path; 600 are a minute.
        noise: on every axis, over the root mean square of the path on it.
        seed: draws paths and noise.
    """
    from finlab.evaluation.experiments.noisy_sequences import noisy_sequence_rows
    from finlab.evaluation.report.sections.questions import sequence_blocks

    check_positive(paths=paths, ticks=ticks - 1)
    allocators, robots = run.methods(methods), open_layouts(layouts)
    rows = noisy_sequence_rows(allocators, robots, n_paths=paths, ticks=ticks, seed=seed, noise=noise)
    run.show(*sequence_blocks(rows, noise), rows=rows)
