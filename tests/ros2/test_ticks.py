"""How far commands may move: within the rates by the time that has passed, and no slower for it."""

import numpy as np
import pytest
from finlab_allocator.robot_source import read_robot
from finlab_allocator.ticks import ACCOUNT_PERIODS, SHORTEST_TICK_S, Ticks

from finlab.errors import AllocationError

PERIOD_S = 0.1


def test_ticks_are_never_longer_than_the_time_that_has_passed() -> None:
    ticks = Ticks(read_robot("ucat"), PERIOD_S, None)
    rng = np.random.default_rng(0)
    times = np.cumsum(rng.choice([0.001, 0.005, 0.03, 0.1, 0.4], size=400))
    lengths = np.array([ticks.spend(time)[0] for time in times])
    assert lengths.max() == PERIOD_S and lengths.min() >= SHORTEST_TICK_S
    spent = np.concatenate([[0.0], np.cumsum(lengths)])
    for i in range(len(times)):
        # Of the ticks i to j: the first one may spend what was left before.
        passed = times[i:] - times[i]
        assert (spent[i + 1 :] - spent[i] <= passed + ACCOUNT_PERIODS * PERIOD_S + 1e-9).all()


@pytest.mark.parametrize("jitter_s", [0.0, 0.02, 0.04])
def test_a_sender_that_jitters_has_whole_ticks(jitter_s: float) -> None:
    ticks = Ticks(read_robot("ucat"), PERIOD_S, None)
    rng = np.random.default_rng(1)
    times = PERIOD_S * np.arange(200) + rng.uniform(-0.5, 0.5, 200) * jitter_s
    assert all(ticks.spend(time)[0] == PERIOD_S for time in times)


def test_a_quick_sender_uses_most_of_the_time() -> None:
    ticks = Ticks(read_robot("ucat"), PERIOD_S, None)
    lengths = [ticks.spend(0.005 * k)[0] for k in range(1000)]
    assert 4.9 <= sum(lengths) <= 5.0 + ACCOUNT_PERIODS * PERIOD_S


def test_a_clock_that_goes_back_pays_nothing_in() -> None:
    ticks = Ticks(read_robot("ucat"), PERIOD_S, None)
    lengths = [ticks.spend(time)[0] for time in (100.0, 50.0, 50.0, 10.0, 10.0)]
    assert sum(lengths) <= ACCOUNT_PERIODS * PERIOD_S + 5 * SHORTEST_TICK_S * 2


def test_each_robot_is_prepared_for_its_tick() -> None:
    ticks = Ticks(read_robot("catamaran"), PERIOD_S, calm=0.0)
    for time in (0.0, 0.0, 0.01, 0.011):
        length, robot = ticks.spend(time)
        settings = vars(robot.allocator.settings)
        assert settings["period_s"] == length and settings["calm"] == 0.0
    with pytest.raises(AllocationError, match="calm"):
        Ticks(read_robot("catamaran"), PERIOD_S, calm=-1.0)


def test_drives_without_rates_need_no_account() -> None:
    ticks = Ticks(read_robot("bluerov2_heavy"), PERIOD_S, None)
    assert {ticks.spend(0.0)[0] for _ in range(50)} == {PERIOD_S}
    command = np.ones((8, 3))
    assert ticks.towards(command, 0.0 * command, PERIOD_S) is command


def test_the_way_to_some_commands_is_within_the_rates() -> None:
    robot = read_robot("ucat")
    ticks = Ticks(robot, PERIOD_S, None)
    last = np.tile([0.5, 2.0, 3.0], (4, 1))
    wanted = np.tile([0.05, 0.1, -3.0], (4, 1))
    step = robot.layout.rates * 0.02
    nearer = ticks.towards(wanted, last, 0.02)
    np.testing.assert_allclose(last[:, :2] - nearer[:, :2], step[:, :2])
    assert nearer[0, 2] == pytest.approx(3.1), "an angle turns the shorter way round"
    wanted[1] = np.nan
    assert np.isnan(ticks.towards(wanted, last, 0.02)[1]).all()
