"""The score card and the quick check; least power against closed forms and what solvers find."""

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from finlab.actuators.law import Blade
from finlab.analysis import authority, losses, score_card
from finlab.analysis.score_card import least_power, quick_check
from finlab.axes import AXES
from finlab.errors import LayoutError
from finlab.layout import FinModelSpec, Layout, load_layout

Layouts = Callable[[str], Layout]
"""The type of the fixture `shipped`: a shipped robot by its name."""


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
    assert card.lost == ("back_left",)
    assert card.n_actuators == 3
    assert card.authority == authority(layout, ("back_left",))
    assert "back_left" not in [loss.actuator for loss in card.losses]
    with pytest.raises(LayoutError, match="has no fin"):
        score_card(layout, ("nobody",))


def test_wide_arcs_are_noted(wide: Layout) -> None:
    assert "wider than half a turn" in score_card(wide, wide.names[2:]).notes[0]


@pytest.mark.parametrize("name", ["A", "B", "ucat", "pair", "no_yaw", "hexa", "asymmetric"])
def test_quick_check_agrees_with_the_whole_analysis(shipped: Layouts, name: str) -> None:
    layout = shipped(name)
    quick = quick_check(layout)
    whole = authority(layout)
    assert (quick.rank, quick.without_authority, quick.coupled) == (
        whole.rank,
        whole.without_authority,
        whole.coupled,
    )
    assert quick.condition == pytest.approx(whole.condition)
    assert dict(quick.lost) == {loss.actuator: loss.lost for loss in losses(layout) if loss.lost}


WRENCHES = np.concatenate([np.diag([1, 1, 1, 0.1, 0.1, 0.1]), [[1.2, 0, 0.5, 0, 0, 0.15]]])
"""A wrench along each axis, and one of surge, heave and yaw: (7, 6) [N, N m]."""


def least_for(force: float, blade: Blade) -> float:
    """The least power [W] of U-CAT's fin that gives a force [N], by brute force."""
    amplitude = np.linspace(0.05, 0.6, 20001)
    frequency = np.sqrt(force / 4.737410112522892) / np.sin(amplitude)
    power = blade.power(amplitude, frequency)
    return float(power[(frequency >= 0.1) & (frequency <= 2.1)].min())


def test_a_pair_shares_heave_evenly() -> None:
    layout = replace(load_layout("pair"), axes=AXES)
    power = least_power(layout, [[0, 0, 4.0, 0, 0, 0], [0, 0, 0, 0, 0.5, 0], [0, 0, 40.0, 0, 0, 0]])
    assert power[0] == pytest.approx(2 * least_for(2.0, Blade()), rel=3e-3)
    assert np.isnan(power[1:]).all()  # a torque it has not, a force beyond its reach


def test_failures() -> None:
    layout = load_layout("A")
    wrench = [[0.5, 0.0, 0.5, 0.0, 0.0, 0.05]]
    assert np.isfinite(least_power(layout, wrench)).all()
    assert np.isnan(least_power(layout, wrench, lost=layout.names[:3])).all()


def test_nothing_costs_nothing_even_without_fins() -> None:
    layout = load_layout("A")
    power = least_power(layout, [np.zeros(6), np.eye(6)[0]], lost=layout.names)
    assert power[0] == 0.0 and np.isnan(power[1])


def test_it_grows_faster_than_the_wrench() -> None:
    power = least_power(load_layout("A"), np.outer([0.25, 0.5, 1.0, 2.0], WRENCHES[-1]))
    assert (power[1:] > 2.0 * power[:-1]).all() and (power[1:] < 4.0 * power[:-1]).all()


def test_larger_blades_of_the_same_thrust_take_more_power() -> None:
    layout = load_layout("A")
    long = FinModelSpec("drag", (("area", 0.02 / 1.44), ("lever", 0.12)))
    other = replace(layout, actuators=tuple(replace(fin, model=long) for fin in layout.fins))
    assert (least_power(other, WRENCHES) > 1.02 * least_power(layout, WRENCHES)).all()
