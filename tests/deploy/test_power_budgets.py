"""Power budgets of a layout go with it into graph files and bundles, and what runs on board keeps
them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.deploy.bundle import make_bundle
from finlab.deploy.deployed_robot import parse_robot
from finlab.deploy.robot_graph import write_graph
from finlab.layout import load_layout
from finlab.layout.layout import Bus, Layout

HEAVY = load_layout("bluerov2_heavy")
LAYOUTS = (
    replace(HEAVY, power_w=100.0),
    replace(
        HEAVY, buses=(Bus("front", 60.0, HEAVY.names[:2]), Bus("rear", 40.0, HEAVY.names[2:4]))
    ),
)
"""One bus for all, and two that leave thrusters without a limit."""


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_graph_file_has_them(layout: Layout, tmp_path: Path) -> None:
    write_graph(layout, tmp_path / "graph.json")
    again = load_layout(tmp_path / "graph.json")
    assert (again.power_w, again.buses) == (layout.power_w, layout.buses)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_bundle_keeps_them(layout: Layout) -> None:
    robot = parse_robot(make_bundle(Allocator(layout)).files)
    wrench = [80.0, 40.0, 0.0, 0.0, 0.0, 10.0]
    for power in (None, 30.0) if layout.power_w else (None, {"rear": 20.0}):
        own = Allocator(layout).allocate(wrench, policy="direction", power=power)
        on_board = robot.allocate(wrench, policy="direction", power=power)
        np.testing.assert_allclose(on_board.command, own.command, rtol=0.0, atol=1e-9)
        assert any("power" in word or "bus" in word for word in on_board.binding)
