"""Robots whose actuators act on each other, by the model that is linear in its weights, answer from
a bundle and over the wire as the library does."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import finlab
from finlab import Allocator, Layout
from finlab.arrays import Array
from finlab.deploy.bundle import make_bundle
from finlab.deploy.deployed_robot import load_robot
from finlab.interaction.linear import SHIPPED_PRIOR, Linear
from finlab.physics import Plant
from tests.deploy.test_serve import served

TARGETS = 10
"""Wrenches that are asked for."""


@pytest.fixture(params=["shipped", "own"])
def layout(request: pytest.FixtureRequest, tmp_path: Path) -> Layout:
    """Eight thrusters; with the shipped weights, or with weights in a file of one's own."""
    model = Linear()
    if request.param == "own":
        path = tmp_path / "known.safetensors"
        shutil.copy(SHIPPED_PRIOR, path)
        model = Linear(str(path))
    return replace(finlab.load_layout("bluerov2_heavy"), interaction=model)


def targets_of(layout: Layout) -> Array:
    """Wrenches (N, 6) within reach, of random commands."""
    plant = Plant(layout)
    return plant.wrench(plant.sample(np.random.default_rng(2), (TARGETS,)))


def test_a_bundle_and_its_server_answer_as_the_library_does(layout: Layout, tmp_path: Path) -> None:
    desk = Allocator(layout)
    make_bundle(desk).write(tmp_path / "robot")
    targets = targets_of(layout)
    truths = [desk.allocate(target) for target in targets]
    # The server limits each reply by the rates from the one before.
    limited = truths[:1]
    for target in targets[1:]:
        limited.append(desk.allocate(target, previous=limited[-1].command))
    if layout.interaction is not None and layout.interaction.reads is not None:
        Path(layout.interaction.reads).unlink()  # the bundle has its own

    robot = load_robot(tmp_path / "robot")
    deployed = Allocator.from_bundle(tmp_path / "robot")
    for target, truth in zip(targets, truths, strict=True):
        assert truth.err_norm <= 1e-6
        assert deployed.allocate(target).power == truth.power
        for runtime in (deployed, robot):
            np.testing.assert_array_equal(runtime.allocate(target).command, truth.command)

    requests = [{"wrench": target.tolist()} for target in targets]
    replies = served(robot, *requests)[:TARGETS]
    for reply, truth in zip(replies, limited, strict=True):
        assert reply["status"] == "ok"
        assert reply["err_norm"] == pytest.approx(truth.err_norm, abs=1e-9)
        assert reply["power"] == pytest.approx(truth.power, rel=1e-9)
