"""What is commanded, and when: without ROS, by a clock of the test's own."""

import math
from typing import Any

import numpy as np
import pytest
from finlab_allocator.commander import Commander, Sent
from finlab_allocator.frames import StaticFrames
from finlab_allocator.input_checks import NO_STAMP, StampedInput
from finlab_allocator.parameters import Parameters
from finlab_allocator.status_report import ERROR, OK, WARN, AuthorityLeft, Report, status_report
from finlab_allocator.ticks import ACCOUNT_PERIODS

import finlab
from finlab.axes import AXES
from finlab.errors import FinlabError

PUSH = (20.0, 0.0, 5.0, 0.0, 0.0, 1.0)
"""A wrench within reach of `bluerov2_heavy`."""


class Robot:
    """A commander with its clock, which moves on when it is told to."""

    def __init__(self, robot: str, active: bool = True, **parameters: Any) -> None:
        self.commander = Commander(
            Parameters().changed({"robot": robot, **parameters}), StaticFrames()
        )
        self.now = 1000.0
        self.sent: list[tuple[float, Sent]] = []
        self.has_sender = True
        if active:
            self.commander.activate()

    def _note(self, sent: Sent | None) -> Sent | None:
        if sent is not None:
            self.sent.append((self.now, sent))
        return sent

    def ask(self, wrench: Any, **given: Any) -> Sent | None:
        """Sends a wrench now."""
        frame, stamp = given.get("frame", "base_link"), given.get("stamp", NO_STAMP)
        asked = StampedInput(np.array(wrench, float), frame, stamp)
        return self._note(self.commander.on_wrench(asked, self.now, self.now))

    def wait(self, seconds: float, step: float = 0.05) -> list[Sent]:
        """Lets time pass, and returns what is sent in it."""
        before = len(self.sent)
        for _ in range(round(seconds / step)):
            self.now += step
            self._note(self.commander.on_time(self.now, self.has_sender))
        return [sent for _, sent in self.sent[before:]]

    @property
    def status(self) -> Report:
        """What is said now."""
        return status_report(self.commander)

    @property
    def values(self) -> dict[str, str]:
        """Values of the status."""
        return dict(self.status.values)


def test_neutral_until_active() -> None:
    heavy = Robot("bluerov2_heavy", active=False)
    assert heavy.ask(PUSH) is None
    sent = heavy.wait(1.2)
    assert len(sent) == 3, "at once, and again every watchdog_s"
    assert not any(each.command.any() for each in sent) and heavy.status.level == WARN
    heavy.commander.activate()
    assert heavy.status.level == OK and "no wrench has come yet" in heavy.status.message
    answer = heavy.ask(PUSH)
    assert answer is not None and answer.command.any()
    heavy.commander.deactivate()
    assert heavy.ask(PUSH) is None
    assert not heavy.wait(0.05)[0].command.any()


@pytest.mark.parametrize("robot", ["bluerov2_heavy", "turtle_hybrid", "catamaran"])
def test_answers_are_those_of_the_librarys_loop(robot: str) -> None:
    own = Robot(robot, policy="direction")
    allocator = finlab.Allocator(finlab.load_layout(robot), period_s=0.1)
    rng = np.random.default_rng(2)
    previous = None
    for _ in range(30):
        wrench = rng.normal(size=6) * allocator.scale * 0.2
        answer = allocator.allocate(wrench, previous=previous, policy="direction")
        sent = own.ask(wrench)
        assert sent is not None
        np.testing.assert_allclose(sent.command, answer.command, rtol=0, atol=1e-12)
        previous = answer
        own.now += 0.1


