"""From a swim to a robot: known truths are found again, what is not there is not, what is unknown
is said."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.axes import wrapped
from finlab.cli import main
from finlab.layout import Fin, FinModelSpec, Layout, Thruster, load_layout, save_layout
from finlab.physics import plant_of
from finlab.swim.identification.fitted_robot import summary, table, write_robot
from finlab.swim.identification.robot_fit import RobotFit, fit_robot
from finlab.swim.identification.swim import Swim, only_new, read_swim, replay
from finlab.swim.simulation.excite import excitation
from tests.allocator_cache import AllocatorCache
from tests.sampled_cases import sampled
from tests.swim.identification.swims import swim, write_csv

CENTER = np.array([0.015, -0.01, 0.005])
"""Where the center of gravity is, in the drawn robot's axes [m]."""
STRENGTH = {"front_right": 0.8, "front_left": 1.15, "back_left": 1.0}
"""Fin -> force over that of its law."""
ANGLE_ERRORS = {"front_right": 0.08, "front_left": -0.05, "back_left": 0.0}
"""Fin -> true mounting angle less the drawn one [rad]."""


def strengths(fit: RobotFit) -> dict[str, tuple[float, float]]:
    """Strength of each fin over what the layout said, and its standard error."""
    found = fit.estimate("strength")
    error = fit.standard_error("strength")
    pairs = zip(np.exp(found).tolist(), (np.exp(found) * error).tolist(), strict=True)
    return dict(zip(fit.model.layout.names, pairs, strict=True))


@pytest.fixture(scope="module")
def drawn() -> Layout:
    """The robot as a designer drew it: three fins."""
    return load_layout("ucat").without(["back_right"])


@pytest.fixture(scope="module")
def truth(drawn: Layout) -> Layout:
    """The robot as it was built."""

    def changed(fin: Fin) -> Fin:
        model = FinModelSpec("drag", (("drag_coefficient", 0.15 * STRENGTH[fin.name]),))
        x, y, z = (np.array(fin.position) - CENTER).tolist()
        angle = fin.mounting_angle + ANGLE_ERRORS[fin.name]
        return replace(fin, position=(x, y, z), mounting_angle=angle, model=model)

    return replace(drawn, actuators=tuple(changed(fin) for fin in drawn.fins))


@pytest.fixture(scope="module")
def fit(drawn: Layout, truth: Layout) -> RobotFit:
    """What a minute of swimming says of it."""
    command, measured = swim(truth, 60.0, seed=1)
    return fit_robot(drawn, [Swim("made up", replay(drawn, command), only_new(measured))])


def test_strengths_directions_and_centre_are_found_within_their_errors(fit: RobotFit) -> None:
    for name, (found, error) in strengths(fit).items():
        assert found == pytest.approx(STRENGTH[name], abs=max(4.0 * error, 0.02)) and error < 0.05
    turned = fit.estimate("mounting")
    error = fit.standard_error("mounting")
    np.testing.assert_array_less(
        np.abs(turned - list(ANGLE_ERRORS.values())), np.maximum(4.0 * error, 0.01)
    )
    center = fit.estimate("center")
    error = fit.standard_error("center")
    np.testing.assert_allclose(center, CENTER, atol=0.004)
    assert (error < 0.004).all()


def test_what_is_not_there_is_not_used_and_nothing_is_doubted(fit: RobotFit) -> None:
    assert fit.doubts() == ()
    assert fit.other_law is False
    assert fit.explained > 0.8
    text = "\n".join(summary(fit))
    assert "tried, and no help" in text and "common scale" in text
    assert "strength of front_left" in table(fit)


def test_the_fitted_layout_allocates_for_the_true_robot(
    fit: RobotFit, truth: Layout, tmp_path: Path
) -> None:
    path = tmp_path / "fitted.yaml"
    write_robot(fit, path)
    fitted = load_layout(path)
    drawn = fit.model.layout
    assert fitted.name == "fitted"
    assert fitted.description.startswith("fitted to 60 s of swimming")
    true = plant_of(truth)
    targets = 0.6 * true.wrench(true.sample(np.random.default_rng(3), (30,)))
    allocator = AllocatorCache()
    missed = [
        np.linalg.norm(
            true.wrench(allocator.allocate_batch(robot, targets).command) - targets, axis=1
        ).mean()
        for robot in (drawn, fitted)
    ]
    assert missed[1] < missed[0] / 4.0


