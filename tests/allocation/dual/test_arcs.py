"""Azimuths with several arcs: the answer is the best of those of robots with one arc each."""

import itertools
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finlab
from finlab import Policy
from finlab.actuators.azimuth import Azimuth
from finlab.arrays import Array
from finlab.deploy.c_sources import c_sources, write_c
from finlab.errors import AllocationError, LayoutError
from finlab.layout import Layout, load_layout, save_layout
from finlab.physics import plant_of

ONE_POD = ([[-70, 70], [110, 250]],)
"""Two zones of 40 deg: at a neighbour, and at a hydrophone."""
THREE_ARCS = ([[-150, -90], [-60, 70], [100, 150]], [[-170, -100], [-45, 45], [90, 170]])
TURNED = ([[-180, -60], [-20, 90], [120, 180]], [[0, 80], [140, 250]])
"""The first and the last arc of the first pod are one."""
ROBOTS = {"one": ONE_POD, "three": THREE_ARCS, "turned": TURNED}


def ship(arcs: Any, rates: bool = False, **more: Any) -> Layout:
    """A ship with a pod of each of some arcs [deg], and a bow tunnel."""
    pods = []
    for k, arc in enumerate(arcs):
        angles = tuple(tuple(np.radians(pair).tolist()) for pair in arc)
        pods.append(
            Azimuth(
                f"pod_{k}",
                (-30.0 - 4.0 * k, 8.0 * k, 0.0),
                turn_axis=(0.0, 0.0, 1.0),
                zero=(1.0, 0.0, 0.0),
                force=(0.0, 2e5),
                model=finlab.PowerLaw(0.01 + 0.002 * k),
                arc=angles,
                turn_rate=np.radians(12) if rates else None,
                rate=4e4 if rates else None,
                **more,
            )
        )
    bow = finlab.Thruster(
        "bow",
        (28.0, 0.0, 0.0),
        axis=(0.0, 1.0, 0.0),
        force=(-9e4, 9e4),
        model=finlab.PowerLaw(0.012),
    )
    return Layout("ship", (*pods, bow), axes=("Fx", "Fy", "Tz"))


def single_arcs(layout: Layout) -> list[Layout]:
    """The robots whose pods have one of their arcs each."""
    choices = []
    for actuator in layout.actuators:
        arcs = actuator.arcs if isinstance(actuator, Azimuth) else (None,)
        choices.append([actuator if arc is None else replace(actuator, arc=arc) for arc in arcs])
    return [replace(layout, actuators=chosen) for chosen in itertools.product(*choices)]


def targets(layout: Layout, count: int, seed: int = 0) -> Array:
    """Wrenches within reach of some arcs, and others, up to a little beyond reach."""
    rng = np.random.default_rng(seed)
    plant = plant_of(layout)
    wrench = plant.wrench(plant.sample(rng, (count,))) * layout.commanded
    return np.asarray(wrench * rng.uniform(0.2, 1.6, (count, 1)))


def assert_in_arcs(layout: Layout, command: Array) -> None:
    """Each pod that pushes is within one of its arcs."""
    for i, actuator in enumerate(layout.actuators):
        if isinstance(actuator, Azimuth):
            for angle in command[..., i, 0].ravel():
                is_within = [low - 1e-9 <= angle <= high + 1e-9 for low, high in actuator.arcs]
                assert any(is_within), (actuator.name, np.degrees(angle))


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("policy", ["closest", "direction"])
def test_the_answer_is_the_best_of_the_single_arcs(name: str, policy: str) -> None:
    layout = ship(ROBOTS[name])
    allocator = finlab.Allocator(layout)
    parts = [finlab.Allocator(part) for part in single_arcs(layout)]
    asked = targets(layout, 200)
    batch = allocator.allocate_batch(asked, policy=policy)
    scale = allocator.allocate(asked[0]).scale
    # Each robot has a scale of its own for torques, by which `closest` measures; here all have one.
    part_weights = [tuple(part.allocate(asked[0]).scale / scale) for part in parts]
    n_reached = 0
    for k, target in enumerate(asked):
        result = allocator.allocate(target, policy=policy)
        assert_in_arcs(layout, result.command)
        np.testing.assert_allclose(batch.power[k], result.power, rtol=1e-9)
        np.testing.assert_allclose(batch.wrench[k], result.wrench, atol=1e-9 * 1e6)
        own = []
        for part, weights in zip(parts, part_weights, strict=True):
            asked_policy = (
                Policy("closest", axis_weights=weights) if policy == "closest" else policy
            )
            own.append(part.allocate(target, policy=asked_policy))
        reached = [each.power for each in own if each.reachable]
        assert result.reachable == bool(reached), (k, target)
        if reached:
            n_reached += 1
            assert result.power <= min(reached) * (1 + 1e-6)
            assert result.bound is not None and result.bound <= result.power * (1 + 1e-9)
        elif policy == "closest":
            misses = [np.linalg.norm(each.unallocated / scale) for each in own]
            assert np.linalg.norm(result.unallocated / scale) <= min(misses) + 1e-6
        else:
            assert result.share >= max(each.share for each in own) * (1 - 1e-6)
    assert 50 < n_reached < 199


