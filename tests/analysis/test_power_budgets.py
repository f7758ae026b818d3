"""What cards and plots say of layouts with power budgets, beside a cone program."""

from dataclasses import replace

import numpy as np
import pytest

from finlab.analysis import score_card
from finlab.analysis.capability import capability
from finlab.errors import AllocationError, LayoutError
from finlab.layout import load_layout
from finlab.layout.layout import Bus
from tests.oracle_budget import BudgetedPlant
from tests.oracle_plant import OraclePlant
from tests.random_robots import bluerov2_heavy, load

WATTS = 80.0
"""A budget that binds along each axis [W]."""


def test_the_largest_wrenches_are_those_within_the_budget() -> None:
    layout = replace(load(bluerov2_heavy()), power_w=WATTS)
    free = score_card(load(bluerov2_heavy())).authority
    card = score_card(layout)
    plant = OraclePlant(bluerov2_heavy())
    for k, (most, without) in enumerate(zip(card.authority.largest, free.largest, strict=True)):
        wrench = 2.0 * without * np.eye(6)[k]
        judge = BudgetedPlant(plant, np.ones((1, layout.n), bool), np.array([WATTS]))
        assert most == pytest.approx(2.0 * without * judge.largest_share(wrench), rel=1e-5)
        assert most < 0.9 * without
    assert any("power budget" in note for note in card.notes)
    assert len(card.losses) == layout.n


def test_a_budget_that_binds_nothing_changes_no_card() -> None:
    layout = load_layout("bluerov2_heavy")
    np.testing.assert_allclose(
        score_card(replace(layout, power_w=1e5)).authority.largest,
        score_card(layout).authority.largest,
        rtol=1e-6,
    )


def test_where_no_budget_is_counted_it_is_refused() -> None:
    supply = load_layout("supply")
    limited = replace(supply, buses=(Bus("aft", 1e6, supply.names[:1]),))
    with pytest.raises(LayoutError, match="has a power budget, which a capability plot"):
        capability(limited)
    with pytest.raises(AllocationError, match="no budget is kept yet for robots with rudders"):
        score_card(replace(load_layout("torpedo"), power_w=100.0))
