"""A robot out of its bundle: the library's answers, and a self-check that notices what is wrong."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab.allocation import Allocator
from finlab.allocation.search.search_allocator import SearchAllocator
from finlab.assets import shipped_layouts
from finlab.deploy.bundle import Bundle, make_bundle
from finlab.deploy.robot import Robot, load_robot, parse_robot
from finlab.deploy.self_check import Finding, self_check
from finlab.errors import DataError, FinlabError
from finlab.forces.compiled_fins import compiled_fins
from finlab.forces.fin_envelope import FinEnvelope
from finlab.layout import FinModelSpec, Layout
from finlab.physics import plant_of
from tests.exhaustive import sampled

HEAVY = ("torch", "scipy", "viser", "matplotlib", "yaml", "tyro", "tqdm", "threadpoolctl")
WRENCH = ["--wrench", "1", "0", "0.5", "0", "0", "0.1"]


@pytest.fixture(scope="module")
def robot(bundle: Bundle) -> Robot:
    return parse_robot(bundle.files)


def with_model(robot: Robot, model: FinModelSpec) -> Robot:
    """The same robot, had all its fins another model than the one that it was exported for."""
    fins = tuple(replace(fin, model=model) for fin in robot.layout.fins)
    return Robot(replace(robot.graph, layout=replace(robot.layout, fins=fins)), robot.allocator)


def bad(robot: Robot) -> list[str]:
    """What its self-check complains about."""
    return [finding.question for finding in self_check(robot) if not finding.good]


def test_answer_says_what_is_missing(robot: Robot) -> None:
    answer = robot.allocate([1, 0, 0.5, 0, 0, 0.1], failed=["front_right"])
    assert answer.fins == finlab.load_layout("A").names
    assert np.isnan(answer.command[0]).all() and not np.isnan(answer.command[1:]).any()
    np.testing.assert_allclose(answer.wrench + answer.unallocated, [1, 0, 0.5, 0, 0, 0.1], atol=1e-12)
    far = robot.allocate([90, 0, 0, 0, 0, 0], policy="direction")
    assert far.err_norm > 1 and abs(far.wrench[1]) < 0.1
    with pytest.raises(FinlabError, match="no fin 'nobody'"):
        robot.allocate([0] * 6, failed=["nobody"])


def test_failed_fins_of_the_bundle_stay_failed(shipped_allocator: Allocator) -> None:
    layout = finlab.load_layout("A")
    robot = parse_robot(make_bundle(layout, shipped_allocator, ("back_left",)).files)
    lost = layout.index("back_left")
    assert np.isnan(robot.allocate([0.5, 0, 0, 0, 0, 0]).command[lost]).all()
    assert np.isnan(robot.allocate([0.5, 0, 0, 0, 0, 0], failed=["front_left"]).command[lost]).all()
    assert np.isnan(robot.neutral()[lost]).all()
    assert all(finding.good for finding in self_check(robot))


@pytest.mark.parametrize("objective", ["power", "effort"])
@pytest.mark.parametrize("name", sampled(["measured", *sorted(shipped_layouts())], every=4))
def test_every_shipped_layout_answers_as_the_library_to_the_last_bit(
    name: str, objective: str, measured: Layout, tmp_path: Path
) -> None:
    """By its own physics, tables included; single, batched and from tick to tick."""
    layout = measured if name == "measured" else finlab.load_layout(name)
    desk = finlab.load_allocator(objective=objective)
    make_bundle(layout, desk).write_zip(tmp_path / "x.zip")
    robot = load_robot(tmp_path / "x.zip")
    assert not bad(robot)
    targets = plant_of(layout).wrench(plant_of(layout).sample(np.random.default_rng(7), (6,)))
    targets[-1] *= 20.0  # out of reach
    previous = None
    for target in targets:
        truth = desk.allocate(layout, target, previous=previous)
        answer = robot.allocate(target, previous=previous)
        for field in ("command", "wrench", "fin_forces", "err_norm", "energy", "power"):
            np.testing.assert_array_equal(getattr(answer, field), getattr(truth, field), field)
        assert answer.judged_by == "plant" and answer.notes == truth.notes
        previous = truth.command
    batch, many = robot.allocator.allocate_batch(robot.layout, targets), desk.allocate_batch(layout, targets)
    np.testing.assert_array_equal(batch.command, many.command)
    assert (many.err_norm[:-1] < 1e-4).all()


def test_what_was_compiled_at_the_desk_is_not_compiled_again(
    measured: Layout, measured_bundle: Bundle, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    measured_bundle.write(tmp_path)
    truth = finlab.load_allocator().allocate(measured, [1, 0, 0.5, 0, 0, 0.1]).command

    def never(*_: object) -> FinEnvelope:
        raise AssertionError("compiled")

    monkeypatch.setattr("finlab.forces.envelopes.fin_envelope", never)
    robot = load_robot(tmp_path)
    np.testing.assert_array_equal(robot.allocate([1, 0, 0.5, 0, 0, 0.1]).command, truth)
    assert robot.allocate([1, 0, 0.5, 0, 0, 0.1], failed=["front_left"]).err_norm < 1e-4
    # Other settings go on with them; another objective is another compilation.
    robot.allocator.with_settings(n_refined=2).allocate(robot.layout, [1, 0, 0.5, 0, 0, 0.1])
    with pytest.raises(AssertionError, match="compiled"):
        robot.allocator.with_settings(objective="effort").allocate(robot.layout, [1, 0, 0.5, 0, 0, 0.1])


def test_compiled_fins_serve_their_own_allocator_alone(robot: Robot) -> None:
    """What a bundle says of a fin is no word about that fin elsewhere."""
    weak = {
        key: replace(fin, largest=fin.largest * 0.5, smallest=fin.smallest * 0.5)
        for key, fin in robot.allocator.compiled.items()
    }
    layout = robot.layout
    liar = SearchAllocator(robot.graph.normalization, compiled=weak)
    hard = 0.9 * plant_of(layout).wrench(np.where([True, True, False], layout.upper, 0.0))
    honest = finlab.load_allocator().allocate(layout, hard)
    assert honest.err_norm < 1e-4
    assert not np.array_equal(liar.allocate(layout, hard).command, honest.command)
    assert finlab.load_allocator().allocate(layout, hard) == honest
    assert set(weak) == set(compiled_fins(layout, robot.allocator.objective))


def test_self_check_notices_fins_that_were_compiled_wrongly(robot: Robot) -> None:
    for change in (
        lambda fin: {"largest": fin.largest * 1.01},
        lambda fin: {"middle": fin.middle + 0.01},
        lambda fin: {"table": fin.table * 1.01},
    ):
        wrong = {key: replace(fin, **change(fin)) for key, fin in robot.allocator.compiled.items()}
        other = Robot(robot.graph, SearchAllocator(robot.graph.normalization, compiled=wrong))
        findings = {finding.question: finding for finding in self_check(other)}
        finding = findings["compiled fins, beside compiling here (share)"]
        assert not finding.good and finding.value == pytest.approx(0.01, rel=1e-6, abs=0.009)


def finding(robot: Robot, question: str) -> Finding:
    return next(found for found in self_check(robot) if found.question.startswith(question))


def test_each_question_sees_its_own_damage(robot: Robot) -> None:
    """Every finding of a healthy robot is good; a changed number shows up as large as it is."""
    assert all(found.good for found in self_check(robot))
    first, *others = robot.graph.self_test
    error, std = robot.graph.normalization.error, robot.graph.normalization.std

    def stored(question: str, **changes: object) -> Finding:
        cases = (replace(first, **changes), *others)  # type: ignore[arg-type]
        return finding(Robot(replace(robot.graph, self_test=cases), robot.allocator), question)

    delivered = np.array(first.delivered_wrench)
    found = stored("wrench of the stored commands", delivered_wrench=tuple(delivered + 0.5 * std))
    assert not found.good
    assert found.value == pytest.approx(float(error(delivered + 0.5 * std, delivered)), abs=1e-6)
    assert not stored("own answers, judged", wrench=tuple(1e3 * delivered)).good
    far = (90.0, *first.wrench[1:])
    assert not stored("own answers, more error", wrench=far, delivered_wrench=far).good
    idle = tuple(None if row is None else (0.5 * row[0], *row[1:]) for row in first.command)
    found = stored("own answers, more cost", command=idle)
    assert not found.good and found.value > 1.0, "half the strokes take less than half the power"


def test_without_self_tests_there_is_nothing_to_check(robot: Robot) -> None:
    with pytest.raises(DataError, match="^the bundle has no self-tests; export it again$"):
        self_check(Robot(replace(robot.graph, self_test=()), robot.allocator))
