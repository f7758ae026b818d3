"""A robot in CasADi, by the formulas of its fins."""

from typing import Any

from finlab.physics import PlanarLaw, Plant, make_law
from finlab.physics.effort import effort_of_shares, effort_scale
from finlab.physics.objective import Name


def plant_formulas(casadi: Any, plant: Plant, objective: Name) -> tuple[Any, Any, Any]:
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
        if objective == "power":
            cost += law.blade.power(amplitude, frequency)
        else:
            shares = amplitude / scale[i, 0], frequency / scale[i, 1], direction / scale[i, 2]
            cost += effort_of_shares(*shares)
    return command, wrench, cost
