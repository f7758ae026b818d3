"""The commands that a robot is sent, one after the other: answers, and neutral ones between them.

`finlab-runtime serve` and the ROS 2 node send such a stream, each by a transport of its own.
"""

import traceback
from collections.abc import Sequence
from typing import Any

from numpy.typing import ArrayLike

from finlab.allocation.allocation import Allocation
from finlab.arrays import Array
from finlab.deploy.deployed_robot import DeployedRobot
from finlab.errors import AllocationError, CommandError, LayoutError

REFUSED = (CommandError, LayoutError, AllocationError)
"""Errors of a request; any other one is a fault of the robot's files or of finlab."""


class CommandStream:
    """What a robot was sent last, and what may follow.

    An answer counts as sent when `note` is told so: whoever sends it may still refuse it.
    """

    def __init__(self, robot: DeployedRobot) -> None:
        """Begins where nothing has been sent.

        Args:
            robot: the robot; it may be replaced by the same one with other settings.
        """
        self.robot = robot
        """The robot that answers."""
        self.last: Allocation | Array | None = None
        """The last answer, or neutral commands (n, 3); None where nothing has been sent."""
        self.lost: tuple[str, ...] = ()
        """Actuators that the last answer did without, besides those that the bundle names."""

    @property
    def command(self) -> Array | None:
        """The commands (n, 3) that were sent last; None where there are none."""
        return self.last.command if isinstance(self.last, Allocation) else self.last

    def answer(
        self, wrench: ArrayLike, *, lost: Sequence[str] = (), follows: bool = True, **options: Any
    ) -> Allocation:
        """Returns the answer to a target; nothing counts as sent yet.

        Args:
            wrench: target (6,) [N, N m] in the body frame.
            lost: actuators that are lost besides those that the bundle names.
            follows: whether it has to lie within the drives' rates of what was sent last.
            **options: further arguments of `finlab.Allocator.allocate`.

        Raises:
            FinlabError: one of `REFUSED` where the request is at fault; any other error is a
                reason to go to neutral, and `unanswered` says it.
        """
        previous = self.last if follows else None
        return self.robot.allocate(wrench, lost=lost, previous=previous, **options)

    def note(self, sent: Allocation | Array, lost: Sequence[str] | None = None) -> None:
        """Takes down what has been sent.

        Args:
            sent: an answer, or commands (n, 3).
            lost: actuators that it does without; those of the last answer when None.
        """
        self.last = sent
        if lost is not None:
            self.lost = tuple(lost)

    def neutral(self) -> Array:
        """Returns the commands (n, 3) of rest after those that were sent last: pods keep their
        angles; NaN for lost actuators."""
        return self.robot.neutral(self.lost, self.command)


def unanswered(error: Exception) -> str:
    """Returns the sentence about a target that met an error which is no fault of the request.

    Args:
        error: as it was caught.
    """
    frame = traceback.extract_tb(error.__traceback__)[-1]
    problem = f"{type(error).__name__}, {frame.name}, line {frame.lineno}: {error!s:.200}"
    return f"the target could not be answered ({problem}); the robot rests, ask again"
