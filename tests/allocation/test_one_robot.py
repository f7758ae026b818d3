"""An allocator is made for one robot: it is copied, sent to other processes, and keeps what it
prepares."""

import copy
import pickle
import subprocess
import sys
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.allocation import METHODS, Allocator
from finlab.allocation.allocation import CHUNK
from finlab.allocation.allocator import MAX_STATES
from finlab.allocation.method import Method
from finlab.errors import AllocationError
from finlab.layout import Damage, Fin, FinModelSpec, Layout, load_layout
from finlab.physics.objective import wrench_scale_of
from tests.allocation.quick_allocator import QUICK_SETTINGS

WRENCH = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]
"""A wrench within reach of robot A: surge, heave and yaw [N, N m]."""


def random_wrenches(n: int) -> np.ndarray:
    """Wrenches (n, 6) [N, N m] of the size that fins give."""
    return np.random.default_rng(0).normal(size=(n, 6)) * [1.0, 0.3, 1.0, 0.05, 0.05, 0.1]


@pytest.mark.parametrize("method", METHODS)
def test_copies_answer_the_same(method: str) -> None:
    layout = load_layout("bluerov2_heavy" if method in ("px4", "ardusub") else "A")
    allocator = Allocator(layout, method, **QUICK_SETTINGS.get(method, {}))
    lost = layout.names[:1]
    answer = allocator.allocate(WRENCH, lost=lost)
    for twin in (
        copy.copy(allocator),
        copy.deepcopy(allocator),
        pickle.loads(pickle.dumps(allocator)),
    ):
        assert (twin.layout, twin.method, twin.settings) == (
            allocator.layout,
            allocator.method,
            allocator.settings,
        )
        assert twin.allocate(WRENCH, lost=lost) == answer


def test_another_process_answers_the_same(tmp_path: Path) -> None:
    allocator = Allocator(load_layout("mixed"), period_s=0.2)
    answer = allocator.allocate(WRENCH)
    (tmp_path / "both").write_bytes(pickle.dumps((allocator, answer)))
    code = (
        "import pickle, sys\n"
        "allocator, answer = pickle.load(open(sys.argv[1], 'rb'))\n"
        "assert allocator.allocate(answer.target) == answer\n"
        "assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "both")], check=True, timeout=60)


def test_an_answer_needs_no_allocator(tmp_path: Path) -> None:
    answer = Allocator(load_layout("A")).allocate(WRENCH)
    (tmp_path / "answer").write_bytes(pickle.dumps(answer))
    code = (
        "import pickle, sys\n"
        "answer = pickle.load(open(sys.argv[1], 'rb'))\n"
        "assert answer.reachable and str(answer)\n"
        "finlab = [name for name in sys.modules if name.startswith('finlab.')]\n"
        "assert not [name for name in finlab if 'allocator' in name or 'method' in name]"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "answer")], check=True, timeout=60)


