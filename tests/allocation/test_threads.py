"""Batches that several threads share: `threads=` of `Allocator.allocate_batch`, and allocators that
threads ask at once."""

import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from finlab import Allocator, load_layout
from finlab.allocation.allocation import CHUNK, chunks
from finlab.allocation.shared_work import in_threads
from finlab.arrays import Array
from finlab.errors import AllocationError


def wrenches_of(allocator: Allocator, count: int, factor: float = 1.5) -> Array:
    """Wrenches (count, 6) of which some are within reach, some beyond."""
    rng = np.random.default_rng(7)
    return np.asarray(rng.normal(size=(count, 6)) * allocator.scale * factor)


@pytest.mark.parametrize("n", [0, 1, 2, 5, CHUNK - 1, CHUNK, CHUNK + 1, 5 * CHUNK, 5000])
@pytest.mark.parametrize("threads", [1, 2, 3, 7])
def test_parts_are_all_rows_in_their_order_alike_in_size(n: int, threads: int) -> None:
    parts = chunks(n, threads)
    rows = [row for part in parts for row in range(part.start, part.stop)]
    assert rows == list(range(n))
    sizes = [part.stop - part.start for part in parts]
    assert all(0 < size <= CHUNK for size in sizes)
    if sizes:
        assert max(sizes) - min(sizes) <= 1
    if n >= threads:
        assert len(parts) % threads == 0


@pytest.mark.parametrize("name", ["bluerov2_heavy", "A"])
@pytest.mark.parametrize("policy", ["closest", "direction"])
def test_answers_do_not_depend_on_the_number_of_threads(name: str, policy: str) -> None:
    allocator = Allocator(load_layout(name))
    wrenches = wrenches_of(allocator, 300, 0.2)
    lost = [allocator.layout.names[1]]
    assert len(wrenches) < CHUNK  # one part alone, several in threads
    for names in ([], lost):
        alone = allocator.allocate_batch(wrenches, policy=policy, lost=names)  # type: ignore[arg-type]
        for threads in (2, 3):
            shared = allocator.allocate_batch(
                wrenches,
                policy=policy,  # type: ignore[arg-type]
                lost=names,
                threads=threads,
            )
            np.testing.assert_array_equal(shared.command, alone.command)
            np.testing.assert_allclose(shared.bound, alone.bound, 1e-9)
            assert shared.notes == alone.notes


def test_allocators_of_several_threads_answer_as_one_does() -> None:
    layout = load_layout("bluerov2_heavy")
    wrenches = wrenches_of(Allocator(layout), 2000, 0.3)
    alone = Allocator(layout).allocate_batch(wrenches).command
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)  # threads take turns as often as can be
    try:
        with ThreadPoolExecutor(3) as pool:
            answers = pool.map(lambda _: Allocator(layout).allocate_batch(wrenches), range(6))
            for answer in answers:
                np.testing.assert_array_equal(answer.command, alone)
    finally:
        sys.setswitchinterval(interval)


def test_single_questions_are_answered_while_a_batch_is() -> None:
    allocator = Allocator(load_layout("bluerov2_heavy"))
    wrenches = wrenches_of(allocator, 400, 0.3)
    single = [allocator.allocate(wrench).command for wrench in wrenches[:40]]
    with ThreadPoolExecutor(2) as pool:
        batch = pool.submit(allocator.allocate_batch, np.tile(wrenches, (10, 1)))
        beside = [allocator.allocate(wrench).command for wrench in wrenches[:40]]
        batch_command = batch.result().command
    np.testing.assert_array_equal(beside, single)
    np.testing.assert_allclose(batch_command[:40], single, 1e-9, 1e-9)


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "2", None])
def test_threads_are_a_whole_number_from_1(threads: object) -> None:
    allocator = Allocator(load_layout("bluerov2_heavy"))
    with pytest.raises(AllocationError, match=r"threads: expected a whole number from 1, got"):
        allocator.allocate_batch(np.zeros((3, 6)), threads=threads)  # type: ignore[arg-type]


@pytest.mark.parametrize("count", [0, 1, 2, 5, 8])
@pytest.mark.parametrize("threads", [1, 2, 3, 20])
def test_shared_work_has_its_results_in_the_order_of_the_items(count: int, threads: int) -> None:
    names = set()

    def named(item: int) -> int:
        names.add(threading.get_ident())
        return item * item

    assert in_threads(named, range(count), threads) == [item * item for item in range(count)]
    assert len(names) <= min(threads, count)


def test_an_error_in_another_thread_is_raised_here() -> None:
    def refuse(item: int) -> int:
        if item == 5:
            raise ValueError("five")
        return item

    with pytest.raises(ValueError, match="five"):
        in_threads(refuse, range(8), 3)


@pytest.mark.parametrize("method", ["dual", "analytic"])
def test_parts_of_a_long_batch_have_their_own_commands(method: str) -> None:
    """Also where an actuator is lost, which one of the methods leaves out of its commands."""
    allocator = Allocator(load_layout("A"), method)  # type: ignore[arg-type]
    most = allocator._whole.method.most_targets
    wrenches = wrenches_of(allocator, most + 5, 0.1)
    lost = [allocator.layout.names[0]]
    for names in ([], lost):
        batch = allocator.allocate_batch(wrenches, lost=names)
        for row in (0, most // 2, most // 2 + 3, len(wrenches) - 1):
            single = allocator.allocate(wrenches[row], lost=names)
            np.testing.assert_allclose(batch.command[row], single.command, 1e-9, 1e-9)
        assert (batch.bound is None) == (method == "analytic")
        if batch.bound is not None:
            assert (batch.bound <= batch.power).all() and (batch.bound[batch.reachable] > 0.0).all()


FORK_SCRIPT = """
import os
from finlab.allocation.shared_work import in_threads

assert in_threads(abs, range(4), 2) == [0, 1, 2, 3]
child = os.fork()
if child == 0:
    os._exit(0 if in_threads(abs, range(4), 2) == [0, 1, 2, 3] else 1)
assert os.waitpid(child, 0)[1] == 0
"""
"""A program whose child shares work, too, after its parent has."""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes have no children here")
def test_a_child_has_threads_of_its_own() -> None:
    subprocess.run([sys.executable, "-c", FORK_SCRIPT], check=True, timeout=60.0)
