"""Arrays that the core reads and writes, and their copies."""

import copy
import ctypes
import pickle
from collections.abc import Callable

import numpy as np
import pytest

from finlab.core.shared_array import SharedArray


def at(address: int) -> float:
    """The number that stands at an address."""
    return ctypes.c_double.from_address(address).value


@pytest.mark.parametrize(
    "copied",
    [copy.copy, copy.deepcopy, lambda shared: pickle.loads(pickle.dumps(shared))],
    ids=["copy", "deepcopy", "pickle"],
)
def test_a_copy_has_numbers_of_its_own(copied: Callable[[SharedArray], SharedArray]) -> None:
    values = np.arange(6, dtype=np.int64).reshape(2, 3)
    shared = SharedArray(values)
    twin = copied(shared)
    shared.array[0, 0] = 7.0
    twin.array[0, 0] = -7.0
    assert values[0, 0] == 0
    assert at(shared.address) == shared.array[0, 0] == 7.0
    assert at(twin.address) == twin.array[0, 0] == -7.0
    np.testing.assert_array_equal(twin.array[1], [3.0, 4.0, 5.0])


def test_numbers_stand_row_by_row() -> None:
    shared = SharedArray(np.arange(6.0).reshape(2, 3).T)
    stored = [at(shared.address + 8 * k) for k in range(6)]
    assert stored == [0.0, 3.0, 1.0, 4.0, 2.0, 5.0]
