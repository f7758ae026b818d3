"""A monitor beside a swim: what it finds, what it leaves alone, and what it hands to the
allocator."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.errors import LayoutError
from finlab.layout import Layout, load_layout
from finlab.layout.damage import Damage
from finlab.research.evaluation.experiments.hard_days import BUILT_OFF
from finlab.swim.control import FaultMonitor, Measurement, MonitorSettings
from finlab.swim.control.jump_evidence import LOST
from finlab.swim.simulation import (
    NOISE_ALONE,
    ClosedLoop,
    Fault,
    RunLog,
    make_trajectory,
    perturbed,
)
from finlab.swim.vehicle.fossen import complete_body
from finlab.swim.vehicle.vehicle import Vehicle
from tests.allocator_cache import AllocatorCache
from tests.ripple_force import rippled

CURRENT = (0.03, -0.02, 0.0)
"""Current of the water [m/s]."""
PRIOR = 0.01
"""More than any fin's prior probability of being broken."""


def swim(
    layout: Layout, allocator: Allocator, failures: list[Fault], **options: object
) -> ClosedLoop:
    """A swim with noise and a current, watched, of whose failures the allocator is not told."""
    return ClosedLoop(
        layout,
        allocator,
        make_trajectory("lissajous"),
        announced=False,
        monitor=FaultMonitor(layout),
        sensors=NOISE_ALONE,
        current=CURRENT,
        failures=failures,
        seed=3,
        **options,  # type: ignore[arg-type]
    )


def log_at(loop: ClosedLoop, seconds: float) -> RunLog:
    """The log of a swim at a time [s]."""
    while loop.time < seconds:
        loop.step()
    return loop.log


def test_whole_fins_are_left_alone(layout_a: Layout, analytic: AllocatorCache) -> None:
    loop = swim(layout_a, analytic.on(layout_a), [])
    log = log_at(loop, 30.0)
    assert loop.damage == Damage()
    assert log.fault_probability.max() < 0.5 and np.median(log.fault_probability) < PRIOR
    np.testing.assert_allclose(log.strength[-1], 1.0, atol=0.15)


@pytest.mark.parametrize(
    "name", ["front_right", pytest.param("back_left", marks=pytest.mark.exhaustive)]
)
def test_a_lost_fin_is_found_and_no_longer_used(layout_a: Layout, name: str) -> None:
    loop = swim(layout_a, AllocatorCache().on(layout_a), [Fault(name, 12.0)])
    log = log_at(loop, 16.0)
    fin = layout_a.index(name)
    assert loop.damage.lost == (name,)
    lost = log.time >= 12.0
    assert not log.alive[lost, fin].any()
    found = float(log.time[np.isnan(log.command[:, fin, 0])][0])
    assert 12.0 < found < 15.0
    assert np.isfinite(log.command[log.time < found]).all()
    assert log.fault_probability[-1, fin] > 0.99
    assert np.delete(log.fault_probability[-1], fin).max() < 0.5
    assert log.fault_probability[log.time < 12.0].max() < 0.5


@pytest.mark.parametrize("lost", [("front_right", "back_left"), ("front_left", "back_right")])
def test_two_fins_lost_at_one_moment_are_found(layout_a: Layout, lost: tuple[str, str]) -> None:
    """Each alone explains as little of it as any other fin would."""
    loop = swim(layout_a, AllocatorCache().on(layout_a), [Fault(name, 12.0) for name in lost])
    log_at(loop, 12.0)
    assert loop.damage.lost == ()
    log_at(loop, 16.0)
    assert loop.damage.lost == lost


def test_a_weak_fin_keeps_its_share(layout_a: Layout, analytic: AllocatorCache) -> None:
    loop = swim(layout_a, analytic.on(layout_a), [Fault("back_left", 12.0, "torn", 0.4)])
    log = log_at(loop, 30.0)
    fin = layout_a.index("back_left")
    assert loop.damage.lost == () and loop.damage.faults_by_kind
    assert log.strength[-1, fin] == pytest.approx(0.4, abs=0.12)
    assert loop.damage.torn["back_left"] == pytest.approx(0.4, abs=0.15)
    assert 0.0 < log.strength_std[-1, fin] < 0.15


