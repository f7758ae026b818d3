"""`finlab-runtime check` and `speed`: does this computer answer as the desk did, truly, and how fast?

To be run on the robot before first use. For each self-test of the graph file: are the node features the same,
does the surrogate predict the same wrench, does the fins' own model confirm what the surrogate promises, and
is this computer's own answer as good as the stored one.
"""

import resource
import time
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.judging import REACHED
from finlab.allocation.learned.learned_allocator import LearnedAllocator
from finlab.deploy.graph import SELF_TEST_TOLERANCE, NodeFeatures, SelfTest
from finlab.deploy.robot import Robot
from finlab.errors import DataError
from finlab.inference.surrogate import surrogate_on
from finlab.physics.energy import command_energy

Array = NDArray[np.float64]

FEATURE_TOLERANCE = 1e-6
"""Largest difference of a node feature; they are written with nine digits."""
ENERGY_TOLERANCE = 0.01
"""Largest share by which an answer may cost more than the stored one."""


class Finding(NamedTuple):
    """One question and its answer."""

    question: str
    """What was compared."""
    value: float
    """Largest difference found; NaN where an answer was no number."""
    limit: float
    """Largest difference allowed."""

    @property
    def good(self) -> bool:
        """Whether the robot may be trusted in this respect; NaN is never good."""
        return self.value <= self.limit


def self_check(robot: Robot) -> list[Finding]:
    """Ask everything.

    Own answers are compared with the stored ones by the full pipeline, also where the fast path runs: they
    are what was stored. The fast path is judged by the fins' own model as well.

    Raises:
        DataError: the bundle has no self-tests, or no weights.
    """
    cases, layout, weights = robot.graph.self_test, robot.layout, robot.allocator.weights
    if not cases or weights is None:
        raise DataError("the bundle has no self-tests; export it again")
    alive = [i for i, name in enumerate(layout.names) if name not in robot.graph.failed]
    healthy = layout.without(robot.graph.failed) if robot.graph.failed else layout
    normalization = robot.graph.normalization
    nodes = NodeFeatures(robot.graph.feature_set, healthy, normalization)
    full, surrogate = robot, surrogate_on(healthy, weights)
    if robot.allocator.name != LearnedAllocator.name:
        full = Robot(robot.graph, LearnedAllocator(weights, **robot.allocator.options))
    targets = [np.array(case.wrench) for case in cases]
    answers = [full.allocator.allocate(layout, target, failed=robot.graph.failed) for target in targets]

    def features(case: SelfTest) -> float:
        seen = nodes.of(np.array(case.wrench))
        stored = np.array([case.features[i] for i in alive])
        return float(np.abs(seen - stored).max()) if seen.shape == stored.shape else np.inf

    def physics(case: SelfTest) -> float:
        command = np.array([case.command[i] for i in alive], dtype=np.float64)
        return float(normalization.error(surrogate.wrench(command), np.array(case.predicted_wrench)))

    missing, dearer = [], []
    for case, answer in zip(cases, answers, strict=True):
        assert answer.wrench_surrogate is not None
        stored_error = normalization.error(np.array(case.predicted_wrench), np.array(case.wrench))
        missing.append(float(normalization.error(answer.wrench_surrogate, answer.target) - stored_error))
        stored = np.array([row or (np.nan,) * 3 for row in case.command])
        dearer.append(answer.energy / max(float(command_energy(stored, layout.upper)), 1e-9) - 1)
    judged = "own answers, judged by the fins' own model (err_norm)"
    findings = [
        Finding("node features", worst(map(features, cases)), FEATURE_TOLERANCE),
        Finding("wrench of the stored commands (err_norm)", worst(map(physics, cases)), SELF_TEST_TOLERANCE),
        Finding("fins that the networks have not learned", len(robot.allocator.unknown_fins(healthy)), 0),
        Finding(judged, worst(answer.err_norm for answer in answers), REACHED),
        Finding("own answers, more error than stored (err_norm)", worst(missing), SELF_TEST_TOLERANCE),
        Finding("own answers, more energy than stored (share)", worst(dearer), ENERGY_TOLERANCE),
    ]
    if full is not robot:
        quick = [robot.allocator.allocate(layout, target, failed=robot.graph.failed) for target in targets]
        errors = worst(answer.err_norm for answer in quick)
        findings.append(Finding(judged.replace("own answers", "answers of the fast path"), errors, REACHED))
    return findings


def worst(values: Iterable[float]) -> float:
    """The largest value, not below 0; NaN if any value is NaN."""
    return float(np.max([0.0, *values]))


N_WARM = 100
"""Answers before the clock starts."""


def answer_times(allocate: Callable[[Array], object], targets: Array) -> tuple[float, float]:
    """Median and 99th percentile [ms] of single answers to targets (N, 6), one after the other."""
    for target in targets[:N_WARM]:
        allocate(target)
    times = []
    for target in targets:
        start = time.perf_counter()
        allocate(target)
        times.append(time.perf_counter() - start)
    p50, p99 = np.percentile(times, [50, 99]) * 1e3
    return float(p50), float(p99)


def peak_memory() -> float:
    """Largest resident size of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
