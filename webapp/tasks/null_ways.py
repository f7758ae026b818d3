"""Ways to do what an answer does, in its null space: the answer, what the sliders say, the mean of
both."""

import numpy as np

from finlab.allocation.allocation import Allocation
from finlab.analysis.null_space import NullSpace
from finlab.arrays import Array
from webapp.markup.verdict import is_proved
from webapp.session.targets import full_thrust
from webapp.tasks.modes import Mode, mode_signature
from webapp.tasks.solver import Modes, NamedMode, NullWays

MOST = 6
"""Directions that have a slider."""
NAMED, MOST_NAMED = 0.1, 4
"""Share of a direction from which an actuator is named by its number, and how many are."""
OTHER = "another way"
MEAN = "average of 1 and 2"


def null_modes(answer: Allocation, shifts: tuple[float, ...]) -> Modes:
    """The answer and, where its forces are shifted [N], the other way and the mean of both
    commands."""
    space = NullSpace(answer)
    count = min(len(space.basis), MOST)
    shift = np.zeros(len(space.basis))
    shift[: len(shifts[:count])] = shifts[:count]
    ranges = space.ranges(shift, count)
    first = "least watts" if is_proved(answer) else "the answer"
    ways = [_way(answer, answer.command, first, "optimum" if is_proved(answer) else answer.method)]
    if shift.any():
        other = space.commands(shift[None])[0]
        ways += [_way(answer, other, OTHER, "null space")]
        ways += [_way(answer, space.mean(answer.command, other), MEAN, "average")]
    names, about = (
        zip(*[_words(answer, space, k) for k in range(count)], strict=True) if count else ((), ())
    )
    ends = tuple((float(low), float(high)) for low, high in ranges)
    return Modes(
        tuple(ways), len(ways), null=NullWays(names, about, ends, len(space.basis) - count)
    )


def _words(answer: Allocation, space: NullSpace, direction: int) -> tuple[str, str]:
    """What a direction is called, by numbers of actuators, and their shares in it by name."""
    shares = space.participants(direction)
    most = sorted(shares, key=lambda name: -shares[name])
    numbers = sorted(
        answer.layout.index(name) + 1 for name in most[:MOST_NAMED] if shares[name] > NAMED
    )
    more = " …" * (len(most) > MOST_NAMED and shares[most[MOST_NAMED]] > NAMED)
    return " ".join(map(str, numbers)) + more, ", ".join(
        f"{name} {shares[name]:.2f}" for name in most
    )


def _way(answer: Allocation, command: Array, name: str, badge: str) -> NamedMode:
    way = answer.with_command(command)
    size = np.linalg.norm(way.forces, axis=-1)
    flow = None if answer.flow is None else tuple(answer.flow.tolist())
    full = np.maximum(full_thrust(answer.layout, flow), 1e-9)
    effort = np.nan if way.effort is None else way.effort
    figures = way.err_norm, effort, way.power, min(float((size / full).max()), 1.0)
    return NamedMode(Mode(command, *figures, (), mode_signature(command, size), ()), name, badge)
