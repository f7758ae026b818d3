"""SI prefixes of large quantities: those of ships are told in kN, MN and kW."""

import math
from typing import NamedTuple

import pytest

import finlab
from finlab.analysis import score_card
from finlab.display import Column, prefix_of, table_of, with_unit


@pytest.mark.parametrize(
    ("size", "symbol", "factor"),
    [
        (0.0, "", 1.0),
        (9999.0, "", 1.0),
        (1e4, "k", 1e3),
        (999_999.0, "k", 1e3),
        (1e6, "M", 1e6),
        (2.5e9, "G", 1e9),
        (1e14, "T", 1e12),
        (1e17, "T", 1e12),
        (math.inf, "", 1.0),
        (math.nan, "", 1.0),
    ],
)
def test_a_prefix_is_that_of_the_size(size: float, symbol: str, factor: float) -> None:
    assert prefix_of(size) == (symbol, factor)


def test_a_quantity_is_told_with_its_prefix() -> None:
    assert with_unit(327.0, "W") == "327 W"
    assert with_unit(-25_800.0, "W") == "-25.8 kW"
    assert with_unit(1.2e6, "N m") == "1.20 MN m"


class Item(NamedTuple):
    """A row of the table below."""

    force: float | None
    length: float


def test_a_column_has_one_prefix_and_other_units_none() -> None:
    columns = (
        Column("force", lambda item: item.force, "N"),
        Column("length", lambda item: item.length, "m"),
    )
    table = table_of(columns, iter([Item(2e6, 2e6), Item(-5e3, 1.0), Item(None, 2.0)]))
    assert table.head == ["force [MN]", "length [m]"]
    assert [row[0] for row in table.rows] == ["2.00", "-0.00500", "-"]
    small = table_of(columns, [Item(20.0, 1.0)])
    assert small.head[0] == "force [N]"


def test_an_answer_and_a_card_of_a_ship_are_in_kilonewtons() -> None:
    """3 MN m of yaw of the supply vessel."""
    layout = finlab.load_layout("supply")
    result = finlab.Allocator(layout).allocate([1e5, 5e4, 0, 0, 0, 3e6])
    words = str(result)
    assert "force [kN]" in words and "Fx [kN]" in words and "Tz [MN m]" in words
    asked = next(line for line in words.splitlines() if line.startswith("asked"))
    assert asked.split()[1:] == ["100.000", "50.000", "free", "free", "free", "3.000"]
    assert f"power {result.power / 1e3:.3f} kW" in words
    card = str(score_card(layout))
    assert "surge  kN" in card and "yaw    MN m" in card and "weakest [kN]" in card


def test_a_target_beyond_all_reach_leaves_the_digits_of_what_is_delivered() -> None:
    result = finlab.Allocator(finlab.load_layout("catamaran")).allocate([5e5, 0, 0, 0, 0, 0])
    assert "Fx [N]" in str(result) and "500000.000" in str(result)
    assert "kN of surge is left undone" in str(result)
