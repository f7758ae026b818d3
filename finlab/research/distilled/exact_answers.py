"""Random robots of thrusters, pods and fins, some with losses, and exact answers of method `dual`:
what is learned from, and what policies are judged on.

Robots that are learned from and those that are judged come from other seeds, with other fins.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from finlab.actuators.fin.fin import Fin
from finlab.arrays import Array
from finlab.layout.layout import Layout
from finlab.physics.plant import plant_of
from finlab.research.distilled.actuator_tokens import RobotTokens
from finlab.research.random_layouts import (
    ActuatorMaker,
    random_azimuth,
    random_fin_model,
    random_robot,
    random_shaft_fin,
    random_thruster,
    random_tilt,
)

Purpose = Literal["training", "judging"]
"""What robots are for."""
DOMAINS: dict[Purpose, int] = {"training": 0xD157, "judging": 0xD158}
"""Lead the seeds of robots and of wrenches."""
ACTUATORS = (4, 10)
"""Least and most of a robot."""
FIN_MODELS = 6
"""Laws of fins in the robots of one purpose; few, since compiling one takes as long as many
answers."""
LOSS_SHARE = 0.3
"""Share of the robots that have lost one actuator or two."""
MOST_LOST = 2
"""Of one robot."""
SHARES = (0.05, 1.0)
"""From where a wrench is drawn, over that of a random command."""


class ExactAnswers(NamedTuple):
    """One robot, and T wrenches that it can give, with their answers of least power."""

    robot: RobotTokens
    """The robot, with its losses."""
    wrench: Array
    """(T, 6) [N, N m]."""
    multipliers: Array
    """lambda (T, 6) [W/N, W/(N m)]."""
    dual_value: Array
    """g (T,) [W], the least power, for all forces of the convex hulls (Eq. 3)."""
    force: Array
    """(T, n, 2) [N]."""


def robots_with_answers(
    purpose: Purpose, robots: int, wrenches: int, seed: int
) -> Iterator[ExactAnswers]:
    """Draws robots, and answers wrenches of each.

    Args:
        purpose: for what; each has robots of its own.
        robots: how many.
        wrenches: of each robot, within its reach.
        seed: of all draws.

    Returns:
        One after the other, the same for the same arguments; the first ones of more are the same.
    """
    makers = _makers(np.random.default_rng([DOMAINS[purpose], seed]))
    for k in range(robots):
        rng = np.random.default_rng([DOMAINS[purpose], seed, k])
        layout = random_robot(rng, f"robot_{k + 1}", ACTUATORS, makers)
        yield answers_of(layout, _draw_lost(rng, layout.n), wrenches, rng)


def answers_of(
    layout: Layout, lost: NDArray[np.bool_] | None, wrenches: int, rng: np.random.Generator
) -> ExactAnswers:
    """Answers wrenches of random commands of one robot.

    Args:
        layout: the robot.
        lost: actuators (n,) that do not work; None for none.
        wrenches: how many.
        rng: source of randomness.
    """
    robot = RobotTokens.of(layout, lost)
    plant = plant_of(layout).counting(layout.commanded)
    met: list[Array] = []
    answers = []
    while sum(map(len, met)) < wrenches:
        force = plant.force(plant.sample(rng, (wrenches,)))
        if lost is not None:
            force[:, lost] = 0.0
        share = rng.uniform(*SHARES, wrenches)[:, None]
        wrench = share * np.einsum("tna,nak->tk", force, plant.effectiveness)
        answer = robot.compiled.core.answer_many(wrench, None, robot.conditions)
        is_met = answer.is_attainable
        met.append(wrench[is_met])
        answers.append(answer.multipliers[is_met])
    wrench = np.concatenate(met)[:wrenches]
    points = robot.compiled.core.dual_points(
        wrench, np.concatenate(answers)[:wrenches], 0, robot.conditions
    )
    return ExactAnswers(robot, wrench, points.multipliers, points.dual_value, points.force)


def _makers(rng: np.random.Generator) -> list[ActuatorMaker]:
    """Makers of thrusters, azimuths, tilts and fins, of a few laws of fins."""
    models = [random_fin_model(rng) for _ in range(FIN_MODELS)]

    def fin(of_robot: np.random.Generator, name: str, size: float) -> Fin:
        own = random_shaft_fin(of_robot, name, size)
        return replace(own, model=models[of_robot.integers(len(models))])

    return [random_thruster, random_azimuth, random_tilt, fin]


def _draw_lost(rng: np.random.Generator, n: int) -> NDArray[np.bool_] | None:
    """Which actuators (n,) are lost, mostly none: None."""
    if rng.uniform() >= LOSS_SHARE:
        return None
    lost = np.zeros(n, bool)
    lost[rng.permutation(n)[: rng.integers(1, MOST_LOST + 1)]] = True
    return lost
