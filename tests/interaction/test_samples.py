"""Samples of forward data, in files and folders, and the formula fitted to them."""

import csv
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import finlab
from finlab.arrays import Array
from finlab.cli import main
from finlab.errors import DataError
from finlab.fit.columns import command_columns
from finlab.fit.interaction.constants import fit_constants
from finlab.fit.interaction.samples import Samples, read_samples, read_table, write_samples
from finlab.interaction.jets import Jets
from finlab.interaction.linear import Linear
from finlab.layout import Layout, save_layout
from finlab.layout.effectiveness import body_force
from finlab.physics import Plant
from finlab.physics.objective import wrench_scale_of
from finlab.research.interaction.random_samples import random_samples

TRUE_JETS = Jets(2.1, 2.4, 28.0, 0.8, 1.0, 0.2, 0.15, 0.45)
"""Jets with other constants than the library's."""


def true_wrench(layout: Layout, command: Array) -> Array:
    """Wrench of commands by these jets."""
    return Plant(replace(layout, interaction=TRUE_JETS)).wrench(command)


def write_table(samples: Samples, path: Path) -> None:
    """Write samples as the file of a test stand."""
    layout = samples.layout
    names = sum(command_columns(layout), [])
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*names, "Fx", "Fy", "Fz", "Tx", "Ty", "Tz"])
        for command, wrench in zip(samples.command, samples.wrench, strict=True):
            cells = list[float]()
            for actuator, row in zip(layout.actuators, command, strict=True):
                cells += row[: len(actuator.KIND.numbers)].tolist()
            writer.writerow([*cells, *wrench])


@pytest.fixture(scope="module")
def samples() -> list[Samples]:
    """Forward data of three robots, by these jets."""
    return random_samples(true_wrench, 3, 60, 7, 0.02, (4, 8))


def test_files_give_back_what_was_written(samples: list[Samples], tmp_path: Path) -> None:
    write_samples(tmp_path / "all.npz", samples)
    for one in samples:
        save_layout(one.layout, tmp_path / f"{one.layout.name}.yaml")
        write_table(one, tmp_path / f"{one.layout.name}.csv")
    for source in (tmp_path / "all.npz", tmp_path):
        for read, one in zip(read_samples(source), samples, strict=True):
            assert read.layout.names == one.layout.names
            assert_allclose(read.layout.frames, one.layout.frames, atol=1e-12)
            assert_allclose(read.command, one.command, atol=1e-12)
            assert_allclose(read.wrench, one.wrench, atol=1e-12)


@pytest.mark.parametrize("kept", [("layouts", "command"), ("command", "wrench")])
def test_what_is_missing_is_named(
    samples: list[Samples], tmp_path: Path, kept: tuple[str, ...]
) -> None:
    write_samples(tmp_path / "all.npz", samples)
    with np.load(tmp_path / "all.npz") as file:
        np.savez(tmp_path / "less.npz", **{name: file[name] for name in kept})
    with pytest.raises(DataError, match=({"layouts", "command", "wrench"} - set(kept)).pop()):
        read_samples(tmp_path / "less.npz")


def test_a_lone_table_is_refused(samples: list[Samples], tmp_path: Path) -> None:
    write_table(samples[0], tmp_path / "lone.csv")
    with pytest.raises(DataError, match="lone"):
        read_samples(tmp_path)
    with pytest.raises(DataError, match="empty"):
        (tmp_path / "empty").mkdir()
        read_samples(tmp_path / "empty")


def test_twenty_samples_fit_the_constants(samples: list[Samples]) -> None:
    missed = []
    expected = []
    for one in samples:
        known = fit_constants(Samples(one.layout, one.command[:20], one.wrench[:20]))
        robot = replace(one.layout, interaction=known.jets)
        command = one.command[20:]
        plant = Plant(robot)
        scale = wrench_scale_of(one.layout)
        truth = true_wrench(one.layout, command)
        error, laws = (
            (Plant(layout).wrench(command) - truth) / scale for layout in (robot, one.layout)
        )
        assert np.linalg.norm(error) <= np.linalg.norm(laws) / 3.0
        assert plant.interaction is not None
        force = body_force(plant.force(command), robot.frames)
        missed.append((error**2).sum())
        expected.append(((plant.interaction.deviation(force) / scale) ** 2).sum())
    assert 0.5 < np.sqrt(np.sum(expected) / np.sum(missed)) < 2.0


def test_the_verbs_go_from_a_table_to_an_answer(samples: list[Samples], tmp_path: Path) -> None:
    one = samples[0]
    save_layout(one.layout, tmp_path / "robot.yaml")
    write_table(Samples(one.layout, one.command[:20], one.wrench[:20]), tmp_path / "tank.csv")
    run = ["fit", "interaction", "robot.yaml", "tank.csv", "-o", "known.yaml"]
    done = subprocess.run(
        [sys.executable, "-m", "finlab", *run],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "laws alone miss" in done.stdout and "type: jets" in done.stdout
    target = true_wrench(one.layout, one.command[-1:])[0]
    errors = []
    for name in ("robot.yaml", "known.yaml"):
        allocator = finlab.Allocator(finlab.load_layout(tmp_path / name))
        command = allocator.allocate(target).command
        errors.append(
            np.linalg.norm((true_wrench(one.layout, command[None])[0] - target) / allocator.scale)
        )
    assert errors[1] < 0.5 * errors[0]


def test_a_robot_fitted_to_a_prior_moves_with_its_weights(
    samples: list[Samples], tmp_path: Path
) -> None:
    one = samples[0]
    made = tmp_path / "made"
    made.mkdir()
    save_layout(one.layout, tmp_path / "robot.yaml")
    write_table(one.some(slice(20)), tmp_path / "tank.csv")
    robot, table, known = (
        str(path) for path in (tmp_path / "robot.yaml", tmp_path / "tank.csv", made / "known.yaml")
    )
    run = ["fit", "interaction", robot, table, "--prior", "several_plants", "-o", known]
    assert main(run) == 0
    here = finlab.load_layout(known).interaction
    moved = made.rename(tmp_path / "moved")
    there = finlab.load_layout(moved / "known.yaml").interaction
    assert isinstance(here, Linear) and isinstance(there, Linear)
    assert here.path == str(made / "known.safetensors")
    assert there.path == str(moved / "known.safetensors")


def test_few_samples_are_refused(samples: list[Samples], tmp_path: Path) -> None:
    with pytest.raises(DataError, match="at least 5"):
        fit_constants(Samples(samples[0].layout, samples[0].command[:3], samples[0].wrench[:3]))
    write_table(samples[0], tmp_path / "table.csv")
    with pytest.raises(DataError, match="missing"):
        read_table(samples[1].layout, tmp_path / "table.csv")
