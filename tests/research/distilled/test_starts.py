"""Multipliers to begin with: exact where they are known by a formula, the same whatever the order
of the actuators is, and answers that do not depend on them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.actuators.thruster import Thruster
from finlab.arrays import Array
from finlab.errors import AllocationError, CheckpointError
from finlab.layout import load_layout
from finlab.research.distilled.actuator_tokens import RobotTokens
from finlab.research.distilled.exact_answers import ExactAnswers, answers_of
from finlab.research.distilled.network import ForceConfig, HeadConfig
from finlab.research.distilled.starts import (
    FittedStart,
    HeadStart,
    NearestStart,
    Start,
    answers_from,
)
from finlab.research.distilled.trained_policy import TrainedPolicy, read_policy, write_policy
from finlab.research.networks.trained import Shapes
from tests.research.distilled.robots import mixed_robot, multipliers_of_six, six_thrusters


def random_weights(shapes: Shapes, seed: int) -> dict[str, Array]:
    """Weights that no training has made."""
    rng = np.random.default_rng(seed)
    return {
        name: (0.5 * rng.normal(size=shape) / np.sqrt(shape[-1])).astype(np.float32)
        for name, shape in shapes.items()
    }


def untrained(config: HeadConfig | ForceConfig, seed: int = 0) -> TrainedPolicy:
    """A network with random weights."""
    return TrainedPolicy(config, random_weights(config.shapes(), seed), {})


def neutral_head() -> TrainedPolicy:
    """A head that adds nothing to what it begins with."""
    config = HeadConfig(width=8, heads=2, graph_layers=1)
    weights = random_weights(config.shapes(), 0)
    for part in ("weight", "bias"):
        weights[f"head.{part}"] *= 0.0
    return TrainedPolicy(config, weights, {})


def stored_answers(number: int, count: int = 64) -> ExactAnswers:
    """Answers of a mixed robot, with a loss where the number is odd."""
    layout = mixed_robot(number)
    lost = np.arange(layout.n) == 2 if number % 2 else None
    return answers_of(layout, lost, count, np.random.default_rng(number))


def relative_error(given: Array, exact: Array) -> float:
    """Largest difference of rows (N, 6), over the size of the row."""
    return float((np.linalg.norm(given - exact, axis=1) / np.linalg.norm(exact, axis=1)).max())


def test_of_six_thrusters_the_first_head_is_exact() -> None:
    """With as many thrusters as axes, and costs ~ F^1.5, one unit a thruster is all there is."""
    layout = six_thrusters()
    robot = RobotTokens.of(layout)
    rng = np.random.default_rng(0)
    effectiveness = robot.compiled.effectiveness[:, 0]
    force = rng.uniform(0.1, 1.0, (50, 6)) * rng.choice([-1.0, 1.0], (50, 6))
    wrench = (force * robot.force_max[:, 0]) @ effectiveness
    exact = multipliers_of_six(layout, effectiveness, wrench)
    given = HeadStart(robot, neutral_head()).multipliers(wrench)
    assert relative_error(given / exact[:, :1], exact / exact[:, :1]) < 1e-2
    scaled = robot.compiled.axis_scale
    assert relative_error(given * scaled, exact * scaled) < 1e-2


def test_a_fit_to_six_thrusters_is_exact() -> None:
    layout = six_thrusters()
    stored = answers_of(layout, None, 200, np.random.default_rng(1))
    asked = answers_of(layout, None, 50, np.random.default_rng(2))
    scale = stored.robot.compiled.axis_scale
    given = FittedStart(stored).multipliers(asked.wrench)
    assert relative_error(given * scale, asked.multipliers * scale) < 0.01


def test_the_nearest_answer_of_a_stored_wrench_is_its_own_and_scales_with_the_root() -> None:
    stored = stored_answers(0)
    start = NearestStart(stored)
    np.testing.assert_allclose(start.multipliers(stored.wrench), stored.multipliers, 1e-9)
    quarter = start.multipliers(0.25 * stored.wrench)
    np.testing.assert_allclose(quarter, 0.5 * stored.multipliers, 1e-9)


@pytest.mark.parametrize("number", [0, 1])
def test_answers_do_not_depend_on_where_they_begin(number: int) -> None:
    stored = stored_answers(number)
    asked = answers_of(
        mixed_robot(number), stored.robot.conditions.lost, 100, np.random.default_rng([9, number])
    )
    robot = asked.robot
    expected = robot.compiled.core.answer_many(asked.wrench, None, robot.conditions)
    starts: list[Start] = [
        NearestStart(stored),
        FittedStart(stored),
        HeadStart(robot, untrained(HeadConfig())),
    ]
    for start in starts:
        answer = answers_from(robot, start, asked.wrench)
        assert answer.is_attainable.all()
        largest = np.abs(expected.force).max()
        np.testing.assert_allclose(answer.force / largest, expected.force / largest, 0, 1e-8)


def test_a_head_is_the_same_whatever_the_order_of_the_actuators() -> None:
    layout = mixed_robot(4)
    order = np.random.default_rng(0).permutation(layout.n)
    other = replace(layout, actuators=tuple(layout.actuators[i] for i in order))
    policy = untrained(HeadConfig())
    wrench = np.random.default_rng(1).normal(size=(20, 6))
    one = HeadStart(RobotTokens.of(layout), policy).multipliers(wrench)
    same = HeadStart(RobotTokens.of(other), policy).multipliers(wrench)
    np.testing.assert_allclose(
        one / np.abs(one).max(axis=0), same / np.abs(one).max(axis=0), 0, 1e-4
    )


def test_tokens_have_no_unit() -> None:
    """A robot whose forces are ten times as large, and whose watts are a hundred times as many."""
    layout = six_thrusters()
    larger = []
    for each in layout.actuators:
        assert isinstance(each, Thruster)
        low, high = each.force
        k = each.model.forward * 100.0 / 10.0**1.5  # type: ignore[union-attr]
        model = replace(each.model, forward=k, reverse=k)  # type: ignore[type-var]
        larger.append(replace(each, force=(10.0 * low, 10.0 * high), model=model))
    one = RobotTokens.of(layout)
    ten = RobotTokens.of(replace(layout, actuators=tuple(larger)))
    np.testing.assert_allclose(ten.token, one.token, 0, 1e-6)
    np.testing.assert_allclose(ten.unwhiten_multipliers, 10.0 * one.unwhiten_multipliers, 1e-6)


def test_whitened_columns_add_up_to_the_identity() -> None:
    robot = RobotTokens.of(mixed_robot(5))
    total = np.einsum("iaj,iak->jk", robot.column, robot.column)
    np.testing.assert_allclose(total, np.eye(6), 0, 1e-9)


def test_robots_with_rudders_are_refused_in_a_sentence() -> None:
    with pytest.raises(AllocationError, match="left to method dual"):
        RobotTokens.of(load_layout("torpedo"))


def test_a_written_network_is_read_back_and_a_damaged_one_refused(tmp_path: Path) -> None:
    policy = untrained(HeadConfig())
    write_policy(tmp_path, "head", vars(policy.config), policy.weights, {"seed": 0})
    read = read_policy(tmp_path, "head")
    assert read.config == policy.config
    for name, array in policy.weights.items():
        np.testing.assert_array_equal(read.weights[name], array)
    path = tmp_path / "head.safetensors"
    path.write_bytes(path.read_bytes()[:-4] + b"\0\0\0\0")
    with pytest.raises(CheckpointError, match="SHA-256"):
        read_policy(tmp_path, "head")
    with pytest.raises(CheckpointError, match="finlab train policy"):
        read_policy(tmp_path, "forces")
