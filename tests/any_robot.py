"""A method for whatever robot a test asks about."""

from typing import Any

from finlab.allocation import Allocation, Allocator, BatchAllocation
from finlab.allocation.methods import Checkpoint, MethodChoice, choose_method
from finlab.allocation.modes import Mode
from finlab.allocation.settings import Settings
from finlab.allocation.solution import Candidates
from finlab.layout import Layout


class AnyRobot:
    """Makes an allocator for each robot, and keeps it."""

    def __init__(self, method: str = "dual", checkpoint: Checkpoint = None, **settings: Any) -> None:
        self.choice: MethodChoice = choose_method(method, checkpoint, **settings)
        self.name = method
        self._made: dict[Layout, Allocator] = {}

    @property
    def settings(self) -> Settings:
        return self.choice.settings

    def on(self, layout: Layout) -> Allocator:
        if layout not in self._made:
            self._made[layout] = Allocator.of_choice(layout, self.choice)
        return self._made[layout]

    def allocate(self, layout: Layout, wrench: Any, **question: Any) -> Allocation:
        return self.on(layout).allocate(wrench, **question)

    def allocate_batch(self, layout: Layout, wrenches: Any, **question: Any) -> BatchAllocation:
        return self.on(layout).allocate_batch(wrenches, **question)

    def explore(self, layout: Layout, result: Allocation) -> tuple[Mode, ...]:
        return self.on(layout).explore(result)

    def alternatives(self, layout: Layout, result: Allocation) -> Candidates | None:
        return self.on(layout).alternatives(result)
