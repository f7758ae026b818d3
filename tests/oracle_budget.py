"""What thrusters and pods give at most within power budgets, by Clarabel on cones: written apart
from the library.

A thruster is a part ahead and a part back, a pod a vector in its arc with its length. A size y
within [0, most] costs k t with t >= y^p, the cone t^(1/p) 1^(1 - 1/p) >= |y|. Needs Clarabel, an
extra of the tests.
"""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from finlab.arrays import Array
from tests.oracle_plant import OracleActuator, OraclePlant


class ConicProgram:
    """A linear objective of numbers x, under cones."""

    def __init__(self) -> None:
        self.count = 0
        self._rows: dict[str, list[tuple[dict[int, float], float]]] = {"zero": [], "most": []}
        self._cones: list[tuple[str, float, list[tuple[dict[int, float], float]]]] = []

    def number(self) -> int:
        """A new unknown."""
        self.count += 1
        return self.count - 1

    def equal(self, terms: dict[int, float], value: float) -> None:
        """sum terms = value."""
        self._rows["zero"].append((terms, value))

    def at_most(self, terms: dict[int, float], value: float) -> None:
        """sum terms <= value."""
        self._rows["most"].append((terms, value))

    def norm_at_most(self, most: int, parts: Sequence[tuple[dict[int, float], float]]) -> None:
        """The norm of parts (terms, constant) is at most x[most]."""
        self._cones.append(("norm", 0.0, [({most: 1.0}, 0.0), *parts]))

    def power_at_least(self, t: int, y: int, exponent: float) -> None:
        """x[t] >= |x[y]|^exponent."""
        parts = [({t: 1.0}, 0.0), ({}, 1.0), ({y: 1.0}, 0.0)]
        self._cones.append(("power", 1.0 / exponent, parts))

    def least(self, cost: dict[int, float]) -> Array:
        """The numbers at which the cost is least.

        Raises:
            ValueError: Clarabel does not solve it.
        """
        import clarabel

        lines: list[tuple[dict[int, float], float]] = []
        cones = []
        for kind, cone in (("zero", clarabel.ZeroConeT), ("most", clarabel.NonnegativeConeT)):
            if self._rows[kind]:
                lines += self._rows[kind]
                cones.append(cone(len(self._rows[kind])))
        for kind, alpha, parts in self._cones:
            lines += [({k: -v for k, v in terms.items()}, constant) for terms, constant in parts]
            norm = clarabel.SecondOrderConeT(len(parts))
            cones.append(norm if kind == "norm" else clarabel.PowerConeT(alpha))
        entries = [(row, k, v) for row, (terms, _) in enumerate(lines) for k, v in terms.items()]
        row, column, value = zip(*entries, strict=True)
        shape = (len(lines), self.count)
        matrix = sparse.csc_matrix((value, (row, column)), shape=shape)
        linear = np.zeros(self.count)
        for k, v in cost.items():
            linear[k] = v
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
        nothing = sparse.csc_matrix((self.count, self.count))
        right = np.array([value for _, value in lines])
        answer = clarabel.DefaultSolver(nothing, linear, matrix, right, cones, settings).solve()
        if "Solved" not in str(answer.status):
            raise ValueError(f"Clarabel: {answer.status}")
        return np.array(answer.x)


