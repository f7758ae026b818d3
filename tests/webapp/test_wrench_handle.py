"""The wrench in the user's hand: what a drag asks for, what it takes, and what undo makes of it."""

import asyncio
import time
from collections.abc import Iterator
from statistics import median
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finlab.layout import load_layout
from tests.webapp.test_faults import Tab
from webapp.scene.wrench_handle import Grip, pulled_force, turn_of, turned_torque, unwound
from webapp.scene.wrench_nodes import LENGTH
from webapp.session.targets import slider_end
from webapp.tasks.slot import Pools
from webapp.tasks.solver import Solver

REACH = (23.0, 13.0, 27.0)
"""How far a robot goes along x, y and z [N]."""
MOST_FRAME_MS = 60.0
"""Processor time from a frame of a drag to its answer on the page [ms], in the middle of many."""
FRAMES = 40
"""Frames of a drag."""


def force(tip: tuple[float, float, float], newtons: float = 1.0, size: float = 1.0) -> Any:
    """What a drag asks for that began at the foot, where nothing was asked."""
    grip = Grip(None, (0.0,) * 6, np.zeros(3))
    return pulled_force(np.array(tip), grip, newtons, size, REACH, LENGTH)


def test_near_the_foot_the_arrow_ends_in_the_hand() -> None:
    pull = force((0.1, 0.05, 0.0))
    assert pull.force == pytest.approx((1.0, 0.5, 0.0), abs=0.03) and pull.newtons == 1.0
    large = force((0.5, 0.0, 0.0), newtons=2.0, size=5.0)
    assert large.force == pytest.approx((2.0, 0.0, 0.0)) and large.newtons == 2.0


def test_farther_out_the_force_grows_without_a_jump_and_its_arrow_ends_in_the_hand() -> None:
    ways = np.arange(0.0, 1.2, 0.002)
    pulls = [force((way, 0.0, 0.0)) for way in ways.tolist()]
    sizes = np.array([pull.force[0] for pull in pulls])
    most = slider_end(REACH[0])
    assert (np.diff(sizes) >= 0.0).all() and sizes[-1] == most
    assert np.diff(sizes).max() < 0.02 * most
    for way, pull in zip(ways.tolist(), pulls, strict=True):
        if way > 0.05 and pull.force[0] < most:
            length = LENGTH * pull.force[0] / pull.newtons
            assert length == pytest.approx(way, rel=0.08), "scale and steps are rounded"


def test_only_what_was_moved_changes() -> None:
    grip = Grip(None, (1.234, 0.0, -0.777, 0.1, 0.2, 0.3), np.array([0.1234, 0.0, -0.0777]))
    pull = pulled_force(np.array([0.1234, 0.05, -0.0777]), grip, 1.0, 1.0, REACH, LENGTH)
    assert pull.force == (1.234, pytest.approx(0.5, abs=0.03), -0.777)


def test_a_hand_that_comes_back_asks_for_nothing() -> None:
    grip = Grip(None, (3.0, 0.0, 0.0, 0.0, 0.0, 0.0), np.array([0.3, 0.0, 0.0]))
    pull = pulled_force(np.array([1e-9, 0.0, 0.0]), grip, 1.0, 1.0, REACH, LENGTH)
    assert pull.force == (0.0, 0.0, 0.0)


def test_a_ring_is_fine_at_first_and_goes_to_the_end() -> None:
    reach = 6.9
    assert turned_torque(0.0, 0.25, reach) == 0.25
    small = turned_torque(np.radians(10.0), 0.25, reach)
    assert 0.25 < small < 0.25 + 0.03 * reach
    assert turned_torque(np.radians(90.0), 0.0, reach) == pytest.approx(slider_end(reach), rel=0.05)
    assert turned_torque(np.radians(-200.0), 0.0, reach) == -slider_end(reach)
    angles = np.radians(np.arange(-90.0, 90.5, 0.5))
    torques = np.array([turned_torque(angle, 0.0, reach) for angle in angles.tolist()])
    assert (np.diff(torques) >= -0.05 * reach / 2).all(), "coarser steps round either way"
    assert np.corrcoef(angles, torques)[0, 1] > 0.9


def test_turns_go_on_beyond_half_a_turn() -> None:
    angles = np.radians([0.0, 100.0, 170.0, 190.0, 260.0, 350.0, 370.0])
    last = 0.0
    for angle in angles.tolist():
        wxyz = np.array([np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])
        last = unwound(turn_of(wxyz, 2), last)
        assert last == pytest.approx(angle)


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    """A page of U-CAT with the shipped methods."""
    pools = Pools()
    tab = Tab(pools, load_layout("ucat"), Solver())
    yield tab
    tab.close()
    pools.stop()


