"""Networks that learn what jets take from forward data: better than the laws on robots never
seen."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import finlab
from finlab.arrays import Array
from finlab.errors import CheckpointError, FinlabError
from finlab.interaction.learned import Learned, read_network
from finlab.layout import Layout, layout_to_dict, parse_layout
from finlab.layout.jet_geometry import jet_geometry_of
from finlab.physics import Plant
from finlab.physics.objective import wrench_scale_of
from finlab.research.random_layouts import random_jet_robot
from tests.interaction.hidden_plant import wrenches
from tests.interaction.test_jets import differs


@pytest.fixture(scope="module")
def network(tmp_path_factory: pytest.TempPathFactory) -> Learned:
    """A network of a short training."""
    from finlab.fit.interaction.samples import read_samples, write_samples
    from finlab.research.interaction.random_samples import random_samples
    from finlab.research.interaction.train import WEIGHTS_FILE, recipe, train

    folder = tmp_path_factory.mktemp("interaction")
    write_samples(folder / "data.npz", random_samples(wrenches, 60, 20, 0, 0.02, (4, 8)))
    train(read_samples(folder / "data.npz"), folder, recipe(steps=120, batch=256), seed=0)
    return Learned(str(folder / WEIGHTS_FILE))


def unseen(count: int) -> list[tuple[Layout, Array]]:
    """Robots that it has not seen, with their true forward data."""
    robots = []
    for k in range(count):
        rng = np.random.default_rng([51, k])
        layout = random_jet_robot(rng, "robot", (4, 8))
        robots.append((layout, wrenches(layout, Plant(layout).sample(rng, (2,)))))
    return robots


def test_unseen_robots_are_missed_by_less_than_half(network: Learned) -> None:
    laws = []
    learned = []
    expected = []
    for layout, targets in unseen(5):
        known = replace(layout, interaction=network)
        for robot, errors in ((layout, laws), (known, learned)):
            allocator = finlab.Allocator(robot)
            for target in targets:
                result = allocator.allocate(target)
                errors.append(
                    np.linalg.norm(
                        (wrenches(layout, result.command[None]) - target) / wrench_scale_of(layout)
                    )
                )
                if robot is known:
                    expected.append(result.expected_error)
    assert np.mean(learned) < 0.5 * np.mean(laws)
    assert np.mean(learned) <= 0.04
    assert 0.3 < np.sqrt(np.mean(np.square(expected)) / np.mean(np.square(learned))) < 3.0


def test_derivatives(network: Learned) -> None:
    rng = np.random.default_rng(3)
    known = network.of(jet_geometry_of(random_jet_robot(rng, "robot", (3, 5))))
    assert differs(known, 8.0 * rng.normal(size=(len(known.geometry.position), 3))) < 1e-5


def test_a_layout_names_its_network(network: Learned) -> None:
    layout = replace(finlab.load_layout("bluerov2"), interaction=network)
    assert parse_layout(layout_to_dict(layout)) == layout


def test_a_bundle_takes_it_along(network: Learned, tmp_path: Path) -> None:
    from finlab.deploy.bundle import make_bundle

    allocator = finlab.Allocator(replace(finlab.load_layout("bluerov2_heavy"), interaction=network))
    make_bundle(allocator).write_zip(tmp_path / "robot.zip")
    make_bundle(allocator).write(tmp_path / "robot")
    here = allocator.allocate([30, 0, 10, 0, 0, 1])
    for name in ("robot.zip", "robot"):
        there = finlab.Allocator.from_bundle(tmp_path / name).allocate([30, 0, 10, 0, 0, 1])
        assert_allclose(there.command, here.command, atol=1e-12)


def test_a_stranger_s_layout_opens_no_file_of_ours(network: Learned, tmp_path: Path) -> None:
    from finlab.swim.design_files import adopted

    layout = replace(finlab.load_layout("bluerov2"), interaction=network)
    with pytest.raises(FinlabError, match="did not come along"):
        adopted(layout, {}, tmp_path, "robot.yaml")
    content = Path(network.path).read_bytes()
    opened = adopted(layout, {network.path: content}, tmp_path, "robot.yaml").layout
    assert (
        opened.interaction is not None and Path(opened.interaction.path).parent.parent == tmp_path
    )


@pytest.mark.parametrize("content", [b"", b"\0" * 100, b'{"a": 1}'])
def test_damaged_files_are_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "damaged.safetensors"
    path.write_bytes(content)
    with pytest.raises(CheckpointError, match="damaged.safetensors"):
        read_network(str(path))


def test_a_missing_file_is_named() -> None:
    layout = replace(
        finlab.load_layout("bluerov2"), interaction=Learned("/nowhere/net.safetensors")
    )
    with pytest.raises(CheckpointError, match="/nowhere/net.safetensors"):
        finlab.Allocator(layout)
