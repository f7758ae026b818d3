"""Whether answers of robots with fitted fins miss as much as they say: four fins, one fit, a known
law."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.arrays import Array
from finlab.fit.fin_fit import fit_fin, write_fin
from finlab.layout import FinModelSpec
from finlab.physics import FinLaw, TableLaw, make_law, plant_of
from finlab.research.random_layouts import random_fin_model, random_layout
from tests.fit.load_cell import commands, measured, samples
from tests.sampled_cases import sampled

LAWS = ("drag", "lighthill", "soft", "table")
"""The last one is a soft fin's grid with noise of 3 %."""
N_TARGETS = 40
"""How many wrenches each robot is asked for."""


def random_law(kind: str, rng: np.random.Generator) -> FinLaw:
    """A fin with random parameters."""
    law = make_law(random_fin_model(rng, "soft" if kind == "table" else kind))
    if kind != "table":
        return law
    axes = [
        np.linspace(0, 0.6, 8),
        np.linspace(0, 2.1, 9),
        np.linspace(-np.pi, np.pi, 12, endpoint=False),
    ]
    force = law.force(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))
    return TableLaw(axes, np.asarray(force * (1.0 + 0.03 * rng.standard_normal(force.shape))), True)


def miss_and_expected(kind: str, seed: int, folder: Path) -> tuple[Array, Array]:
    """True misses and expected ones (K, 6) over the wrench scale, of targets on three robots with
    one fit."""
    rng = np.random.default_rng([seed, LAWS.index(kind)])
    law = random_law(kind, rng)
    command = commands(300, seed)
    path = folder / f"{kind}-{seed}.csv"
    write_fin(fit_fin(samples(command, measured(law, command, 0.05, seed + 1))), path)
    model = FinModelSpec("table", (("path", str(path)),))
    misses = []
    expected = []
    for _ in range(3):
        layout = random_layout(rng, n_fins=4)
        layout = replace(layout, actuators=tuple(replace(fin, model=model) for fin in layout.fins))
        plant = plant_of(layout)
        allocator = Allocator(layout)
        targets = rng.uniform(0.2, 0.9, (N_TARGETS, 1)) * plant.wrench(
            plant.sample(rng, (N_TARGETS,))
        )
        answers = allocator.allocate_batch(targets)
        off = law.force(answers.command) - plant.force(answers.command)
        misses.append(np.einsum("kni,niw->kw", off, plant.effectiveness) / allocator.scale)
        expected.append(answers.expected_miss / allocator.scale)
    return np.concatenate(misses), np.concatenate(expected)


def ratio(miss: Array, expected: Array) -> float:
    """Root mean square of the size of the true miss over the expected one."""
    return float(np.sqrt(np.mean((miss**2).sum(axis=1) / (expected**2).sum(axis=1))))


@pytest.mark.parametrize("kind", sampled(LAWS, every=4))
def test_fitted_fins_miss_as_much_as_they_say(kind: str, tmp_path: Path) -> None:
    rows = [miss_and_expected(kind, seed, tmp_path) for seed in (21, 22)]
    miss, expected = (np.concatenate(part) for part in zip(*rows, strict=True))
    assert 0.5 < ratio(miss, expected) < 2.0
    assert (
        np.abs(np.log(np.sqrt(np.mean(miss**2, axis=0) / np.mean(expected**2, axis=0)))) < 1.1
    ).all()
