"""Sectors of the world that no azimuth may blow into: judged by the directions of its race."""

import math
from dataclasses import replace

import numpy as np
import pytest

import finlab
from finlab.errors import LayoutError
from finlab.layout import Layout, kept_clear
from tests.random_robots import T200, layout_of, load

SECTORS = ((0.3, 1.1), (2.9, 3.6))
"""Two sectors of the world [rad]."""
NEAR = 1e-6
"""Angles [rad] as near as this to the end of an arc or a sector are not judged."""


def pods() -> Layout:
    """Three pods: all round, upside down in an arc, and with two arcs; and a thruster."""
    arcs = (None, [-170.0, 100.0], [[-150.0, -20.0], [40.0, 200.0]])
    actuators = []
    for k, arc_deg in enumerate(arcs):
        pod = {"name": f"p{k}", "type": "azimuth", "position_m": [-1.0, k - 1.0, 0.0]}
        pod |= {"turn_axis": [0, 0, -1 if k == 1 else 1], "zero": [0.6, 0.8, 0.0]}
        pod |= {"force_n": [0.0, 20.0], "model": T200}
        actuators.append(pod if arc_deg is None else pod | {"arc_deg": arc_deg})
    thruster = {"name": "bow", "type": "thruster", "position_m": [1.0, 0.0, 0.0]}
    actuators.append(thruster | {"axis": [0, 1, 0], "force_n": [-20.0, 20.0], "model": T200})
    return load({**layout_of("pods", actuators), "axes": ["Fx", "Fy", "Tz"]})


def is_inside(angle: float, arcs: object) -> bool | None:
    """Whether an angle is in arcs, modulo a turn; None too near to an end of one."""
    inside = False
    for begin, end in arcs:
        beyond = (angle - begin) % (2.0 * math.pi)
        if min(beyond, 2.0 * math.pi - beyond, abs(beyond - (end - begin))) < NEAR:
            return None
        inside |= beyond < end - begin
    return inside


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.4, 3.1, 9.0])
def test_races_stay_out_of_the_sectors(yaw: float) -> None:
    """Of each pod an angle is allowed where it was and its race, turned into the world, goes into
    no sector."""
    before = pods()
    after = kept_clear(before, SECTORS, yaw)
    assert after.names == before.names
    assert after.actuators[3] == before.actuators[3]
    for old, new in zip(before.actuators[:3], after.actuators[:3], strict=True):
        assert replace(new, arc=old.arc) == old
        assert np.abs(np.ravel(new.arc)).max() <= 2.0 * math.pi + 1e-9
        across = np.cross(new.turn_axis, new.zero)
        for angle in np.linspace(-math.pi, math.pi, 721):
            thrust = math.cos(angle) * np.array(new.zero) + math.sin(angle) * across
            race = math.atan2(-thrust[1], -thrust[0]) + yaw
            was = is_inside(angle, old.arcs)
            is_barred = is_inside(race, SECTORS)
            allowed = is_inside(angle, new.arcs)
            full = old.arcs[0][1] - old.arcs[0][0] > 2.0 * math.pi - NEAR
            if None not in (is_barred, allowed) and (full or was is not None):
                assert allowed == ((full or was) and not is_barred)


def test_an_answer_at_each_heading_keeps_clear() -> None:
    """The robot is asked for a force toward the diver's side: where its pods may not give it, they
    are seen to do so nowhere else."""
    for yaw in np.linspace(0.0, 6.0, 7):
        layout = kept_clear(pods(), SECTORS, yaw)
        result = finlab.Allocator(layout).allocate([-5, -5, 0, 0, 0, 0])
        for force in result.forces[:3]:
            if np.linalg.norm(force) > 1e-6:
                race = math.atan2(-force[1], -force[0]) + yaw
                assert is_inside(race, SECTORS) in (False, None)


def test_no_sectors_change_nothing() -> None:
    assert kept_clear(pods(), ()) == pods()
    assert kept_clear(pods(), SECTORS, names=["p1"]).actuators[0] == pods().actuators[0]


@pytest.mark.parametrize(
    ("sectors", "options", "words"),
    [
        (((1.0, 1.0),), {}, r"sectors\[0\]"),
        (((0.0, 7.0),), {}, r"sectors\[0\]"),
        (((0.0, math.nan),), {}, r"sectors\[0\]"),
        (SECTORS, {"yaw": math.inf}, "yaw"),
        (SECTORS, {"names": ["bow"]}, "bow is no azimuth"),
        (SECTORS, {"names": ["stern"]}, "stern"),
    ],
)
def test_what_is_wrong_is_named(sectors: object, options: dict, words: str) -> None:
    with pytest.raises(LayoutError, match=words):
        kept_clear(pods(), sectors, **options)


def test_sectors_that_leave_nothing_are_told() -> None:
    layout = pods().replace_actuator("p0", arc=(-0.1, 0.1))
    with pytest.raises(LayoutError, match="p0: the sectors leave it no direction"):
        kept_clear(layout, ((0.0, 6.2),))


def test_pods_that_push_astern_are_refused() -> None:
    layout = pods().replace_actuator("p0", force=(-10.0, 20.0))
    with pytest.raises(LayoutError, match="p0: pushes astern"):
        kept_clear(layout, SECTORS)