def test_silence_leads_to_neutral_and_a_wrench_back() -> None:
    heavy = Robot("bluerov2_heavy")
    heavy.ask(PUSH)
    assert heavy.wait(0.5) == []
    sent = heavy.wait(0.1)
    assert len(sent) == 1 and not sent[0].command.any()
    assert heavy.status.message == "neutral: no good wrench for 0.5 s"
    assert heavy.wait(2.0) == [], "a sender that is there is sent no more"
    heavy.has_sender = False
    assert len(heavy.wait(1.05)) in (2, 3), "neutral is repeated every watchdog_s"
    assert heavy.ask(PUSH) is not None and heavy.status.level == OK


def test_a_clock_that_goes_back_leads_to_neutral() -> None:
    heavy = Robot("bluerov2_heavy")
    heavy.ask(PUSH)
    heavy.now -= 500.0
    sent = heavy.wait(0.05)
    assert len(sent) == 1 and not sent[0].command.any()
    assert heavy.ask(PUSH) is not None


def test_refused_wrenches_keep_nobody_from_neutral() -> None:
    heavy = Robot("bluerov2_heavy")
    heavy.ask(PUSH)
    for _ in range(11):
        heavy.now += 0.05
        assert heavy.ask([math.nan] * 6) is None
        heavy.wait(0.0)
    sent = heavy.wait(0.05)
    assert len(sent) == 1 and not sent[0].command.any()
    assert heavy.values["refusals"] == "11" and "NaN" in heavy.values["last refusal"]


@pytest.mark.parametrize(
    ("wrench", "given", "sentence"),
    [
        ((1, 0, math.nan, 0, 0, 0), {}, "Fz is NaN"),
        ((1, 0, math.inf, 0, 0, 0), {}, "Fz is infinite"),
        ((1e13, 0, 0, 0, 0, 0), {}, "Fx must be a number of at most 1e+12"),
        (PUSH, {"frame": "map"}, "frame 'map': no static transform leads from it to 'base_link'"),
        (PUSH, {"frame": "\x1b[31m" + "x" * 999}, "frame '\\x1b[31mxxx"),
        (PUSH, {"stamp": 990.0}, "its stamp is 10 s old"),
        (PUSH, {"stamp": 1010.0}, "its stamp lies 10 s ahead"),
    ],
)
def test_a_refusal_is_said_and_commands_nothing(
    wrench: Any, given: dict[str, Any], sentence: str
) -> None:
    heavy = Robot("bluerov2_heavy")
    heavy.ask(PUSH)
    before = heavy.commander.command
    assert heavy.ask(wrench, **given) is None
    assert heavy.commander.command is before
    status = heavy.status
    assert status.level == WARN and sentence in status.message and len(status.message) < 500
    assert heavy.ask(PUSH) is not None
    assert heavy.status.level == OK and sentence in heavy.values["last refusal"]


def test_nan_frees_an_axis_where_that_is_asked_for() -> None:
    heavy = Robot("bluerov2_heavy", nan="free", free=["Tx"])
    sent = heavy.ask([20, 0, 5, 0, math.nan, 1])
    assert sent is not None
    allocator = finlab.Allocator(finlab.load_layout("bluerov2_heavy"))
    expected = allocator.allocate([20, 0, 5, 0, 0, 1], free=("Tx", "Ty"))
    np.testing.assert_allclose(sent.command, expected.command, atol=1e-9)
    assert heavy.ask([math.nan] * 6) is None
    assert "names each axis" in heavy.status.message


