"""A robot in CasADi: by the formulas of its fins, or, where one has none, as functions that ask the plant."""

from typing import Any

import numpy as np

from finlab.allocation.command_cost import CommandCost
from finlab.arrays import Array
from finlab.physics import PlanarLaw, Plant, make_law
from finlab.physics.effort import effort_of_shares, effort_scale
from finlab.physics.objective import Objective

DIFFERENCE = 1e-4
"""Half width of the differences, as a share of each command's range."""


def plant_formulas(casadi: Any, plant: Plant, objective: Objective) -> tuple[Any, Any, Any]:
    """Returns symbols of the commands (3 n,), and the wrench (6,) and the cost that they give, as formulas.

    Args:
        casadi: the module.
        plant: a robot whose fins all have formulas.
        objective: what commands cost.
    """
    command, wrench, cost = casadi.SX.sym("command", 3 * plant.n_fins), casadi.SX.zeros(6), 0
    scale = effort_scale(plant.upper)
    for i, fin in enumerate(plant.layout.fins):
        law = make_law(fin.model)
        assert isinstance(law, PlanarLaw)
        amplitude, frequency, direction = (command[3 * i + k] for k in range(3))
        thrust, points = law.thrust(amplitude, frequency, direction), direction + law.offset
        wrench += thrust * casadi.cos(points) * casadi.DM(plant.effectiveness[i, 1])
        wrench += thrust * casadi.sin(points) * casadi.DM(plant.effectiveness[i, 2])
        if objective.name == "power":
            cost += law.blade.driving_power(amplitude, frequency, objective.copper_loss)
        else:
            shares = amplitude / scale[i, 0], frequency / scale[i, 1], direction / scale[i, 2]
            cost += effort_of_shares(*shares, objective.weights)
    return command, wrench, cost


def plant_in_casadi(casadi: Any, plant: Plant, cost: CommandCost, sigma: Array) -> tuple[Any, Any]:
    """Returns two functions, which must be kept as long as what is built of them.

    The first turns commands (3 n,) into the wrench (6,) and the cost behind it, and knows its exact Jacobian.
    The second is the Hessian (3 n, 3 n), upper half, of `err_norm^2 + cost`, with the signature of
    `hess_lag`. Each fin's own second derivatives are central differences of its exact first ones, one-sided
    at the limits, beyond which a table has no slope.

    Args:
        casadi: the module.
        plant: the robot.
        cost: what its commands cost.
        sigma: per-axis standard deviation (6,) of the error.
    """
    shift = DIFFERENCE * plant.width * np.eye(3)[:, None]
    size, shape = 3 * plant.n_fins, (1, plant.n_fins, 3)

    def answer(command: Array) -> Array:
        at = command.reshape(shape)
        return np.concatenate([plant.wrench(at)[0], cost(at)])

    def gradient(command: Array, *_: Array) -> Array:
        at = command.reshape(shape)
        return np.concatenate([plant.linearize(at)[1][0], cost.gradient(at).reshape(1, -1)])

    def curvature(command: Array, target: Array, factor: Array, *_: Array) -> Array:
        at = command.reshape(shape)
        wrench, jacobian = plant.linearize(at)
        slope = jacobian[0] / sigma[:, None]
        half = slope.T @ slope
        before, after = np.maximum(at - shift, plant.lower), np.minimum(at + shift, plant.upper)
        around = np.concatenate([before, after])
        pull = plant.effectiveness @ ((wrench[0] - target) / sigma**2)
        by = np.einsum("rnka,na->rnk", plant.force_and_jacobian(around)[1], pull)
        by = by + 0.5 * cost.gradient(around)
        hessian = (by[3:] - by[:3]) / np.maximum((after - before).sum(-1, keepdims=True), 1e-300)
        first = 3 * np.arange(plant.n_fins)
        for i, j in np.ndindex(3, 3):
            half[first + i, first + j] += 0.5 * (hessian[i, :, j] + hessian[j, :, i])
        return np.asarray(2.0 * factor * half)

    dense, upper = casadi.Sparsity.dense, casadi.Sparsity.upper(size)
    jacobian = _function(casadi, "slopes", gradient, [dense(size), dense(7)], dense(7, size))
    called = _function(casadi, "answer", answer, [dense(size)], dense(7), jacobian)
    given = [dense(size), dense(6), dense(1), dense(0)]
    return called, _function(casadi, "curvature", curvature, given, upper)


def _function(
    casadi: Any, name: str, compute: Any, given: list[Any], result: Any, jacobian: Any = None
) -> Any:
    """A CasADi function that calls Python, with the sparsities of what is given and of the result."""

    class Called(casadi.Callback):  # type: ignore[misc]
        def __init__(self) -> None:
            casadi.Callback.__init__(self)
            self.construct(name, {})

        def get_n_in(self) -> int:
            return len(given)

        def get_sparsity_in(self, i: int) -> Any:
            return given[i]

        def get_sparsity_out(self, i: int) -> Any:
            return result

        def eval(self, arguments: Any) -> list[Any]:
            values = compute(*(np.array(argument).ravel() for argument in arguments))
            return [casadi.DM(values) if result.is_dense() else casadi.triu(casadi.DM(values))]

        def has_jacobian(self) -> bool:
            return jacobian is not None

        def get_jacobian(self, *_: Any) -> Any:
            return jacobian

    return Called()
