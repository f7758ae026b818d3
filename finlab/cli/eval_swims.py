"""`finlab eval swims`: the suite of hard days."""

from typing import Annotated

from tyro.conf import arg

from finlab.cli.eval_arguments import Count, MethodRun, Names, PathController

RUN = MethodRun()


def swims(
    scenarios: Names = "all",
    methods: Names = "search,analytic,on-board",
    seed: Count = 0,
    seeds: Count = 5,
    controller: PathController = "tracking",
    run: Annotated[MethodRun, arg(name="")] = RUN,
) -> None:
    """Swim hard days: other bodies, water, sensors and fins than believed; errors, watts and who leads.

    One controller for all. search, analytic and on-board take two minutes of the processor each per seed.

    Args:
        scenarios: all, or names with commas between: nominal, damping-half, damping-double, parameters-low,
            parameters-high, current, current-turns, buoyant, heavy, gravity-off, late, circle, dive, square,
            waves, hexa, octo, fins-mixed, fins-soft, weak, lost-one, lost-one-unannounced, lost-two,
            lost-two-unannounced, restricted, saturated, flexible, wake, inflow.
        methods: names with commas between; on-board is U-CAT's own law at a fixed frequency. Slow ones
            (sqp, multistart, paper) are best tried on a few scenarios.
        seed: the first seed of noise, biases, waves and mixed fins.
        seeds: how many; verdicts need two or more.
        controller: tracking, or waypoint (heads for a point ahead, as in the paper).
    """
    from finlab.cli.inputs import check_positive
    from finlab.evaluation.experiments.hard_days import choose_days
    from finlab.evaluation.experiments.swims import not_swum, swim_all, swim_rows
    from finlab.evaluation.report.sections.swims import swim_blocks

    check_positive(seeds=seeds)
    days = choose_days(scenarios)
    done = swim_all(days, run.methods(methods), range(seed, seed + seeds), controller=controller)
    rows, hopeless = swim_rows(done), not_swum(days)
    about = f"{controller.capitalize()} controller, {seeds} seeds from {seed}."
    run.show(
        *swim_blocks(days, rows, hopeless),
        about,
        rows=rows,
        not_swum=hopeless,
        swims=[swim._asdict() for swim in done],
    )
