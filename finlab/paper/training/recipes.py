"""Named training recipes: `paper` (the printed numbers, our choices elsewhere), `annealed` (to go on from
there) and `smoke` (seconds, for tests)."""

from dataclasses import dataclass, field, replace

from finlab.paper.network import NetworkConfig
from finlab.paper.surrogate import SurrogateConfig
from finlab.training.loop import LoopSettings


@dataclass(frozen=True)
class SampledTraining(LoopSettings):
    """How a network of the paper is trained on forward samples."""

    layouts: int = 1000
    """Random layouts of the data set."""
    commands: int = 5000
    """Random commands on each of them."""
    varied_limits: float = 0.5
    """Share of the layouts with limits of their own."""


@dataclass(frozen=True)
class AllocatorTraining(SampledTraining):
    """How the paper's network is trained: L = imitation NLL + beta guidance + lambda entropy."""

    guidance: float = 1000.0
    """Final weight beta of the physics guidance; not printed."""
    guidance_start: float = 0.01
    """Weight beta at the first step."""
    ramp: float = 0.5
    """Share of the steps over which beta grows linearly."""
    entropy: float = 0.01
    """Weight lambda of the entropy of the mixture weights; not printed."""


@dataclass(frozen=True)
class PaperRecipe:
    """The paper's surrogate and the network that it guides."""

    surrogate_training: SampledTraining
    allocator_training: AllocatorTraining
    surrogate: SurrogateConfig = field(default_factory=SurrogateConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)


_PAPER = PaperRecipe(
    # Fin physics is to hold on any layout, so few commands on each of many are learned from.
    SampledTraining(30_000, 16_384, 2e-3, warmup=100, ema=0.99, layouts=500_000, commands=10),
    AllocatorTraining(115 * (5_000_000 // 16_384), 16_384, 1e-4, cosine=False),  # 115 epochs
    network=NetworkConfig(n_components=8),
)
_SMOKE = replace(_PAPER.allocator_training, guidance=1.0)
RECIPES = {
    "paper": _PAPER,
    # What goes on from a trained network: the printed rate is not small enough to settle at.
    "annealed": replace(
        _PAPER,
        allocator_training=replace(
            _PAPER.allocator_training,
            steps=26_667,
            learning_rate=5e-4,
            warmup=300,
            cosine=True,
            guidance_start=_PAPER.allocator_training.guidance,
        ),
    ),
    "smoke": PaperRecipe(
        replace(_PAPER.surrogate_training, steps=60, batch_size=256, layouts=500),
        replace(_SMOKE, steps=40, batch_size=128, learning_rate=1e-3, layouts=100, commands=50),
        SurrogateConfig(hidden=(16, 16)),
        NetworkConfig(
            width=32, heads=2, graph_layers=1, transformer_layers=1, feedforward=32, n_components=4
        ),
    ),
}
