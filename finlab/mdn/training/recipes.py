"""Named training recipes: `default` (what is shipped) and `smoke` (seconds, for tests)."""

from dataclasses import dataclass, field, replace

from finlab.mdn.network import ForceNetworkConfig
from finlab.training.loop import LoopSettings


@dataclass(frozen=True)
class AnswerSettings:
    """What the teacher answers: files of random targets on random robots."""

    files: int = 48
    """Files, the first of which is held out."""
    fins: int = 18
    """Random fins per file with nominal limits, and as many with limits of their own."""
    robots: int = 240
    """Robots per file that are made of them."""
    targets: int = 48
    """Targets for each robot."""
    sharpness: float = 0.03
    """By how much dearer a way may be, as a share of the cost, for its weight to fall to a third."""


@dataclass(frozen=True)
class MdnTraining(LoopSettings):
    """How the network of method `mdn` is trained: the likelihood of the ways that the teacher has found."""

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


_MDN = MdnRecipe(MdnTraining(100_000, 256, 2e-3, warmup=200, ema=0.999, seconds=5400.0))
RECIPES = {
    "default": _MDN,
    "smoke": MdnRecipe(
        replace(_MDN.training, steps=30, batch_size=16, warmup=5, ema=0.9, anneal=10),
        AnswerSettings(files=2, fins=2, robots=6, targets=8),
        ForceNetworkConfig(width=16, heads=2, layers=1, feedforward=16, n_components=4),
    ),
}
"""Name -> recipe of `finlab train mdn`."""
