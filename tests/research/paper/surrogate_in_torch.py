"""The paper's surrogate asked with tensors: the judge of its answers and slopes in numpy."""

import torch

from finlab.layout import Layout
from finlab.research.networks.trained import TrainedWeights
from finlab.research.paper.training.samples import ROBOT, SampleBatch
from finlab.research.paper.training.train import surrogate_of


def wrench_in_torch(weights: TrainedWeights, layout: Layout, command: torch.Tensor) -> torch.Tensor:
    """Wrenches (R, 6) of commands (R, n, 3) in their precision."""
    rows, n, _ = command.shape
    parts = [torch.tensor(getattr(layout, name), dtype=command.dtype) for name in ROBOT[:-1]]
    parts = [part.expand(rows, *part.shape) for part in parts]
    batch = SampleBatch(
        *parts, torch.ones(rows, n, dtype=torch.bool), command, torch.empty(rows, 6)
    )
    wrench: torch.Tensor = surrogate_of(weights, dtype=command.dtype)(command, batch)
    return wrench
