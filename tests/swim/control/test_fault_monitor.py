"""A monitor beside a swim: what it finds, what it leaves alone, and what it hands to the
allocator."""

import math
from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.errors import LayoutError
from finlab.layout import Layout
from finlab.layout.damage import Damage
from finlab.research.evaluation.experiments.hard_days import BUILT_OFF
from finlab.swim.control import FaultMonitor, Measurement, MonitorSettings
from finlab.swim.control.hypotheses import LOST
from finlab.swim.simulation import (
    NOISE_ALONE,
    ClosedLoop,
    Fault,
    RunLog,
    make_trajectory,
    perturbed,
)
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
    hypotheses.onset_age[:] = 1.0
    nothing = hypotheses.evidence()
    sure = nothing._replace(log_odds=nothing.log_odds.copy())
    sure.log_odds[0, 2, LOST] = 20.0
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
