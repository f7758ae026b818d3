"""What the parts of the default method ask of it: `Dual`, prepared for a robot in one flow.

`ahead`, `ray` and `outer_iterations` are each loaded where a question needs them, by `Dual` in
dual/method.py; so they know it by this protocol, which holds the members that one of them uses.
Each docstring here is short: the arguments are documented there.
"""

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.dual.compiled import Compiled
from finlab.allocation.levenberg_marquardt import CommandProblem
from finlab.allocation.policy import Policy
from finlab.allocation.rates import Rates
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.core.calls import Conditions, CoreAnswer
from finlab.layout.layout import Layout
from finlab.physics.plant import Plant

if TYPE_CHECKING:
    from finlab.core.coupled_core import CoupledCore


class PreparedDual(Protocol):
    """Method `dual` of a robot of n actuators, in its flow."""

    layout: Layout
    plant: Plant
    scale: Array
    """Wrench scale (6,) [N, N m]."""
    compiled: Compiled

    @property
    def period_s(self) -> float:
        """Time between ticks [s]."""
        ...

    @property
    def rates(self) -> Rates:
        """How far commands may change in a tick."""
        ...

    @property
    def turning_pods(self) -> NDArray[np.bool_]:
        """Which actuators (n,) are pods whose turning costs."""
        ...

    @property
    def coupled(self) -> "CoupledCore":
        """The robot in the core, with its wrench offset."""
        ...

    def forces(
        self,
        targets: Array,
        policy: Policy | None,
        multipliers: Array | None,
        conditions: Conditions,
    ) -> CoreAnswer:
        """Answers wrenches (N, 6) by the laws alone; see `Dual.forces`."""
        ...

    def exact(self, answer: CoreAnswer, conditions: Conditions) -> Array:
        """Makes commands (N, n, 3) exact; see `Dual.exact`."""
        ...

    def error(self, command: Array, wrench: Array, conditions: Conditions) -> Array:
        """Measures normalized errors (N,) of commands (N, n, 3); see `Dual.error`."""
        ...

    def problem_under(self, conditions: Conditions) -> CommandProblem:
        """Poses the steps on commands; see `Dual.problem_under`."""
        ...

    def cheapest_exact(
        self, problem: CommandProblem, wrench_normalized: Array, starts: Array
    ) -> Array | None:
        """Finds the cheapest command (n, 3) that gives a wrench; see `Dual.cheapest_exact`."""
        ...

    def undriven_notes(self, targets: Array, conditions: Conditions) -> set[str]:
        """Tells of axes that come together only; see `Dual.undriven_notes`."""
        ...

    def solution(
        self,
        command: Array,
        wrench_served: Array,
        multipliers: Array,
        gap_power_bound: Array,
        notes: set[str],
        conditions: Conditions,
    ) -> Solution:
        """Makes a solution; see `Dual.solution`."""
        ...
