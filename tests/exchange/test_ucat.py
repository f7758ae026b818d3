"""Commands as U-CAT's messages."""

import numpy as np
import pytest

from finlab.errors import CommandError
from finlab.exchange import flippers

NAMES = ("front_right", "front_left", "back_left", "back_right")
COMMAND = np.array([[0.1, 1.0, 0.5], [0.2, 1.1, 0.6], [0.3, 1.2, 0.7], [np.nan] * 3])


def test_amplitude_is_doubled_and_motors_are_in_their_own_order() -> None:
    messages = flippers(NAMES, COMMAND)
    assert [(m.motor_number, m.amplitude) for m in messages] == [(1, 0.2), (3, 0.6), (4, 0.4)]
    assert messages[1].frequency == 1.2 and messages[1].zero_direction == 0.7
    assert messages[0]._fields == ("motor_number", "frequency", "zero_direction", "amplitude", "phase_offset")


def test_other_robots_keep_their_order() -> None:
    assert [m.motor_number for m in flippers(("a", "b", "c", "d"), COMMAND)] == [1, 2, 3]
    assert [m.amplitude for m in flippers(("a", "b"), COMMAND[:2], motors=("b", "a"))] == [0.4, 0.2]


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(CommandError, match=r"expected shape \(4, 3\)"):
        flippers(NAMES, COMMAND[:2])
    with pytest.raises(CommandError, match="each of a, b once"):
        flippers(("a", "b"), COMMAND[:2], motors=("a", "a"))
