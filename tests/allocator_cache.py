"""`AllocatorCache`: a method with its settings, and its allocator of each robot that a test asks
about.

Tests of several robots load the networks of a method once, and not once a robot. Used by all rooms
that allocate.
"""

from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from finlab.allocation import Allocation, Allocator, BatchAllocation
from finlab.allocation.method import Method, Settings
from finlab.allocation.methods import (
    Checkpoint,
    MethodChoice,
    checked_settings,
    choose_method,
    method_class,
)
from finlab.assets import shipped_layouts
from finlab.files.checkpoint_config import WrenchNormalization, read_normalization
from finlab.layout import Layout, load_layout
from finlab.research.networks.checkpoint import resolve_checkpoint


class AllocatorCache:
    """Makes an allocator for each robot, and keeps it."""

    def __init__(
        self, method: str | type[Method] = "dual", checkpoint: Checkpoint = None, **settings: Any
    ) -> None:
        if not isinstance(method, str):
            self.choice = MethodChoice(method, checked_settings(method, settings))
        elif method_class(method).needs_networks:
            self.choice = choose_method(method, checkpoint, **settings)
        else:
            self.choice = choose_method(method, None, **settings)
        self.name = self.choice.kind.name
        self._made: dict[Layout, Allocator] = {}

    @property
    def normalization(self) -> WrenchNormalization:
        """What the networks were trained with; the paper's where there are none."""
        if self.choice.networks is not None:
            return self.choice.networks.normalization
        return read_normalization(resolve_checkpoint("default"))

    @property
    def settings(self) -> Settings:
        """Settings of the method."""
        return self.choice.settings

    def with_settings(self, **changes: Any) -> "AllocatorCache":
        """The same method with some settings changed."""
        other = copy(self)
        settings = checked_settings(self.choice.kind, {**vars(self.settings), **changes})
        other.choice = replace(self.choice, settings=settings)
        other._made = {}
        return other

    def on(self, layout: Layout) -> Allocator:
        """The allocator of a robot, made at the first question."""
        if layout not in self._made:
            self._made[layout] = Allocator.of_choice(layout, self.choice)
        return self._made[layout]

    def method(self, layout: Layout) -> Any:
        """The method itself, for tests of what is inside."""
        return self.on(layout)._whole.method

    def allocate(self, layout: Layout, wrench: Any, **question: Any) -> Allocation:
        """`Allocator.allocate` of a robot."""
        return self.on(layout).allocate(wrench, **question)

    def allocate_batch(self, layout: Layout, wrenches: Any, **question: Any) -> BatchAllocation:
        """`Allocator.allocate_batch` of a robot."""
        return self.on(layout).allocate_batch(wrenches, **question)


def normalized_error(normalization: WrenchNormalization, wrench: Any, target: Any) -> Any:
    """`||(wrench - target) / std||`, over the last axis."""
    return np.linalg.norm((np.asarray(wrench) - np.asarray(target)) / normalization.std, axis=-1)


def _is_of_planar_fins(layout: Layout) -> bool:
    """Whether a robot has fins alone, all with shafts across the hull as in the paper."""
    return layout.is_of_fins and all(fin.mounting_angle is not None for fin in layout.fins)


FIN_ROBOTS = {
    name: path for name, path in shipped_layouts().items() if _is_of_planar_fins(load_layout(path))
}
"""Name of a shipped robot of such fins -> its layout file."""