def test_a_stuck_fin_is_told_from_a_lost_one(layout_a: Layout, analytic: AllocatorCache) -> None:
    loop = swim(layout_a, analytic.on(layout_a), [Fault("front_left", 12.0, "stuck")])
    log = log_at(loop, 20.0)
    assert loop.damage.lost == () and loop.damage.faults_by_kind
    held = log.fin_motion[-1, layout_a.index("front_left"), 2]
    assert math.remainder(loop.damage.stuck["front_left"] - held, 2 * math.pi) == pytest.approx(
        0.0, abs=0.35
    )


def test_a_repaired_fin_is_taken_back(layout_a: Layout) -> None:
    events = [Fault("back_right", 10.0), Fault("back_right", 15.0, "whole")]
    loop = swim(layout_a, AllocatorCache().on(layout_a), events)
    log_at(loop, 15.0)
    assert loop.damage.lost == ("back_right",)
    log_at(loop, 60.0)
    assert loop.damage == Damage()


def test_fins_at_rest_cannot_be_told(layout_a: Layout, analytic: AllocatorCache) -> None:
    """The allocator rests a fin, of which nothing is known then: its probability stays at its
    prior."""
    loop = ClosedLoop(
        layout_a,
        analytic.on(layout_a),
        make_trajectory("lissajous"),
        failures=[("front_left", 0.0), Fault("front_left", 8.0)],
        announced=True,
        seed=1,
    )
    monitor = FaultMonitor(layout_a)
    fin = layout_a.index("front_left")
    watch = loop.controller.wrench
    command = None
    seen: list[Measurement] = []
    loop.controller.wrench = lambda m, s, g: (seen.append(m), watch(m, s, g))[1]  # type: ignore[func-returns-value, method-assign]
    verdicts = []
    while loop.time < 20.0:
        tick = loop.step()
        verdicts.append(monitor.step(seen[-1], command))
        command = tick.command
    assert np.isnan(command[fin]).all()
    assert max(v.probability[fin] for v in verdicts) < PRIOR
    assert verdicts[-1].strength[fin] == pytest.approx(1.0, abs=1e-9)
    assert verdicts[-1].strength_std[fin] == pytest.approx(MonitorSettings().strength, rel=1e-6)


def test_what_somebody_knows_is_believed(layout_a: Layout) -> None:
    monitor = FaultMonitor(layout_a)
    assert monitor.tell("front_left", 0.0).damage.lost == ("front_left",)
    assert monitor.tell("front_left").damage.lost == ()
    verdict = monitor.tell("back_left", 0.5, stuck=0.3)
    assert verdict.damage.stuck == {"back_left": 0.3}
    assert verdict.damage.torn == {"back_left": 0.5}
    assert verdict.probability[layout_a.index("back_left")] > 0.99
    with pytest.raises(LayoutError, match="no fin 'tail'"):
        monitor.tell("tail")


def test_a_single_odd_sample_decides_nothing(layout_a: Layout) -> None:
    """A fault that is all but certain in one sample and not in the next is not acted on."""
    monitor = FaultMonitor(layout_a)
    hypotheses = monitor._hypotheses
    hypotheses.age_s = monitor.settings.settle_s  # long enough under way to be believed
    hypotheses._begin_onset()
    hypotheses._age[:] = 1.0
    nothing = hypotheses.evidence()
    sure = nothing._replace(log_odds=nothing.log_odds.copy(), by_kind=nothing.by_kind.copy())
    sure.log_odds[0, 2, LOST] = 20.0
    sure.by_kind[2, LOST] = 20.0
    for evidence in (sure, nothing, sure):
        hypotheses.evidence = lambda evidence=evidence: evidence  # type: ignore[method-assign]
        monitor._decide(0.1)
        assert monitor.verdict().damage == Damage()
    monitor._decide(0.1)
    assert monitor.verdict().damage.lost == (layout_a.names[2],), "the second in a row decides"