@pytest.fixture
def opened(tab: Tab) -> Tab:
    """The page, as at first sight."""
    tab.on_loop(lambda: tab.view.do(tab.view.session.start_over))
    tab.on_loop(lambda: tab.view.do(lambda: tab.view.session.show_drawer("Candidates")))
    tab.settle()
    return tab


def gizmo(tab: Tab, name: str) -> Any:
    """A gizmo of the page by the end of its name."""
    return tab.client.scene.get_handle_by_name(f"/robot/wrench/{name}")


def drag(tab: Tab, handle: Any, phase: str, **pose: Any) -> None:
    """What viser does with a message of a drag."""
    for key, value in pose.items():
        setattr(handle._impl, key, np.array(value))
    event = SimpleNamespace(client=tab.client, target=handle, phase=phase)
    for hear in handle._impl_aux.update_cb:
        asyncio.run_coroutine_threadsafe(hear(event), tab.server.get_event_loop()).result(30)


def test_a_drag_of_the_tip_is_one_step_of_undo(opened: Tab) -> None:
    session = opened.view.session
    tip = gizmo(opened, "tip")
    assert tip.visible and tip.active_axes == (True, True, True)
    before = session.state.target
    start = np.array(tip.position)
    steps = len(session.history.past)
    drag(opened, tip, "start")
    for way in (0.02, 0.06, 0.1):
        drag(opened, tip, "update", position=start + [0.0, way, 0.0])
    opened.settle()
    held = session.state.target
    assert held[1] > 0.3 and (held[0], held[2:]) == (before[0], before[2:])
    assert tip.position == pytest.approx(start + [0.0, 0.1, 0.0]), "the hand has it"
    drag(opened, tip, "end")
    opened.settle()
    assert session.state.target == held and len(session.history.past) == steps + 1
    assert opened.view.shown_allocation is not None
    assert opened.view.shown_allocation.target == pytest.approx(held)
    arrow = np.array(held[:3]) * LENGTH / opened.view.scenery._scale.newtons
    assert tip.position == pytest.approx(arrow), "it stands at the tip again"
    session.undo()
    assert session.state.target == before


def test_a_ring_turns_one_torque_and_goes_back(opened: Tab) -> None:
    session = opened.view.session
    ring = gizmo(opened, "ring_x")
    before = session.state.target
    drag(opened, ring, "start")
    for angle in (0.3, 0.8):
        drag(opened, ring, "update", wxyz=[np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0])
    drag(opened, ring, "end")
    opened.settle()
    assert session.state.target[3] > 0.5
    assert session.state.target[:3] == before[:3] and session.state.target[4:] == before[4:]
    assert np.array(ring.wxyz) == pytest.approx([1.0, 0.0, 0.0, 0.0])
    assert session.history.undo_name == "Pull the wrench"


def test_only_axes_that_the_robot_commands_are_pulled(opened: Tab) -> None:
    session = opened.view.session
    opened.open(load_layout("catamaran"))
    assert gizmo(opened, "tip").active_axes == (True, True, False)
    shown = [gizmo(opened, f"ring_{axis}").visible for axis in "xyz"]
    assert shown == [False, False, True]
    opened.on_loop(lambda: opened.view.do(lambda: session.set_display("handle", False)))
    opened.settle()
    assert not gizmo(opened, "tip").visible and not gizmo(opened, "ring_z").visible
    opened.on_loop(lambda: opened.view.do(lambda: session.set_display("handle", True)))
    opened.on_loop(lambda: opened.view.do(lambda: session.show_task("Design")))
    opened.settle()
    assert not gizmo(opened, "tip").visible


def test_a_frame_of_a_drag_is_answered_in_time(opened: Tab) -> None:
    tip = gizmo(opened, "tip")
    start = np.array(tip.position)
    drag(opened, tip, "start")
    times = []
    for k in range(FRAMES):
        began_s = time.process_time()
        drag(opened, tip, "update", position=start + [0.004 * k, 0.002 * k, 0.0])
        asked = opened.view.session.state.target

        def answered(asked: Any = asked) -> bool:
            answer = opened.view.shown_allocation
            return answer is not None and tuple(answer.target) == asked

        while not (answered() and not opened.view.busy and not opened.view._is_due):
            time.sleep(0.001)
        times.append(1e3 * (time.process_time() - began_s))
    drag(opened, tip, "end")
    print(f"a frame of a drag: {median(times):.1f} ms of processor time, at most {max(times):.1f}")
    assert median(times) <= MOST_FRAME_MS