def test_damaged_robots_are_prepared_when_first_asked_about(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    allocator = Allocator(load_layout("A"))
    made = []
    kind = type(allocator._whole.method)
    first = Method.__init__

    def counted(self: Method, layout: Layout, *others: object) -> None:
        made.append(layout.names)
        first(self, layout, *others)  # type: ignore[arg-type]

    monkeypatch.setattr(Method, "__init__", counted)
    assert issubclass(kind, Method)
    for _ in range(3):
        allocator.allocate(WRENCH)
        allocator.allocate(WRENCH, lost=["front_left"])
        allocator.allocate(WRENCH, damage=Damage(weak={"back_left": 0.5}))
    assert len(made) == 1  # a loss prepares nothing
    for k in range(MAX_STATES + 3):
        allocator.allocate(WRENCH, damage=Damage(weak={"back_left": 0.5 + 0.01 * k}))
    assert len(allocator._states) == MAX_STATES


def test_errors_are_shares_of_what_the_robot_can_push() -> None:
    layout = load_layout("A")
    allocator = Allocator(layout)
    strongest = 4.737410112522892 * (2.1 * np.sin(0.6)) ** 2
    lever = np.linalg.norm(layout.position, axis=1)
    np.testing.assert_allclose(allocator.scale[:3], 2.0 * strongest, rtol=1e-9)
    assert (
        0.8 * 2.0 * strongest * lever.max()
        < allocator.scale[3]
        <= 2.0 * strongest * lever.max() * 1.0001
    )
    result_out_of_reach = allocator.allocate([100.0, 0, 0, 0, 0, 0])
    assert result_out_of_reach.err_norm == pytest.approx(
        (100.0 - result_out_of_reach.wrench[0]) / allocator.scale[0], rel=1e-6
    )
    assert result_out_of_reach.expected_error == 0.0 and not result_out_of_reach.expected_miss.any()
    lost = allocator.allocate(WRENCH, lost=["front_left"])
    np.testing.assert_array_equal(lost.scale, allocator.scale)


@pytest.mark.parametrize("size", [0.05, 0.2, 5.0])
def test_the_wrench_scale_grows_with_the_robot(size: float) -> None:
    """Of fins whose force grows with the area, on levers that grow with the robot."""
    model = FinModelSpec("drag", (("area", 0.02 * size**2), ("lever", 0.1)))
    places = [(size, 0.0, 0.0), (-size, 0.0, 0.0), (0.0, size, 0.0)]
    robot = Layout(
        "robot", tuple(Fin(f"f{i}", place, 0.3 * i, model=model) for i, place in enumerate(places))
    )
    plain = Layout(
        "robot", tuple(replace(f, position=tuple(np.array(f.position) / size)) for f in robot.fins)
    )
    plain = replace(
        plain, actuators=tuple(replace(f, model=FinModelSpec("drag")) for f in plain.fins)
    )
    expected = wrench_scale_of(plain) * np.repeat([size**2, size**3], 3)
    np.testing.assert_allclose(wrench_scale_of(robot), expected, rtol=1e-9)


def test_many_targets_take_flat_memory() -> None:
    allocator = Allocator(load_layout("A"))
    targets = random_wrenches(12 * CHUNK)
    allocator.allocate_batch(targets[: CHUNK + 1])
    tracemalloc.start()
    batch = allocator.allocate_batch(targets)
    kept, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # Commands, prices, and a copy of the targets: 216 bytes each.
    assert kept < 1.1 * 216 * len(targets) and most < kept + 6000 * CHUNK
    np.testing.assert_allclose(batch.power.sum(), batch.bound.sum(), rtol=1e-3)
    some = allocator.allocate_batch(targets[:CHUNK])
    np.testing.assert_array_equal(batch.command[:CHUNK], some.command)
    np.testing.assert_array_equal(batch.wrench[:CHUNK], some.wrench)
    np.testing.assert_array_equal(batch.err_norm[:CHUNK], some.err_norm)


@pytest.mark.parametrize("name", ["bluerov2_heavy", "turtle_hybrid"])
def test_robots_with_other_actuators_are_told_as_well(name: str) -> None:
    allocator = Allocator(load_layout(name))
    for wrench in (WRENCH, [1e4, 0.0, 0.0, 0.0, 0.0, 0.0]):
        answer = allocator.allocate(wrench)
        assert pickle.loads(pickle.dumps(answer)) == answer and answer.effort is None
        assert answer.reachable or any("at full thrust" in words for words in answer.binding)
        assert "effort" not in repr(answer) + str(answer)


def test_an_answer_of_another_robot_is_not_refined() -> None:
    answer = Allocator(load_layout("A"), "mdn").allocate(WRENCH)
    with pytest.raises(
        AllocationError, match="this answer is of layout 'A', and this allocator is for 'B'"
    ):
        Allocator(load_layout("B"), "mdn").refinement(answer)


def test_what_is_no_method_is_refused() -> None:
    layout = load_layout("A")
    with pytest.raises(AllocationError, match="method: expected the name of a method, got 3"):
        Allocator(layout, 3)  # type: ignore[call-overload]
    assert not hasattr(finlab, "load_allocator")