def test_a_tick_stays_in_the_arc_that_its_rate_allows() -> None:
    """A second of 12 deg/s does not pass a zone of 40 deg; over four seconds it does."""
    layout = ship(ONE_POD, rates=True)
    slow = finlab.Allocator(layout, period_s=1.0)
    before = slow.allocate([1e5, 0.0, 0.0, 0.0, 0.0, 0.0]).command
    rate = layout.actuators[0].rates
    for target in targets(layout, 60, 3):
        result = slow.allocate(target, previous=before)
        assert_in_arcs(layout, result.command)
        change = np.abs(result.command[0] - before[0])
        assert change[0] <= rate[0] + 1e-9 and change[1] <= rate[1] * 1.0 + 1e-3
        assert -np.radians(70) - 1e-9 <= result.command[0, 0] <= np.radians(70) + 1e-9
        before = result.command
    quick = finlab.Allocator(layout, period_s=8.0)
    passed = quick.allocate([-1e5, 0.0, 0.0, 0.0, 0.0, 0.0], previous=before)
    assert_in_arcs(layout, passed.command)


def test_a_pod_that_was_left_in_a_zone_comes_out_of_it() -> None:
    layout = ship(ONE_POD, rates=True)
    allocator = finlab.Allocator(layout, period_s=1.0)
    before = np.array([[np.radians(85.0), 1e4, 0.0], [0.0, 0.0, 0.0]])
    result = allocator.allocate([1e4, 1e4, 0, 0, 0, 0], previous=before)
    assert_in_arcs(layout, result.command)


def test_turning_costs_keep_to_the_arcs() -> None:
    layout = ship(THREE_ARCS, rates=True)
    allocator = finlab.Allocator(layout, period_s=2.0, calm=0.3)
    before = allocator.allocate([1e5, 0.0, 0.0, 0.0, 0.0, 0.0]).command
    for target in targets(layout, 40, 4):
        before = allocator.allocate(target, previous=before).command
        assert_in_arcs(layout, before)


def test_damage_of_a_pod_with_arcs() -> None:
    layout = ship(ONE_POD)
    allocator = finlab.Allocator(layout)
    stuck = allocator.allocate(
        [1e4, 1e4, 0, 0, 0, 0], damage=finlab.Damage(stuck={"pod_0": np.radians(90.0)})
    )
    assert stuck.command[0, 0] == pytest.approx(np.radians(90.0))
    weak = allocator.allocate([1e4, 3e4, 0, 0, 0, 0], damage=finlab.Damage(weak={"pod_0": 0.5}))
    assert_in_arcs(layout, weak.command)


def test_other_methods_refuse_several_arcs() -> None:
    with pytest.raises(AllocationError, match="'pod_0' has .*expected one arc, or method"):
        finlab.Allocator(ship(ONE_POD), "qp")


def is_within(pod: Azimuth, degree: float) -> bool:
    """Whether an angle is in one of the arcs of a pod, any turn of it."""
    turned = np.radians(degree + 360.0 * np.arange(-1, 2))
    return any(low <= angle <= high for angle in turned for low, high in pod.arcs)


def test_files_keep_the_arcs(tmp_path: Path) -> None:
    for name, arcs in ROBOTS.items():
        layout = ship(arcs)
        path = tmp_path / f"{name}.yaml"
        save_layout(layout, path)
        assert load_layout(path) == layout
        mirrored = layout.actuators[0].image()
        assert mirrored.image() == layout.actuators[0]
        for degree in np.arange(-179.5, 180.0):
            assert is_within(layout.actuators[0], degree) == is_within(mirrored, -degree), degree


def test_arcs_that_meet_are_one() -> None:
    pod = ship(TURNED).actuators[0]
    assert isinstance(pod, Azimuth)
    np.testing.assert_allclose(np.degrees(pod.arcs), [[-20, 90], [120, 300]])
    np.testing.assert_allclose(np.degrees(pod.barred), [[90, 120]])
    joined = replace(pod, arc=((-1.0, 0.5), (0.5, 1.0)))
    assert joined.arcs == ((-1.0, 1.0),) and joined.barred == ()


@pytest.mark.parametrize(
    ("arc", "force", "sentence"),
    [
        (((-1.0, 1.0), (0.5, 2.0)), (0.0, 1e5), "arc.*must rise, by at most one turn"),
        (((-3.0, 1.0), (2.0, 4.0)), (0.0, 1e5), "arc.*must rise, by at most one turn"),
        (((-1.0, 1.0), 2.0), (0.0, 1e5), "arc.*expected two numbers, or several pairs"),
        ((1.0,), (0.0, 1e5), "arc.*expected two numbers, got 1"),
        (((-1.0, 1.0), (2.0, 2.5)), (-1e4, 1e5), "arc.*pushes ahead only"),
        (((0.0, 0.1),) * 6, (0.0, 1e5), "arc.*expected a list of 1 to 5 values"),
    ],
)
def test_arcs_that_do_not_fit_are_refused(arc: Any, force: Any, sentence: str) -> None:
    pod = ship(ONE_POD).actuators[0]
    with pytest.raises(LayoutError, match=sentence):
        replace(pod, arc=arc, force=force)


def test_exported_c_keeps_to_the_arcs(tmp_path: Path) -> None:
    for single in ("", "-DFL_SINGLE"):
        folder = tmp_path / f"c{single}"
        write_c(c_sources(ship(THREE_ARCS, rates=True), 24), folder)
        words = f"gcc -std=c99 -O1 {single} *.c -lm && ./a.out"
        said = subprocess.run(words, shell=True, cwd=folder, capture_output=True, text=True)
        assert said.returncode == 0 and said.stdout.startswith("0 of 24 "), said
