"""A small class on one server: each page has its own state, and the answers come in time."""

import numpy as np

from tools.classroom import class_cost

MOST_MS = 400.0
"""Time from a key to its answer that nine of ten stay below [ms]."""


def test_pages_of_a_class_keep_their_own_states_and_are_answered_in_time() -> None:
    cost = class_cost(pages=5, followers=2, keys=3)
    assert cost.own_states == 3, "two of five show what the first one asks"
    assert len(cost.own) == 3 * 3 and len(cost.followed) == 3 * 2
    for name, times in (("key to answer", cost.own), ("followed", cost.followed)):
        p90 = float(np.percentile(times, 90))
        print(f"{name}: p90 {p90:.0f} ms")
        assert p90 <= MOST_MS
