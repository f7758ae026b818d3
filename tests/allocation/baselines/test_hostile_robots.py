"""The model-based methods on strong fins and long levers, and what they answer when their time is up."""

import time
import warnings

import numpy as np
import pytest

from finlab.allocation import Allocator
from finlab.layout import Fin, FinModelSpec, Layout, Limits
from finlab.physics import Plant


def strong(n_fins: int, angle: float = 1.0) -> Layout:
    """Fins of thousands of newton at one place, 9 m from the centre of gravity."""
    limits = Limits((0.0, 1.5), (0.0, 20.0))
    model = FinModelSpec("drag", (("area", 0.2), ("lever", 0.5)))
    return Layout(
        "strong", tuple(Fin(f"f{i}", (8.0, 5.0, 1.0), 0.3 + angle * i, limits, model) for i in range(n_fins))
    )


@pytest.mark.parametrize("layout", [strong(1), strong(2, 0.0), strong(4)], ids=["one", "twins", "four"])
def test_strong_fins_on_long_levers_are_no_singular_problem(layout: Layout) -> None:
    targets = np.concatenate(
        [np.random.default_rng(0).normal(size=(4, 6)) * 10.0**k for k in range(-12, 7, 3)]
    )
    targets = np.concatenate(
        [targets, Plant(layout).wrench(Plant(layout).sample(np.random.default_rng(1), (4,)))]
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        command = Allocator(layout, "sqp").allocate_batch(np.clip(targets, -1e6, 1e6)).command
    assert ((command >= layout.lower) & (command <= layout.upper)).all()


def many_fins() -> tuple[Layout, np.ndarray]:
    """A robot on which every one of the methods takes long, and a wrench within its reach."""
    arc = Limits((0.05, 0.6), (0.1, 2.1), (-1.0, 0.5))
    rng = np.random.default_rng(0)
    fins = (
        Fin(f"f{i}", tuple(rng.uniform(-0.3, 0.3, 3).tolist()), float(rng.uniform(-3, 3)), arc)
        for i in range(16)
    )
    layout = Layout("many", tuple(fins))
    return layout, Plant(layout).wrench(Plant(layout).sample(rng, ()))


def test_when_the_time_is_up_the_best_so_far_is_the_answer() -> None:
    layout, target = many_fins()
    start = time.thread_time()
    hasty = Allocator(layout, "sqp", time_limit_s=1e-6).allocate(target)
    assert time.thread_time() - start < 0.3
    assert ((hasty.command >= layout.lower) & (hasty.command <= layout.upper)).all()
    patient = Allocator(layout, "sqp", time_limit_s=60.0).allocate(target)
    assert patient.err_norm < 1e-5 and patient.power < hasty.power
