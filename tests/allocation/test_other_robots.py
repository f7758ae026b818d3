"""Methods that know fins only refuse other robots in one sentence."""

from dataclasses import replace

import pytest

import finlab
from finlab.errors import LayoutError
from finlab.layout import Fin, load_layout


@pytest.mark.parametrize("method", ["mdn", "paper", "qp", "sqp", "paper_sqp", "fixed_frequency"])
def test_a_thruster_is_named_with_its_type(method: str) -> None:
    with pytest.raises(LayoutError, match=f"method {method} works for .* 'lift_left' .* is of type thruster"):
        finlab.Allocator(load_layout("turtle_hybrid"), method)


def test_the_papers_method_names_the_fin_whose_shaft_it_does_not_know() -> None:
    layout = load_layout("A")
    tail = Fin("tail", (-0.4, 0.0, 0.0), shaft=(0.0, 0.0, 1.0), zero=(1.0, 0.0, 0.0))
    with pytest.raises(LayoutError, match="method paper works for .* 'tail' .* a shaft of its own"):
        finlab.Allocator(replace(layout, actuators=(*layout.fins, tail)), "paper")


@pytest.mark.parametrize("method", ["mdn", "qp", "sqp", "paper_sqp", "analytic", "fixed_frequency"])
def test_other_methods_take_shafts_in_any_direction(method: str) -> None:
    layout = load_layout("A")
    tail = Fin("tail", (-0.4, 0.0, 0.0), shaft=(0.0, 0.0, 1.0), zero=(1.0, 0.0, 0.0))
    allocator = finlab.Allocator(replace(layout, actuators=(*layout.fins, tail)), method)
    assert allocator.allocate([0.5, 0.3, 0.2, 0.0, 0.0, 0.1]).err_norm < 0.05
