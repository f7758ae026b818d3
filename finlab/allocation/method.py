"""What an allocation method is made of: its settings, what it can solve, and how it meets a policy."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from copy import copy
from dataclasses import fields
from functools import lru_cache
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from finlab.allocation.evaluate import REACHED
from finlab.allocation.policy import Policy, largest_share
from finlab.allocation.settings import Settings
from finlab.allocation.solution import Solution
from finlab.arrays import Array
from finlab.errors import AllocationError
from finlab.layout import FinModelSpec, Layout
from finlab.networks.normalization import Normalization
from finlab.networks.trained import TrainedWeights
from finlab.physics import plant_of


class AllocationMethod(ABC):
    """What turns target wrenches into commands, for layouts whose fins are all healthy.

    A method implements `_solve`; `Allocator` asks the questions.
    """

    name: str
    """What the method is called."""
    normalization: Normalization
    """Yardstick of the error."""
    checkpoint: str | None = None
    """Name of the checkpoint that the networks come from; None for methods without networks."""
    weights: TrainedWeights | None = None
    """The trained networks; None for methods without networks."""
    policy_under_way: str = "closest"
    """What a control loop asks for by default where a wrench is out of reach."""
    settings_class: type[Settings] = Settings
    """What can be set."""
    settings: Settings = Settings()
    """Present settings."""
    flow: Array | None = None
    """Velocity (6,) of the body relative to the water at which it answers [m/s, rad/s], body frame; None at
    rest."""
    fin_model: FinModelSpec | None = None
    """Fin model that the networks have learned; None for methods that ask every fin's own model."""

    def at(self, flow: Array | None) -> Self:
        """The same method for a robot that moves through the water; what it has prepared is shared."""
        if flow is None:
            return self
        other = copy(self)
        other.flow = flow
        return other

    def unknown_fins(self, layout: Layout) -> tuple[str, ...]:
        """Names of the fins whose model the networks have not learned; answers for them are wrong."""
        return () if self.fin_model is None else _other_fins(layout, self.fin_model)

    @classmethod
    def option_names(cls) -> list[str]:
        """Names of what can be set when the method is made."""
        return [field.name for field in fields(cls.settings_class)]

    @property
    def options(self) -> dict[str, Any]:
        """Present values of all that can be set, by name; `load_allocator` makes the same method of them."""
        return dict(vars(self.settings))

    def with_settings(self, **changes: Any) -> Self:
        """The same method with other settings. This one stays as it is; what it has loaded is shared.

        Raises:
            AllocationError: the method knows no such setting, or cannot work with its value.
        """
        self.check_options(changes)
        return self._made_with({**self.options, **changes})

    @classmethod
    def check_options(cls, names: Iterable[str]) -> None:
        """Raise an `AllocationError` at a setting that the method does not know."""
        known = cls.option_names()
        if unknown := [name for name in names if name not in known]:
            raise AllocationError(
                f"method {cls.name!r} knows the options {', '.join(known) or 'none'}, got {unknown[0]!r}"
            )

    def _made_with(self, options: dict[str, Any]) -> Self:
        """The same method made again; those with networks override this."""
        return type(self)(self.normalization, **options)  # type: ignore[call-arg]

    def _in_time(self, layout: Layout, target: Array, reference: Array) -> Array:
        """Which wrench (6,) is answered: a target (6,), or one of those that are expected (K, 6)."""
        return target

    @abstractmethod
    def _solve(self, layout: Layout, targets: Array, *, seed: int, previous: Array | None) -> Solution:
        """Solve for targets (N, 6) on a layout whose fins are all healthy.

        Args:
            layout: the healthy fins.
            targets: desired wrenches (N, 6).
            seed: makes the answer repeatable.
            previous: command (n, 3) of the previous tick, or None.
        """

    def _check_policy(self, policy: Policy) -> None:
        """Refuse a policy that the method does not know; those that know all override this."""
        if not policy.is_plain and policy.kind != "direction":
            raise AllocationError(
                f"policy: method {self.name!r} minimizes the plain error and knows neither axis weights nor "
                "priorities; use method 'search', or policy 'closest' or 'direction'"
            )

    def bound(self, result: Any) -> float:
        """A lower bound on what any answer to the question of a result costs.

        Raises:
            AllocationError: the method proves none.
        """
        raise AllocationError(f"method {self.name!r} proves no lower bound of the cost; use method 'search'")

    def _solve_by(
        self, policy: Policy, layout: Layout, target: Array, *, seed: int, previous: Array | None
    ) -> Solution:
        """Solve for one target (1, 6) under a policy. Methods that minimize the plain error override this."""
        if policy.kind == "direction":
            return self._solve_direction(layout, target, seed=seed, previous=previous)
        return self._solve(layout, target, seed=seed, previous=previous)

    def _solve_direction(
        self, layout: Layout, target: Array, *, seed: int, previous: Array | None
    ) -> Solution:
        """The largest share of the target that is delivered whole."""
        whole = self._solve(layout, target, seed=seed, previous=previous)
        if self._reaches(layout, whole, target)[0]:
            return whole

        def reached(shares: Array) -> NDArray[np.bool_]:
            targets = shares[:, None] * target
            return self._reaches(layout, self._solve(layout, targets, seed=seed, previous=None), targets)

        return self._solve(layout, largest_share(reached) * target, seed=seed, previous=previous)

    def _reaches(self, layout: Layout, solution: Solution, targets: Array) -> NDArray[np.bool_]:
        """Which of the targets (N, 6) are met, by the method's own model, or the plant where it has none."""
        wrench = solution.wrench_surrogate
        if wrench is None:
            wrench = plant_of(layout).wrench(solution.command, flow=self.flow)
        return self.normalization.error(wrench, targets) <= REACHED

    def _solve_many(self, policy: Policy, layout: Layout, targets: Array, *, seed: int) -> Solution:
        """Solve for targets (N, 6) together, then for those out of reach one by one, as the policy says."""
        if len(targets) == 0:
            return Solution(np.empty((0, layout.n_fins, 3)))
        solution = self._solve(layout, targets, seed=seed, previous=None)
        if policy.is_plain:
            return solution
        command, wrench = solution.command.copy(), solution.wrench_surrogate
        wrench = None if wrench is None else wrench.copy()
        for row in np.flatnonzero(~self._reaches(layout, solution, targets)):
            answer = self._solve_by(policy, layout, targets[row : row + 1], seed=seed, previous=None)
            command[row] = answer.command[0]
            if wrench is not None and answer.wrench_surrogate is not None:
                wrench[row] = answer.wrench_surrogate[0]
        return Solution(command, wrench)


@lru_cache(maxsize=256)
def _other_fins(layout: Layout, known: FinModelSpec) -> tuple[str, ...]:
    """Names of the fins of another model than the known one."""
    return tuple(
        fin.name
        for fin in layout.fins
        if fin.model.type != known.type or fin.model.values() != known.values()
    )
