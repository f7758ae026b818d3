"""Named recipes: `paper` (the printed numbers, our choices elsewhere), `short` (20 minutes on two cores) and
`smoke` (seconds)."""

from dataclasses import dataclass, field

from finlab.errors import DataError
from finlab.paper.network import NetworkConfig
from finlab.paper.surrogate import SurrogateConfig
from finlab.paper.training.samples import DataSettings
from finlab.training.loop import LoopSettings


@dataclass(frozen=True)
class PaperLoop(LoopSettings):
    """How one of the two networks is trained."""

    one_layout: bool = False
    """Whether a step sees commands of one random layout, as printed of the surrogate, or of many."""


@dataclass(frozen=True)
class AllocatorTraining(PaperLoop):
    """How the network is trained: L = L_imit + beta L_guide + lambda L_ent (Eq. 7)."""

    guidance: float = 1000.0
    """Final weight beta; not printed."""
    guidance_start: float = 0.01
    """Weight beta at the first step; not printed."""
    ramp: float = 0.5
    """Share of the steps over which beta grows linearly; not printed."""
    entropy: float = 0.01
    """Weight lambda; not printed."""

    def beta(self, step: int) -> float:
        """Weight of the guidance in a step."""
        ramp = min(1.0, step / max(1.0, self.ramp * self.steps))
        return self.guidance_start + ramp * (self.guidance - self.guidance_start)


@dataclass(frozen=True)
class PaperRecipe:
    """The paper's two networks, and what they learn from."""

    data: DataSettings
    surrogate_training: PaperLoop
    allocator_training: AllocatorTraining
    surrogate: SurrogateConfig = field(default_factory=SurrogateConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)


RECIPES = {
    "paper": PaperRecipe(
        DataSettings(),
        PaperLoop(115_000, 4096, 1e-3, warmup=100, ema=0.99, one_layout=True),
        AllocatorTraining(115 * (5_000_000 // 16_384), 16_384, 1e-4, cosine=False),  # 115 epochs
    ),
    "short": PaperRecipe(
        DataSettings(20_000, 200),
        # Many small steps and a third hidden layer learn more in the same time than few large ones.
        PaperLoop(48_000, 256, 2e-3, warmup=100, ema=0.99),
        # With a guidance of 10 and twice the rate, narrow components made a run diverge half-way.
        AllocatorTraining(8_000, 256, 5e-4, warmup=100, ema=0.99, guidance=3.0),
        SurrogateConfig(hidden=(512, 64, 64)),
    ),
    "smoke": PaperRecipe(
        DataSettings(200, 200),
        PaperLoop(3000, 256, 3e-3, warmup=20, ema=0.9),
        AllocatorTraining(150, 128, 2e-3, warmup=10, ema=0.9, guidance=1.0),
        SurrogateConfig(hidden=(64, 32, 32)),
        NetworkConfig(
            width=32, heads=2, graph_layers=1, transformer_layers=1, feedforward=64, n_components=4
        ),
    ),
}
"""Name -> recipe of `finlab train surrogate` and `finlab train allocator`."""


def recipe(preset: str) -> PaperRecipe:
    """A recipe by its name; a `DataError` names those there are."""
    if preset not in RECIPES:
        raise DataError(f"preset: expected one of {', '.join(RECIPES)}, got {preset!r:.40}")
    return RECIPES[preset]
