"""Steps of Newton's method from given multipliers, and batches that begin at some: what is read at a
point is the dual's derivative there, and answers are those of batches that begin at their own."""

import numpy as np
import pytest

from finlab.allocation.dual.compiled import Compiled
from finlab.arrays import Array
from finlab.assets import shipped_layouts
from finlab.core.calls import NOMINAL, Conditions, Core
from finlab.errors import CommandError
from finlab.layout import load_layout
from tests.core.test_lanes import NONE, SAME, WIDTHS, shipped_wrenches

ROBOTS = ("bluerov2_heavy", "A", "turtle_hybrid", "catamaran", "mixed")
"""Of thrusters, fins, both, pods, and all."""
STEPS_TO_THE_END = 200


def points_of(name: str, share: float = 0.5) -> tuple[Compiled, Array, Array]:
    """A robot, wrenches (20, 6) and their exact multipliers."""
    layout = load_layout(name)
    compiled = Compiled.of(layout)
    wrench = shipped_wrenches(layout, share, 20)
    return compiled, wrench, compiled.core.answer_many(wrench, None).multipliers


@pytest.mark.parametrize("name", ROBOTS)
def test_what_is_read_at_multipliers_is_the_derivative_of_the_dual(name: str) -> None:
    compiled, wrench, exact = points_of(name)
    core = compiled.core
    at = exact * np.random.default_rng(0).uniform(0.7, 1.3, exact.shape)
    points = core.dual_points(wrench, at, 0)
    assert (points.steps == 0).all()
    given = np.einsum("tia,iak->tk", points.force, compiled.effectiveness)
    scale = compiled.axis_scale
    span = compiled.basis @ compiled.basis.T
    missed = (wrench - compiled.wrench_offset - given) / scale
    np.testing.assert_allclose(points.residual / scale, missed @ span, 0, 1e-9)
    for k in range(6):
        move = np.zeros(6)
        move[k] = 1e-6 * np.abs(at * scale).max() / scale[k]
        ahead = core.dual_points(wrench, at + move, 0)
        back = core.dual_points(wrench, at - move, 0)
        rise = (ahead.dual_value - back.dual_value) / (2.0 * move[k])
        np.testing.assert_allclose(rise / scale[k], points.residual[:, k] / scale[k], 0, 1e-5)
        # dy = (dy / ds) B' dlambda; at a kink the difference is that of neither side
        price = compiled.effectiveness @ move
        xx, xy, yy = np.moveaxis(points.slope, -1, 0)
        change = np.stack(
            [xx * price[:, 0] + xy * price[:, 1], xy * price[:, 0] + yy * price[:, 1]]
        )
        difference = np.moveaxis(ahead.force - back.force, -1, 0) / 2.0
        off = np.abs(change - difference).max(axis=0) / compiled.row_force_max[:, 0]
        assert np.quantile(off, 0.9) < 1e-8


def test_steps_lead_to_the_answer_and_are_counted() -> None:
    compiled, wrench, exact = points_of("turtle_hybrid")
    core = compiled.core
    begin = 1.05 * exact
    sizes = []
    for steps in (0, 1, 2, STEPS_TO_THE_END):
        points = core.dual_points(wrench, begin, steps)
        assert (points.steps <= steps).all()
        sizes.append(np.median(np.abs(points.residual / compiled.axis_scale).max(axis=1)))
    assert sizes[0] > 10.0 * sizes[1] > 100.0 * sizes[2]
    assert sizes[3] < 1e-9
    own = core.dual_points(wrench, None, STEPS_TO_THE_END)
    expected = [core.answer_one(each, None).multipliers[0] for each in wrench]
    np.testing.assert_array_equal(own.multipliers, expected)


def test_points_know_losses_and_refuse_what_is_no_number() -> None:
    compiled, wrench, exact = points_of("bluerov2_heavy")
    lost = Conditions(lost=np.arange(8) == 0)
    assert (compiled.core.dual_points(wrench, exact, 0, lost).force[:, 0] == 0.0).all()
    with pytest.raises(CommandError):
        compiled.core.dual_points(wrench, np.inf * exact, 0)
    with pytest.raises(CommandError):
        compiled.core.dual_points(np.nan * wrench, exact, 0)


def in_lanes(core: Core, lanes: int, wrench: Array, multipliers: Array | None) -> list[Array]:
    """Answers of a batch in so many lanes."""
    core._lanes = lanes
    return list(core.answer_many(wrench, None, NOMINAL, multipliers)[:-1])


@pytest.mark.parametrize("name", [*shipped_layouts()])
def test_a_batch_that_begins_at_multipliers_has_the_same_answers(name: str) -> None:
    layout = load_layout(name)
    core = Compiled.of(layout).core
    wrench = shipped_wrenches(layout, 0.6, 21)
    own = core.answer_many(wrench, None)
    begin = own.multipliers * np.random.default_rng(1).uniform(0.8, 1.2, own.multipliers.shape)
    begin[3] = np.nan  # nowhere to begin: as if none were given
    begin[4] = 0.0
    for lanes in (NONE, *WIDTHS):
        answer = in_lanes(core, lanes, wrench, begin)
        np.testing.assert_array_equal(answer[4], own.is_attainable)
        for given, expected in zip(answer[:3], own[:3], strict=True):
            size = np.abs(expected).max(initial=1e-12)
            np.testing.assert_allclose(given / size, expected / size, 0, SAME)
    widest = in_lanes(core, WIDTHS[-1], wrench, begin)
    for one, other in zip(in_lanes(core, WIDTHS[0], wrench, begin), widest, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(core.answer_many(wrench, None).force, own.force)


def test_exact_multipliers_leave_no_step_and_a_wrong_shape_is_refused() -> None:
    compiled, wrench, exact = points_of("bluerov2_heavy")
    assert (compiled.core.dual_points(wrench, exact, STEPS_TO_THE_END).steps <= 1).all()
    with pytest.raises(CommandError, match=r"expected an array \(20, 6\)"):
        compiled.core.answer_many(wrench, None, NOMINAL, exact[:3])
