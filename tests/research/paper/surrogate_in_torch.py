"""The paper's surrogate asked with tensors: the judge of its answers and slopes in numpy."""

import torch

from finlab.layout import Layout
from finlab.research.networks.trained import TrainedWeights
from finlab.research.paper.training.samples import ROBOT, SampleTable
from finlab.research.paper.training.train import surrogate_of


def wrench_in_torch(weights: TrainedWeights, layout: Layout, command: torch.Tensor) -> torch.Tensor:
    """Wrenches (R, 6) of commands (R, n, 3) in their precision."""
    rows, n, _ = command.shape
    arrays = {name: torch.tensor(getattr(layout, name)[None]) for name in ROBOT[:-1]}
    arrays = {name: values.to(command.dtype) for name, values in arrays.items()}
    arrays["mask"] = torch.ones(1, n, dtype=torch.bool)
    arrays |= {"command": command[None], "wrench": torch.empty(1, rows, 6)}
    batch = SampleTable.of(arrays).batch(torch.arange(rows))
    wrench: torch.Tensor = surrogate_of(weights, dtype=command.dtype)(batch.command, batch)
    return wrench
