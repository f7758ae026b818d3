"""The age, the frame and the numbers of a wrench, before it is answered."""

import math
from dataclasses import replace

import numpy as np
import pytest
from finlab_allocator.frames import StaticFrames
from finlab_allocator.input_checks import NO_STAMP, StampedInput, Target, target_of, velocity_of
from finlab_allocator.parameters import Parameters

from finlab.errors import CommandError

NOW = 1_795_927_258.0
PARAMETERS = Parameters(free=("Tx",))


def asked(
    wrench: list[float],
    frame: str = "base_link",
    stamp: float = NOW,
    parameters: Parameters = PARAMETERS,
) -> Target:
    """The target of a wrench that is looked at now."""
    frames = StaticFrames()
    frames.add("base_link", "mast", (0.0, 0.0, 2.0), (0.0, 0.0, 0.0, 1.0))
    return target_of(StampedInput(np.array(wrench), frame, stamp), NOW, parameters, frames)


@pytest.mark.parametrize("frame", ["base_link", ""])
@pytest.mark.parametrize("stamp", [NO_STAMP, NOW, NOW - 0.49, NOW + 0.49])
def test_a_good_wrench_stays_as_it_is(frame: str, stamp: float) -> None:
    target = asked([1, 2, 3, 4, 5, 6], frame, stamp)
    np.testing.assert_array_equal(target.wrench, [1, 2, 3, 4, 5, 6])
    assert target.free == ("Tx",)


def test_a_known_frame_is_turned() -> None:
    np.testing.assert_allclose(asked([3, 0, 0, 0, 0, 0], "mast").wrench, [3, 0, 0, 0, 6, 0])


@pytest.mark.parametrize(
    ("stamp", "sentence"),
    [
        (NOW - 0.6, "its stamp is 0.6 s old, expected at most watchdog_s = 0.5 s"),
        (1.0, "its stamp is 1.8e"),
        (NOW + 0.6, "its stamp lies 0.6 s ahead"),
    ],
)
def test_a_stale_stamp_is_refused(stamp: float, sentence: str) -> None:
    with pytest.raises(CommandError) as refusal:
        asked([1, 0, 0, 0, 0, 0], stamp=stamp)
    assert sentence in str(refusal.value)


def test_nan_is_refused_or_frees_its_axis() -> None:
    wrench = [1.0, math.nan, 0, 0, math.nan, 2.0]
    with pytest.raises(CommandError, match="wrench: Fy, Ty is NaN, expected numbers"):
        asked(wrench)
    freeing = replace(PARAMETERS, nan="free")
    target = asked(wrench, parameters=freeing)
    assert target.free == ("Fy", "Tx", "Ty")
    np.testing.assert_array_equal(target.wrench, [1, 0, 0, 0, 0, 2])
    with pytest.raises(CommandError, match="Fy, Ty is NaN in frame 'mast'"):
        asked(wrench, "mast", parameters=freeing)


@pytest.mark.parametrize("nan", ["refuse", "free"])
@pytest.mark.parametrize("value", [math.inf, -math.inf])
def test_infinity_is_refused(value: float, nan: str) -> None:
    with pytest.raises(CommandError, match="wrench: Tz is infinite"):
        asked([math.nan, 0, 0, 0, 0, value], parameters=replace(PARAMETERS, nan=nan))


def test_a_velocity_is_checked_too() -> None:
    frames = StaticFrames()
    frames.add("base_link", "mast", (0.0, 0.0, 2.0), (0.0, 0.0, 0.0, 1.0))

    def taken(numbers: list[float], frame: str = "", stamp: float = NOW) -> np.ndarray:
        return velocity_of(StampedInput(np.array(numbers), frame, stamp), NOW, PARAMETERS, frames)

    np.testing.assert_array_equal(taken([1, 0, 0, 0, 0, 0.1]), [1, 0, 0, 0, 0, 0.1])
    np.testing.assert_allclose(taken([1, 0, 0, 0, 0.1, 0], "mast"), [0.8, 0, 0, 0, 0.1, 0])
    with pytest.raises(CommandError, match="flow: each component must be finite"):
        taken([math.nan, 0, 0, 0, 0, 0])
    with pytest.raises(CommandError, match="velocity: its stamp is 2 s old"):
        taken([1, 0, 0, 0, 0, 0], stamp=NOW - 2.0)
    with pytest.raises(CommandError, match="frame 'map'"):
        taken([1, 0, 0, 0, 0, 0], "map")