@pytest.mark.parametrize("robot", ["ucat", "catamaran", "turtle_hybrid"])
def test_commands_stay_within_rates_and_limits(robot: str) -> None:
    """Wrenches at any times, of any size, with losses, refusals and silence between them: what is
    sent moves by at most the rates times the time between two messages, and the account's."""
    own = Robot(robot, policy="direction")
    layout = own.commander.layout
    rng = np.random.default_rng(3)
    scale = own.commander.robot.allocator.scale
    for _ in range(500):
        own.now += rng.choice([0.002, 0.005, 0.02, 0.1, 0.13])
        event = rng.integers(20)
        if event == 0:
            own.wait(rng.choice([0.6, 1.5]))
        elif event == 1:
            own.ask([math.nan] * 6)
        elif event == 2:
            lost = rng.choice(layout.names, size=rng.integers(2), replace=False).tolist()
            own.commander.change({"lost": lost})
        elif event == 3:
            own.commander.deactivate()
            own.wait(0.2)
            own.commander.activate()
        else:
            own.ask(rng.normal(size=6) * scale * rng.choice([0.1, 10.0]))
    times = np.array([time for time, _ in own.sent])
    commands = np.array([sent.command for _, sent in own.sent])
    known = np.isfinite(commands)
    assert (known.all(axis=2) | ~known.any(axis=2)).all()
    with np.errstate(invalid="ignore"):
        assert not (commands < layout.lower - 1e-9).any()
        assert not (commands > layout.upper + 1e-9).any()
    for ahead in (1, 2, 5, 20):
        passed = np.minimum(times[ahead:] - times[:-ahead], 10.0)
        most_s = np.minimum(0.1 * ahead, passed + ACCOUNT_PERIODS * 0.1)
        change = np.abs(commands[ahead:] - commands[:-ahead])
        turns = np.array([part.KIND.aiming_number is not None for part in layout.actuators])
        for i in np.flatnonzero(turns):
            k = layout.actuators[i].KIND.aiming_number
            change[:, i, k] = np.minimum(change[:, i, k], 2 * np.pi - change[:, i, k])
        # Of an actuator that was lost in between nothing is known.
        was_lost = np.array(
            [~known[j : j + ahead + 1].all(axis=0) for j in range(len(times) - ahead)]
        )
        too_far = (change > layout.rates * most_s[:, None, None] + 1e-9) & ~was_lost
        assert not too_far.any(), np.argwhere(too_far)[:3]


def test_the_way_to_neutral_is_within_the_rates_but_for_the_last_of_all() -> None:
    ucat = Robot("ucat")
    for _ in range(20):
        ucat.ask([1.0, 0, 0.5, 0, 0, 0.1])
        ucat.now += 0.1
    assert ucat.commander.command is not None and ucat.commander.command[0, 0] > 0.2
    way = ucat.wait(1.5)
    assert len(way) > 2 and way[0].command[0, 0] > way[1].command[0, 0]
    lowest = ucat.commander.layout.lower[:, :2]
    np.testing.assert_allclose(way[-1].command[:, :2], lowest)
    ucat.ask([1.0, 0, 0.5, 0, 0, 0.1])
    np.testing.assert_allclose(ucat.commander.stop().command[:, :2], lowest)
    assert ucat.commander.state == "inactive" and ucat.ask(PUSH) is None


def test_an_unforeseen_error_leads_to_neutral_and_on(monkeypatch: pytest.MonkeyPatch) -> None:
    heavy = Robot("bluerov2_heavy")
    heavy.ask(PUSH)
    with monkeypatch.context() as broken:

        def fail(*_: Any, **__: Any) -> None:
            raise ZeroDivisionError("a fault of our own")

        broken.setattr(type(heavy.commander.robot), "allocate", fail)
        sent = heavy.ask(PUSH)
    assert sent is not None and not sent.command.any()
    assert heavy.status.level == ERROR
    assert (
        "ZeroDivisionError" in heavy.status.message
        and "a fault of our own" in heavy.values["state"] + heavy.status.message
    )
    assert heavy.values["state"] == "failed"
    again = heavy.ask(PUSH)
    assert again is not None and again.command.any() and heavy.status.level == OK


def test_lost_actuators_are_done_without() -> None:
    heavy = Robot("bluerov2_heavy")
    assert heavy.commander.change({"lost": ["front_left"]}) is None
    sent = heavy.ask(PUSH)
    allocator = finlab.Allocator(finlab.load_layout("bluerov2_heavy"))
    expected = allocator.allocate(PUSH, lost=["front_left"]).command
    assert sent is not None
    np.testing.assert_allclose(sent.command, expected, atol=1e-9)
    assert np.isnan(heavy.wait(0.6)[0].command[:, 0]).sum() == 1, "at neutral it has no command"
    assert heavy.values["lost"] == "front_left"


