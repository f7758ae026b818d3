"""Learning on the way: a robot whose fins lean and are weak is known after a minute of swimming."""

from dataclasses import replace

import numpy as np
import pytest

from finlab import Allocator, load_layout
from finlab.cli import main
from finlab.control import FaultMonitor
from finlab.errors import FinlabError
from finlab.fit.robot.learned_fins import leaned
from finlab.fit.robot.online import OnlineFit
from finlab.layout import Layout
from finlab.physics import plant_of
from finlab.sim import ClosedLoop, make_trajectory


def worn(layout: Layout) -> Layout:
    """Fins that lean by 5 degrees, one this way and the next that way, and give 0.8 of their thrust."""
    return replace(
        layout,
        actuators=tuple(
            replace(leaned(fin, np.radians(5.0 * (-1) ** i)), model=fin.model.scaled(0.8))
            for i, fin in enumerate(layout.fins)
        ),
    )


def test_a_minute_of_swimming_divides_the_true_miss_by_three() -> None:
    layout = load_layout("A")
    truth = worn(layout)
    plant, rng = plant_of(truth), np.random.default_rng(3)
    command = layout.lower + (layout.upper - layout.lower) * rng.random((60, layout.n_fins, 3))
    targets = 0.6 * plant.wrench(command)

    def missed(allocator: Allocator) -> float:
        away = plant.wrench(allocator.allocate_batch(targets).command) - targets
        return float(np.sqrt(np.mean((away / allocator.scale) ** 2)))

    learner, monitor = OnlineFit(layout), FaultMonitor(layout)
    loop = ClosedLoop(
        layout, Allocator(layout), make_trajectory("lissajous", 61.0), truth=truth, monitor=monitor,
        learner=learner, seed=2,
    )  # fmt: skip
    before = missed(loop.allocator)
    loop.run()
    assert missed(loop.allocator) < before / 3.0
    assert "learned strengths front_right 0." in learner.notes[0] and len(learner.notes) == 1
    known = loop.allocator.layout.fins[0].uncertainty
    assert known is not None and 0.005 < known.share < 0.15
    assert monitor.layout == loop.allocator.layout and loop.layout == layout


def test_what_cannot_be_learned_is_refused_in_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(FinlabError, match="learning on the way"):
        OnlineFit(load_layout("turtle_hybrid"))
    for option in (["--method", "paper"], ["--excite"]):
        assert main(["simulate", "A", "--learn", "--duration", "60", *option]) == 2
        assert len(capsys.readouterr().err.strip().splitlines()) == 1
