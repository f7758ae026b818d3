"""Rank, weakest directions, and the cost of each failure."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from finlab.analysis import authority, losses
from finlab.axes import AXES
from finlab.forces.force_sets import force_sets
from finlab.forces.reach import weakest
from finlab.layout import Layout
from tests.forces.conftest import THRUST

Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""


def test_layout_a_in_closed_form(shipped: Layouts) -> None:
    held = authority(shipped("A"))
    assert held.rank == 6
    assert held.without_authority == held.coupled == ()
    # Along one pair's shafts that pair is useless; the other two push at 60 degrees to their axes.
    assert held.weakest == pytest.approx(2 * THRUST * np.sin(np.radians(60)), rel=1e-4)
    assert np.abs(held.weakest_direction[:2]) == pytest.approx([0.5, np.sqrt(0.75)], abs=1e-2)


def test_no_yaw_has_no_yaw(shipped: Layouts) -> None:
    held = authority(replace(shipped("no_yaw"), axes=AXES))
    assert held.rank == 5
    assert held.without_authority == ("yaw",)
    assert held.condition is None
    assert held.weakest == 0.0
    assert np.abs(held.weakest_direction) == pytest.approx(np.eye(6)[5])
    assert held.reachable == ("surge", "sway", "heave", "roll", "pitch")
    held = authority(shipped("no_yaw"))
    assert (held.rank, held.counted, held.free, held.without_authority) == (5, 5, ("yaw",), ())
    assert held.weakest > 1.0 and held.condition is not None and held.weakest_direction[5] == 0.0


@pytest.mark.parametrize("name", ["A", "B", "mixed", "restricted", "hexa"])
def test_the_weakest_direction_is_that_of_all(shipped: Layouts, name: str) -> None:
    sets = force_sets(shipped(name))
    drawn = np.random.default_rng(5).standard_normal((20_000, 6))
    drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    near = weakest(sets)
    # Around the weakest direction, too, nothing is weaker.
    close = near.direction[0] + 0.05 * drawn[:2000]
    close /= np.linalg.norm(close, axis=1, keepdims=True)
    directions = np.concatenate([drawn, close])
    reach = sets.tile(len(directions)).farthest(directions)[0]
    assert reach.min() >= near.size[0] - 1e-4
    assert sets.farthest(near.direction)[0] == pytest.approx(near.size, abs=1e-6)


@pytest.mark.parametrize("name", ["C", "D", "restricted"])
def test_failures_never_help(shipped: Layouts, name: str) -> None:
    layout = shipped(name)
    before = authority(layout)
    for loss in losses(layout):
        after = authority(layout, (loss.actuator,))
        assert loss.rank == after.rank <= before.rank
        assert loss.weakest <= before.weakest + 1e-4
        assert set(loss.reachable) | set(loss.lost) == set(before.reachable)
        assert np.all(np.array(after.largest) <= np.array(before.largest) + 1e-4)
        assert all(share is None or 0.0 <= share <= 1.0 for share in loss.share_left)


def test_a_last_fin_has_no_loss_to_tell(shipped: Layouts) -> None:
    layout = shipped("A")
    assert losses(layout, layout.names[1:]) == ()
    assert authority(layout, layout.names).rank == 0
