"""First multipliers for Newton's method on the dual, for many wrenches of one robot.

Each class is made once for a robot in its state of losses, and then gives multipliers for any
number of wrenches. `Core.answer_many` goes on from there, and its answers are the same to rounding,
whatever it began with.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from finlab.arrays import AnyArray, Array
from finlab.core.calls import CoreAnswer
from finlab.research.distilled.actuator_tokens import RobotTokens
from finlab.research.distilled.exact_answers import ExactAnswers
from finlab.research.distilled.network import ROOT_EPSILON, HeadConfig, RobotBatch
from finlab.research.distilled.trained_policy import TrainedPolicy

CHUNK = 512
"""Wrenches that go through a head at once: what they need then stays in the cache."""
RIDGE = 1e-6
"""Share of the mean square of a feature that is added in a least-squares fit."""


class Start(Protocol):
    """Gives multipliers of one robot to begin with."""

    def multipliers(self, wrench: Array) -> Array:
        """Returns lambda (N, 6) [W/N, W/(N m)] for wrenches (N, 6) [N, N m]."""
        ...


def answers_from(robot: RobotTokens, start: Start, wrench: Array) -> CoreAnswer:
    """Answers wrenches by method `dual`, begun at multipliers.

    Args:
        robot: in its state of losses.
        start: gives the multipliers.
        wrench: desired (N, 6) [N, N m].

    Returns:
        What `dual` answers, to rounding.
    """
    first = start.multipliers(wrench)
    return robot.compiled.core.answer_many(wrench, None, robot.conditions, first)


class NearestStart:
    """The multipliers of the stored answer whose wrench has the nearest direction, by the root of
    the ratio of sizes: for costs ~ T^1.5 those of a wrench t times as large are t^(1/2) times as
    large."""

    def __init__(self, stored: ExactAnswers) -> None:
        """Takes answers of the robot."""
        self._whiten = stored.robot.whiten_wrench.T
        whitened = stored.wrench @ self._whiten
        self._size = np.maximum(np.linalg.norm(whitened, axis=1), ROOT_EPSILON)
        self._direction = (whitened / self._size[:, None]).T
        self._multipliers = stored.multipliers

    def multipliers(self, wrench: Array) -> Array:
        """Returns lambda (N, 6) for wrenches (N, 6); see `Start`."""
        whitened = wrench @ self._whiten
        nearest = (whitened @ self._direction).argmax(axis=1)
        ratio = np.linalg.norm(whitened, axis=1) / self._size[nearest]
        return np.asarray(np.sqrt(ratio)[:, None] * self._multipliers[nearest])


class FittedStart:
    """Multipliers that are linear in some features of the wrench, by least squares from stored
    answers: the whitened wrench, and the roots of what each actuator gives by quadratic costs."""

    def __init__(self, stored: ExactAnswers) -> None:
        """Fits to answers of the robot, each counting by the size of its multipliers."""
        robot = stored.robot
        own = robot.root_stiffness[:, None, None] * robot.column
        of_line = robot.compiled.is_line[robot.works]
        units = np.concatenate([own[:, 0], own[~of_line, 1], np.eye(6)])
        self._into = units @ robot.whiten_wrench  # (U, 6)
        self._whiten = robot.whiten_wrench
        features = self._features(stored.wrench)
        whitened = np.linalg.solve(
            robot.unwhiten_multipliers.T @ robot.unwhiten_multipliers
            + 1e-12
            * np.trace(robot.unwhiten_multipliers.T @ robot.unwhiten_multipliers)
            * np.eye(6),
            robot.unwhiten_multipliers.T @ stored.multipliers.T,
        ).T
        weight = 1.0 / np.maximum(np.linalg.norm(whitened, axis=1, keepdims=True), ROOT_EPSILON)
        A = weight * features
        gram = A.T @ A
        gram += RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
        coefficients = np.linalg.solve(gram, A.T @ (weight * whitened))
        self._out = coefficients @ robot.unwhiten_multipliers.T

    def _features(self, wrench: Array) -> Array:
        """(N, U + 6)."""
        scaled = wrench @ self._into.T
        roots = np.copysign(np.sqrt(np.abs(scaled)), scaled)
        return np.concatenate([roots, wrench @ self._whiten.T], axis=1)

    def multipliers(self, wrench: Array) -> Array:
        """Returns lambda (N, 6) for wrenches (N, 6); see `Start`."""
        return np.asarray(self._features(wrench) @ self._out)


class HeadStart:
    """The head that a trained network makes for the robot, folded into products of matrices in
    single precision."""

    def __init__(self, robot: RobotTokens, policy: TrainedPolicy) -> None:
        """Runs the network once."""
        assert isinstance(policy.config, HeadConfig)
        batch = robot_batch(robot, np.empty((0, 6)))
        head = policy.config.head(policy.weights, batch)
        U, V, W = (part.reshape(-1, 6) for part in head)
        self._into = single(robot.whiten_wrench.T @ U.T)
        self._out = single(np.concatenate([V, W]) @ robot.unwhiten_multipliers.T)

    def multipliers(self, wrench: Array) -> Array:
        """Returns lambda (N, 6) for wrenches (N, 6); see `Start`."""
        result = np.empty(wrench.shape)
        units = self._into.shape[1]
        features = np.empty((CHUNK, 2 * units), np.float32)
        for first in range(0, len(wrench), CHUNK):
            v = single(wrench[first : first + CHUNK]) @ self._into
            count = len(v)
            squared = np.square(v).reshape(count, -1, 2).sum(axis=2)
            size = np.sqrt(squared + np.float32(ROOT_EPSILON**2))
            pairs = v.reshape(count, -1, 2)
            halves = features[:count].reshape(count, 2, -1, 2)
            np.divide(pairs, np.sqrt(size)[..., None], out=halves[:, 0])
            np.multiply(pairs, size[..., None], out=halves[:, 1])
            result[first : first + count] = features[:count] @ self._out
        return result


def robot_batch(robot: RobotTokens, wrench: Array) -> RobotBatch:
    """Returns one robot with wrenches (T, 6) [N, N m], as networks read it, in single precision."""
    mask: NDArray[np.bool_] = np.ones((1, len(robot.works)), bool)
    return RobotBatch(
        token=single(robot.token)[None],
        column=single(robot.column)[None],
        root_stiffness=single(robot.root_stiffness)[None],
        mask=mask,
        wrench=single(wrench @ robot.whiten_wrench.T)[None],
    )


def single(values: AnyArray) -> AnyArray:
    """Returns values in single precision, C-contiguous."""
    return np.ascontiguousarray(values, np.float32)
