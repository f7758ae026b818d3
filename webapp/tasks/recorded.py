"""A swim that has been swum, or so much of it as there is: any moment of it can be looked at again."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from finlab.arrays import Array
from finlab.control import Completion, TrackingController
from finlab.layout import Layout
from finlab.sim import RunLog
from webapp.tasks.moment import Moment, doubted, figures_of, thinned


@dataclass(frozen=True, eq=False)
class Recorded:
    """One robot's swim."""

    method: str
    """Who allocated."""
    about: str
    """Scenario and controller, in words."""
    layout: Layout
    """The robot."""
    path: Array
    """The way to go (N, 3) [m]."""
    duration_s: float
    """How long the task takes [s]."""
    log: RunLog
    """Everything that happened."""
    rows: Array
    """Record of all ticks, as in `Moment`, not thinned."""
    found: tuple[tuple[str, float], ...]
    """What the monitor has found, and how long that took [s]."""

    @property
    def fins(self) -> tuple[str, ...]:
        """Names of the fins."""
        return self.layout.names

    @cached_property
    def line(self) -> Array:
        """The record for plots, thinned out."""
        return thinned(self.rows)

    @property
    def period_s(self) -> float:
        """Time between two ticks [s]."""
        return float(self.log.time[1] - self.log.time[0]) if self.log.n_ticks > 1 else 0.1

    def moment(self, time: float) -> Moment:
        """The moment of a time [s]; before the start and after the end the nearest there is."""
        log = self.log
        k = max(0, int(np.searchsorted(log.time, time + 1e-6, side="right")) - 1)
        rows = self.rows[: k + 1]
        lost = tuple(name for name, works in zip(self.fins, log.alive[k], strict=True) if not works)
        told = np.isnan(log.command[k, :, 0])
        failed = tuple(name for name, gone in zip(self.fins, told, strict=True) if gone)
        return Moment(
            time=float(log.time[k]),
            pose=np.concatenate([log.position[k], log.quaternion[k]]),
            motion=log.fin_motion[k],
            angle=log.fin_angle[k],
            force=log.fin_force[k],
            asked=log.asked[k],
            delivered=log.delivered[k],
            reference=log.reference[k],
            flow=log.flow[k],
            lost=lost,
            failed=failed,
            found=tuple(item for item in self.found if item[0] in failed and item[0] in lost),
            doubted=doubted(log.fault_probability[k], self.fins),
            controllable=self._controllable(failed),
            done=False,
            figures=figures_of(rows, self.period_s),
            record=thinned(rows),
        )

    def _controllable(self, failed: tuple[str, ...]) -> bool:
        return Completion(self.layout, failed, TrackingController.axes).controllable
