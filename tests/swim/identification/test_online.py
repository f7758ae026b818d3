"""Learning on the way: a robot whose actuators lean and are weak is known after a minute of
swimming."""

from dataclasses import replace

import numpy as np
import pytest

from finlab import Allocator, load_layout
from finlab.cli import main
from finlab.errors import FinlabError
from finlab.layout import FinModelSpec
from finlab.physics import plant_of
from finlab.swim.control import FaultMonitor
from finlab.swim.identification.fitted_robot import with_lean
from finlab.swim.identification.online_fit import OnlineFit
from finlab.swim.simulation import ClosedLoop, Fault, make_trajectory
from tests.sampled_cases import sampled


@pytest.mark.parametrize("name", sampled(["A", "bluerov2_heavy"]))
def test_a_minute_of_swimming_divides_the_true_miss_by_three(name: str) -> None:
    """Actuators lean by 5 degrees, one this way and the next that way, and give 0.8 of their
    force."""
    layout = load_layout(name)
    truth = with_lean(layout, np.radians(5.0 * (-1.0) ** np.arange(layout.n)))
    plant = plant_of(truth)
    rng = np.random.default_rng(3)
    command = layout.lower + (layout.upper - layout.lower) * rng.random((60, layout.n, 3))
    targets = 0.6 * 0.8 * plant.wrench(command)

    def missed(allocator: Allocator) -> float:
        away = (
            0.8 * plant.wrench(learner.factor * allocator.allocate_batch(targets).command) - targets
        )
        return float(np.sqrt(np.mean((away / allocator.scale) ** 2)))

    learner = OnlineFit(layout)
    monitor = FaultMonitor(layout)
    loop = ClosedLoop(
        layout, Allocator(layout), make_trajectory("lissajous", 61.0), truth=truth, learner=learner, seed=2,
        failures=[Fault(each, 0.0, "torn", 0.8) for each in layout.names], announced=False,
        monitor=monitor if name == "A" else None,
    )  # fmt: skip
    before = missed(loop.allocator)
    loop.run()
    assert missed(loop.allocator) < before / 3.0
    assert "learned strengths front_right 0." in learner.notes[0] and len(learner.notes) == 1
    known = loop.allocator.layout.actuators[0].uncertainty
    assert known is not None and 0.005 < known.share < 0.15
    assert loop.monitor is None or monitor.layout == loop.allocator.layout
    assert loop.layout == layout


def test_what_cannot_be_learned_is_refused_in_a_sentence(
    capsys: pytest.CaptureFixture[str],
) -> None:
    fin = load_layout("A").fins[0]
    table = replace(fin, model=FinModelSpec("table", (("path", "fin.csv"),)))
    with pytest.raises(FinlabError, match="is a table, expected a law"):
        OnlineFit(replace(load_layout("A"), actuators=(table,)))
    for option in (["--method", "paper"], ["--excite"]):
        assert main(["simulate", "A", "--learn", "--duration", "60", *option]) == 2
        assert len(capsys.readouterr().err.strip().splitlines()) == 1