def test_late_sensors_are_found_out(drawn: Layout, truth: Layout) -> None:
    command, measured = swim(truth, 60.0, seed=1)
    late = measured.copy()
    late[2:, 6:9] = measured[:-2, 6:9]
    late[1:, [0, 1, 5]] = measured[:-1, [0, 1, 5]]
    made = Swim("late", replay(drawn, command)[2:], late[2:])
    found = fit_robot(drawn, [made], other_law=False)
    delay = found.estimate("delay")
    error = found.standard_error("delay")
    # The made-up swims themselves take forces from the ends of steps of 0.02 s.
    np.testing.assert_array_less(
        np.abs(delay - [0.1, 0.0, 0.0, 0.2]), np.maximum(4.0 * error, 0.02)
    )
    for name, (strength, own) in strengths(found).items():
        assert strength == pytest.approx(STRENGTH[name], abs=max(4.0 * own, 0.02))


def test_a_fin_that_never_works_is_said_to_be_unknown(drawn: Layout) -> None:
    lost = replace(drawn, actuators=tuple(fin for i, fin in enumerate(drawn.fins) if i != 1))
    command, measured = swim(lost, 60.0, seed=2)
    motion = replay(lost, command)
    whole = np.zeros((*motion.shape[:2], 3, 3))
    whole[:, :, [0, 2]] = motion
    found = fit_robot(drawn, [Swim("two fins", whole, only_new(measured))], other_law=False)
    assert any("front_left" in doubt for doubt in found.doubts())
    assert "strength of front_left, logarithm" in found.undetermined()
    assert summary(found)[0].startswith("not to be trusted")


def test_the_command_reads_a_csv_file(
    drawn: Layout, truth: Layout, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_layout(drawn, tmp_path / "drawn.yaml")
    command, measured = swim(truth, 31.0, seed=4)
    write_csv(tmp_path / "swim.csv", drawn, command, measured)
    again = read_swim(tmp_path / "swim.csv", drawn)
    assert len(again) == 309
    np.testing.assert_allclose(again.motion, replay(drawn, command)[:309], atol=1e-6)
    np.testing.assert_allclose(again.measured[:, 6:], measured[:309, 6:], atol=1e-6)
    np.testing.assert_allclose(
        wrapped(again.measured[:, 3:6] - measured[:309, 3:6]), 0.0, atol=1e-6
    )
    arguments = [
        "fit",
        "robot",
        "--no-other-law",
        f"{tmp_path}/drawn.yaml",
        f"{tmp_path}/swim.csv",
        "-o",
    ]
    assert main([*arguments, f"{tmp_path}/found.json"]) == 0
    assert "strength of front_right" in capsys.readouterr().out
    assert load_layout(tmp_path / "found.json").names == drawn.names
    assert main([*arguments, f"{tmp_path}/found.txt"]) == 2
    assert not (tmp_path / "found.txt").exists()


@pytest.mark.parametrize("name", sampled(["turtle_hybrid", "bluerov2_heavy", "catamaran"]))
def test_strengths_of_any_actuators_are_found_in_a_minute_on_the_spot(
    name: str, tmp_path: Path
) -> None:
    layout = load_layout(name)
    loop = excitation(layout, 60.0, seed=3)
    shares = [(0.9, 0.7)[i % 2] for i in range(layout.n)]
    for each, share in zip(layout.names, shares, strict=True):
        loop.fail(each, "torn", share, announced=False)
    loop.run().save(tmp_path / "log.npz")
    fit = fit_robot(layout, [read_swim(tmp_path / "log.npz", layout)])
    for (found, error), share in zip(strengths(fit).values(), shares, strict=True):
        assert found == pytest.approx(share, abs=max(4.0 * error, 0.02)) and error < 0.05
    assert fit.doubts() == ()
    written = write_robot(fit, tmp_path / "fitted.yaml")
    for part, drawn, share in zip(written.actuators, layout.actuators, shares, strict=True):
        if isinstance(part, Thruster) and isinstance(drawn, Thruster):
            assert part.force[1] == pytest.approx(share * drawn.force[1], rel=0.05)
