"""The closed loop as a whole, with the quickest method."""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finlab.errors import DataError, FinlabError, LayoutError
from finlab.layout import Layout
from finlab.research.evaluation.experiments.hard_days import BUILT_OFF
from finlab.swim import simulation as sim
from finlab.swim.control import FaultMonitor, TrackingController
from finlab.swim.simulation.log import log_of_ticks
from finlab.swim.vehicle.fossen import ucat_body
from tests.allocator_cache import AllocatorCache
from tests.ripple_force import rippled


def swum(swim: sim.ClosedLoop, seconds: float) -> sim.RunLog:
    """The log of the first seconds."""
    while swim.time < seconds:
        swim.step()
    return swim.log


@pytest.mark.parametrize("truth", ["drawn", "ripple", "askew"])
def test_it_follows_a_circle_whatever_its_fins_do(
    layout_a: Layout, analytic: AllocatorCache, truth: str
) -> None:
    built = sim.perturbed(layout_a, **BUILT_OFF) if truth == "askew" else None
    loop = sim.ClosedLoop(
        layout_a, analytic.on(layout_a), sim.make_trajectory("circle"), truth=built, seed=7
    )
    log = swum(rippled(loop) if truth == "ripple" else loop, 20.0)
    error = np.linalg.norm(log.position - log.reference, axis=1)
    assert error.max() < 0.25
    assert np.sqrt((error**2).mean()) < 0.1


def test_same_seed_same_swim(layout_a: Layout, analytic: AllocatorCache) -> None:
    swims = [
        sim.ClosedLoop(
            layout_a, analytic.on(layout_a), sim.make_trajectory("circle", 20.0), seed=seed
        )
        for seed in (1, 1, 2)
    ]
    first, again, other = ([swim.step() for _ in range(30)][-1].position for swim in swims)
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_a_copy_of_a_swim_goes_on_as_the_swim_does(
    layout_a: Layout, analytic: AllocatorCache
) -> None:
    swim = sim.ClosedLoop(layout_a, analytic.on(layout_a), sim.make_trajectory("circle", 20.0))
    for _ in range(5):
        swim.step()
    twin = deepcopy(swim)
    ticks = [swim.step() for _ in range(5)]
    for tick in ticks:
        also = twin.step()
        np.testing.assert_array_equal(tick.position, also.position)
        np.testing.assert_array_equal(tick.command, also.command)
        np.testing.assert_array_equal(tick.measured, also.measured)


def test_a_straight_path_holds_speed_and_depth(layout_a: Layout, analytic: AllocatorCache) -> None:
    log = swum(
        sim.ClosedLoop(
            layout_a, analytic.on(layout_a), sim.straight(30.0, 0.15), sensors=sim.NO_NOISE
        ),
        20.0,
    )
    late = log.time > 15.0
    assert np.abs(log.motion[late, 0] - 0.15).max() < 0.01
    assert np.abs(log.position[late, 2] + 1.0).max() < 0.02


def test_fins_fail_and_mend(layout_a: Layout, analytic: AllocatorCache) -> None:
    swim = sim.ClosedLoop(
        layout_a,
        analytic.on(layout_a),
        sim.make_trajectory("circle", 20.0),
        failures=[("front_left", 0.5)],
    )
    ticks = [swim.step() for _ in range(8)]
    lost = layout_a.index("front_left")
    assert [bool(tick.alive[lost]) for tick in ticks] == [True] * 5 + [False] * 3
    assert np.isnan(ticks[-1].command[lost]).all()
    assert np.abs(ticks[-1].force[lost]).max() < 0.01, "it hangs, and the robot is slow"
    swim.mend("front_left")
    assert swim.step().alive.all() and swim.damage.lost == ()
    swim.fail("front_left")
    swim.fail("back_left")
    assert not swim.controllable, "both left fins lost leave surge and yaw tied to each other"
    swim.fail("back_right")
    with pytest.raises(LayoutError, match="no fin left"):
        swim.fail("front_right")
    with pytest.raises(LayoutError, match="no fin 'tail'"):
        swim.mend("tail")


def test_bad_swims_are_refused(layout_a: Layout, analytic: AllocatorCache) -> None:
    task = sim.make_trajectory("circle", 20.0)
    with pytest.raises(LayoutError, match="no fin 'tail'"):
        sim.ClosedLoop(layout_a, analytic.on(layout_a), task, failures=[("tail", 1.0)])
    with pytest.raises(FinlabError, match="0 s or more"):
        sim.ClosedLoop(layout_a, analytic.on(layout_a), task, failures=[("front_left", -1.0)])


def test_logs_survive_the_disk(layout_a: Layout, analytic: AllocatorCache, tmp_path: Path) -> None:
    swim = sim.ClosedLoop(
        layout_a, analytic.on(layout_a), sim.make_trajectory("circle", 20.0), seed=3
    )
    ticks = [swim.step() for _ in range(5)]
    log = swim.log
    log.save(tmp_path / "log.npz")
    read = sim.load_log(tmp_path / "log.npz")
    assert (read.names, read.method, read.seed, read.n_ticks) == (layout_a.names, "analytic", 3, 5)
    for name in sim.Tick._fields:
        np.testing.assert_array_equal(
            getattr(read, name), getattr(log_of_ticks_like(log, ticks), name)
        )
    (tmp_path / "bad.npz").write_bytes(b"no archive")
    for path in ("bad.npz", "missing.npz"):
        with pytest.raises(DataError, match="expected a swim log"):
            sim.load_log(tmp_path / path)


