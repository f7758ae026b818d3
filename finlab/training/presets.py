"""Named training recipes: `default` (method `mdn`), `paper` (the printed numbers, our choices elsewhere),
`annealed` (to go on from there) and `smoke` (seconds, for tests)."""

from dataclasses import dataclass, field, replace
from typing import TypeVar

from finlab.errors import DataError
from finlab.inference.weights import ForceNetworkConfig, NetworkConfig, SurrogateConfig
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
    """How the surrogate is trained."""
    allocator_training: AllocatorTraining
    """How the network is trained."""
    surrogate: SurrogateConfig = field(default_factory=SurrogateConfig)
    """Sizes of the surrogate."""
    network: NetworkConfig = field(default_factory=NetworkConfig)
    """Sizes of the network."""


@dataclass(frozen=True)
class AnswerSettings:
    """What the teacher answers: files of random targets on random robots."""

    shards: int = 80
    """Most files; what is not there in time is not learned from."""
    first: int = 2
    """Files that must be there to begin, at least two: the first one is held out."""
    fins: int = 18
    """Random fins per file with nominal limits, and as many with limits of their own."""
    robots: int = 240
    """Robots per file that are made of them."""
    targets: int = 48
    """Targets for each robot."""
    effort_share: float = 0.75
    """Share of the robots that keep the effort least; the others keep the power least."""
    sharpness: float = 0.03
    """By how much dearer a way may be, as a share of the cost, for its weight to fall to a third."""


@dataclass(frozen=True)
class MdnTraining(LoopSettings):
    """How the network of method `mdn` is trained: the likelihood of the ways that the search has found."""

    anneal: int = 2500
    """Steps over which components stop sharing what they stand for; at first all of them learn from all."""
    spread: float = 0.02
    """Weight of the entropy of the components' mean weights over a batch, so that none is left unused."""


@dataclass(frozen=True)
class MdnRecipe:
    """The network of method `mdn`, and what it learns from."""

    training: MdnTraining
    """How it is trained."""
    answers: AnswerSettings = field(default_factory=AnswerSettings)
    """What it learns from."""
    network: ForceNetworkConfig = field(default_factory=ForceNetworkConfig)
    """Its sizes."""


_PAPER = PaperRecipe(
    # Fin physics is to hold on any layout, so few commands on each of many are learned from.
    SampledTraining(30_000, 16_384, 2e-3, warmup=100, ema=0.99, layouts=500_000, commands=10),
    AllocatorTraining(115 * (5_000_000 // 16_384), 16_384, 1e-4, cosine=False),  # 115 epochs
    network=NetworkConfig(n_components=8),
)
_SMOKE = replace(_PAPER.allocator_training, guidance=1.0)
PAPER_RECIPES = {
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
"""Name -> recipe of `finlab train surrogate` and `finlab train allocator`."""

_MDN = MdnRecipe(MdnTraining(100_000, 256, 2e-3, warmup=200, ema=0.999, seconds=5400.0))
MDN_RECIPES = {
    "default": _MDN,
    "smoke": MdnRecipe(
        replace(_MDN.training, steps=30, batch_size=16, warmup=5, ema=0.9, anneal=10),
        AnswerSettings(shards=2, fins=2, robots=6, targets=8),
        ForceNetworkConfig(width=16, heads=2, layers=1, feedforward=16, n_components=4),
    ),
}
"""Name -> recipe of `finlab train mdn`."""

Recipe = TypeVar("Recipe", PaperRecipe, MdnRecipe)


def get_recipe(recipes: dict[str, Recipe], name: str) -> Recipe:
    """A recipe by name; `DataError` lists the names that exist."""
    if name not in recipes:
        raise DataError(f"preset: expected one of {', '.join(recipes)}, got {name!r}")
    return recipes[name]
