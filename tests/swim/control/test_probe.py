"""Pushes that keep actuators known: of fins that all but rest, and of those that are taken for lost
or stuck."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.layout import Layout, load_layout
from finlab.physics import plant_of
from finlab.swim.control import FaultMonitor, MonitorSettings
from finlab.swim.control.jump_evidence import LOST
from finlab.swim.control.probe import PROBE_FORCE_N, Probe

LEAST_PUSH = MonitorSettings().least_push
"""Force below which the monitor learns nothing of a fin [N]."""
NO_FIN_LOST = np.zeros(4, dtype=bool)
"""Which of four fins are lost."""
NEVER_STUCK = np.full(4, np.nan)
"""Forces at which they are stuck: they are not."""


def planar_forces(layout: Layout, command: np.ndarray) -> np.ndarray:
    """Forces (n, 2) [N] of fins in their planes."""
    return plant_of(layout).forces(command)[:, 1:]


def test_fins_that_all_but_rest_push_up_and_down(layout_a: Layout) -> None:
    probe = Probe(layout_a, MonitorSettings(), 0.1)
    command = np.array([[0.5, 1.5, 0.2], [0.5, 0.3, 0.0], [np.nan] * 3, [0.5, 0.2, 1.0]])
    before = planar_forces(layout_a, command)
    after = planar_forces(layout_a, probe.added(command, NO_FIN_LOST, np.zeros(4), NEVER_STUCK))
    np.testing.assert_array_equal(after[[0, 2]], before[[0, 2]])
    for fin in (1, 3):
        assert np.linalg.norm(before[fin]) < LEAST_PUSH
        assert np.linalg.norm(after[fin]) == pytest.approx(LEAST_PUSH, rel=0.05)
        assert after[fin, 0] == pytest.approx(before[fin, 0], abs=0.02), (
            "what it pushes ahead is kept"
        )
    assert after[1, 1] * after[3, 1] < 0.0, "together they lift little"
    command[1, 2] = np.pi  # now it is told to push astern: the side stays
    again = planar_forces(layout_a, probe.added(command, NO_FIN_LOST, np.zeros(4), NEVER_STUCK))
    np.testing.assert_allclose(again[1], after[1] * [-1.0, 1.0], atol=1e-6)


def test_a_lost_fin_is_probed_unless_somebody_said_that_it_is_lost(layout_a: Layout) -> None:
    settings = replace(MonitorSettings(), probe_every_s=3.0, least_push=0.0)
    command = np.tile([0.5, 1.0, 0.0], (4, 1))
    command[2] = np.nan
    told = FaultMonitor(layout_a, settings=settings)
    told.tell(layout_a.names[2], 0.0)
    found = FaultMonitor(layout_a, settings=settings)
    found._kind[2] = LOST
    beats = [np.isfinite(found.probed(command)[2, 0]) for _ in range(90)]
    assert beats == [30 <= k % 60 < 50 or k >= 60 and k < 80 for k in range(1, 91)]
    assert all(np.isnan(told.probed(command)[2, 0]) for _ in range(90))
    for _ in range(
        40
    ):  # ten ticks into a probe: it is turned and swings up as fast as the servos may
        probed = found.probed(command)
    push = planar_forces(layout_a, probed)[2]
    assert push[1] == pytest.approx(PROBE_FORCE_N, rel=0.05) and abs(push[0]) < 1e-9


def test_pushes_and_the_way_back_are_held_to_the_rates(layout_a: Layout) -> None:
    """Commands within the rates of fins that hardly push or are lost: what is sent is within them,
    too."""
    settings = replace(MonitorSettings(), probe_every_s=3.0)
    monitor = FaultMonitor(layout_a, settings=settings)
    rng = np.random.default_rng(0)
    monitor._kind[2] = LOST
    command = np.tile([0.3, 0.2, 0.0], (4, 1))
    most = 0.1 * layout_a.rates
    before = None
    pushed = 0
    for _ in range(400):
        command = command + rng.uniform(-1.0, 1.0, (4, 3)) * most
        command[:, :2] = np.clip(command[:, :2], layout_a.lower[:, :2], [0.6, 2.0])
        command[2] = np.nan
        sent = monitor.probed(command)
        pushed += not np.array_equal(sent, command, equal_nan=True)
        if before is not None:
            change = np.abs(sent - before)
            change[:, 2] = np.minimum(change[:, 2], 2 * np.pi - change[:, 2])
            # Of one that rests nothing is known but where it points.
            assert not (change > most + 1e-9)[np.isfinite(before[:, 0])].any()
        before = sent
        command[2] = [0.3, 0.2, 0.0]
    assert pushed > 100


@pytest.mark.parametrize("stuck_at", [-30.0, -0.01, 0.2, 12.0, 51.0])
def test_a_stuck_thruster_is_probed_by_a_force_that_tells_what_it_is(stuck_at: float) -> None:
    """One that is whole gives something else than one that is stuck, lost or reversed."""
    layout = load_layout("bluerov2")
    probe = Probe(layout, MonitorSettings(), 0.1)
    stuck = np.full(layout.n, np.nan)
    stuck[3] = stuck_at
    command = np.zeros((layout.n, 3))
    command[3, 0] = stuck_at
    told = [probe.added(command, ~np.isnan(stuck), np.zeros(layout.n), stuck) for _ in range(210)]
    last = told[-1]
    np.testing.assert_array_equal(np.delete(last, 3, axis=0), np.delete(command, 3, axis=0))
    force = float(last[3, 0])
    assert layout.lower[3, 0] <= force <= layout.upper[3, 0]
    assert min(abs(force - stuck_at), abs(force), abs(2.0 * force)) > 1.5
