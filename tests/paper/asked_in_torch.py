"""The paper's surrogate asked with tensors: the judge of its answers and slopes in numpy."""

import torch

from finlab.layout.arrays import force_effectiveness
from finlab.networks.normalization import to_normalized
from finlab.paper.features import raw_features
from finlab.paper.surrogate import SurrogateConfig, correction, of_fins, perceptron
from finlab.physics.wrench import wrench_of_forces

Place = tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]


def wrench_in_torch(
    config: SurrogateConfig, w: dict[str, torch.Tensor], command: torch.Tensor, place: Place
) -> torch.Tensor:
    """Wrenches (R, 6) of commands (R, n, 3) on one layout: its positions, mounting angles and limits."""
    position, mounting_angle, lower, upper = place
    x = raw_features(position, mounting_angle, lower, upper)
    force = perceptron(config, w, of_fins(w, x), to_normalized(command, lower, upper))
    # The perceptron answers in the body frame, that of a fin whose shaft points forward.
    wrench = wrench_of_forces(force, force_effectiveness(position, 0.0 * mounting_angle))
    scale, bias = correction(w, x)
    answer: torch.Tensor = wrench * (1.0 + scale) + bias
    return answer
