"""The layout graph as a value: a robot as the network sees it, and proof of what it should answer."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finlab.allocation import Allocator
from finlab.errors import AllocationError
from finlab.inference.features import fin_frame_features, geometry, raw_features
from finlab.inference.normalization import Normalization
from finlab.layout import Layout, stack_layouts
from finlab.physics import Plant

N_SELF_TEST = 4
"""Self-test wrenches in a graph file: enough to notice a wrong file, few enough to read."""
SELF_TEST_TOLERANCE = 1e-3
"""Allowed normalized error between a self-test's wrench and what another machine predicts for its command."""

Row = tuple[float, ...]
Array = NDArray[np.float64]


@dataclass(frozen=True)
class SelfTest:
    """One target with the answer that the allocator gave on the machine that wrote the file."""

    wrench: Row
    """Target (6,) [N, N m]."""
    command: tuple[Row | None, ...]
    """Command of each fin: amplitude [rad], frequency [Hz], zero direction [rad]; None for a failed fin."""
    predicted_wrench: Row
    """Wrench (6,) that the surrogate predicts for the command [N, N m]."""
    features: tuple[Row | None, ...]
    """Node features of each fin for this target, exactly as the network sees them; None for a failed fin."""


@dataclass(frozen=True)
class LayoutGraph:
    """A layout prepared for deployment with one checkpoint."""

    layout: Layout
    """The robot, failed fins included."""
    failed: tuple[str, ...]
    """Fins that do not work; they have no features and no edges."""
    feature_set: str
    """Which node features the checkpoint's network is fed: `raw` or `fin_frame`."""
    features: tuple[Row | None, ...]
    """The part of each fin's node features that does not depend on the target; None for a failed fin."""
    normalization: Normalization
    """Mean and standard deviation of the wrench that the checkpoint was trained with."""
    checkpoint: str
    """Name of the checkpoint."""
    checkpoint_sha256: str
    """SHA-256 of the checkpoint, hexadecimal."""
    self_test: tuple[SelfTest, ...]
    """Targets with their answers."""

    @property
    def edges(self) -> tuple[tuple[str, str], ...]:
        """Pairs of fins that attend to each other: all healthy ones, each to itself as well."""
        alive = [name for name in self.layout.names if name not in self.failed]
        return tuple((a, b) for i, a in enumerate(alive) for b in alive[i:])


def build_graph(layout: Layout, allocator: Allocator, failed: tuple[str, ...] = ()) -> LayoutGraph:
    """Prepare a layout for deployment with the checkpoint of an allocator.

    The self-test's targets are wrenches of random commands, so each can be reached; they and everything
    else depend on the layout and the checkpoint alone.

    Raises:
        LayoutError: an unknown failed fin, or none left.
        AllocationError: the allocator's method has no network, or its network has not learned the fins.
    """
    healthy = layout.without(failed) if failed else layout
    checkpoint = allocator.weights
    if checkpoint is None:
        raise AllocationError(
            f"method {allocator.name!r} has no trained network to make a graph for; use learned"
        )
    if unknown := allocator.unknown_fins(healthy):
        raise AllocationError(
            f"checkpoint {checkpoint.name!r} has not learned the fins {', '.join(unknown)} of layout "
            f"{layout.name!r}, so the robot would answer wrongly; train a surrogate and an allocator for "
            "them, or give the fins a model that the checkpoint knows"
        )
    features = NodeFeatures(checkpoint.check_network().features, healthy, checkpoint.normalization)
    cases = []
    for target in random_targets(healthy, N_SELF_TEST):
        target = _rounded(target)
        result = allocator.allocate(layout, target, failed=failed, seed=0)
        assert result.wrench_surrogate is not None
        cases.append(
            SelfTest(
                wrench=tuple(target.tolist()),
                command=_rows(layout, failed, result.command[~np.isnan(result.command).any(axis=1)]),
                predicted_wrench=tuple(_rounded(result.wrench_surrogate).tolist()),
                features=_rows(layout, failed, features.of(target)),
            )
        )
    return LayoutGraph(
        layout=layout,
        failed=tuple(failed),
        feature_set=features.name,
        features=_rows(layout, failed, features.fixed),
        normalization=checkpoint.normalization,
        checkpoint=checkpoint.name,
        checkpoint_sha256=checkpoint.sha256,
        self_test=tuple(cases),
    )


def random_targets(layout: Layout, count: int) -> Array:
    """Wrenches (count, 6) of random commands, the same ones every time."""
    draws = np.random.default_rng(0).random((count, layout.n_fins, 3))
    return Plant(layout).wrench(layout.lower + draws * (layout.upper - layout.lower))


class NodeFeatures:
    """The node features of one layout, from the same functions that training uses."""

    def __init__(self, name: str, layout: Layout, normalization: Normalization) -> None:
        """`name` is a feature set of `finlab.inference.features`; all fins of `layout` are healthy."""
        arrays = stack_layouts([layout])
        numbers = (arrays.position, arrays.mounting_angle, arrays.lower, arrays.upper)
        self.name = name
        self._normalization = normalization
        self._geometry = geometry(*numbers, normalization.std) if name == "fin_frame" else None
        self.fixed: Array = raw_features(*numbers)[0] if self._geometry is None else self._geometry.static[0]
        """The part (n, F) that does not depend on the target."""

    def of(self, target: Array) -> Array:
        """All node features (n, F) for a target wrench (6,)."""
        if self._geometry is None:
            return self.fixed
        scaled = (target - self._normalization.mean) / self._normalization.std
        features: Array = fin_frame_features(self._geometry, scaled[None])[0]
        return features


def _rows(layout: Layout, failed: tuple[str, ...], healthy: Array) -> tuple[Row | None, ...]:
    """Rows (m, ...) of the healthy fins among all fins, None for the failed ones."""
    rows = iter(healthy)
    return tuple(None if name in failed else tuple(_rounded(next(rows)).tolist()) for name in layout.names)


def _rounded(values: Array) -> Array:
    """Nine significant digits: more than the network's float32 holds, and the same text on most machines."""
    return np.array([float(f"{value:.9g}") for value in values])
