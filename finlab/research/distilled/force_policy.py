"""The policy that gives forces, as the paper's network gives commands: a Transformer for each
wrench, then steps of Newton's kind on the commands."""

import numpy as np

from finlab.allocation.levenberg_marquardt import CommandProblem, RefinedCommands, refine
from finlab.arrays import Array
from finlab.physics.objective import wrench_scale_of
from finlab.physics.plant import Plant
from finlab.research.distilled.actuator_tokens import RobotTokens
from finlab.research.distilled.network import ForceConfig
from finlab.research.distilled.starts import robot_batch
from finlab.research.distilled.trained_policy import TrainedPolicy

CHUNK = 256
"""Wrenches that go through the network at once."""


class ForcePolicy:
    """Commands of one robot by a network, made exact by Levenberg-Marquardt steps by its laws."""

    def __init__(self, robot: RobotTokens, policy: TrainedPolicy, plant: Plant) -> None:
        """Takes the robot, a network and the plant, which scores the commands."""
        assert isinstance(policy.config, ForceConfig)
        self._robot = robot
        self._config = policy.config
        self._weights = policy.weights
        works = np.zeros(robot.compiled.count, bool)
        works[robot.works] = True
        self._scale = wrench_scale_of(plant.layout)
        self._problem = CommandProblem.of(plant, self._scale).restricted(works, None)

    def forces(self, wrench: Array) -> Array:
        """Returns forces (N, n, 2) [N] along the rows of each actuator, for wrenches (N, 6)."""
        force = np.zeros((len(wrench), self._robot.compiled.count, 2))
        for first in range(0, len(wrench), CHUNK):
            part = wrench[first : first + CHUNK]
            shares = self._config.shares(self._weights, robot_batch(self._robot, part))[0]
            force[first : first + CHUNK, self._robot.works] = shares * self._robot.force_max
        return force

    def commands(self, wrench: Array, steps: int) -> RefinedCommands:
        """Returns commands (N, n, 3) for wrenches (N, 6), after some steps, and their errors.

        Args:
            wrench: desired [N, N m].
            steps: of Levenberg and Marquardt, by the laws.
        """
        first = self._robot.compiled.core.commands(self.forces(wrench))
        return refine(self._problem, wrench / self._scale, first, steps)
