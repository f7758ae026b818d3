"""The score card: complete, consistent, fit for JSON, and free of torch."""

import json
from collections.abc import Callable

import pytest

from finlab.analysis import authority, score_card
from finlab.errors import LayoutError
from finlab.layout import Layout

Layouts = Callable[[str], Layout]


def test_a_card_is_json(shipped: Layouts) -> None:
    card = score_card(shipped("D"))
    record = json.loads(json.dumps(card.to_dict(), allow_nan=False))
    assert record["layout"] == "D"
    assert record["authority"]["condition"] is None
    assert record["unit_power"][1] is None  # no sway
    assert record["unit_power"][0] > 0.0
    assert [loss["actuator"] for loss in record["losses"]] == list(shipped("D").names)
    assert record["worst_loss"] in shipped("D").names
    assert card.notes == ()


def test_failed_fins_are_left_out(shipped: Layouts) -> None:
    layout = shipped("A")
    card = score_card(layout, ("back_left",))
    assert card.failed == ("back_left",)
    assert card.n_actuators == 3
    assert card.authority == authority(layout, ("back_left",))
    assert "back_left" not in [loss.actuator for loss in card.losses]
    with pytest.raises(LayoutError, match="has no fin"):
        score_card(layout, ("nobody",))


def test_wide_arcs_are_noted(wide: Layout) -> None:
    assert "wider than half a turn" in score_card(wide, wide.names[2:]).notes[0]
