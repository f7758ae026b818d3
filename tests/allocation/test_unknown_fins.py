"""The paper's method says which fins its surrogate has not learned; all others ask every fin's own model."""

from dataclasses import replace

import pytest

from finlab.assets import shipped_checkpoints
from finlab.layout import FinModelSpec, Layout, load_layout
from tests.allocation.quick import OF_FINS, quick_allocator

SURGE = [1.0, 0.0, 0.5, 0.0, 0.0, 0.1]

pytestmark = pytest.mark.skipif(
    not {"default", "paper"} <= set(shipped_checkpoints()), reason="no trained checkpoints in the tree"
)


def with_models(**models: FinModelSpec) -> Layout:
    layout = load_layout("A")
    return replace(
        layout, actuators=tuple(replace(f, model=models.get(f.name, f.model)) for f in layout.fins)
    )


@pytest.mark.parametrize("method", OF_FINS)
def test_fins_that_no_network_learned_are_named(method: str) -> None:
    allocator = quick_allocator(method)
    wide = FinModelSpec("drag", (("area", 0.03),))
    layout = with_models(front_left=FinModelSpec("lighthill"), back_right=wide)
    expected = ("front_left", "back_right") if method == "paper" else ()
    assert allocator.on(layout).unknown_fins == expected
    assert allocator.on(load_layout("A")).unknown_fins == ()


@pytest.mark.parametrize("method", OF_FINS)
def test_the_note_names_the_fins_that_work(method: str) -> None:
    layout = with_models(front_left=FinModelSpec("lighthill"))
    allocator = quick_allocator(method)
    notes = allocator.allocate(layout, SURGE).notes
    assert len(notes) == (method == "paper")
    assert all("front_left" in note and "drag" in note for note in notes)
    assert allocator.allocate(layout, SURGE, failed=["front_left"]).notes == ()