class BudgetedPlant:
    """Forces of a plant of thrusters and pods that push one way, within budgets."""

    def __init__(self, plant: OraclePlant, members: Array, watts: Array) -> None:
        self.plant = plant
        self.program = ConicProgram()
        self.wrench: list[dict[int, float]] = [{} for _ in range(6)]
        """Along each axis, over its scale."""
        self.total: dict[int, float] = {}
        """Power of all [W]."""
        buses: list[dict[int, float]] = [{} for _ in watts]
        for i, actuator in enumerate(plant.actuators):
            power = self._thruster(actuator) if actuator.kind == "thruster" else self._pod(actuator)
            self.total |= power
            for bus, has in zip(buses, members[:, i], strict=True):
                if has:
                    bus.update(power)
        for bus, most in zip(buses, watts, strict=True):
            # over what it has, so that Clarabel's tolerance is a share
            self.program.at_most({k: v / most for k, v in bus.items()}, 1.0)

    def _give(self, unknown: int, column: Array) -> None:
        for axis, scale in enumerate(self.plant.scales):
            self.wrench[axis][unknown] = float(column[axis] / scale)

    def _size(self, actuator: OracleActuator, most: float, sign: float) -> tuple[int, float, int]:
        """A size in [0, 1] of a largest force, what t = 1 costs, and t."""
        model = actuator.model
        size = self.program.number()
        t = self.program.number()
        exponent = model.get("exponent", 1.5)
        factor = model["forward"] if sign > 0.0 else model.get("reverse", model["forward"])
        self.program.at_most({size: -1.0}, 0.0)
        self.program.at_most({size: 1.0}, 1.0)
        self.program.power_at_least(t, size, exponent)
        return size, float(factor * most**exponent), t

    def _thruster(self, actuator: OracleActuator) -> dict[int, float]:
        low, high = (float(end[0]) for end in actuator.limits)
        if low > 0.0 or high < 0.0:
            raise ValueError("expected thrusters whose limits hold 0")
        power = {}
        for sign, most in ((1.0, high), (-1.0, -low)):
            if most <= 0.0:
                continue
            size, cost, t = self._size(actuator, most, sign)
            self._give(size, sign * most * actuator.effectiveness[:, 0])
            power[t] = cost
        return power

    def _pod(self, actuator: OracleActuator) -> dict[int, float]:
        low, high = actuator.limits
        most = float(high[1])
        if low[1] != 0.0 or (not actuator.turns_fully and high[0] - low[0] > np.pi):
            raise ValueError("expected pods whose forces are a convex set")
        size, cost, t = self._size(actuator, most, 1.0)
        along = [self.program.number(), self.program.number()]
        self.program.norm_at_most(size, [({k: 1.0}, 0.0) for k in along])
        for k, column in zip(along, actuator.effectiveness.T, strict=True):
            self._give(k, most * column)
        if not actuator.turns_fully:
            a, b = float(low[0]), float(high[0])
            self.program.at_most({along[0]: np.sin(a), along[1]: -np.cos(a)}, 0.0)
            self.program.at_most({along[0]: -np.sin(b), along[1]: np.cos(b)}, 0.0)
        return {t: cost}

    def least_power(self, wrench: Array) -> float:
        """Least watts that give a wrench (6,) within the budgets.

        Raises:
            ValueError: there are none.
        """
        for axis, terms in enumerate(self.wrench):
            self.program.equal(terms, float(wrench[axis] / self.plant.scales[axis]))
        largest = max(self.total.values())
        x = self.program.least({k: v / largest for k, v in self.total.items()})
        return float(sum(v * x[k] for k, v in self.total.items()))

    def least_miss(self, wrench: Array, axes: Sequence[int] = range(6)) -> float:
        """Least norm of what is missing along some axes, over the scales."""
        miss = self._miss(wrench, axes)
        return float(self.program.least({miss: 1.0})[miss])

    def hold(self, wrench: Array, axes: Sequence[int], most: float) -> None:
        """Allows no more to be missing along some axes."""
        self.program.at_most({self._miss(wrench, axes): 1.0}, most)

    def _miss(self, wrench: Array, axes: Sequence[int]) -> int:
        miss = self.program.number()
        scaled = wrench / self.plant.scales
        parts = [({k: -v for k, v in self.wrench[axis].items()}, scaled[axis]) for axis in axes]
        self.program.norm_at_most(miss, parts)
        return miss

    def largest_share(self, wrench: Array) -> float:
        """Largest share up to 1 of a wrench that is given alone."""
        share = self.program.number()
        scaled = wrench / self.plant.scales
        for axis, terms in enumerate(self.wrench):
            self.program.equal({**terms, share: -float(scaled[axis])}, 0.0)
        self.program.at_most({share: 1.0}, 1.0)
        return float(self.program.least({share: -1.0})[share])
