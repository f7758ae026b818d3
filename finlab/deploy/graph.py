"""The layout graph as a value: a robot ready for deployment, and proof of what should be answered."""

from dataclasses import dataclass

import numpy as np

from finlab.allocation import Allocator
from finlab.allocation.bundle_settings import normalization_of
from finlab.arrays import Array
from finlab.layout import Layout
from finlab.layout.graph_form import Case
from finlab.networks.normalization import Normalization
from finlab.physics import plant_of

N_SELF_TEST = 4
"""Self-test wrenches in a graph file: enough to notice a wrong file, few enough to read."""
SELF_TEST_TOLERANCE = 1e-6
"""Allowed normalized error between the wrench of a self-test's command and what another machine computes for
it; both are written with nine digits."""


@dataclass(frozen=True)
class LayoutGraph:
    """A layout prepared for deployment with one allocator."""

    layout: Layout
    """The robot, failed fins included."""
    failed: tuple[str, ...]
    """Actuators that do not work; they have no edges."""
    normalization: Normalization
    """Mean and standard deviation of the wrench; the latter is the yardstick of errors."""
    checkpoint: str | None
    """Name of the checkpoint that the networks come from; None for methods without networks."""
    checkpoint_sha256: str | None
    """SHA-256 of its weights, hexadecimal."""
    method: str
    """Method that answered the self-tests."""
    self_test: tuple[Case, ...]
    """Targets with their answers."""

    @property
    def edges(self) -> tuple[tuple[str, str], ...]:
        """Pairs of actuators that share the work: all healthy ones, each with itself as well."""
        alive = [name for name in self.layout.names if name not in self.failed]
        return tuple((a, b) for i, a in enumerate(alive) for b in alive[i:])

    @property
    def healthy(self) -> Layout:
        """The actuators that work."""
        return self.layout.without(self.failed) if self.failed else self.layout


def build_graph(allocator: Allocator, failed: tuple[str, ...] = ()) -> LayoutGraph:
    """Prepare the robot of an allocator for deployment.

    The self-test's targets are wrenches of random commands, so each can be reached; they and everything
    else depend on the layout and the allocator alone.

    Raises:
        LayoutError: an unknown failed actuator, or none left.
        DataError: a fin's force table cannot be read.
    """
    layout = allocator.layout
    healthy = layout.without(failed) if failed else layout
    plant = plant_of(healthy)
    cases = []
    for wrench in random_targets(healthy, N_SELF_TEST):
        target = _rounded(wrench)
        answer = _rounded(allocator.allocate(target, failed=failed).command)
        delivered = _rounded(plant.wrench(answer[~np.isnan(answer).any(axis=1)]))
        rows = tuple(
            None if name in failed else tuple(row)
            for name, row in zip(layout.names, answer.tolist(), strict=True)
        )
        cases.append(Case(tuple(target.tolist()), rows, tuple(delivered.tolist())))
    weights = allocator.weights
    return LayoutGraph(
        layout=layout,
        failed=tuple(failed),
        normalization=normalization_of(allocator),
        checkpoint=None if weights is None else weights.name,
        checkpoint_sha256=None if weights is None else weights.sha256,
        method=allocator.method,
        self_test=tuple(cases),
    )


def random_targets(layout: Layout, count: int) -> Array:
    """Wrenches (count, 6) of random commands, the same ones every time."""
    plant = plant_of(layout)
    return plant.wrench(plant.sample(np.random.default_rng(0), (count,)))


def _rounded(values: Array) -> Array:
    """Nine significant digits: more than any servo has, and the same text on most machines."""
    return np.array([float(f"{value:.9g}") for value in values.flat]).reshape(values.shape)
