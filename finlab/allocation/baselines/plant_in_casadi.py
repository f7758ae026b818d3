"""A robot in CasADi: by the formulas of its fins, or, where one has none, as functions that ask the plant."""

from typing import Any

import numpy as np

from finlab.allocation.command_cost import CommandCost
from finlab.arrays import Array
from finlab.physics import PlanarLaw, Plant, make_law
from finlab.physics.effort import effort_of_shares, effort_scale
from finlab.physics.objective import Objective


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


def plant_in_casadi(casadi: Any, plant: Plant, cost: CommandCost) -> Any:
    """Returns a function that turns commands (3 n,) into the wrench (6,) and the cost behind it.

    It knows its exact Jacobian, and must be kept as long as what is built of it.

    Args:
        casadi: the module.
        plant: the robot.
        cost: what its commands cost.
    """
    size, shape = 3 * plant.n_fins, (1, plant.n_fins, 3)

    def answer(command: Array) -> Array:
        at = command.reshape(shape)
        return np.concatenate([plant.wrench(at)[0], cost(at)])

    def gradient(command: Array, *_: Array) -> Array:
        at = command.reshape(shape)
        return np.concatenate([plant.linearize(at)[1][0], cost.gradient(at).reshape(1, -1)])

    dense = casadi.Sparsity.dense
    jacobian = _function(casadi, "slopes", gradient, [dense(size), dense(7)], dense(7, size))
    return _function(casadi, "answer", answer, [dense(size)], dense(7), jacobian)


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
            return [casadi.DM(values)]

        def has_jacobian(self) -> bool:
            return jacobian is not None

        def get_jacobian(self, *_: Any) -> Any:
            return jacobian

    return Called()
