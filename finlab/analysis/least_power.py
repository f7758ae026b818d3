"""The least power for a wrench, by the dual."""

from collections.abc import Collection

import numpy as np
from numpy.typing import ArrayLike

from finlab.allocation import Allocator
from finlab.allocation.yardstick import REACHED
from finlab.arrays import Array
from finlab.layout import Layout


def least_power(
    layout: Layout,
    wrenches: ArrayLike,
    *,
    failed: Collection[str] = (),
    flow: ArrayLike | None = None,
) -> Array:
    """Returns the least power [W] for each wrench (N, 6) [N, N m]: (N,), NaN where it is out of reach; `flow`
    as for an allocator.

    Raises:
        LayoutError: there is no actuator of a name in `failed`.
    """
    wanted = np.asarray(wrenches, dtype=np.float64).reshape(-1, 6)
    if len(set(layout.indices(tuple(failed)))) == layout.n:
        return np.where((wanted == 0.0).all(-1), 0.0, np.nan)
    answer = Allocator(layout).allocate_batch(wanted, failed=tuple(failed), flow=flow)
    return np.where(answer.err_norm <= REACHED, answer.power, np.nan)
