"""Rows of losses made by hand, one small run of each kind, and what the verb refuses."""

import math

import numpy as np
import pytest

from finlab.allocation.allocator import Allocator
from finlab.cli import main
from finlab.evaluation.experiments.fault_monitoring import Loss, monitoring_rows, swim_losses
from finlab.evaluation.report.sections.fault_monitoring import monitoring_blocks
from finlab.evaluation.report.text import to_text
from finlab.layout import Layout
from finlab.sim import Trajectory

QUICK = Loss("A", False, "bow", 1.0, True, True, 0, 900.0, 0.06, 0.05, 0.08)


def test_shares_hours_and_ratios() -> None:
    losses = [
        QUICK,
        QUICK._replace(found_s=2.0, right=False),
        QUICK._replace(found_s=4.0, pushes=False),
        QUICK._replace(found_s=math.inf, right=False, pushes=False),
        QUICK._replace(fin=None, false_alarms=2, found_s=math.inf, right=False, ate=9.0),
    ]
    one, every = monitoring_rows(losses)
    assert (one["layout"], every["layout"], every["servos"]) == ("A", "all", "silent")
    assert every["losses"] == 4 and every["found"] == 0.5
    assert every["pushing"] == 2 and every["found_pushing"] == 1.0
    assert every["right"] == pytest.approx(2 / 3) and every["found_s"] == 2.0
    assert every["hours"] == pytest.approx(1.25) and every["false_per_hour"] == pytest.approx(1.6)
    assert every["ate_ratio"] == pytest.approx(1.2)
    text = to_text(*monitoring_blocks([one, every])).replace("\n", " ")
    assert "found within 3 s 0.500 (misses at least 0.95)" in text
    assert "false alarms an hour 1.600 (misses at most 1)" in text
    assert "per tick [ms] 0.080 (meets at most 0.1)" in text


def test_a_loss_is_swum_beside_an_announced_one(layout_a: Layout, analytic: Allocator) -> None:
    time = np.array([0.0, 24.0])
    line = Trajectory("line", time, np.outer(time, [0.12, 0.0, 0.0]) + [0.0, 0.0, -1.0])
    losses = swim_losses([layout_a], line, analytic, [1], feedback=[True], whole_seeds=[2])
    assert [loss.fin for loss in losses] == [None, *layout_a.names, None]
    assert losses[-1].whole_s == pytest.approx(24.0) and losses[-1].ate != losses[0].ate
    assert all(loss.false_alarms == 0 and loss.tick_ms > 0.0 for loss in losses)
    assert all(loss.right and loss.found_s < 1.0 for loss in losses[1:-1])
    assert 0.5 < losses[1].ate / losses[1].ate_announced < 2.0 and losses[1].ate != losses[1].ate_announced


def test_the_verb_refuses_no_seeds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", "monitor", "--seeds", "0"]) == 2
    assert "seeds" in capsys.readouterr().err
    assert main(["eval", "monitor", "--whole", "-1"]) == 2
    assert "whole" in capsys.readouterr().err
