"""The yardstick of costs: exact, within limits, one solver against the other, and cheaper than any sample."""

import numpy as np
import pytest

from finlab.evaluation import cheapest_commands
from finlab.evaluation.cheapest_commands import EXACT, CheapestCommands
from finlab.evaluation.splits import make_split
from finlab.physics import plant_of
from finlab.physics.objective import Name, Objective

SIGMA = np.array([1.4, 1.4, 2.0, 0.35, 0.35, 0.35])


@pytest.mark.parametrize("objective", ["power", "effort"])
@pytest.mark.parametrize("split", ["id", "limits", "fins-mixed", "tables"])
def test_ends_deliver_the_target_within_limits_cheapest_first(split: str, objective: Name) -> None:
    case = make_split(split, 2, 1, 8)[1]
    plant, aim = plant_of(case.layout), Objective(objective)
    command, cost = CheapestCommands(aim, SIGMA).ends(case.layout, case.targets[0], 8, 0)
    assert len(command) > 0 and (np.diff(cost) >= 0).all()
    np.testing.assert_allclose(aim.meter(plant)(command), cost)
    error = (plant.wrench(command) - case.targets[0]) / SIGMA
    assert np.linalg.norm(error, axis=-1).max() <= EXACT
    assert ((command >= plant.lower) & (command <= plant.upper)).all()


@pytest.mark.parametrize("objective", ["power", "effort"])
def test_both_solvers_find_the_same_least_cost(objective: Name, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("casadi")
    # Two fins leave little choice: one least cost, whoever looks for it.
    case = next(case for case in make_split("fins", 9, 2, 3) if case.layout.n_fins == 2)
    for target in case.targets:
        ipopt = CheapestCommands(Objective(objective), SIGMA).ends(case.layout, target, 16, 0)[1]
        with monkeypatch.context() as patch:
            patch.setattr(cheapest_commands, "has_formulas", lambda _: False)
            slsqp = CheapestCommands(Objective(objective), SIGMA).ends(case.layout, target, 16, 0)[1]
        assert slsqp[0] == pytest.approx(ipopt[0], rel=1e-3)


def test_a_target_out_of_reach_has_no_ends() -> None:
    (case,) = make_split("id", 1, 1, 0)
    command, cost = CheapestCommands(Objective(), SIGMA).ends(case.layout, 50.0 * case.targets[0], 4, 0)
    assert command.shape == (0, case.layout.n_fins, 3) and cost.shape == (0,)
