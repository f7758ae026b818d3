"""Named training recipes: `default` (ours), `paper` (as printed) and `smoke` (seconds, for tests)."""

from dataclasses import dataclass, field, replace

from finlab.errors import DataError
from finlab.inference.weights import NetworkConfig, SurrogateConfig


@dataclass(frozen=True)
class SurrogateTraining:
    """How the surrogate is trained."""

    steps: int = 20_000
    """Optimizer steps."""
    batch_size: int = 4096
    """Samples per step."""
    learning_rate: float = 3e-3
    """Peak learning rate of Adam."""


@dataclass(frozen=True)
class AllocatorTraining:
    """How the allocator network is trained: L = imitation NLL + beta guidance + lambda entropy."""

    steps: int = 30_000
    """Optimizer steps."""
    batch_size: int = 2048
    """Samples per step, over all processes."""
    learning_rate: float = 1e-3
    """Peak learning rate of Adam."""
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
    ema: float = 0.999
    """Decay of the running average of the weights that is shipped; 0 ships the last weights."""
    warmup: int = 200
    """Steps over which the learning rate rises."""
    cosine: bool = True
    """Whether the learning rate falls to a hundredth along a cosine (True) or stays (the paper)."""


@dataclass(frozen=True)
class Preset:
    """One named recipe."""

    name: str
    """Its name."""
    surrogate: SurrogateConfig = field(default_factory=SurrogateConfig)
    """Kind and size of the surrogate."""
    network: NetworkConfig = field(default_factory=NetworkConfig)
    """Sizes of the allocator network."""
    surrogate_training: SurrogateTraining = field(default_factory=SurrogateTraining)
    """How the surrogate is trained."""
    allocator_training: AllocatorTraining = field(default_factory=AllocatorTraining)
    """How the network is trained."""


_DEFAULT = Preset(
    "default",
    network=NetworkConfig(width=96, transformer_layers=2, feedforward=192, n_components=16),
    surrogate_training=SurrogateTraining(steps=40_000),
    allocator_training=AllocatorTraining(steps=20_000, batch_size=1024),
)
_PAPER = Preset(
    "paper",
    surrogate=SurrogateConfig(kind="mlp", hidden=(512, 64)),
    network=NetworkConfig(features="raw", joint=False, n_components=8),
    surrogate_training=SurrogateTraining(steps=30_000, batch_size=512, learning_rate=2e-3),
    allocator_training=AllocatorTraining(
        steps=35_000,  # 115 epochs of 5 M samples
        batch_size=16_384,
        learning_rate=1e-4,
        imitation=1.0,
        imitate="all",
        guidance=1.0,
        guidance_start=0.01,
        ramp=0.5,
        guide="samples",
        entropy=0.01,
        ema=0.0,
        warmup=0,
        cosine=False,
    ),
)
_SMOKE = Preset(
    "smoke",
    surrogate=SurrogateConfig(hidden=(16,)),
    network=NetworkConfig(
        width=32, heads=2, graph_layers=1, transformer_layers=1, feedforward=32, n_components=4
    ),
    surrogate_training=SurrogateTraining(steps=60, batch_size=256),
    allocator_training=replace(_DEFAULT.allocator_training, steps=40, batch_size=128, warmup=5, ema=0.9),
)

PRESETS = {preset.name: preset for preset in (_DEFAULT, _PAPER, _SMOKE)}
"""Name -> recipe."""


def get_preset(name: str) -> Preset:
    """A recipe by name; `DataError` lists the names that exist."""
    if name not in PRESETS:
        raise DataError(f"preset: expected one of {', '.join(PRESETS)}, got {name!r}")
    return PRESETS[name]