def test_rudders_push_while_a_velocity_is_known() -> None:
    torpedo = Robot("torpedo")
    wrench = [10.0, 0, 0, 0, 2.0, 0]
    velocity = np.array([1.5, 0, 0, 0, 0, 0])
    at_rest = torpedo.ask(wrench)
    torpedo.commander.on_velocity(
        StampedInput(velocity, "base_link", NO_STAMP), torpedo.now, torpedo.now
    )
    torpedo.now += 1.0
    torpedo.commander.on_velocity(
        StampedInput(velocity, "base_link", NO_STAMP), torpedo.now, torpedo.now
    )
    torpedo.wait(0.1)
    swimming = torpedo.ask(wrench)
    assert at_rest is not None and swimming is not None
    assert at_rest.answer is not None and swimming.answer is not None
    assert swimming.answer.flow is not None and at_rest.answer.flow is None
    assert swimming.answer.err_norm < 0.9 * at_rest.answer.err_norm
    torpedo.now += 0.6
    late = torpedo.ask(wrench)
    assert late is not None and late.answer is not None and late.answer.flow is None
    bad = StampedInput(np.full(6, math.nan), "base_link", NO_STAMP)
    torpedo.commander.on_velocity(bad, torpedo.now, torpedo.now)
    assert "flow: each component must be finite" in torpedo.values["last refusal"]
    heavy = Robot("bluerov2_heavy")
    heavy.commander.on_velocity(bad, heavy.now, heavy.now)
    assert not heavy.values["last refusal"], "a robot without rudders does not read it"


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"lost": ["nobody"]}, "lost: layout bluerov2_heavy has no actuator 'nobody', it has"),
        ({"free": ["Ux"]}, "free: expected axes among Fx, Fy, Fz, Tx, Ty, Tz, got 'Ux'"),
        ({"free": list(AXES)}, "free: names each axis that layout bluerov2_heavy commands"),
        ({"robot": "nowhere"}, "layout 'nowhere' is neither a file nor a shipped layout"),
        ({"robot": ""}, "robot: expected the name of a shipped layout"),
        ({"robot": "ucat", "lost": ["lift_1"]}, "lost: layout ucat has no fin 'lift_1'"),
        ({"period_s": 1.0, "policy": "best"}, "policy: expected one of"),
    ],
)
def test_a_change_is_refused_as_a_whole(values: dict[str, Any], sentence: str) -> None:
    heavy = Robot("bluerov2_heavy")
    heavy.ask(PUSH)
    parameters, ticks = heavy.commander.parameters, heavy.commander.ticks
    with pytest.raises(FinlabError) as refusal:
        heavy.commander.change(values)
    assert str(refusal.value).startswith(sentence)
    assert heavy.commander.parameters is parameters and heavy.commander.ticks is ticks
    assert heavy.ask(PUSH) is not None


def test_all_lost_is_refused() -> None:
    heavy = Robot("bluerov2_heavy")
    with pytest.raises(FinlabError, match="lost: names each actuator of bluerov2_heavy"):
        heavy.commander.change({"lost": list(heavy.commander.layout.names)})


def test_another_robot_begins_at_its_own_neutral() -> None:
    own = Robot("bluerov2_heavy")
    own.ask(PUSH)
    rest = own.commander.change({"robot": "ucat"})
    assert rest is not None and rest.shape == (8, 3) and not rest.any()
    assert own.commander.layout.name == "ucat" and own.commander.state == "waiting"
    assert own.wait(0.05)[0].command.shape == (4, 3)
    assert own.commander.change({"robot": "ucat"}) is None, "the same robot read again"


