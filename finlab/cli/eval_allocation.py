"""`finlab eval steadiness|modes|unreachable`: what an allocator does from tick to tick,
how many ways it knows, and what it delivers of wrenches out of reach."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import arg

from finlab.cli.eval_arguments import (
    Checkpoint,
    Count,
    JsonFile,
    Split,
    check_positive,
    check_writable,
    open_layouts,
    write_json,
)
from finlab.cli.eval_closed_loop import verbs

Layouts = Annotated[str, arg(metavar="A,B,...")]


@verbs.command
def steadiness(
    layouts: Layouts = "A,B,C,D,ucat,asymmetric,penta,hexa,octo,restricted,pair",
    paths: Count = 3,
    ticks: Count = 600,
    seed: Count = 0,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
) -> None:
    """Follow smooth paths of wrenches at 10 Hz with and without the previous command; turns and energy.

    Args:
        layouts: files or names of shipped layouts, with commas between.
        paths: random paths of each layout.
        ticks: length of a path; 600 are a minute.
        seed: draws the paths; same numbers, same paths.
        checkpoint: trained checkpoint; the shipped one by default.
        json: file for the rows.
    """
    from finlab.allocation import load_allocator
    from finlab.evaluation.experiments.steadiness import steadiness_report, steadiness_rows

    check_positive("paths", paths)
    check_positive("ticks", ticks - 1)
    check_writable(json)
    robots = open_layouts(layouts)
    rows = steadiness_rows(
        load_allocator(checkpoint=checkpoint), robots, n_paths=paths, ticks=ticks, seed=seed
    )
    write_json(json, {"rows": rows})
    print(steadiness_report(rows))


@verbs.command
def modes(
    split: Split = "id",
    layouts: Count = 20,
    targets: Count = 2,
    starts: Count = 256,
    seed: Count = 0,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
) -> None:
    """Compare the distinct ways that an answer tells with those that many random starts lead to.

    Args:
        split: id, ood, ood-fins, limits, failure or near-singular.
        layouts: layouts of the split.
        targets: targets on each layout.
        starts: random starts of the ground truth, per target.
        seed: draws layouts, targets and starts.
        checkpoint: trained checkpoint; the shipped one by default.
        json: file for the rows.
    """
    from finlab.allocation import load_allocator
    from finlab.evaluation.experiments.mode_coverage import mode_report, mode_rows
    from finlab.evaluation.splits import make_split

    check_positive("starts", starts)
    check_writable(json)
    cases = make_split(split, layouts, targets, seed)
    rows = mode_rows(load_allocator(checkpoint=checkpoint), cases, n_starts=starts, seed=seed)
    write_json(json, {"rows": rows})
    print(mode_report(rows, starts))


@verbs.command
def unreachable(
    layouts: Count = 50,
    seed: Count = 0,
    checkpoint: Checkpoint = None,
    json: JsonFile = None,
) -> None:
    """Ask for wrenches out of reach; what each policy delivers against the best possible.

    Args:
        layouts: random layouts of 2 to 8 fins per kind of limits, with one target each.
        seed: draws layouts and targets.
        checkpoint: trained checkpoint; the shipped one by default.
        json: file for the rows.
    """
    from finlab.allocation import load_allocator
    from finlab.evaluation.experiments.unreachable import unreachable_report, unreachable_rows

    check_positive("layouts", layouts)
    check_writable(json)
    rows = unreachable_rows(load_allocator(checkpoint=checkpoint), n_layouts=layouts, seed=seed)
    write_json(json, {"rows": rows})
    print(unreachable_report(rows))
