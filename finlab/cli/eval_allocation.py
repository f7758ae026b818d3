"""`finlab eval wrench|cost|network|ablation|temperature|latency|...`: methods on targets, without a body."""

from __future__ import annotations

from itertools import product
from typing import Annotated

from tyro.conf import arg

from finlab.cli.eval_arguments import (
    Cases,
    Count,
    MethodRun,
    Name,
    Names,
    Run,
    parse_counts,
)
from finlab.cli.inputs import check_positive

RUN, METHODS = Run(), MethodRun()
TWENTY = Cases(layouts=20, targets=100)
FEW, PAIRS = Cases(layouts=20, targets=2), Cases(targets=2)
EVERYWHERE, WAYS = Cases("all", layouts=20, targets=4), MethodRun(objective="effort")


def cost(
    cases: Annotated[Cases, arg(name="")] = EVERYWHERE,
    methods: Names = "search,mdn",
    objectives: Names = "power,effort",
    starts: Count = 32,
    run: Annotated[Run, arg(name="")] = RUN,
) -> None:
    """Cost under exact tracking over the best of many random starts, by split and number of fins.

    Splits may also be axes or axes-mixed: pure axes and their mixes on the symmetric shipped layouts.

    Args:
        methods: names with commas between, as in `eval wrench`.
        objectives: power, effort or both.
        starts: random starts of IPOPT per target; robots with tables get twice as many, of SLSQP.
    """
    from finlab.evaluation.experiments.cost import cost_rows, cost_sets, parse_objectives
    from finlab.evaluation.method_specs import load_method_specs
    from finlab.evaluation.report.sections.cost import cost_tables, introduction
    from finlab.evaluation.report.text import to_text

    check_positive(starts=starts)
    aims, allocators = parse_objectives(objectives), load_method_specs(methods, run.checkpoint)
    drawn = {"layouts": cases.layouts, "targets": cases.targets, "seed": cases.seed}
    print(to_text(*introduction(starts)))
    rows = []
    for name, aim in product(cost_sets(cases.split), aims):
        found = cost_rows(name, allocators, aim, n_starts=starts, **drawn)
        rows += found
        run.write(rows=rows)
        print("\n" + to_text(*cost_tables(found)))


def network(
    fins: Names = "3,4,5,6,8,10,12",
    layouts: Count = 20,
    targets: Count = 20,
    candidates: Count | None = None,
    objectives: Names = "power,effort",
    seed: Count = 0,
    run: Annotated[Run, arg(name="")] = RUN,
) -> None:
    """What the network of method mdn buys: its proposals against as many other seeds of the same search.

    Args:
        fins: numbers of fins with commas between.
        layouts: random robots for each number of fins.
        targets: targets on each robot.
        candidates: proposals, and seeds of the others; as many as method mdn takes by default.
        objectives: power, effort or both.
        seed: of robots, targets and random seeds.
    """
    from finlab.allocation.methods import load_allocator
    from finlab.evaluation.experiments.cost import parse_objectives
    from finlab.evaluation.experiments.network import network_rows
    from finlab.evaluation.report.sections.network import network_blocks

    check_positive(layouts=layouts, targets=targets, candidates=candidates)
    counts, aims = parse_counts(fins), parse_objectives(objectives)
    options = {} if candidates is None else {"n_candidates": candidates}
    allocator = load_allocator("mdn", checkpoint=run.checkpoint).with_settings(**options)
    drawn = {"layouts": layouts, "targets": targets, "seed": seed}
    rows = [row for aim in aims for row in network_rows(allocator, counts, aim, **drawn)]
    run.show(*network_blocks(rows, allocator.settings.n_candidates), rows=rows)


def ablation(
    cases: Annotated[Cases, arg(name="")] = TWENTY,
    candidates: Count = 64,
    temperature: Annotated[float, arg(metavar="T")] = 0.02,
    run: Annotated[Run, arg(name="")] = RUN,
) -> None:
    """Change one stage of the paper's pipeline at a time; scored by its surrogate and by the plant.

    Args:
        candidates: candidates drawn per target.
        temperature: of the draw.
    """
    from finlab.evaluation.experiments.ablation import ablation_rows
    from finlab.evaluation.report.sections.ablation import ablation_blocks

    options = {"n_candidates": candidates, "temperature": temperature, "checkpoint": run.checkpoint}
    rows = ablation_rows(cases.draw(), seed=cases.seed, **options)
    run.show(*ablation_blocks(rows, candidates, temperature), rows=rows)


