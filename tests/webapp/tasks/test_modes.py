"""Distinct ways to deliver a wrench: what counts as the same, and what is told of each."""

import math
from itertools import combinations, starmap

import numpy as np
import pytest

from finlab.allocation.solution import Candidates
from finlab.assets import shipped_layouts
from finlab.layout import load_layout
from finlab.physics import Plant
from tests.allocator_cache import AllocatorCache, normalized_error
from webapp.tasks.modes import (
    ModeSignature,
    cluster,
    find_modes,
    force_sizes,
    mode_signature,
    same_signature,
    signature_difference,
)

COMMAND_MIN = np.tile([0.05, 0.1, -math.pi], (2, 1))
"""Lower limits (2, 3) of two fins."""
COMMAND_MAX = np.tile([0.6, 2.1, math.pi], (2, 1))
"""Their upper limits."""
PUSH_COMMAND = (0.4, 1.5, 0.0)
"""A command of a fin that pushes."""
REST_COMMAND = (0.05, 0.1, 0.0)
"""A command of a fin that rests."""


def candidates_of(*commands: list[tuple[float, ...]]) -> Candidates:
    """Candidates by the commands of their fins, the cheaper ones first."""
    command = np.array(commands)
    k = len(command)
    return Candidates(
        command,
        np.zeros((k, 6)),
        np.zeros(k),
        np.arange(1.0, k + 1),
        np.arange(1.0, k + 1) ** 2,
        ("",) * k,
    )


def drag(command: np.ndarray) -> np.ndarray:
    """Sizes of forces (..., n) that grow with the squares of sin(A) and f; zero for lost fins."""
    with np.errstate(invalid="ignore"):
        return np.nan_to_num((np.sin(command[..., 0]) * command[..., 1]) ** 2)


def signature_of(command: np.ndarray) -> ModeSignature:
    """The signature of commands (..., n, 3) of such fins."""
    return mode_signature(command, drag(command))


def test_a_fin_rests_by_its_own_law() -> None:
    """The same beat is rest for a small fin beside a large one; nothing rests where nothing
    pushes."""
    command = np.array([PUSH_COMMAND, PUSH_COMMAND, (math.nan,) * 3])
    force = np.array([(2.0, 0.2, 0.0), (2.0, 0.0, 0.0), (0.0, 0.0, 0.0)])
    resting = mode_signature(np.array([command] * 3), force).resting
    assert resting.tolist() == [[False, True, False], [False, True, False], [False] * 3]


def test_the_same_fins_at_rest_are_the_same_mode_whatever_they_do_there() -> None:
    told = candidates_of(
        [PUSH_COMMAND, REST_COMMAND], [PUSH_COMMAND, (0.05, 0.1, 2.0)], [REST_COMMAND, PUSH_COMMAND]
    )
    modes = find_modes(told, drag(told.command), COMMAND_MIN, COMMAND_MAX)
    assert [mode.resting for mode in modes] == [(1,), (0,)]
    assert modes[1].effort == 3.0 and modes[1].power == 9.0 and modes[0].saturation < 1.0


def test_angles_are_compared_the_shorter_way_round() -> None:
    one = signature_of(np.array([PUSH_COMMAND, (0.4, 1.5, math.pi - 0.05)]))
    assert same_signature(one, signature_of(np.array([PUSH_COMMAND, (0.4, 1.5, 0.05 - math.pi)])))
    assert not same_signature(
        one, signature_of(np.array([PUSH_COMMAND, (0.4, 1.5, 0.6 - math.pi)]))
    )


def test_modes_of_an_answer_deliver_the_wrench_in_different_ways() -> None:
    search = AllocatorCache("mdn")
    layout = load_layout(shipped_layouts()["penta"])
    target = np.array([1.0, 0.5, 2.0, 0.0, 0.1, 0.1])
    before = search.allocate(layout, 0.9 * target).command
    result = search.allocate(layout, target, lost=["bow"], previous=before)
    assert result.candidates is not None
    force = force_sizes(layout, result.candidates.command)
    modes = find_modes(result.candidates, force, layout.lower, layout.upper)
    assert len(modes) >= 2
    np.testing.assert_array_equal(modes[0].command, result.command)
    assert modes[0].effort == pytest.approx(result.effort) and modes[0].power == pytest.approx(
        result.power
    )
    wrench = Plant(layout).wrench(np.array([mode.command for mode in modes]))
    assert normalized_error(search.normalization, wrench, target).max() < 1e-3
    signatures = [mode.signature for mode in modes]
    assert not any(starmap(same_signature, combinations(signatures, 2)))
    bow = layout.index("bow")
    assert all(np.isnan(mode.command[bow]).all() for mode in modes)


def test_signatures_by_hand() -> None:
    """Thrust grows with the squares of sin(A) and f; a fin below 15 % of the strongest one
    rests."""
    command = np.array(
        [(0.5, 2.0, 1.0), (0.2, 1.2, -2.0), (0.3, 1.0, 0.4), (0.0, 1.0, 0.0), (math.nan,) * 3]
    )
    signature = signature_of(command)
    thrust = [math.log((math.sin(a) * f) ** 2) for a, f, _ in command[:3]]
    assert math.exp(thrust[1] - thrust[0]) < 0.15 and math.exp(thrust[2] - thrust[0]) < 0.15
    assert signature.resting.tolist() == [False, True, True, True, False], (
        "one that gives nothing rests"
    )
    stronger = signature_of(np.array([*command[:2], (0.3, 1.4, 0.4)]))
    assert stronger.resting.tolist() == [False, True, False]
    np.testing.assert_allclose(
        stronger.thrust, [thrust[0], np.nan, math.log((math.sin(0.3) * 1.4) ** 2)]
    )
    np.testing.assert_allclose(stronger.direction, [1.0, np.nan, 0.4])
    np.testing.assert_allclose(stronger.style, [math.log(0.25), np.nan, math.log(0.3 / 1.4)])


def test_what_counts_as_different() -> None:
    """A turn of 25 degrees, or a factor of exp(1/4) in thrust or in amplitude over frequency."""
    a = signature_of(np.array([(0.3, 1.0, 0.2), (0.3, 1.2, 0.0)]))

    def other(turn: float = 0.0, thrust: float = 0.0, style: float = 0.0) -> ModeSignature:
        return a._replace(
            direction=a.direction + [turn, 0.0],
            thrust=a.thrust + [0.0, thrust],
            style=a.style + [style, 0.0],
        )

    difference = signature_difference(a, other(math.radians(12.5), 0.05, -0.1))
    np.testing.assert_allclose(difference, [[0.5, 0.0], [0.0, 0.2], [-0.4, 0.0]], atol=1e-9)
    for limit, key in ((math.radians(25.0), "turn"), (0.25, "thrust"), (0.25, "style")):
        for sign in (1, -1):
            assert same_signature(a, other(**{key: 0.99 * sign * limit}))
            assert not same_signature(a, other(**{key: 1.01 * sign * limit}))
    assert not same_signature(a, a._replace(resting=~a.resting))


def test_groups_are_led_by_their_first() -> None:
    """The third differs from the first, though not from the second: it leads a group of its own."""
    ways = np.array([[PUSH_COMMAND, (0.4, 1.5, angle)] for angle in (0.0, 0.3, 0.6, 0.1, 0.7)])
    assert cluster(signature_of(ways)) == [[0, 1, 3], [2, 4]]