def log_of_ticks_like(log: object, ticks: list[sim.Tick]) -> object:
    """The same log made anew from its ticks."""
    about = {
        name: getattr(log, name)
        for name in ("layout", "names", "method", "controller", "task", "water")
    }
    return log_of_ticks(ticks, seed=log.seed, **about)  # type: ignore[attr-defined]


def test_what_becomes_of_fins_without_a_word(layout_a: Layout, analytic: AllocatorCache) -> None:
    events = [sim.Fault("front_left", 2.0), sim.Fault("back_left", 2.0, "torn", 0.5)]
    events += [sim.Fault("back_right", 2.0, "stuck"), sim.Fault("back_left", 4.0, "whole")]
    swim = sim.ClosedLoop(
        layout_a,
        analytic.on(layout_a),
        sim.make_trajectory("circle"),
        failures=events,
        announced=False,
    )
    log = swum(swim, 5.0)
    lost, weak, stuck = (layout_a.index(name) for name in ("front_left", "back_left", "back_right"))
    after = log.time >= 2.0
    assert (
        swim.damage.lost == () and not swim.damage.faults_by_kind and swim.lost == ("front_left",)
    )
    assert set(swim.broken) == {"front_left", "back_right"}
    assert np.isfinite(log.command).all(), "the allocator goes on as before"
    assert not log.alive[after, lost].any() and log.alive[~after].all()
    assert not log.force[after, lost].any(), "a fin that hangs still gives nothing"
    assert (
        np.ptp(log.fin_motion[after, stuck, 2]) < 1e-9
        and np.ptp(log.command[after, stuck, 2]) > 0.02
    )
    law = np.linalg.norm(swim._plant.body_forces(log.fin_motion), axis=-1)
    share = np.linalg.norm(log.force, axis=-1)[:, weak] / law[:, weak]
    assert np.median(share[after & (log.time < 4.0)]) == pytest.approx(0.5, abs=0.06)
    assert np.median(share[log.time > 4.0]) == pytest.approx(1.0, abs=0.06)
    assert np.isnan(log.fault_probability).all(), "nobody watches"


def test_what_is_announced_reaches_the_allocator(
    layout_a: Layout, analytic: AllocatorCache
) -> None:
    swim = sim.ClosedLoop(layout_a, analytic.on(layout_a), sim.make_trajectory("circle"))
    swum(swim, 1.0)
    swim.fail("front_left", "torn", 0.4)
    swim.fail("back_left", "stuck")
    assert swim.damage.torn == {"front_left": 0.4}
    ((name, angle),) = swim.damage.stuck.items()
    fin = layout_a.index("back_left")
    assert name == "back_left" and angle == swim.fin_motion.value[2][fin]
    assert swim.step().command[fin, 2] == pytest.approx(angle, abs=1e-9)
    swim.mend("front_left", announced=False)
    assert swim.damage.torn == {"front_left": 0.4}, "nobody said that it is whole"
    swim.mend("front_left")
    assert swim.damage.torn == {}


@pytest.mark.parametrize(("kind", "share"), [("melted", 0.5), ("torn", 1.0), ("torn", 0.0)])
def test_no_such_failures(
    layout_a: Layout, analytic: AllocatorCache, kind: str, share: float
) -> None:
    with pytest.raises(FinlabError, match="fault of front_left: expected"):
        sim.Fault("front_left", 1.0, kind, share).checked()
    with pytest.raises(FinlabError, match="fault of front_left: expected"):
        sim.ClosedLoop(layout_a, analytic.on(layout_a), sim.make_trajectory("circle")).fail(
            "front_left", kind, share
        )


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "body",
    [
        {"mass_kg": 7.0, "buoyancy_n": 3.0, "linear_damping": (14, 8, 6, 15, 18, 18)},
        {
            "mass_kg": 1.0,
            "added_mass": (0.0,) * 6,
            "linear_damping": (100,) * 6,
            "inertia_kgm2": (0.1,) * 3,
        },
        {"mass_kg": 0.5, "quadratic_damping": (1000,) * 6, "inertia_kgm2": (0.001,) * 3},
    ],
    ids=["sinks", "held fast", "light"],
)
def test_odd_bodies_keep_loop_and_monitor_finite(layout_a: Layout, body: dict[str, Any]) -> None:
    """A body typed in with weight far from lift, or that water stops within a period."""
    layout = replace(layout_a, body=replace(ucat_body(), **{"buoyancy_n": None, **body}))
    monitor = FaultMonitor(layout)
    task = sim.make_trajectory("lissajous")
    loop = sim.ClosedLoop(
        layout,
        AllocatorCache("analytic").on(layout),
        task,
        TrackingController(layout),
        monitor=monitor,
    )
    for _ in range(60):
        tick = loop.step()
        assert np.isfinite(
            [*tick.motion, *tick.asked, *tick.fault_probability, *tick.strength_std]
        ).all()
    assert np.abs(loop.state[7:]).max() < 10.0
