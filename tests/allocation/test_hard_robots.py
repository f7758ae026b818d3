"""Every method ends in an answer within the limits on robots of 3 m and of 5 cm whose fins hardly add to each
other: parallel, in line, in a heap, at one place, one above the other."""

import warnings
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.evaluation.method_specs import installed_methods, is_slow, load_method_spec
from finlab.evaluation.splits import make_split
from finlab.layout import FinModelSpec, Layout
from finlab.physics import plant_of

SPLITS = ("parallel", "collinear", "clustered", "coincident", "stacked", "big", "tiny")
LARGE, SMALL = (
    FinModelSpec("drag", (("area", 0.3), ("lever", 0.4))),
    FinModelSpec("lighthill", (("length", 0.015), ("width", 0.007))),
)
IN_TIME_S = 0.02
"""Time that slow methods have for a target here."""


def sized(layout: Layout, times: float, model: FinModelSpec) -> Layout:
    """A layout of another size."""
    fins = (
        replace(fin, position=tuple((times * np.array(fin.position)).tolist()), model=model)
        for fin in layout.fins
    )
    return replace(layout, fins=tuple(fins))


def hard_robots(seed: int) -> Iterator[Layout]:
    """One robot of each kind as it is drawn, and those of usual size with 3 m and with 5 cm."""
    for split in SPLITS:
        layout = make_split(split, 1, 1, seed)[0].layout
        yield layout
        if split not in ("big", "tiny"):
            yield sized(layout, 10.0, LARGE)
            yield sized(layout, 1.0 / 6.0, SMALL)


def quickened(name: str) -> Allocator:
    method = load_method_spec(name)
    return method.with_settings(time_limit_s=IN_TIME_S) if "time_limit_s" in method.option_names() else method


@pytest.mark.parametrize("name", installed_methods())
def test_every_method_answers(name: str) -> None:
    method = quickened(name)
    for layout in hard_robots(1):
        plant, rng = plant_of(layout), np.random.default_rng(2)
        within = plant.wrench(plant.sample(rng, (1,)))
        beyond = np.clip(1e3 * plant.wrench(plant.sample(rng, (1,))), -1e6, 1e6)
        targets = np.concatenate([within, 1.2 * within, beyond, np.zeros((1, 6))])
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            commands = list(method.allocate_batch(layout, targets[:: 2 if is_slow(name) else 1]).command)
            if not is_slow(name):
                commands.append(method.allocate(layout, targets[0], previous=plant.lower).command)
        for command in commands:
            assert np.isfinite(command).all(), (name, layout.name)
            assert ((command >= plant.lower) & (command <= plant.upper)).all(), (name, layout.name)


def test_the_default_method_is_exact_on_all_of_them() -> None:
    method = load_method_spec("search")
    for layout in hard_robots(1):
        plant = plant_of(layout)
        targets = plant.wrench(plant.sample(np.random.default_rng(3), (6,)))
        error = np.linalg.norm(method.allocate_batch(layout, targets).wrench - targets, axis=-1)
        assert (error <= 1e-2 * np.linalg.norm(targets, axis=-1)).all(), layout.name
