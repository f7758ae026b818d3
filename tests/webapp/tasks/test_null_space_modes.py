"""Ways along the null space: rows, sliders and the robot say the same, and a table of them can be
saved."""

import csv
import io

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.layout import Layout, load_layout
from tests.webapp.stand_in import Direct, context_of, until
from webapp.panels.modes_tab import mode_table
from webapp.session import Session
from webapp.session.looking import NULL_SPACE
from webapp.session.state import State
from webapp.tasks.answering import Answering
from webapp.tasks.modes_csv import modes_csv
from webapp.tasks.null_space_modes import MOST, null_space_modes
from webapp.tasks.solver import Solver

HYBRID = load_layout("turtle_hybrid")
"""Fins and thrusters."""
BLUEROV = load_layout("bluerov2_heavy")
"""Eight thrusters."""
TARGET = (1.2, 0.0, 0.0, 0.0, 0.0, 0.25)
"""A wrench in surge and yaw [N, N m]."""


@pytest.mark.parametrize(
    "layout", [HYBRID, BLUEROV, load_layout("ucat")], ids=lambda layout: layout.name
)
def test_another_way_is_exact_and_dearer_and_the_mean_stands_beside_it(layout: Layout) -> None:
    answer = Solver().solve(State(layout, target=TARGET))
    (alone,) = null_space_modes(answer, ()).visible
    assert alone.badge == "optimum" and np.array_equal(alone.mode.command, answer.command)
    modes = null_space_modes(answer, (0.0, 4.0))
    optimum, other, mean = modes.visible
    assert other.mode.err_norm < 1e-6 and other.mode.power > 1.01 * optimum.mode.power
    assert (mean.mode.err_norm > 1e-3) is (layout is not BLUEROV), (
        "commands of thrusters are their forces"
    )
    assert ("class='missing'" in mode_table(modes, 1)) is (layout is not BLUEROV)
    assert ("<th>effort" in mode_table(modes, 1)) is layout.is_of_fins
    assert modes.null_space is not None
    low, high = modes.null_space.ranges[1]
    assert (
        low < 0.0 < 4.0 < high
        and len(modes.null_space.names) == len(modes.null_space.ranges) <= MOST
    )


def test_the_answer_uses_as_much_in_both_tables() -> None:
    """Of fins it is the range of amplitude and frequency, of others the full thrust."""
    answer = Allocator(load_layout("ucat")).allocate(TARGET)
    ranges = answer.layout.upper - answer.layout.lower
    used = (answer.command - answer.layout.lower) / ranges
    (mode,) = null_space_modes(answer, ()).visible
    assert mode.mode.saturation == pytest.approx(used[:, :2].max())
    answer = Allocator(BLUEROV).allocate(TARGET)
    forces = answer.command[:, 0]
    limits = np.maximum(-BLUEROV.lower[:, 0], BLUEROV.upper[:, 0])
    (mode,) = null_space_modes(answer, ()).visible
    assert mode.mode.saturation == pytest.approx(np.abs(forces / limits).max(), rel=1e-3)


def test_a_robot_without_another_way_says_so() -> None:
    layout = load_layout("ucat").without(["back_left", "back_right"])
    modes = null_space_modes(Allocator(layout).allocate([0.5, 0, 0, 0, 0, 0]), (1.0,))
    assert modes.null_space is not None and modes.null_space.names == () and len(modes.visible) == 1


def ask(answering: Answering) -> None:
    """As a page does, until all is known."""
    answering.ask()
    until(lambda: not answering.busy)
    answering.ask()
    until(lambda: not answering.searching)


def test_sliders_move_the_robot_until_something_else_is_asked() -> None:
    session = Session(HYBRID)
    answering = Answering(context_of(Direct(), session, Solver()))
    assert session.drawer == NULL_SPACE, "the network proposes for fins alone"
    ask(answering)
    best = answering.shown_answer().shown_allocation
    session.shift(0, 5.0)
    ask(answering)
    seen = answering.shown_answer()
    assert (
        seen.shown_allocation is not seen.best is best
        and seen.shown_allocation is not None
        and best is not None
    )
    assert seen.shown_allocation.reachable and seen.shown_allocation.power > best.power
    session.show_mode(2)
    assert not answering.shown_answer().shown_allocation.reachable  # type: ignore[union-attr]
    session.shift(0, 0.0)
    assert session.shifts == () and session.mode == 0
    session.shift(1, 2.0)
    session.set_target(0, 2.0)
    assert session.shifts == () and session.mode == 0, "of another wrench nothing is known"


def test_the_table_of_candidates_has_commands_that_give_its_figures() -> None:
    answer = Solver().solve(State(HYBRID, target=TARGET))
    rows = list(
        csv.DictReader(io.StringIO(modes_csv(answer, null_space_modes(answer, (5.0,))).decode()))
    )
    assert [row["origin"] for row in rows] == ["optimum", "null space", "average"]
    for row in rows:
        force = [[float(row[f"{name}.F{axis}_n"]) for axis in "xyz"] for name in HYBRID.names]
        if row["origin"] != "average":
            np.testing.assert_allclose(np.sum(force, axis=0), TARGET[:3], atol=1e-6)
        assert float(row["power_w"]) >= answer.power * (1 - 1e-9) and row["effort"] == ""
    assert float(rows[0]["lift_left.force_n"]) == pytest.approx(answer.command[4, 0])
