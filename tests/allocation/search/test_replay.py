"""The path to an answer: the same search again, from where it began to the answer, without a gap."""

import numpy as np
import pytest

from finlab.allocation import load_allocator
from finlab.allocation.policy import CLOSEST, as_policy
from finlab.allocation.search.replay import SEEN
from finlab.layout import Layout, load_layout
from finlab.physics import Plant

TURN = (1.5, 0.0, 0.0, 0.0, 0.0, 0.25)


def jumps(layout: Layout, command: np.ndarray) -> list[float]:
    """Largest change of a force from step to step, as shares of the last command's largest force."""
    force = Plant(layout).forces(command)
    return [
        float(np.abs(b - a).max() / np.abs(force[-1]).max())
        for a, b in zip(force[:-1], force[1:], strict=True)
    ]


@pytest.mark.parametrize("objective", ["power", "effort"])
@pytest.mark.parametrize("method", ["search", "mdn"])
@pytest.mark.parametrize("name", ["ucat", "penta"])
def test_a_path_leads_to_each_way_without_a_gap(name: str, method: str, objective: str) -> None:
    layout = load_layout(name)
    allocator = load_allocator(method).with_settings(objective=objective)
    answer = allocator.allocate(layout, TURN)
    for mode in answer.explore()[:3]:
        path = allocator.path(layout, TURN, mode.command, CLOSEST)
        assert path is not None and path.names[-1] == "answer"
        np.testing.assert_array_equal(path.command[-1], mode.command)
        assert (path.command >= layout.lower - 1e-12).all() and (path.command <= layout.upper + 1e-12).all()
        errors = allocator.normalization.error(Plant(layout).wrench(path.command), np.array(TURN))
        assert errors[-1] <= errors[0] and errors[-1] < 1e-3
        steps = jumps(layout, path.command)
        assert steps[-1] < SEEN, "the last step of the search is the answer, as far as one sees"
        told = zip(steps, path.names[1:], strict=True)
        assert all(step > SEEN for step, name in told if name.startswith("search")), "each can be seen"


def test_drawn_ways_begin_with_the_sample_itself() -> None:
    layout, allocator = load_layout("hexa"), load_allocator("mdn")
    answer = allocator.allocate(layout, TURN)
    path = allocator.path(layout, TURN, answer.command, CLOSEST)
    assert path is not None and answer.samples is not None and path.names[0] == "start"
    drawn = [k for k, source in enumerate(answer.samples.source) if source == path.start]
    assert any(np.allclose(answer.samples.command[k], path.command[0], atol=1e-9) for k in drawn)


@pytest.mark.parametrize("policy", ["closest", "direction"])
def test_out_of_reach_it_begins_with_what_is_within(policy: str) -> None:
    layout, allocator = load_layout("ucat"), load_allocator()
    far = (30.0, 6.0, 0.0, 0.0, 0.0, 4.0)
    answer = allocator.allocate(layout, far, policy=policy)
    path = allocator.path(layout, far, answer.command, as_policy(policy))
    assert path is not None and path.names[0] == "nearest within reach"
    assert max(jumps(layout, path.command)) < SEEN


def test_the_papers_path_is_adam_from_a_sample() -> None:
    layout, allocator = load_layout("A"), load_allocator("paper")
    answer = allocator.allocate(layout, TURN)
    path = allocator.path(layout, TURN, answer.command, CLOSEST)
    assert path is not None and path.names[:2] == ("start", "Adam, step 2") and answer.samples is not None
    assert any(np.allclose(drawn, path.command[0]) for drawn in answer.samples.command)
    assert jumps(layout, path.command)[-1] < 0.1
    assert allocator.path(layout, TURN, answer.command, as_policy("direction")) is None
    assert load_allocator("qp").path(layout, TURN, answer.command, CLOSEST) is None
