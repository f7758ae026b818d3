"""What binds a robot, in its actuators one by one: at both ends of each range, at rest, of changes
in a tick and in dead bands."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.actuators.rudder import Rudder
from finlab.actuators.thrust_model import PowerLaw
from finlab.allocation.binding import at_limits, band_words, limits_reached, rate_words, what_binds
from finlab.arrays import Array
from finlab.axes import AXES
from finlab.layout import Azimuth, Fin, Layout, Limits, Thruster, load_layout

ORIGIN = (0.0, 0.0, 0.0)
LAW = PowerLaw(1.0)
ARC = (-0.5, 1.0)
"""Of all that turns and does not turn freely [rad]."""


def robot() -> Layout:
    """One actuator of each kind: names say what is special of it."""
    return Layout(
        "all",
        (
            Thruster("both ways", ORIGIN, (1.0, 0.0, 0.0), (-20.0, 30.0), LAW, dead_band=2.0),
            Thruster("ahead", ORIGIN, (1.0, 0.0, 0.0), (0.0, 30.0), LAW),
            Azimuth("pod", ORIGIN, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 40.0), LAW, ARC),
            Azimuth("free pod", ORIGIN, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 40.0), LAW),
            Fin("fin", ORIGIN, 0.0, Limits((0.05, 0.6), (0.1, 2.1), ARC)),
            Fin("free fin", ORIGIN, 0.0, Limits((0.05, 0.6), (0.1, 2.1))),
            Rudder("rudder", ORIGIN, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.03, ARC, 3.0),
        ),
    )


MIDDLE = np.array(
    [
        [10.0, 0.0, 0.0],
        [10.0, 0.0, 0.0],
        [0.2, 20.0, 0.0],
        [0.2, 20.0, 0.0],
        [0.3, 1.0, 0.2],
        [0.3, 1.0, 0.2],
        [0.2, 0.0, 0.0],
    ]
)
"""A command of which nothing is at a limit."""


def with_row(name: str, row: list[float]) -> Array:
    """The middle command with another one of a single actuator."""
    command = MIDDLE.copy()
    command[robot().index(name), : len(row)] = row
    return command


@pytest.mark.parametrize(
    ("name", "row", "said"),
    [
        ("both ways", [30.0], "at full thrust"),
        ("both ways", [-20.0], "at full thrust"),
        ("both ways", [29.0], ""),
        ("both ways", [-19.0], ""),
        ("both ways", [0.0], ""),
        ("ahead", [30.0], "at full thrust"),
        ("ahead", [0.0], ""),  # at rest, which is no thrust
        ("pod", [0.2, 40.0], "at full thrust"),
        ("pod", [-0.5, 20.0], "at the end of its arc"),
        ("pod", [1.0, 20.0], "at the end of its arc"),
        ("pod", [0.99, 20.0], ""),
        ("pod", [-0.49, 20.0], ""),
        ("pod", [1.0, 0.0], ""),  # its angle is of no use at rest
        ("free pod", [math.pi, 20.0], ""),
        ("free pod", [-math.pi, 20.0], ""),
        ("free pod", [-math.pi, 40.0], "at full thrust"),
        ("fin", [0.6, 2.1, 0.2], "at full thrust"),
        ("fin", [0.6, 1.0, 0.2], ""),
        ("fin", [0.3, 2.1, 0.2], ""),
        ("fin", [0.3, 1.0, 1.0], "at the end of its arc"),
        ("fin", [0.3, 1.0, -0.5], "at the end of its arc"),
        ("fin", [0.05, 0.1, 1.0], ""),
        ("fin", [0.05, 1.0, 1.0], "at the end of its arc"),
        ("free fin", [0.3, 1.0, math.pi], ""),
        ("rudder", [-0.5], "at the end of its arc"),
        ("rudder", [1.0], "at the end of its arc"),
        ("rudder", [0.99], ""),
    ],
)
def test_an_actuator_is_at_its_limits_alone(name: str, row: list[float], said: str) -> None:
    expected = (f"{name} {said}",) if said else ()
    assert limits_reached(robot(), with_row(name, row)) == expected


def test_many_commands_are_looked_at_one_by_one() -> None:
    layout = robot()
    commands = np.stack([MIDDLE, with_row("fin", [0.6, 2.1, 1.0]), with_row("ahead", [30.0])])
    commands[0, 0] = np.nan
    at_full_thrust, at_end_of_arc = at_limits(layout, commands)
    names = np.array(layout.names)
    assert [list(names[row]) for row in at_full_thrust] == [[], ["fin"], ["ahead"]]
    assert [list(names[row]) for row in at_end_of_arc] == [[], ["fin"], []]


def test_an_end_is_as_wide_as_a_thousandth_of_the_range() -> None:
    for off, is_at_end in ((0.5e-3, True), (1.5e-3, False)):
        high = with_row("both ways", [30.0 - off * 50.0])
        low = with_row("both ways", [-20.0 + off * 50.0])
        for command in (high, low):
            assert bool(limits_reached(robot(), command)) == is_at_end


RATED = Layout(
    "rated",
    (
        Thruster("screw", ORIGIN, (1.0, 0.0, 0.0), (-20.0, 30.0), LAW, rate=50.0),
        Azimuth(
            "pod",
            ORIGIN,
            (0.0, 0.0, 1.0),
            (1.0, 0.0, 0.0),
            (0.0, 40.0),
            LAW,
            rate=100.0,
            turn_rate=2.0,
        ),
        Thruster("quick", ORIGIN, (1.0, 0.0, 0.0), (-20.0, 30.0), LAW),
    ),
)
BEFORE = np.array([[5.0, 0.0, 0.0], [3.1, 20.0, 0.0], [0.0, 0.0, 0.0]])
"""In a tenth of a second the screw changes by 5 N, the pod by 0.2 rad and 10 N."""


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ([[5.0], [0.0, 0.0], [0.0]], ["screw"]),
        ([[-5.0], [0.0, 0.0], [0.0]], ["screw"]),
        ([[4.9], [0.0, 0.0], [25.0]], []),
        ([[0.0], [0.2, 0.0], [0.0]], ["pod"]),
        ([[0.0], [-0.2, 0.0], [0.0]], ["pod"]),
        ([[0.0], [0.19, 0.0], [0.0]], []),
        ([[0.0], [0.2 - 2.0 * math.pi, 0.0], [0.0]], ["pod"]),  # over the seam
        ([[0.0], [0.1 - 2.0 * math.pi, 0.0], [0.0]], []),
        ([[0.0], [0.0, -10.0], [0.0]], ["pod"]),
        ([[5.0], [0.0, 10.0], [0.0]], ["screw", "pod"]),
    ],
)
def test_what_changed_as_fast_as_it_may_is_named(
    changes: list[list[float]], named: list[str]
) -> None:
    command = BEFORE.copy()
    for row, change in zip(command, changes, strict=True):
        row[: len(change)] += change
    words = tuple(f"rate of {name}" for name in named)
    assert rate_words(RATED, BEFORE, command, 0.1) == words
    assert rate_words(RATED, BEFORE, command, 0.2) == ()
    unknown = np.full_like(BEFORE, np.nan)
    assert rate_words(RATED, unknown, command, 0.1) == ()


@pytest.mark.parametrize(
    ("force", "is_named"), [(0.0, True), (1.5, True), (-2.0, True), (2.001, True), (2.1, False)]
)
def test_a_force_within_its_dead_band_is_named(force: float, is_named: bool) -> None:
    words = band_words(robot(), with_row("both ways", [force]))
    assert words == (("dead band of both ways",) if is_named else ())


def test_limits_come_before_dead_bands_and_these_before_axes() -> None:
    missing = np.array([0.0, -0.5, 0.04, 0.0, 0.0, 0.06])
    in_band = with_row("both ways", [1.0])
    at_limit = in_band.copy()
    at_limit[1, 0] = 30.0
    assert what_binds(robot(), at_limit, missing, None, 0.1) == ("ahead at full thrust",)
    assert what_binds(robot(), in_band, missing, None, 0.1) == ("dead band of both ways",)
    assert what_binds(robot(), MIDDLE, missing, None, 0.1) == (
        "Fy, Tz not given apart by these actuators",
    )
    faster = BEFORE.copy()
    faster[0, 0] += 5.0
    assert what_binds(RATED, faster, missing, BEFORE, 0.1) == ("rate of screw",)
    at_end = BEFORE.copy()
    at_end[0, 0] = 30.0
    before = at_end - [[5.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    assert what_binds(RATED, at_end, missing, before, 0.1) == (
        "screw at full thrust",
        "rate of screw",
    )


@pytest.mark.parametrize(
    ("lost", "freed", "is_apart"),
    [((), (), True), ((0,), (), True), ((0, 1), (), False), ((0, 1), ("Fy", "Ty"), True)],
)
def test_axes_that_fins_give_apart_do_not_bind(
    lost: tuple[int, ...], freed: tuple[str, ...], is_apart: bool
) -> None:
    # Each fin pushes along two directions, so three of them give six axes, and two give four.
    layout = load_layout("ucat")
    layout = replace(layout, axes=tuple([axis for axis in AXES if axis not in freed]))
    command = np.tile([0.3, 1.0, 0.2], (layout.n, 1))
    command[list(lost)] = np.nan
    missing = np.array([0.01, 0.0, 0.01, 0.0, 0.0, 0.0])
    words = what_binds(layout, command, missing, None, 0.1)
    assert words == (() if is_apart else ("Fx, Fz not given apart by these actuators",))