@pytest.mark.parametrize("truth", ["ripple", "askew"])
def test_a_model_that_does_not_fit_raises_no_alarm(
    layout_a: Layout, analytic: AllocatorCache, truth: str
) -> None:
    """Fins that shake the robot by several newtons, or push elsewhere than the model says."""
    built = perturbed(layout_a, **BUILT_OFF) if truth == "askew" else None
    loop = swim(layout_a, analytic.on(layout_a), [], truth=built)
    loop = rippled(loop) if truth == "ripple" else loop
    log_at(loop, 25.0)
    assert loop.damage == Damage()


def test_the_last_fin_that_works_is_never_called_lost(layout_a: Layout) -> None:
    monitor = FaultMonitor(layout_a, settings=replace(MonitorSettings(), settle_s=0.0))
    for name in layout_a.names[1:]:
        monitor.tell(name, 0.0)
    still = Measurement(0.0, np.zeros(3), 0.0, np.zeros(3), 0.0, np.zeros(3), 0.0, 0.0)
    command = np.full((4, 3), np.nan)
    command[0] = 0.5, 1.5, 0.0  # it should push hard, and the robot stays where it is
    for _ in range(60):
        verdict = monitor.step(still, command)
    assert verdict.strength[0] < 0.9 or verdict.probability[0] > 0.5, "the case is not hard enough"
    assert layout_a.names[0] not in verdict.damage.lost


def at_rest(time: float, velocity: np.ndarray) -> Measurement:
    """What a robot measures that lies still."""
    return Measurement(time, np.zeros(3), 0.0, velocity, 0.0, np.zeros(3), 0.0, 0.0)


def test_a_weak_thruster_is_asked_for_more() -> None:
    heavy = load_layout("bluerov2_heavy")
    monitor = FaultMonitor(heavy)
    command = np.zeros((heavy.n, 3))
    command[:, 0] = 4.0
    np.testing.assert_array_equal(monitor.sent(command), command)
    verdict = monitor.tell("rear_left", 0.5)
    (finding,) = verdict.findings
    assert (finding.name, finding.kind, finding.value) == ("rear_left", "weak", 0.5)
    weak = heavy.index("rear_left")
    np.testing.assert_allclose(monitor.sent(command)[weak, 0], 8.0)
    np.testing.assert_array_equal(np.delete(monitor.sent(command), weak, axis=0)[:, 0], 4.0)
    monitor.tell("rear_left")
    np.testing.assert_array_equal(monitor.sent(command), command)


def test_the_force_of_a_stuck_thruster_is_public() -> None:
    monitor = FaultMonitor(load_layout("bluerov2_heavy"))
    verdict = monitor.tell("front_left", stuck=7.5)
    assert verdict.damage.lost == ()
    assert verdict.damage.stuck["front_left"] == pytest.approx(7.5, abs=0.2)
    (finding,) = verdict.findings
    assert finding.kind == "stuck" and finding.value == verdict.damage.stuck["front_left"]


