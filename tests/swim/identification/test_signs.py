"""Motors that push the other way: named in a fit and under way, and none where there is none."""

from pathlib import Path

import numpy as np
import pytest

from finlab import Allocator, load_layout
from finlab.cli import main
from finlab.layout import Layout
from finlab.swim.control import FaultMonitor
from finlab.swim.identification.online_fit import OnlineFit
from finlab.swim.identification.robot_fit import RobotFit, fit_robot
from finlab.swim.identification.robot_model import opposed_in
from finlab.swim.identification.swim import read_swim
from finlab.swim.simulation import ClosedLoop, make_trajectory
from finlab.swim.simulation.excite import excitation


def swim_file(path: Path, layout: Layout, truth: Layout, seed: int) -> Path:
    """The file of a swim of a robot that is not as drawn."""
    excitation(layout, 60.0, truth=truth, seed=seed).run().save(path)
    return path


def fit_of(layout: Layout, path: Path) -> RobotFit:
    """What a file of a swim says of a robot."""
    return fit_robot(layout, [read_swim(path, layout)])


@pytest.mark.parametrize(
    ("name", "motor"),
    [
        pytest.param("bluerov2_heavy", 2, marks=pytest.mark.exhaustive),
        pytest.param("bluerov2_heavy", 5, marks=pytest.mark.exhaustive),
        ("ucat", 1),
        pytest.param("catamaran", 0, marks=pytest.mark.exhaustive),
    ],
)
def test_a_reversed_motor_is_named_and_the_rest_is_fitted(
    tmp_path: Path, name: str, motor: int
) -> None:
    """The robot is sound and the layout wrong, so that no motor makes the swim end."""
    right = load_layout(name)
    wrong = opposed_in(right, [right.names[motor]])
    path = swim_file(tmp_path / "swim.npz", right, right, seed=motor)
    good = fit_of(right, path)
    found = fit_of(wrong, path)
    assert good.opposed == () and found.opposed == (right.names[motor],)
    assert found.explained > good.explained - 0.03
    np.testing.assert_allclose(np.exp(found.estimate("strength")), 1.0, atol=0.15)


def test_the_command_line_names_it_and_writes_the_corrected_layout(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drawn = load_layout("bluerov2_heavy")
    truth = opposed_in(drawn, ["rear_left"])
    path = swim_file(tmp_path / "swim.npz", drawn, truth, seed=3)
    output = tmp_path / "found.yaml"
    assert main(["fit", "robot", "bluerov2_heavy", str(path), "-o", str(output)]) == 0
    assert "rear_left pushes the other way" in capsys.readouterr().out
    for part, true in zip(load_layout(output).actuators, truth.actuators, strict=True):
        assert np.dot(part.frame[0], true.frame[0]) > 0.98
    drawn_part = drawn.actuators[drawn.index("rear_left")]
    assert (
        np.dot(
            load_layout(output).actuators[drawn.index("rear_left")].frame[0], drawn_part.frame[0]
        )
        < -0.98
    )


@pytest.mark.exhaustive
def test_a_tumbling_robot_tells_its_reversed_lift_motor_too(tmp_path: Path) -> None:
    """It tumbles at once, and its accelerations alone do not tell; the likelihood of a whole fit
    does."""
    layout = load_layout("bluerov2_heavy")
    truth = opposed_in(layout, ["lift_front_right"])
    ClosedLoop(
        layout, Allocator(layout), make_trajectory("lissajous", 60.0), truth=truth, seed=4
    ).run().save(tmp_path / "swim.npz")
    assert fit_of(layout, tmp_path / "swim.npz").opposed == ("lift_front_right",)


@pytest.mark.parametrize(
    "motor", [pytest.param("front_left", marks=pytest.mark.exhaustive), "lift_rear_right", None]
)
def test_the_monitor_names_it_within_seconds_and_the_robot_keeps_its_way(motor: str | None) -> None:
    layout = load_layout("bluerov2_heavy")
    truth = layout if motor is None else opposed_in(layout, [motor])
    monitor = FaultMonitor(layout)
    loop = ClosedLoop(
        layout, Allocator(layout), make_trajectory("lissajous", 60.0), truth=truth, monitor=monitor,
        announced=False, seed=1,
    )  # fmt: skip
    while loop.time < 4.0:
        loop.step()
    assert monitor.opposed == monitor.verdict().damage.lost == (() if motor is None else (motor,))
    while loop.time < 30.0:  # through a probe of what is not used
        loop.step()
    assert monitor.opposed == (() if motor is None else (motor,))
    assert loop.log.capsized_s is None


@pytest.mark.exhaustive
def test_learning_under_way_turns_it_about() -> None:
    layout = load_layout("bluerov2_heavy")
    learner = OnlineFit(layout)
    loop = ClosedLoop(
        layout, Allocator(layout), make_trajectory("lissajous", 61.0), learner=learner, seed=2,
        truth=opposed_in(layout, ["front_right"]),
    )  # fmt: skip
    loop.run()
    assert "front_right pushes the other way" in learner.notes[0]
    turned = loop.allocator.layout.actuators[0].frame[0]
    assert np.dot(turned, layout.actuators[0].frame[0]) < -0.98
