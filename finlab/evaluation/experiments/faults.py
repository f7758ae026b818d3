"""The paper's fault experiment: a trajectory with fins lost from the start, or on the way."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from finlab.control import Completion, WaypointController
from finlab.evaluation.experiments.closed_loop_runs import (
    LOST_M,
    Row,
    Run,
    Scenario,
    follow_row,
    group_runs,
    over_seeds,
)
from finlab.layout import Layout
from finlab.sim import Trajectory

HEALTHY = "healthy"
ALLOWED = 1.15
"""Growth of the error over the healthy robot's that one lost fin should not exceed."""


@dataclass(frozen=True)
class Fault:
    """Fins that are lost, and when."""

    fins: tuple[str, ...]
    """Their names."""
    time_s: float
    """When they stop [s]."""
    controllable: bool
    """Whether the others can still give surge, heave and yaw independently."""

    @property
    def label(self) -> str:
        """In words."""
        if not self.fins:
            return HEALTHY
        when = f" at {self.time_s:.0f} s" if self.time_s > 0 else ""
        return f"{' + '.join(self.fins)} lost{when}"

    @property
    def kind(self) -> str:
        """Cases of one kind are summed up together."""
        if not self.fins:
            return HEALTHY
        count = "one fin" if len(self.fins) == 1 else "two fins"
        return f"{count} on the way" if self.time_s > 0 else count


def all_faults(layout: Layout, half_way_s: float) -> list[Fault]:
    """Healthy, each fin, each pair, and each fin half-way."""
    names = layout.names
    lost = [((), 0.0), *(((name,), 0.0) for name in names)]
    if len(names) > 2:
        lost += [(pair, 0.0) for pair in combinations(names, 2)]
    lost += [((name,), half_way_s) for name in names]
    axes = WaypointController.axes
    return [
        Fault(tuple(fins), time, Completion(layout, fins, axes).controllable)
        for fins, time in lost
        if len(fins) < len(names)
    ]


def fault_scenarios(layout: Layout, trajectory: Trajectory, faults: Sequence[Fault]) -> list[Scenario]:
    """Every controllable fault, under its label."""
    return [
        Scenario(fault.label, layout, trajectory, tuple((name, fault.time_s) for name in fault.fins))
        for fault in faults
        if fault.controllable
    ]


def fault_rows(faults: Sequence[Fault], runs: Sequence[Run]) -> list[Row]:
    """One row per fault and method; `ate_over_healthy` is the ratio of means, `tracked` whether every run
    stayed with its reference. Faults that leave the robot uncontrollable have a row without figures."""
    groups = group_runs(runs, follow_row)
    methods = dict.fromkeys(method for _, method in groups)
    rows: list[Row] = []
    for fault in faults:
        about = {"fault": fault.label, "kind": fault.kind, "controllable": fault.controllable}
        if not fault.controllable:
            rows.append(about)
            continue
        for method in methods:
            found = groups[fault.label, method]
            row = {**about, "method": method, "runs": len(found), **over_seeds(found)}
            row["tracked"] = max(single["max"] for single in found) < LOST_M
            if (HEALTHY, method) in groups:
                row["ate_over_healthy"] = row["ate"] / over_seeds(groups[HEALTHY, method])["ate"]
            rows.append(row)
    return rows


def fault_verdict(row: Row) -> str:
    """`lost` its reference, else how the error compares with `ALLOWED` times that of the healthy robot."""
    if not row["tracked"]:
        return "lost"
    growth = row.get("ate_over_healthy")
    if growth is None or row["kind"] == HEALTHY:
        return ""
    return f"{'within' if growth <= ALLOWED else 'beyond'} {ALLOWED}"