def test_period_and_calm_change_under_way() -> None:
    own = Robot("catamaran")
    own.ask([20, 5, 0, 0, 0, 2])
    before = own.commander.command
    own.commander.change({"period_s": 0.5, "calm": 0.0})
    assert own.commander.command is before and own.commander.ticks.period_s == 0.5
    assert vars(own.commander.robot.allocator.settings)["calm"] == 0.0


def test_a_budget_of_power_is_kept_and_changed() -> None:
    heavy = Robot("bluerov2_heavy", power_w=100.0)
    for power_w in (100.0, 40.0):
        heavy.commander.change({"power_w": power_w})
        answer = heavy.ask([80.0, 40.0, 0.0, 0.0, 0.0, 10.0]).answer
        assert answer is not None and answer.power == pytest.approx(power_w, rel=1e-6)
        assert "power" in heavy.status.message
        assert dict(heavy.status.values)["power_w"] == f"{power_w:g}"
    heavy.commander.change({"power_w": None})
    answer = heavy.ask([80.0, 40.0, 0.0, 0.0, 0.0, 10.0]).answer
    assert answer is not None and answer.power > 100.0
    with pytest.raises(FinlabError, match="power: expected watts above 0"):
        heavy.commander.change({"power_w": 0.0})


def test_the_status_has_what_an_answer_says() -> None:
    heavy = Robot("bluerov2_heavy", policy="direction")
    sent = heavy.ask([900, 0, 0, 0, 0, 0])
    assert sent is not None and sent.answer is not None
    status, values = heavy.status, heavy.values
    assert status.level == WARN and status.message.startswith("not reached: ")
    assert "at full thrust" in values["binding"] and values["reachable"] == "false"
    assert float(values["unallocated Fx [N]"]) == pytest.approx(
        sent.answer.unallocated[0], rel=1e-4
    )
    assert float(values["power [W]"]) == pytest.approx(sent.answer.power, rel=1e-4)
    assert float(values["bound [W]"]) <= float(values["power [W]"]) * (1 + 1e-5)
    assert values["policy"] == "direction"


def test_times_of_answers() -> None:
    heavy = Robot("bluerov2_heavy")
    assert "answer time p99 [ms]" not in heavy.values
    for k in range(12_000):
        heavy.commander.times.add(1e-3 * (k % 100), 5e-4 * (k % 100))
    values = heavy.values
    assert values["answers"] == "12000"
    assert float(values["answer time p50 [ms]"]) == pytest.approx(50.0, abs=1.0)
    assert float(values["answer time p99 [ms]"]) == pytest.approx(99.0, abs=1.0)
    assert float(values["processor time p99 [ms]"]) == pytest.approx(49.5, abs=0.5)


def test_what_is_left_of_each_axis() -> None:
    heavy = Robot("bluerov2_heavy")
    whole = AuthorityLeft.of(heavy.commander.layout, heavy.commander)
    assert [report.level for report in whole.reports()] == [OK] * 6
    allocator = finlab.Allocator(heavy.commander.layout)
    surge = dict(whole.reports()[0].values)
    just_within = [0.999 * float(surge["largest [N]"]), 0, 0, 0, 0, 0]
    just_beyond = [1.01 * float(surge["largest [N]"]), 0, 0, 0, 0, 0]
    assert allocator.allocate(just_within).reachable
    assert not allocator.allocate(just_beyond).reachable
    heavy.commander.change({"lost": ["front_left"]})
    left = AuthorityLeft.of(heavy.commander.layout, heavy.commander).reports()
    assert left[0].level == WARN and "% is left" in left[0].message
    assert 0.2 < float(dict(left[0].values)["share left"]) < 0.9
    assert left[2].level == OK, "heave has thrusters of its own"
    no_yaw = Robot("no_yaw")
    words = {
        report.name: report.message
        for report in AuthorityLeft.of(no_yaw.commander.layout, no_yaw.commander).reports()
    }
    assert "does not push along it alone" in words["finlab_allocator: Tz (yaw)"]
