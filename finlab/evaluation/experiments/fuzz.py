"""Methods on hostile robots: are answers finite, within the limits and in time, without other errors?"""

import tempfile
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from finlab.allocation.allocator import Allocator
from finlab.allocation.policy import KINDS
from finlab.arrays import Array
from finlab.errors import FinlabError
from finlab.evaluation.hostile_cases import hostile_robot, hostile_targets
from finlab.evaluation.method_specs import is_slow
from finlab.evaluation.progress import progress
from finlab.evaluation.statistics.tables import text_table
from finlab.layout import FinModelSpec, Layout
from finlab.physics import make_law, write_table

LATE_S = 1.0
"""A single call that takes longer counts as late [s of processor time]."""
SLOW_BATCH = 3
"""Targets in the batch of a method that takes a tenth of a second each."""
EXAMPLES = 5
"""Faults of each method that are described."""


@dataclass
class FuzzCount:
    """What went wrong with one method, over all robots."""

    method: str
    """Its name."""
    targets: int = 0
    """Targets that were answered."""
    calls: int = 0
    """Calls, of single targets and of batches."""
    nan: int = 0
    """Answers with a number that is not finite."""
    broken_limits: int = 0
    """Answers with a command outside its limits."""
    foreign_errors: int = 0
    """Calls that ended in an exception that is no `FinlabError`."""
    warnings: int = 0
    """Calls during which a warning was issued."""
    late: int = 0
    """Single calls that took longer than a second."""
    refused: int = 0
    """Calls that were refused with a `FinlabError`: the method does not know the fin model."""
    slowest_ms: float = 0.0
    """The slowest single call [ms of this process' processor time, which other work does not prolong]."""
    slowest_in_batch_ms: float = 0.0
    """The slowest batch's time per target, likewise [ms]."""
    examples: list[str] = field(default_factory=list)
    """The first faults, in words."""

    @property
    def clean(self) -> bool:
        """Whether nothing went wrong."""
        return self.nan + self.broken_limits + self.foreign_errors + self.warnings + self.late == 0

    def note(self, layout: Layout, fault: str) -> None:
        """Keep a fault as an example, if there is room."""
        if len(self.examples) < EXAMPLES:
            self.examples.append(f"{self.method}, robot {layout.name!r}: {fault}")

    def row(self) -> dict[str, Any]:
        """The counts as a row of the table."""
        return {key: value for key, value in asdict(self).items() if key != "examples"}


def fuzz_methods(
    allocators: Mapping[str, Allocator],
    *,
    n_robots: int,
    n_targets: int,
    n_single: int = 6,
    seed: int = 0,
    first_robot: int = 0,
) -> list[FuzzCount]:
    """What goes wrong with methods on hostile robots.

    Args:
        allocators: the methods by name.
        n_robots: robots to draw.
        n_targets: targets of each robot, solved together; slow methods solve a few.
        n_single: targets of each robot that are also solved in calls of their own, in turn with the previous
            answer, with a failed fin and, by the methods that know them all, under the three policies.
        seed: draws robots and targets; the same numbers give the same cases.
        first_robot: number of the first robot, to go on from where another run ended.
    """
    counts = [FuzzCount(name) for name in allocators]
    with tempfile.TemporaryDirectory() as folder:
        table = str(Path(folder) / "forces.csv")
        axes = np.linspace(0.0, 0.6, 7), np.linspace(0.0, 2.1, 6), np.linspace(-np.pi, np.pi, 13)
        write_table(table, make_law(FinModelSpec()), *axes)
        numbers = range(first_robot, first_robot + n_robots)
        for number in progress(numbers, "robot"):
            layout = hostile_robot(number, seed, table)
            targets = hostile_targets(layout, n_targets, number, seed)
            for count in counts:
                allocator = allocators[count.method]
                _try_batch(count, allocator, layout, targets[: SLOW_BATCH if is_slow(count.method) else None])
                _try_singles(count, allocator, layout, targets[:n_single])
    return counts


def fuzz_report(counts: Sequence[FuzzCount]) -> str:
    """The table, and the first faults in words."""
    examples = [example for count in counts for example in count.examples]
    heading = ["", "first faults"] if examples else []
    return "\n".join([text_table([count.row() for count in counts]), *heading, *examples])


def _try_batch(count: FuzzCount, allocator: Allocator, layout: Layout, targets: Array) -> None:
    command, seconds = _watched(
        count, layout, "batch", lambda: allocator.allocate_batch(layout, targets).command
    )
    if command is not None:
        count.slowest_in_batch_ms = max(count.slowest_in_batch_ms, 1e3 * seconds / max(len(targets), 1))


def _try_singles(count: FuzzCount, allocator: Allocator, layout: Layout, targets: Array) -> None:
    previous = None
    for i, target in enumerate(targets):
        options: dict[str, Any] = {"previous": previous if i % 2 else None, "seed": i}
        if count.method in ("search", "mdn"):
            options["policy"] = KINDS[i % len(KINDS)]
        if i % 4 == 3 and layout.n_fins > 1:
            options["failed"] = layout.names[:1]

        def call(target: Array = target, options: dict[str, Any] = options) -> Array:
            result = allocator.allocate(layout, target, **options)
            judged = np.array([result.err_norm, result.energy, result.scale])
            healthy = result.command[None, len(options.get("failed", ())) :]
            return healthy if np.isfinite(judged).all() else np.full_like(healthy, np.nan)

        where = f"target {i}"
        healthy, seconds = _watched(count, layout, where, call)
        if healthy is None:
            continue
        count.slowest_ms = max(count.slowest_ms, 1e3 * seconds)
        if seconds > LATE_S:
            count.late += 1
            count.note(layout, f"{where}: took {seconds:.2f} s")
        whole = np.isfinite(healthy).all() and healthy.shape[1] == layout.n_fins
        previous = healthy[0] if whole else None


def _watched(
    count: FuzzCount, layout: Layout, where: str, call: Callable[[], Array]
) -> tuple[Array | None, float]:
    """The answers (N, n, 3) of a call, None where it failed, and its time [s]; faults are counted."""
    count.calls += 1
    start = time.process_time()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        answer = None
        try:
            answer = call()
        except FinlabError:
            count.refused += 1
        except Exception as error:  # any other is the fault that is looked for
            count.foreign_errors += 1
            count.note(layout, f"{where}: {type(error).__name__}: {error}")
    seconds = time.process_time() - start
    if caught:
        count.warnings += 1
        at = f"{Path(caught[0].filename).name}:{caught[0].lineno}"
        count.note(layout, f"{where}: {caught[0].category.__name__}: {caught[0].message} ({at})")
    if answer is not None:
        _check(count, layout, answer, where)
    return answer, seconds


def _check(count: FuzzCount, layout: Layout, command: Array, where: str) -> None:
    """Count answers (N, n, 3) of the last n fins that are not finite or leave the limits."""
    count.targets += len(command)
    n = command.shape[1]
    lower, upper = layout.lower[-n:], layout.upper[-n:]
    nan = ~np.isfinite(command).all((1, 2))
    broken = ~nan & ((command < lower) | (command > upper)).any((1, 2))
    count.nan += int(nan.sum())
    count.broken_limits += int(broken.sum())
    if nan.any():
        count.note(layout, f"{where}: not finite at place {int(nan.argmax())}")
    if broken.any():
        k = int(broken.argmax())
        excess = np.maximum(lower - command[k], command[k] - upper)
        count.note(layout, f"{where}: {excess.max():.3g} outside the limits at place {k}")