def temperature(
    cases: Annotated[Cases, arg(name="")] = PAIRS,
    candidates: Count = 64,
    run: Annotated[Run, arg(name="")] = RUN,
) -> None:
    """Diversity and best J of the candidates against the temperature of the draw (the paper's figure A).

    Args:
        candidates: candidates drawn per target.
    """
    from finlab.evaluation.experiments.temperature import temperature_rows
    from finlab.evaluation.report.sections.studies import temperature_blocks

    check_positive(candidates=candidates)
    rows = temperature_rows(cases.draw(), checkpoint=run.checkpoint, n_candidates=candidates, seed=cases.seed)
    run.show(*temperature_blocks(rows, candidates=candidates), rows=rows)


def latency(
    methods: Names = "search,mdn,paper,analytic,qp,sqp",
    fins: Count = 4,
    calls: Count = 200,
    budget: Annotated[float, arg(metavar="SECONDS")] = 20.0,
    robots: Count = 3,
    seed: Count = 0,
    run: Annotated[MethodRun, arg(name="")] = METHODS,
) -> None:
    """Time single calls of methods side by side in one run, and first answers for fins never seen.

    Args:
        methods: names with commas between; ipopt needs its extra.
        fins: fins of the layouts, 2 to 5.
        calls: calls of each method.
        budget: a slow method stops after this long.
        robots: robots with fins that method search has not seen, of each kind of fin.
        seed: draws layouts and targets.
    """
    from finlab.evaluation.experiments.first_answers import first_answer_rows
    from finlab.evaluation.experiments.latency import latency_cases, latency_rows, machine
    from finlab.evaluation.report.sections.studies import first_answer_blocks, latency_blocks

    check_positive(calls=calls, robots=robots)
    cases = latency_cases(fins, seed)
    rows = latency_rows(run.methods(methods), cases, n_calls=calls, budget_s=budget)
    first = first_answer_rows(run.method("search"), robots=robots, seed=seed)
    described = machine()
    on = "Machine: " + ", ".join(f"{key} {value}" for key, value in described.items())
    blocks = (*latency_blocks(rows, fins), *first_answer_blocks(first), on)
    run.show(*blocks, rows=rows, first_answers=first, machine=described)


def modes(
    cases: Annotated[Cases, arg(name="")] = FEW,
    method: Name = "search",
    starts: Count = 256,
    run: Annotated[MethodRun, arg(name="")] = WAYS,
) -> None:
    """Compare the distinct ways that an answer tells with those that many random starts lead to.

    Args:
        method: search or mdn.
        starts: random starts of the ground truth, per target.
    """
    from finlab.evaluation.experiments.mode_coverage import mode_rows
    from finlab.evaluation.report.sections.questions import mode_blocks

    check_positive(starts=starts)
    rows = mode_rows(run.method(method), cases.draw(), n_starts=starts, seed=cases.seed)
    about = {"method": method, "objective": run.objective, "split": cases.split}
    run.show(*mode_blocks(rows, starts, **about), rows=rows)


def fuzz(
    robots: Count = 50,
    targets: Count = 60,
    single: Count = 6,
    methods: Names = "search,mdn,paper,qp,sqp,analytic",
    seed: Count = 0,
    first: Count = 0,
    run: Annotated[MethodRun, arg(name="")] = METHODS,
) -> int | None:
    """Look for answers on hostile robots that are not finite, leave their limits, fail or are late.

    Ends with exit code 1 where there is any.

    Args:
        robots: robots to draw.
        targets: targets on each robot, solved together; trf, slsqp and ipopt solve a few.
        single: targets on each robot that are solved again in calls of their own.
        methods: names with commas between, as in `eval wrench`.
        seed: draws robots and targets; same numbers, same cases.
        first: number of the first robot, to go on from where another run ended.
    """
    from finlab.evaluation.experiments.fuzz import fuzz_methods, fuzz_report

    check_positive(robots=robots, targets=targets)
    counts = fuzz_methods(
        run.methods(methods),
        n_robots=robots,
        n_targets=targets,
        n_single=single,
        seed=seed,
        first_robot=first,
    )
    run.write(rows=[count.row() for count in counts])
    print(fuzz_report(counts))
    return None if all(count.clean for count in counts) else 1