def test_a_sample_of_the_velocity_counts_once() -> None:
    """A node that makes a new array of its last message in each call feeds no new sample."""
    heavy = load_layout("bluerov2_heavy")
    rng = np.random.default_rng(0)
    samples = 0.01 * rng.normal(size=(10, 3))
    command = np.zeros((heavy.n, 3))
    command[:, 0] = 2.0
    monitors = FaultMonitor(heavy), FaultMonitor(heavy)
    for tick in range(50):
        sample = samples[tick // 5]
        kept, copied = [
            monitor.step(at_rest(0.1 * tick, velocity), command if tick else None)
            for monitor, velocity in zip(monitors, (sample, sample.copy()), strict=True)
        ]
    np.testing.assert_array_equal(kept.strength, copied.strength)
    assert (monitors[0]._hypotheses.state == monitors[1]._hypotheses.state).all()


def test_no_velocity_is_no_velocity() -> None:
    """NaN, or the same numbers for ever, say nothing; the filter stays finite."""
    heavy = load_layout("bluerov2_heavy")
    command = np.zeros((heavy.n, 3))
    command[:4, 0] = -2.0, -2.0, 2.0, 2.0  # ahead
    speeds = []
    for velocity in (np.full(3, np.nan), np.zeros(3)):
        monitor = FaultMonitor(heavy)
        for tick in range(40):
            monitor.step(at_rest(0.1 * tick, velocity), command if tick else None)
        speeds.append(monitor._hypotheses.state[0])
    assert abs(speeds[0]) > 0.1, "it is taken to swim"
    assert speeds[0] == speeds[1]


@pytest.mark.parametrize("times", [1, 2, 4])
def test_any_period_will_do(times: int) -> None:
    """Looked at more and less often, a robot without a velocity is expected where the simulated
    body comes to."""
    heavy = load_layout("bluerov2_heavy")
    body = np.array([0.0, 0.0, 0.0, 1.0, *np.zeros(9)])
    thrust = 8.0 * np.sqrt(0.5)
    for _ in range(195):  # 0.1 s less: actuators lag by that
        ahead = Vehicle(complete_body(heavy)).step(body, [thrust, 0.0, 0.0, 0.0, 0.0, 0.0], 0.02)
        body[7] = ahead[7]
    command = np.zeros((heavy.n, 3))
    command[:4, 0] = -2.0, -2.0, 2.0, 2.0
    monitor = FaultMonitor(heavy)
    for tick in range(20 * times + 1):
        time = tick * 0.2 / times
        monitor.step(at_rest(time, np.full(3, np.nan)), command if tick else None)
    assert monitor._clock_s == pytest.approx(4.0)
    assert monitor._hypotheses.state[0] == pytest.approx(body[7], rel=0.04)


def test_a_robot_that_tumbles_leaves_the_monitor_finite() -> None:
    """What no model says of a motion is no exception, and no number that is none."""
    heavy = load_layout("bluerov2_heavy")
    rng = np.random.default_rng(1)
    monitor = FaultMonitor(heavy)
    for tick in range(150):
        command = rng.uniform(-40.0, 40.0, (heavy.n, 3)) * [1.0, 0.0, 0.0]
        measurement = at_rest(0.1 * tick, rng.normal(size=3))._replace(
            rates=10.0 * rng.normal(size=3),
            roll=rng.uniform(-3.0, 3.0),
            pitch=rng.uniform(-1.5, 1.5),
        )
        verdict = monitor.step(measurement, command if tick else None)
        assert np.isfinite(verdict.probability).all() and np.isfinite(verdict.strength).all()
        assert len(verdict.damage.lost) < heavy.n
        Allocator(heavy).allocate(np.ones(6), damage=verdict.damage)


def test_nothing_is_told_of_a_robot_that_stands_on_its_nose() -> None:
    """There its roll is any number; it is watched again from when it lies level."""
    heavy = load_layout("bluerov2_heavy")
    rng = np.random.default_rng(2)
    command = np.zeros((heavy.n, 3))
    monitor = FaultMonitor(heavy)
    for tick in range(120):
        measurement = at_rest(0.1 * tick, np.zeros(3))
        if 80 <= tick < 100:
            roll = rng.uniform(-math.pi, math.pi)
            measurement = measurement._replace(roll=roll, pitch=1.5)
        verdict = monitor.step(measurement, command if tick else None)
        assert verdict.findings == ()
        if 80 <= tick < 100:
            assert not verdict.unknown
            assert monitor._hypotheses.state[6] == measurement.roll
    assert len(monitor._hypotheses.onset_age) > 5
    assert not monitor._hypotheses.settled


def test_a_robot_on_its_back_may_roll_over_the_seam() -> None:
    """Roll goes on at -pi from pi: no innovation of a whole turn."""
    heavy = load_layout("bluerov2_heavy")
    command = np.zeros((heavy.n, 3))
    monitor = FaultMonitor(heavy)
    for tick in range(10):
        roll = math.pi - 0.002 if tick % 2 else -math.pi + 0.002
        measurement = at_rest(0.1 * tick, np.zeros(3))._replace(roll=roll)
        monitor.step(measurement, command if tick else None)
        assert monitor._hypotheses.distance < 5.0
