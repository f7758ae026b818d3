"""Compiled fins: the least effort of a force, as a search over all commands finds it; what limits allow."""

import numpy as np
import pytest

from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.mdn.answers import effort_robot
from finlab.mdn.descent import EffortProblem, realize
from finlab.physics import plant_of
from finlab.physics.effort import effort_of_shares

ARC = Limits(zero_direction=(-0.6, 1.4))
UNEVEN = FinModelSpec("soft", (("e", 0.2), ("d", 0.15), ("phi_e", 1.0)))
KINDS = [
    (FinModelSpec("drag", ()), Limits()),
    (FinModelSpec("lighthill", ()), ARC),
    (UNEVEN, Limits()),
    (UNEVEN, ARC),
]


def compiled(model: FinModelSpec, limits: Limits) -> tuple[Layout, EffortProblem]:
    layout = Layout("one", (Fin("a", (0.2, 0.1, 0.0), 0.3, limits, model=model),))
    return layout, effort_robot(plant_of(layout), np.ones(6)).forces


@pytest.mark.parametrize(("model", "limits"), KINDS)
def test_commands_give_the_forces_with_the_least_effort(model: FinModelSpec, limits: Limits) -> None:
    layout, problem = compiled(model, limits)
    fins, plant, rng = problem.fins, plant_of(layout), np.random.default_rng(0)
    direction = fins.middle + fins.half * rng.uniform(-0.9, 0.9, (40, 1))
    wanted = rng.uniform(0.05, 0.9, (40, 1)) * fins.gauges(direction) * fins.largest
    found = fins.project(wanted * np.exp(1j * direction))
    np.testing.assert_allclose(found.size, wanted, rtol=1e-9)
    command, effort = realize(problem, found)
    given = plant.force(command)
    np.testing.assert_allclose(given[..., 1] + 1j * given[..., 2], found.force, atol=0.01 * fins.maximum[0])
    # No other amplitude gives that force with less, wherever the frequency allows it.
    amplitude = np.linspace(*limits.amplitude, 60)[:, None]
    frequency = np.linspace(*limits.frequency, 400)
    for (row,), least, (size,) in zip(command, effort, wanted, strict=True):
        grid = np.stack(np.broadcast_arrays(amplitude, frequency, row[2]), axis=-1)
        strong = np.linalg.norm(plant.force(grid[..., None, :])[..., 0, 1:], axis=-1) >= 0.999 * size
        upper = layout.upper[0]
        every = effort_of_shares(amplitude / upper[0], frequency / upper[1], row[2] / upper[2])
        assert least <= every[strong].min() * 1.01


def test_what_a_fin_cannot_give_becomes_the_nearest_that_it_can() -> None:
    fins = compiled(FinModelSpec("drag", ()), ARC)[1].fins
    asked = np.array([2.0 * fins.maximum * np.exp(0.4j), [1.0 * np.exp(2.0j)], [0.0j], [np.exp(-2.9j)]])
    found = fins.project(asked)
    np.testing.assert_allclose(found.force[0], fins.maximum * np.exp(0.4j))
    np.testing.assert_allclose(found.force[1], np.cos(0.6) * np.exp(1.4j))
    np.testing.assert_allclose(found.size[2:], fins.smallest[[0, 0], None])
