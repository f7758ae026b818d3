"""Modes in the null space of an answer: the answer, the command of the page's sliders, and the mean
of both."""

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.allocation.report import is_proved_least
from finlab.analysis.null_space import NullSpace
from finlab.arrays import Array
from webapp.session.targets import full_thrust
from webapp.tasks.modes import Mode, largest_used_share, mode_signature
from webapp.tasks.solver import Modes, NamedMode, NullSpaceDirections

MOST = 6
"""Directions that have a slider."""
NAMED = 0.1
"""Share of a direction from which an actuator is named by its number."""
MOST_NAMED = 4
"""Actuators that are named by their numbers."""
OTHER = "another way"
"""Name of the mode whose forces are shifted."""
MEAN = "average of 1 and 2"
"""Name of the mode that is the mean of both commands."""


def null_space_modes(answer: Allocation, shifts: tuple[float, ...]) -> Modes:
    """The answer and, where its forces are shifted, the shifted command and the mean of both.

    Args:
        answer: whose null space it is.
        shifts: how far along its first directions the forces are [N]; those left out are 0.
    """
    space = NullSpace(answer)
    count = min(len(space.basis), MOST)
    shift = np.zeros(len(space.basis))
    shift[: len(shifts[:count])] = shifts[:count]
    is_least = is_proved_least(answer)
    name = "least watts" if is_least else "the answer"
    badge = "optimum" if is_least else answer.method
    modes = [_mode(answer, answer.command, name, badge)]
    if shift.any():
        shifted = space.commands(shift[None])[0]
        mean = space.mean(answer.command, shifted)
        modes.append(_mode(answer, shifted, OTHER, "null space"))
        modes.append(_mode(answer, mean, MEAN, "average"))
    directions = NullSpaceDirections(
        names=tuple(_numbers_words(answer, space, k) for k in range(count)),
        about=tuple(_share_words(space, k) for k in range(count)),
        ranges=tuple((float(low), float(high)) for low, high in space.ranges(shift, count)),
        more=len(space.basis) - count,
        has_budget=answer.budget is not None,
    )
    return Modes(tuple(modes), len(modes), null_space=directions)


def _takers(space: NullSpace, direction: int) -> list[tuple[str, float]]:
    """Names of the actuators that push along a direction, and their shares, the largest first."""
    return sorted(space.participants(direction).items(), key=lambda taker: -taker[1])


def _numbers_words(answer: Allocation, space: NullSpace, direction: int) -> str:
    """What a direction is called: the numbers of the actuators that push most along it."""
    takers = _takers(space, direction)
    numbers = []
    for name, share in takers[:MOST_NAMED]:
        if share > NAMED:
            numbers.append(answer.layout.index(name) + 1)
    has_more = len(takers) > MOST_NAMED and takers[MOST_NAMED][1] > NAMED
    return " ".join(map(str, sorted(numbers))) + " …" * has_more


def _share_words(space: NullSpace, direction: int) -> str:
    """The shares of the actuators in a direction, by name."""
    return ", ".join(f"{name} {share:.2f}" for name, share in _takers(space, direction))


def _mode(answer: Allocation, command: Array, name: str, badge: str) -> NamedMode:
    """A command (n, 3) for the wrench of an answer, judged by the plant."""
    other = answer.with_command(command)
    size = np.linalg.norm(other.forces, axis=-1)
    flow = None if answer.flow is None else tuple(answer.flow.tolist())
    full = full_thrust(answer.layout, flow)
    mode = Mode(
        command=command,
        err_norm=other.err_norm,
        effort=np.nan if other.effort is None else other.effort,
        power=other.power,
        saturation=largest_used_share(answer.layout, command, size, full),
        still=(),
        signature=mode_signature(command, size),
        sources=(),
    )
    return NamedMode(mode, name, badge)
