"""Named training recipes: `default` (ours), `paper` (as printed) and `smoke` (seconds, for tests)."""

from dataclasses import dataclass, field, replace

from finlab.errors import DataError
from finlab.inference.weights import NetworkConfig, SurrogateConfig
from finlab.training.loop import LoopSettings


@dataclass(frozen=True)
class AllocatorTraining(LoopSettings):
    """How the allocator network is trained: L = imitation NLL + beta guidance + lambda entropy."""

    imitation: float = 0.01
    """Weight of the negative log-likelihood of the recorded commands."""
    imitate: str = "spread"
    """What that likelihood moves: `all` (the paper) or only the `spread` around the means. Uniformly
    sampled commands are neither cheap nor sharp to imitate, so in `default` means and weights learn
    from the physics alone."""
    guidance: float = 1.0
    """Final weight beta of the physics guidance."""
    guidance_start: float = 1.0
    """Weight beta at the first step."""
    ramp: float = 0.2
    """Share of the steps over which beta grows linearly."""
    guide: str = "modes"
    """`modes`: the soft best of all components' means; `samples`: samples of the mixture (the paper)."""
    energy: float = 0.05
    """Weight gamma of the energy proxy inside the guidance of `modes`."""
    softness: float = 0.02
    """Width of the soft minimum over components, in units of the guidance loss."""
    every_mode: float = 0.05
    """Weight of the mean over all components beside the soft best one, so that none goes astray."""
    entropy: float = 0.003
    """Weight lambda of the entropy of the mixture weights."""
    varied_limits: float = 0.5
    """Share of training layouts with limits of their own."""


@dataclass(frozen=True)
class Preset:
    """One named recipe."""

    name: str
    """Its name."""
    surrogate_training: LoopSettings
    """How the surrogate is trained."""
    allocator_training: AllocatorTraining
    """How the network is trained."""
    surrogate: SurrogateConfig = field(default_factory=SurrogateConfig)
    """Kind and size of the surrogate."""
    network: NetworkConfig = field(default_factory=NetworkConfig)
    """Sizes of the allocator network."""


_DEFAULT = Preset(
    "default",
    LoopSettings(40_000, 4096, 3e-3, warmup=100, ema=0.99),
    AllocatorTraining(20_000, 1024, 1e-3, warmup=200, ema=0.999),
    network=NetworkConfig(width=96, transformer_layers=2, feedforward=192, n_components=16),
)
_PAPER = Preset(
    "paper",
    LoopSettings(30_000, 512, 2e-3, warmup=100, ema=0.99),
    AllocatorTraining(
        steps=35_000,  # 115 epochs of 5 M samples
        batch_size=16_384,
        learning_rate=1e-4,
        cosine=False,
        imitation=1.0,
        imitate="all",
        guidance=1.0,
        guidance_start=0.01,
        ramp=0.5,
        guide="samples",
        entropy=0.01,
    ),
    SurrogateConfig(kind="mlp", hidden=(512, 64)),
    NetworkConfig(features="raw", joint=False, n_components=8),
)
_SMOKE = Preset(
    "smoke",
    replace(_DEFAULT.surrogate_training, steps=60, batch_size=256),
    replace(_DEFAULT.allocator_training, steps=40, batch_size=128, warmup=5, ema=0.9),
    SurrogateConfig(hidden=(16,)),
    NetworkConfig(width=32, heads=2, graph_layers=1, transformer_layers=1, feedforward=32, n_components=4),
)

PRESETS = {preset.name: preset for preset in (_DEFAULT, _PAPER, _SMOKE)}
"""Name -> recipe."""


def get_preset(name: str) -> Preset:
    """A recipe by name; `DataError` lists the names that exist."""
    if name not in PRESETS:
        raise DataError(f"preset: expected one of {', '.join(PRESETS)}, got {name!r}")
    return PRESETS[name]
